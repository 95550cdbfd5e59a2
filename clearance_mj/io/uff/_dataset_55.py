"""Data set 55: mode shapes. Normal modes (analysis type 2) and complex ones (3, 7) are read, complex ones written."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import RecordError
from ._blocks import Block, fields
from ._fields import read_integer, read_real

NORMAL, COMPLEX = (2,), (3, 7)
DISPLACEMENT = 8
TRANSLATION = 2
"""data characteristic: vector of three translations"""
REAL_DATA, COMPLEX_DATA = 2, 5
AXES = "XYZ"


@dataclass(frozen=True)
class Mode:
    """One mode."""

    frequency: float
    """Hz, undamped"""
    damping: float
    """ratio to critical damping"""
    shape: dict[int, np.ndarray]
    """(3,) complex displacement along X, Y, Z by node"""


def is_mode(block: Block) -> bool:
    return read_integer(block.record(5)[10:20], "analysis type") in (*NORMAL, *COMPLEX)


def read_mode(block: Block) -> Mode:
    definition = [read_integer(text, "data definition") for text in fields(block.record(5), 10, 6)]
    _, analysis, _, _, data_type, per_node = definition
    if data_type not in (REAL_DATA, COMPLEX_DATA) or per_node not in (3, 6):
        raise RecordError(f"mode shape of data type {data_type} with {per_node} values per node; needs 2 or 5, 3 or 6")
    real = [read_real(text, "parameter of a mode") for text in fields(block.record(7), 13, 6)]
    if analysis in NORMAL:
        frequency, damping = real[0], real[2]
    else:
        frequency = np.hypot(*real[:2]) / (2 * np.pi)
        damping = -real[0] / np.hypot(*real[:2]) if frequency else 0.0
    if not 0 < frequency < np.inf:
        raise RecordError(f"natural frequency {frequency:g} Hz must be > 0 and finite")
    return Mode(float(frequency), float(damping), _shape(block, per_node, data_type == COMPLEX_DATA))


def _shape(block, per_node, is_complex) -> dict[int, np.ndarray]:
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


def mode_set(number: int, mode: Mode) -> dict:
    """The data set as pyuff writes it: a complex eigenvalue, with three complex displacements at each node."""
    omega = 2 * np.pi * mode.frequency
    r1, r2, r3 = np.array(list(mode.shape.values()), dtype=complex).T
    return {
        "type": 55,
        "id4": f"Mode {number}",
        "id5": f"{mode.frequency:.6g} Hz, damping {mode.damping:.6g}",
        "model_type": 1,
        "analysis_type": COMPLEX[0],
        "data_ch": TRANSLATION,
        "spec_data_type": DISPLACEMENT,
        "load_case": 0,
        "mode_n": number,
        "eig": omega * complex(-mode.damping, np.sqrt(1 - mode.damping**2)),
        "node_nums": list(mode.shape),
        "r1": r1,
        "r2": r2,
        "r3": r3,
    }
