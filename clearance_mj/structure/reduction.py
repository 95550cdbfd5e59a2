"""Modes of unit mass, and the reduction of large matrices to the lowest ones and static shapes.

The static shapes are those under unit loads less the retained modes: the residual flexibility (MacNeal 1971;
Rubin 1975). A structure with rigid-body modes has no static shapes; those of a stiffness shifted by a little of its
mass replace them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse

from .base import Assembly, ratios_of_modes
from .large import factored, lowest_modes, residual_shapes

__all__ = ["MassNormalisedModes", "modal_damping", "reduced", "vibration_modes"]

SINGULAR = 1e-13  # eigenvalues of a scaled stiffness (at most 1) that are 0 up to rounding
SOFT_EIGENVALUE = 1e-7  # eigenvalues of a scaled stiffness below which the other modes would lose their digits
MASSLESS = 1e-15
"""Of the mass of the slowest motion of unit stiffness: assigned to massless motions, for a finite frequency."""
SPRING_RATIO = 1e-2  # of the next frequency: motions on soft springs are below
SPRING_EIGENVALUE = 1e-3  # of the square of the lowest bending frequency: motions on soft springs are below
RIGID_EIGENVALUE = 1e-11  # of the square of the lowest bending frequency: rigid bodies' motions are below
NEW_SHARE = 1e-10  # energy fraction of a static shape that is independent of the others, below which it is left out
NEGATIVE = "the structure's stiffness is negative in some motion; check the signs in K"
MAX_DENSE = 1500  # coordinates up to which methods are dense


class MassNormalisedModes(NamedTuple):
    """Modes of unit mass."""

    omega: np.ndarray  # (n,) 1/s
    shapes: np.ndarray  # (n_q, n) per coordinate of the structure


def vibration_modes(mass: np.ndarray, stiffness: np.ndarray) -> MassNormalisedModes:
    """Return all modes of dense matrices, computed from the flexibility, so that the lowest are the most exact.

    A structure with motions of little or no stiffness is shifted by springs in proportion to its mass, of the size of
    its other stiffness, and the shift is removed again.

    Parameters
    ----------
    mass, stiffness : ndarray, shape (n, n)
        Symmetric matrices.

    Raises
    ------
    ValueError
        If the stiffness is negative in some motion, or the mass, or both are zero in one.
    """
    value, vector = _scaled_motions(stiffness)
    if value[0] < -SOFT_EIGENVALUE:
        raise ValueError(NEGATIVE)
    if value[0] > SOFT_EIGENVALUE:
        return _refine_above_slow(mass, _modes(mass, vector / np.sqrt(value)))
    stiff = value > SOFT_EIGENVALUE
    basis = vector[:, stiff] / np.sqrt(value[stiff])
    shift = 1 / np.linalg.eigvalsh(basis.T @ mass @ basis)[-1] if stiff.any() else 1.0
    value, vector = _scaled_motions(stiffness + shift * mass)
    if value[0] < SINGULAR:
        raise ValueError("a motion has neither stiffness nor mass; check M and K, and the supports")
    shifted = _modes(mass, vector / np.sqrt(value))
    squares, shapes = shifted.omega**2 - shift, shifted.shapes
    slow = squares < SPRING_EIGENVALUE * shift
    squares[slow], rotation = np.linalg.eigh(shapes[:, slow].T @ stiffness @ shapes[:, slow])
    if squares.min(initial=0.0) < -SPRING_EIGENVALUE * shift:  # more than the rounded digits of a file explain
        raise ValueError(NEGATIVE)
    shapes[:, slow] = shapes[:, slow] @ rotation
    return MassNormalisedModes(np.sqrt(np.where(squares < RIGID_EIGENVALUE * shift, 0.0, squares)), shapes)


def _refine_above_slow(mass: np.ndarray, modes: MassNormalisedModes) -> MassNormalisedModes:
    """Recompute modes above much slower ones, in whose flexibility theirs is lost, in the complement of these."""
    jumps = np.flatnonzero(modes.omega[:-1] < SPRING_RATIO * modes.omega[1:])
    if not jumps.size:
        return modes
    n = jumps[0] + 1
    slow, basis = modes.shapes[:, :n], modes.shapes[:, n:] / modes.omega[n:]
    others = _refine_above_slow(mass, _modes(mass, basis - slow @ (slow.T @ mass @ basis)))
    return MassNormalisedModes(np.concatenate((modes.omega[:n], others.omega)), np.hstack((slow, others.shapes)))


def _scaled_motions(stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues of a stiffness whose diagonal is scaled to 1, and motions of that stiffness."""
    diagonal = stiffness.diagonal()
    scale = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled = stiffness / np.outer(scale, scale)
    if not np.isfinite(scaled).all():  # LAPACK finds eigenvalues of it, or does not, by chance
        raise np.linalg.LinAlgError("the stiffness is not finite")
    value, vector = np.linalg.eigh(scaled)
    return value, vector / scale[:, None]


def _modes(mass: np.ndarray, basis: np.ndarray) -> MassNormalisedModes:
    """Return modes in a basis of motions of unit stiffness."""
    inverse_omega2, rotation = np.linalg.eigh(basis.T @ mass @ basis)
    largest = inverse_omega2.max(initial=0.0)
    if np.any(inverse_omega2 < -1e3 * MASSLESS * largest):
        raise ValueError("the structure's mass is negative in some motion; check the signs in M")
    omega = 1 / np.sqrt(np.maximum(inverse_omega2[::-1], MASSLESS * largest))
    return MassNormalisedModes(omega, basis @ (rotation[:, ::-1] * omega))


