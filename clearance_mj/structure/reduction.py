"""Modes of unit mass, and the reduction of large matrices to the lowest ones and static shapes.

The static shapes are those under unit loads that the kept modes leave over: the residual flexibility (MacNeal 1971;
Rubin 1975). A structure that can move without bending has no static shapes; the ones under a little of its own inertia
stand for them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from .base import LinearModel

__all__ = ["Modes", "reduced", "vibration_modes"]

SINGULAR = 1e-13
"""of 1: smallest eigenvalue of a scaled stiffness, below which a structure can move without bending"""
STILL = 1e-9
"""of the lowest eigenvalue of bending: those below are rigid bodies'"""
REPEATED = 1e-10
"""of 1: a static shape that adds less than this to the others is left out"""
DENSE = 1500
"""coordinates up to which matrices are taken whole"""


class Modes(NamedTuple):
    """Modes of unit mass."""

    omega: np.ndarray  # (n,) 1/s
    shapes: np.ndarray  # (n_coordinates, n)


def vibration_modes(mass: np.ndarray, stiffness: np.ndarray) -> Modes:
    """All modes of dense matrices, found from the flexibility, so that the lowest are the most exact."""
    scale = np.sqrt(stiffness.diagonal())
    if not np.all(scale > 0):
        return _free_modes(mass, stiffness)
    value, vector = np.linalg.eigh(stiffness / np.outer(scale, scale))
    if value[0] < SINGULAR:
        return _free_modes(mass, stiffness)
    basis = vector / np.sqrt(value) / scale[:, None]
    inverse_omega2, rotation = np.linalg.eigh(basis.T @ mass @ basis)
    inverse_omega2, rotation = inverse_omega2[::-1], rotation[:, ::-1]
    return Modes(1 / np.sqrt(inverse_omega2), basis @ rotation / np.sqrt(inverse_omega2))


def _free_modes(mass: np.ndarray, stiffness: np.ndarray) -> Modes:
    """The same of a structure that can move without bending: with springs that its masses carry, taken off again."""
    shift = _shift(mass, stiffness)
    held = vibration_modes(mass, stiffness + shift * mass)
    squares = held.omega**2 - shift
    if squares[0] < -1e-6 * shift:
        raise ValueError("the structure's stiffness is negative in some motion; check the signs in K")
    return Modes(np.sqrt(np.where(squares < STILL * shift, 0.0, squares)), held.shapes)


def _shift(mass: np.ndarray, stiffness: np.ndarray) -> float:
    """The lowest eigenvalue of bending."""
    values = scipy.linalg.eigvalsh(stiffness, mass)
    bending = values[values > 1e-12 * len(values) * values[-1]]
    return float(bending[0]) if bending.size else 1.0


def reduced(
    linear: LinearModel,
    masses: Sequence[tuple[float, np.ndarray]],
    springs: Sequence[tuple[float, np.ndarray]],
    loads: Sequence[np.ndarray],
    modes: int,
) -> Modes:
    """Add masses and springs, each with its row, to a structure, and reduce it to modes and static shapes under loads.

    A ValueError says what is wrong with the structure.
    """
    mass, stiffness = _with(linear.mass, masses), _with(linear.stiffness, springs)
    n = mass.shape[0]
    if linear.reduced or n <= modes + len(loads):
        return vibration_modes(*map(_dense, (mass, stiffness)))
    basis = (_dense_basis if n <= DENSE else _sparse_basis)(mass, stiffness, loads, modes)
    found = vibration_modes(basis.T @ (mass @ basis), basis.T @ (stiffness @ basis))
    return Modes(found.omega, basis @ found.shapes)


def _with(matrix: Any, terms: Sequence[tuple[float, np.ndarray]]) -> Any:
    for factor, row in terms:
        term = scipy.sparse.csr_matrix(row) if scipy.sparse.issparse(matrix) else row[None]
        matrix = matrix + factor * (term.T @ term)
    return matrix


def _dense(matrix: Any) -> np.ndarray:
    return matrix.toarray() if scipy.sparse.issparse(matrix) else np.asarray(matrix)


def _dense_basis(mass: Any, stiffness: Any, loads: Sequence[np.ndarray], modes: int) -> np.ndarray:
    """Lowest modes, and what the others give to the static shapes."""
    omega, shapes = vibration_modes(_dense(mass), _dense(stiffness))
    low, high, fast = shapes[:, :modes], shapes[:, modes:], omega[modes:]
    rest = high / fast**2 @ (high.T @ np.reshape(loads, (-1, len(shapes))).T)
    return _independent(low, rest, stiffness)


def _sparse_basis(mass: Any, stiffness: Any, loads: Sequence[np.ndarray], modes: int) -> np.ndarray:
    """The same of matrices that are too large to be taken whole (Lanczos; Lehoucq, Sorensen & Yang, ARPACK, 1998)."""
    raise NotImplementedError


def _independent(low: np.ndarray, rest: np.ndarray, stiffness: Any) -> np.ndarray:
    """Modes and those static shapes that do not repeat each other."""
    energy = rest.T @ (stiffness @ rest)
    size = np.sqrt(np.maximum(energy.diagonal(), 0.0))
    rest, size = rest[:, size > 0], size[size > 0]
    value, vector = np.linalg.eigh((rest / size).T @ (stiffness @ (rest / size)))
    sound = value > REPEATED
    return np.hstack((low, rest / size @ (vector[:, sound] / np.sqrt(value[sound]))))
