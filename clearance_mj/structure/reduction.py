"""Modes of unit mass, and the reduction of large matrices to the lowest ones and static shapes.

The static shapes are those under unit loads that the kept modes leave over: the residual flexibility (MacNeal 1971;
Rubin 1975). A structure that can move without bending has no static shapes; the ones under a little of its own inertia
stand for them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse

from .base import Assembly, ratios_of_modes
from .large import factored, lowest, residual_shapes

__all__ = ["Modes", "modal_damping", "reduced", "vibration_modes"]

SINGULAR = 1e-13  # eigenvalues of a scaled stiffness (at most 1) that are 0 but for rounding
SOFT_EIGENVALUE = 1e-7  # eigenvalues of a scaled stiffness below which the other modes would lose their digits
MASSLESS = 1e-15
"""Of the mass of the slowest motion of unit stiffness: given to a motion without mass, for a finite frequency."""
SPRING_RATIO = 1e-2  # of the next frequency: motions on soft springs are below
SPRING_EIGENVALUE = 1e-3  # of the square of the lowest bending frequency: motions on soft springs are below
RIGID_EIGENVALUE = 1e-11  # of the square of the lowest bending frequency: rigid bodies' motions are below
NEW_SHARE = 1e-10  # a static shape of which less than this is new to the others is left out
NEGATIVE = "the structure's stiffness is negative in some motion; check the signs in K"
MAX_DENSE = 1500  # coordinates up to which matrices are taken whole


class Modes(NamedTuple):
    """Modes of unit mass."""

    omega: np.ndarray  # (n,) 1/s
    shapes: np.ndarray  # (n_q, n) per coordinate of the structure


def vibration_modes(mass: np.ndarray, stiffness: np.ndarray) -> Modes:
    """All modes of dense matrices, found from the flexibility, so that the lowest are the most exact.

    A structure that can move with little or no stiffness is held by springs that its masses carry, of the size of its
    other stiffness, which are taken off again.

    Parameters
    ----------
    mass, stiffness : ndarray, shape (n, n)
        Symmetric matrices.

    Raises
    ------
    ValueError
        If the stiffness is negative in some motion, or the mass, or both are zero in one.
    """
    value, vector = _principal(stiffness)
    if value[0] < -SOFT_EIGENVALUE:
        raise ValueError(NEGATIVE)
    if value[0] > SOFT_EIGENVALUE:
        return _without_slow(mass, _modes(mass, vector / np.sqrt(value)))
    stiff = value > SOFT_EIGENVALUE
    basis = vector[:, stiff] / np.sqrt(value[stiff])
    shift = 1 / np.linalg.eigvalsh(basis.T @ mass @ basis)[-1] if stiff.any() else 1.0
    value, vector = _principal(stiffness + shift * mass)
    if value[0] < SINGULAR:
        raise ValueError("a motion has neither stiffness nor mass; check M and K, and the supports")
    held = _modes(mass, vector / np.sqrt(value))
    squares, shapes = held.omega**2 - shift, held.shapes
    slow = squares < SPRING_EIGENVALUE * shift
    squares[slow], rotation = np.linalg.eigh(shapes[:, slow].T @ stiffness @ shapes[:, slow])
    if squares.min(initial=0.0) < -SPRING_EIGENVALUE * shift:  # more than the digits of a file leave out
        raise ValueError(NEGATIVE)
    shapes[:, slow] = shapes[:, slow] @ rotation
    return Modes(np.sqrt(np.where(squares < RIGID_EIGENVALUE * shift, 0.0, squares)), shapes)


def _without_slow(mass: np.ndarray, found: Modes) -> Modes:
    """The same modes; those above much slower ones, in whose flexibility theirs is lost, found again without them."""
    jumps = np.flatnonzero(found.omega[:-1] < SPRING_RATIO * found.omega[1:])
    if not jumps.size:
        return found
    n = jumps[0] + 1
    slow, basis = found.shapes[:, :n], found.shapes[:, n:] / found.omega[n:]
    rest = _without_slow(mass, _modes(mass, basis - slow @ (slow.T @ mass @ basis)))
    return Modes(np.concatenate((found.omega[:n], rest.omega)), np.hstack((slow, rest.shapes)))


def _principal(stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues of a stiffness whose diagonal is scaled to 1, and motions of that stiffness."""
    diagonal = stiffness.diagonal()
    scale = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled = stiffness / np.outer(scale, scale)
    if not np.isfinite(scaled).all():  # LAPACK finds eigenvalues of it, or does not, by chance
        raise np.linalg.LinAlgError("the stiffness is not finite")
    value, vector = np.linalg.eigh(scaled)
    return value, vector / scale[:, None]


