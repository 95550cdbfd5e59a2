"""Lowest modes and residual static shapes of matrices that are too large for dense methods.

Shift-invert Lanczos (Lehoucq, Sorensen & Yang, ARPACK Users' Guide, 1998) on one sparse factorisation. A structure with
rigid-body modes is shifted by a little of its mass, K + σM, and the static shapes of the residual loads beyond the
lowest modes (inertia relief) follow from it by iteration.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

__all__ = ["factored", "lowest_modes", "residual_shapes", "symmetric_factors"]

Solve: TypeAlias = Callable[[np.ndarray], np.ndarray]

SINGULAR = 1e-11  # smallest eigenvalue of a scaled stiffness (at most 1) below which it is not factored by itself
LARGEST_SHIFT = 0.05  # of the highest requested eigenvalue: static shapes converge fast with shifts up to it
RIGID_EIGENVALUE = 1e-14  # of the largest ratio of stiffness to mass: eigenvalues below it are 0 up to rounding
BEYOND = "no modes are found: masses or stiffnesses differ by more than floating point holds"
SHAPE_TOLERANCE = 1e-13  # relative change of a static shape at which its refinement ends


def symmetric_factors(matrix: Any) -> tuple[Any, scipy.sparse.csc_array, np.ndarray]:
    """Factor a symmetric matrix of positive diagonal, which is scaled to 1: pivots stay on the diagonal.

    Returns
    -------
    factors : scipy.sparse.linalg.SuperLU or None
        Of the scaled matrix; None if it is exactly singular.
    scaled : scipy.sparse.csc_array
    scale : ndarray, shape (n,)
        Of its rows and columns.
    """
    scale = 1 / np.sqrt(matrix.diagonal())
    scaled = scipy.sparse.csc_array(matrix.multiply(scale[:, None]).multiply(scale))
    options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    try:
        return scipy.sparse.linalg.splu(scaled, **options), scaled, scale
    except RuntimeError:
        return None, scaled, scale


def factored(matrix: Any) -> tuple[Solve, float]:
    """Return a solver of a symmetric sparse matrix, and the smallest eigenvalue of the matrix scaled to unit diagonal.

    The solver must not be used where the eigenvalue is 0: the matrix is singular.
    """
    if not np.all(matrix.diagonal() > 0):
        return np.zeros_like, 0.0
    factors, _, scale = symmetric_factors(matrix)
    if factors is None:
        return np.zeros_like, 0.0
    vector, size = np.random.default_rng(0).standard_normal(len(scale)), 1.0
    for _ in range(3):
        vector = factors.solve(vector / np.linalg.norm(vector))
        size = float(np.linalg.norm(vector))
    if not np.isfinite(size):
        return np.zeros_like, 0.0

    def solve(rhs: np.ndarray) -> np.ndarray:
        return (factors.solve((rhs.T * scale).T).T * scale).T

    return solve, 1 / size


def lowest_modes(mass: Any, stiffness: Any, modes: int) -> tuple[np.ndarray, np.ndarray, Solve, float]:
    """Find the lowest modes.

    Returns
    -------
    squares : ndarray, shape (modes,)
        ω², 1/s²; 0 for rigid-body modes.
    shapes : ndarray, shape (n, modes)
        Shapes of unit modal mass.
    solve : callable
        Solver of K + σM.
    shift : float
        σ, 1/s²; 0 for a structure without rigid-body modes.
    """
    heavy = mass.diagonal() > 0
    fastest = float(np.max(stiffness.diagonal()[heavy] / mass.diagonal()[heavy]))
    solve, soft = factored(stiffness)
    shift = 0.0 if soft > SINGULAR else 1e-10 * fastest
    while True:
        if shift:
            del solve  # before the next one takes as much memory
            solve, soft = factored(stiffness + shift * mass)
            if soft < 1e-3 * SINGULAR:
                raise ValueError("a motion has neither stiffness nor mass; check M and K, and the supports")
        shapes = _lanczos(mass, stiffness, solve, shift, modes)
        squares, rotation = np.linalg.eigh(shapes.T @ (stiffness @ shapes))
        if shift <= LARGEST_SHIFT * squares[-1] or shift <= RIGID_EIGENVALUE * fastest:
            break
        shift = LARGEST_SHIFT / 2 * max(squares[-1], 1e-3 * shift)
    if squares[0] < -max(1e2 * RIGID_EIGENVALUE * fastest, 1e-6 * shift):
        raise ValueError("the structure's stiffness is negative in some motion; check the signs in K")
    return np.where(squares < RIGID_EIGENVALUE * fastest, 0.0, squares), shapes @ rotation, solve, shift


def _lanczos(mass: Any, stiffness: Any, solve: Solve, shift: float, modes: int) -> np.ndarray:
    """Return shapes (n, modes) of the lowest modes, of unit modal mass."""
    inverse = scipy.sparse.linalg.LinearOperator(mass.shape, solve, dtype=float)
    start = solve(mass @ np.random.default_rng(0).standard_normal(mass.shape[0]))
    if not np.isfinite(start @ (mass @ start)):
        raise ValueError(BEYOND)
    try:
        _, shapes = scipy.sparse.linalg.eigsh(stiffness, modes, mass, sigma=-shift, OPinv=inverse, v0=start)
    except scipy.sparse.linalg.ArpackError:
        raise ValueError(BEYOND) from None
    # By rounding, modes of equal frequency, such as a rigid body's, are not quite orthogonal.
    size, vector = np.linalg.eigh(shapes.T @ (mass @ shapes))
    if not np.all(size > 0):
        raise ValueError(BEYOND)
    return shapes @ (vector / np.sqrt(size))


def residual_shapes(
    mass: Any, stiffness: Any, shapes: np.ndarray, solve: Solve, shift: float, loads: np.ndarray
) -> np.ndarray:
    """Return the static shapes (n, n_loads) under loads (n, n_loads), less their components in the modes ``shapes``."""
    inertia = mass @ shapes
    residual_loads = loads - inertia @ (shapes.T @ loads)
    static = np.zeros_like(residual_loads)
    for _ in range(30):
        change = solve(residual_loads - stiffness @ static)
        change -= shapes @ (inertia.T @ change)
        static += change
        if np.all(np.linalg.norm(change, axis=0) <= SHAPE_TOLERANCE * np.linalg.norm(static, axis=0)):
            break
    return static
