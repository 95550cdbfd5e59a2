"""Data set 55: mode shapes. Normal modes (analysis type 2) and complex ones (3, 7) are read, complex ones written."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ...errors import RecordError
from ...signals.ema import Modes
from .._checks import naming
from ._fields import Block, fields, read_integer, read_real, text_set

NORMAL, COMPLEX = (2,), (3, 7)
REAL_DATA, COMPLEX_DATA = 2, 5
AXES = "XYZ"
_TRANSLATION = re.compile(r"(\d{1,9}):([+-])([XYZ])")
Shape = dict[int, np.ndarray]
"""(3,) complex displacement along X, Y, Z by node"""


def read_modes(blocks: Sequence[Block]) -> Modes:
    """Put the modes of a file together, by frequency; components that move in no mode are left out."""
    found: list[tuple[float, float, Shape]] = []
    for block in blocks:
        with naming(f"data set {block.number}"):
            if read_integer(block.record(5)[10:20], "analysis type") in (*NORMAL, *COMPLEX):
                found.append(_read_mode(block))
    if not found:
        raise RecordError("holds no modes (data sets 55 of analysis type 2, 3 or 7)")
    found.sort(key=lambda mode: mode[0])
    frequency, damping, shapes = zip(*found)
    nodes = shapes[0].keys()
    if not nodes or any(shape.keys() != nodes for shape in shapes):
        raise RecordError("its modes are not of the same nodes, or of none")
    values = np.array([[shape[node] for node in nodes] for shape in shapes])  # (n, nodes, 3)
    moving = np.flatnonzero(np.any(values, axis=(0, 1)))
    labels = tuple(f"{node}:+{AXES[axis]}" for node in nodes for axis in moving)
    return Modes(np.array(frequency), np.array(damping), values[:, :, moving].reshape(len(found), -1).T, labels)


def _read_mode(block: Block) -> tuple[float, float, Shape]:
    """Undamped frequency in Hz, damping ratio and shape."""
    _, analysis, _, _, data_type, per_node = (
        read_integer(text, "data definition") for text in fields(block.record(5), 10, 6)
    )
    if data_type not in (REAL_DATA, COMPLEX_DATA) or per_node not in (3, 6):
        raise RecordError(f"mode shape of data type {data_type} with {per_node} values per node; needs 2 or 5, 3 or 6")
    real = [read_real(text, "parameter of a mode") for text in fields(block.record(7), 13, 6)]
    if analysis in NORMAL:
        frequency, damping = real[0], real[2]
    else:
        omega = float(np.hypot(real[0], real[1]))
        frequency, damping = omega / (2 * np.pi), -real[0] / omega if omega else 0.0
    if not 0 < frequency < np.inf:
        raise RecordError(f"natural frequency {frequency:g} Hz must be > 0 and finite")
    return frequency, damping, _shape(block, per_node, data_type == COMPLEX_DATA)


def _shape(block: Block, per_node: int, is_complex: bool) -> Shape:
    numbers = per_node * (1 + is_complex)
    height = 1 + -(-numbers // 6)
    body = [line for line in block.lines[8:] if line.strip()]
    if len(body) % height:
        raise RecordError(f"mode shape needs {height} records per node, has {len(body)}")
    shape = {}
    for i in range(0, len(body), height):
        node = read_integer(body[i][:10], "node of a mode shape")
        words = [word for line in body[i + 1 : i + height] for word in fields(line, 13, 6)][:numbers]
        values = np.array([read_real(word, f"mode shape at node {node}") for word in words])
        shape[node] = (values.view(complex) if is_complex else values.astype(complex))[:3]
    return shape


def mode_sets(modes: Modes) -> Iterator[str]:
    """One data set per mode: a complex eigenvalue, three complex displacements at each node."""
    labels = modes.responses or tuple(f"{i + 1}:+Z" for i in range(modes.shape.shape[0]))
    places = []
    for label in labels:
        if not (place := _TRANSLATION.fullmatch(label)):
            raise RecordError(f"mode shape at {label}; data set 55 holds translations, as 3:+Z")
        places.append((int(place[1]), AXES.index(place[3]), 1 if place[2] == "+" else -1))
    if not modes.frequency.size:
        raise RecordError("there is no mode")
    for number, (frequency, damping, column) in enumerate(zip(modes.frequency, modes.damping, modes.shape.T), 1):
        shape = {node: np.zeros(3, dtype=complex) for node, _, _ in places}
        for (node, axis, sign), value in zip(places, column):
            shape[node][axis] = sign * value
        omega = 2 * np.pi * frequency
        lines = [f"{'NONE':<80}"] * 3
        lines += [f"{f'Mode {number}':<80}", f"{f'{frequency:.6g} Hz, damping {damping:.6g}':<80}"]
        # structural model, complex eigenvalue, vector of three translations, displacement, complex, 3 values per node
        lines += [_integers(1, COMPLEX[0], 2, 8, COMPLEX_DATA, 3), _integers(2, 6, 0, number)]
        lines.append(_reals((-damping * omega, omega * np.sqrt(1 - damping**2), 0, 0, 0, 0)))
        for node, values in shape.items():
            lines += [f"{node:10d}", _reals(values.view(float))]
        yield text_set(55, lines)


def _integers(*values: int) -> str:
    return "".join(f"{value:10d}" for value in values)


def _reals(values: Iterable[float]) -> str:
    return "".join(f"{value:13.5e}" for value in values)
