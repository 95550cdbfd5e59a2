"""Mode shapes at nodes: data sets 55 and 2414. Normal modes (analysis type 2) and complex ones (3, 7) are read.

Both have the same fields, in other places. Modes are written as data sets 55, complex, without modal masses.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.checks import AXES, naming
from ..core.errors import RecordError
from ..signals.ema import Modes
from .fields import Block, fields, read_integer, read_real, text_set

NORMAL, COMPLEX = (2,), (3, 7)
REAL_DATA, COMPLEX_DATA = (2, 4), (5, 6)  # of single and double precision
PER_NODE = (3, 6)
KINDS = (55, 2414)
AT_NODES = 1
_TRANSLATION = re.compile(r"(\d{1,9}):([+-])([XYZ])")
Shape = dict[int, np.ndarray]  # (6,) complex displacement along X, Y, Z and rotation about them by node


@dataclass(frozen=True, eq=False)
class ModeShapes:
    """Modes of a universal file, by frequency, in SI units."""

    frequency: np.ndarray  #: (n,) undamped natural frequencies, Hz
    damping: np.ndarray  #: (n,) damping ratios
    shape: np.ndarray  #: (n_dofs, n) complex; rotations in rad per metre of a translation
    dofs: tuple[str, ...]  #: degree of freedom of each row; what moves in no mode is left out
    modal_mass: np.ndarray  #: (n,) kg, of normal modes; nan where the file has none
    modal_a: np.ndarray  #: (n,) kg/s, of complex modes; nan where the file has none


@dataclass(frozen=True)
class _Mode:
    frequency: float
    damping: float
    shape: Shape
    modal_mass: float
    modal_a: complex


def read_modes(blocks: Sequence[Block]) -> list[ModeShapes]:
    """Return the modes of a file, by frequency, those of the same nodes in one set.

    Passed over are other results at nodes, such as static deflections, and shapes that are no displacements.
    """
    groups: dict[frozenset[int], list[_Mode]] = {}
    for block in blocks:
        if block.kind not in KINDS:
            continue
        with naming(f"data set {block.number}"):
            if block.kind == 2414 and read_integer(block.record(2)[:10], "location of data") != AT_NODES:
                continue
            if read_integer(_definition(block)[10:20], "analysis type") not in (*NORMAL, *COMPLEX):
                continue
            if read_integer(_definition(block)[50:60], "values per node") not in PER_NODE:
                continue
            mode = _read_mode(block)
            if not mode.shape:
                raise RecordError("mode shape without a node")
        groups.setdefault(frozenset(mode.shape), []).append(mode)
    return [_to_mode_shapes(modes) for modes in groups.values()]


def _to_mode_shapes(modes: list[_Mode]) -> ModeShapes:
    """Return the shapes of modes of the same nodes, by frequency."""
    modes.sort(key=lambda mode: mode.frequency)
    nodes = modes[0].shape.keys()
    values = np.array([[mode.shape[node] for node in nodes] for mode in modes])  # (n, nodes, 6)
    moving = np.flatnonzero(np.any(values, axis=(0, 1)))
    dofs = tuple(f"{node}:+{AXES[axis]}" for node in nodes for axis in moving)
    columns = zip(*((mode.frequency, mode.damping, mode.modal_mass, mode.modal_a) for mode in modes))
    frequency, damping, modal_mass, modal_a = map(np.array, columns)
    shape = values[:, :, moving].reshape(len(modes), -1).T
    return ModeShapes(frequency, damping, shape, dofs, modal_mass, modal_a)


def _definition(block: Block) -> str:
    """Return the record of model and analysis type, characteristic, result type, data type, values per node."""
    return block.record(5 if block.kind == 55 else 8)


def _read_mode(block: Block) -> _Mode:
    """Return the mode of one data set: undamped frequency, damping ratio, shape and scale."""
    texts = fields(_definition(block), 10, 6)
    _, analysis, _, _, data_type, per_node = (read_integer(text, "data definition") for text in texts)
    if data_type not in (*REAL_DATA, *COMPLEX_DATA):
        raise RecordError(f"mode shape of data type {data_type}; needs 2 or 4 (real), 5 or 6 (complex)")
    frequency, damping, mass, a = _parameters(block, analysis in NORMAL)
    if not 0 <= frequency < np.inf:
        raise RecordError(f"natural frequency {frequency:g} Hz must be >= 0 and finite")
    kilogram = block.units.factor("force") / block.units.factor("displacement")
    modal_a = complex(np.nan, np.nan) if a == 0 else a * kilogram
    shape = _shape(block, per_node, data_type in COMPLEX_DATA)
    return _Mode(frequency, damping, shape, mass * kilogram if mass > 0 else np.nan, modal_a)


def _parameters(block: Block, normal: bool) -> tuple[float, float, float, complex]:
    """Return frequency in Hz, damping ratio, modal mass (0: none), modal A (0: none)."""
    first, second = (7, 8) if block.kind == 55 else (11, 12)
    real = [read_real(text, "parameter of a mode") for text in fields(block.record(first), 13, 6)]
    if normal:
        if block.kind == 55:  # frequency, modal mass, viscous damping ratio
            return real[0], real[2], real[1], 0
        return real[1], real[4], real[3], 0  # time, frequency, eigenvalue, modal mass, viscous damping ratio
    if block.kind == 2414:
        real = [read_real(text, "parameter of a mode") for text in fields(block.record(second), 13, 6)]
    omega = float(np.hypot(real[0], real[1]))
    return omega / (2 * np.pi), -real[0] / omega if omega else 0.0, 0.0, complex(real[2], real[3])


def _shape(block: Block, per_node: int, is_complex: bool) -> Shape:
    numbers = per_node * (1 + is_complex)
    height = 1 + -(-numbers // 6)
    body = [line for line in block.lines[8 if block.kind == 55 else 13 :] if line.strip()]
    if len(body) % height:
        raise RecordError(f"mode shape needs {height} records per node, has {len(body)}")
    shape = {}
    per_metre = np.array([1.0, 1.0, 1.0] + 3 * [1 / block.units.factor("displacement")])
    for i in range(0, len(body), height):
        node = read_integer(body[i][:10], "node of a mode shape")
        words = [word for line in body[i + 1 : i + height] for word in fields(line, 13, 6)][:numbers]
        values = np.array([read_real(word, f"mode shape at node {node}") for word in words])
        values = values.view(complex) if is_complex else values.astype(complex)
        shape[node] = np.append(values, np.zeros(6 - per_node)) * per_metre
    return shape


def mode_sets(modes: Modes) -> Iterator[str]:
    """Yield one data set per mode: a complex eigenvalue, three complex displacements at each node."""
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
        lines += [_integers(1, COMPLEX[0], 2, 8, COMPLEX_DATA[0], 3), _integers(2, 6, 0, number)]
        lines.append(_reals((-damping * omega, omega * np.sqrt(1 - damping**2), 0, 0, 0, 0)))
        for node, values in shape.items():
            lines += [f"{node:10d}", _reals(values.view(float))]
        yield text_set(55, lines)


def _integers(*values: int) -> str:
    return "".join(f"{value:10d}" for value in values)


def _reals(values: Iterable[float]) -> str:
    return "".join(f"{value:13.5e}" for value in values)