def _modes(mass: np.ndarray, basis: np.ndarray) -> Modes:
    """Modes from motions of unit stiffness."""
    inverse_omega2, rotation = np.linalg.eigh(basis.T @ mass @ basis)
    largest = inverse_omega2.max(initial=0.0)
    if np.any(inverse_omega2 < -1e3 * MASSLESS * largest):
        raise ValueError("the structure's mass is negative in some motion; check the signs in M")
    omega = 1 / np.sqrt(np.maximum(inverse_omega2[::-1], MASSLESS * largest))
    return Modes(omega, basis @ (rotation[:, ::-1] * omega))


def modal_damping(linear: Assembly, omega: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Return the damping matrix (n, n) 1/s of vibrations with unit modal mass: of their ratios and of the structure."""
    eta1, eta2 = linear.rayleigh
    found = np.diag(eta1 + eta2 * omega**2 + 2 * omega * ratios_of_modes(linear.ratios, omega.size))
    return found if linear.viscous is None else found + shapes.T @ (linear.viscous @ shapes)


def reduced(
    linear: Assembly,
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
    if linear.reduction == "craig-bampton":
        return _craig_bampton(mass, stiffness, [*loads, *(row for _, row in masses)], modes)
    if n <= MAX_DENSE:
        return _truncated(vibration_modes(_dense(mass), _dense(stiffness)), loads, modes)
    return _large(scipy.sparse.csc_array(mass), scipy.sparse.csc_array(stiffness), loads, modes)


def _with(matrix: Any, terms: Sequence[tuple[float, np.ndarray]]) -> Any:
    for factor, row in terms:
        term = scipy.sparse.csr_matrix(row) if scipy.sparse.issparse(matrix) else row[None]
        matrix = matrix + factor * (term.T @ term)
    return matrix


def _dense(matrix: Any) -> np.ndarray:
    return matrix.toarray() if scipy.sparse.issparse(matrix) else np.asarray(matrix)


def _truncated(found: Modes, loads: Sequence[np.ndarray], modes: int) -> Modes:
    """Lowest modes, and those that the static shapes of the others have: the two are uncoupled.

    In coordinates y = ω q of the other modes, a static shape under the modal forces f is f/ω and stiffness is 1.
    """
    low, high, fast = found.shapes[:, :modes], found.shapes[:, modes:], found.omega[modes:]
    static = (np.reshape(loads, (-1, len(high))) @ high / fast).T
    size = np.linalg.norm(static, axis=0)
    basis, share, _ = np.linalg.svd(static[:, size > 0] / size[size > 0], full_matrices=False)
    basis = basis[:, share**2 > NEW_SHARE] / fast[:, None]
    rest = _modes(np.eye(len(basis)), basis)
    return Modes(np.concatenate((found.omega[:modes], rest.omega)), np.hstack((low, high @ rest.shapes)))


def _large(mass: Any, stiffness: Any, loads: Sequence[np.ndarray], modes: int) -> Modes:
    """The same of matrices that are too large to be taken whole."""
    squares, shapes, solve, shift = lowest(mass, stiffness, modes)
    static = residual_shapes(mass, stiffness, shapes, solve, shift, np.reshape(loads, (-1, len(shapes))).T)
    energy = static.T @ (stiffness @ static)
    size = np.sqrt(np.maximum(energy.diagonal(), 0.0))
    sound = size > 0
    value, vector = np.linalg.eigh(energy[np.ix_(sound, sound)] / np.outer(size[sound], size[sound]))
    basis = static[:, sound] / size[sound] @ (vector / np.sqrt(value))[:, value > NEW_SHARE]
    rest = _modes(mass, basis)
    return Modes(np.concatenate((np.sqrt(squares), rest.omega)), np.hstack((shapes, rest.shapes)))


def _craig_bampton(mass: Any, stiffness: Any, rows: Sequence[np.ndarray], modes: int) -> Modes:
    """Modes with the coordinates of ``rows`` held, and static shapes under unit displacements of each (Craig & Bampton,
    AIAA Journal 6, 1968).
    """
    kept = np.any(np.reshape(rows, (-1, mass.shape[0])), axis=0)
    inside, edge = np.flatnonzero(~kept), np.flatnonzero(kept)
    inner, across = stiffness[inside][:, inside], _dense(stiffness[inside][:, edge])
    inner_mass = mass[inside][:, inside]
    solve, soft = factored(scipy.sparse.csc_array(inner))
    if soft < SINGULAR:
        raise ValueError(
            "the structure can move while its clearances and forces are held, so Craig-Bampton has no static shapes; "
            'add a support, or use reduction = "residual-flexibility"'
        )
    if len(inside) <= MAX_DENSE:
        held = vibration_modes(_dense(inner_mass), _dense(inner)).shapes[:, :modes]
    else:
        held = lowest(inner_mass, inner, modes)[1]
    basis = np.zeros((mass.shape[0], edge.size + held.shape[1]))
    basis[edge, np.arange(edge.size)] = 1.0
    basis[inside] = np.hstack((-solve(across), held))
    found = vibration_modes(basis.T @ (mass @ basis), basis.T @ (stiffness @ basis))
    return Modes(found.omega, basis @ found.shapes)