def modal_damping(linear: Assembly, omega: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Return the damping matrix (n, n) 1/s of vibrations with unit modal mass: of their ratios and of the structure."""
    eta1, eta2 = linear.rayleigh
    damping = np.diag(eta1 + eta2 * omega**2 + 2 * omega * ratios_of_modes(linear.ratios, omega.size))
    return damping if linear.viscous is None else damping + shapes.T @ (linear.viscous @ shapes)


def reduced(
    linear: Assembly, masses: Sequence[tuple[float, np.ndarray]], springs: Sequence[tuple[float, np.ndarray]],
    loads: Sequence[np.ndarray], modes: int,
) -> MassNormalisedModes:  # fmt: skip
    """Add masses and springs, each with its row, to a structure, and reduce it to modes and static shapes under loads.

    A ValueError describes a defect of the structure.
    """
    mass, stiffness = _add_terms(linear.mass, masses), _add_terms(linear.stiffness, springs)
    n = mass.shape[0]
    if linear.reduced or n <= modes + len(loads):
        return vibration_modes(*map(_dense, (mass, stiffness)))
    if linear.reduction == "craig-bampton":
        return _craig_bampton(mass, stiffness, [*loads, *(row for _, row in masses)], modes)
    if n <= MAX_DENSE:
        return _truncate(vibration_modes(_dense(mass), _dense(stiffness)), loads, modes)
    return _truncate_sparse(scipy.sparse.csc_array(mass), scipy.sparse.csc_array(stiffness), loads, modes)


def _add_terms(matrix: Any, terms: Sequence[tuple[float, np.ndarray]]) -> Any:
    for factor, row in terms:
        term = scipy.sparse.csr_matrix(row) if scipy.sparse.issparse(matrix) else row[None]
        matrix = matrix + factor * (term.T @ term)
    return matrix


def _dense(matrix: Any) -> np.ndarray:
    return matrix.toarray() if scipy.sparse.issparse(matrix) else np.asarray(matrix)


def _truncate(modes_found: MassNormalisedModes, loads: Sequence[np.ndarray], modes: int) -> MassNormalisedModes:
    """Return the lowest modes, and those in the static shapes of the others: the two are uncoupled.

    In coordinates y = ω q of the other modes, a static shape under the modal forces f is f/ω and stiffness is 1.
    """
    low, high, fast = modes_found.shapes[:, :modes], modes_found.shapes[:, modes:], modes_found.omega[modes:]
    static = (np.reshape(loads, (-1, len(high))) @ high / fast).T
    size = np.linalg.norm(static, axis=0)
    basis, singular_values, _ = np.linalg.svd(static[:, size > 0] / size[size > 0], full_matrices=False)
    basis = basis[:, singular_values**2 > NEW_SHARE] / fast[:, None]
    residual = _modes(np.eye(len(basis)), basis)
    omega = np.concatenate((modes_found.omega[:modes], residual.omega))
    return MassNormalisedModes(omega, np.hstack((low, high @ residual.shapes)))


def _truncate_sparse(mass: Any, stiffness: Any, loads: Sequence[np.ndarray], modes: int) -> MassNormalisedModes:
    """Return the modes of `_truncate` for matrices that are too large for dense methods."""
    squares, shapes, solve, shift = lowest_modes(mass, stiffness, modes)
    static = residual_shapes(mass, stiffness, shapes, solve, shift, np.reshape(loads, (-1, len(shapes))).T)
    energy = static.T @ (stiffness @ static)
    size = np.sqrt(np.maximum(energy.diagonal(), 0.0))
    positive = size > 0
    value, vector = np.linalg.eigh(energy[np.ix_(positive, positive)] / np.outer(size[positive], size[positive]))
    basis = static[:, positive] / size[positive] @ (vector / np.sqrt(value))[:, value > NEW_SHARE]
    residual = _modes(mass, basis)
    return MassNormalisedModes(np.concatenate((np.sqrt(squares), residual.omega)), np.hstack((shapes, residual.shapes)))


def _craig_bampton(mass: Any, stiffness: Any, rows: Sequence[np.ndarray], modes: int) -> MassNormalisedModes:
    """Return fixed-interface modes, and static shapes under unit displacements of the interface, that of ``rows``.

    Craig & Bampton, AIAA Journal 6, 1968.
    """
    is_interface = np.any(np.reshape(rows, (-1, mass.shape[0])), axis=0)
    inner_dofs, interface = np.flatnonzero(~is_interface), np.flatnonzero(is_interface)
    inner, coupling = stiffness[inner_dofs][:, inner_dofs], _dense(stiffness[inner_dofs][:, interface])
    inner_mass = mass[inner_dofs][:, inner_dofs]
    solve, soft = factored(scipy.sparse.csc_array(inner))
    if soft < SINGULAR:
        raise ValueError(
            "the structure can move while its clearances and forces are held, so Craig-Bampton has no static shapes; "
            'add a support, or use reduction = "residual-flexibility"'
        )
    if len(inner_dofs) <= MAX_DENSE:
        fixed_modes = vibration_modes(_dense(inner_mass), _dense(inner)).shapes[:, :modes]
    else:
        fixed_modes = lowest_modes(inner_mass, inner, modes)[1]
    basis = np.zeros((mass.shape[0], interface.size + fixed_modes.shape[1]))
    basis[interface, np.arange(interface.size)] = 1.0
    basis[inner_dofs] = np.hstack((-solve(coupling), fixed_modes))
    modes_in_basis = vibration_modes(basis.T @ (mass @ basis), basis.T @ (stiffness @ basis))
    return MassNormalisedModes(modes_in_basis.omega, basis @ modes_in_basis.shapes)
