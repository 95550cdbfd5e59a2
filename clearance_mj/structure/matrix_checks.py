"""What matrices of a structure must be: a symmetric positive mass, a stiffness whose symmetric part is not negative."""

from __future__ import annotations

import numpy as np
import scipy.sparse

from .dofs import Dofs
from .large import symmetric_factors
from .matrix_files import Matrix

__all__ = ["check_mass_and_stiffness", "parts_of"]

ASYMMETRY = 1e-6
"""Of the geometric mean of both diagonal terms: difference between the halves that rounding in a file leaves."""


def parts_of(what: str, matrix: Matrix, dofs: Dofs) -> tuple[Matrix, Matrix | None]:
    """Return the symmetric and the skew part of a matrix, None for a skew one that rounding explains.

    A ValueError says where a mass is not symmetric.
    """
    difference = scipy.sparse.coo_array(matrix - matrix.T)
    size = np.sqrt(np.abs(matrix.diagonal()))
    floor = 1e-9 * size.max(initial=0.0)
    size = np.maximum(size, floor)
    share = np.abs(difference.data) / np.maximum(size[difference.row] * size[difference.col], 1e-300)
    symmetric = (matrix + matrix.T) / 2
    if not share.size or share.max() <= ASYMMETRY:
        return symmetric, None
    if what == "mass":
        worst = int(np.argmax(share))
        i, j = int(difference.row[worst]), int(difference.col[worst])
        raise ValueError(
            f"{what} is not symmetric: {matrix[i, j]:g} between {dofs.names[i]} and {dofs.names[j]} (row {i + 1}, "
            f"column {j + 1}), {matrix[j, i]:g} between {dofs.names[j]} and {dofs.names[i]}"
        )
    return symmetric, (matrix - matrix.T) / 2


def check_mass_and_stiffness(mass: Matrix, stiffness: Matrix, names: tuple[str, ...]) -> None:
    """Refuse a mass that is not positive and a stiffness that is negative; the message names the degree of freedom.

    A rotation may have no mass, as in lumped mass matrices, if it has a stiffness.
    """
    heavy, stiff = mass.diagonal(), stiffness.diagonal()
    light = (heavy == 0) & (abs(mass).sum(axis=0) == 0) & np.array([":R" in name for name in names])
    if not np.all(sound := (stiff > 0) | ~light):
        at = int(np.argmin(sound))
        raise ValueError(
            f"mass of {names[at]} and its stiffness are 0 (row {at + 1}); leave it out, or hold it by fixed"
        )
    if not np.all(sound := (heavy > 0) | light):
        at = int(np.argmin(sound))
        raise ValueError(
            f"mass of {names[at]} is {heavy[at]:g} (row {at + 1}); needs > 0: give it a mass, export a consistent mass "
            "matrix, or condense it (Guyan) in the FE program"
        )
    if light.all():
        raise ValueError("mass is 0; needs a translation with a mass")
    rows = np.flatnonzero(~light)
    if (worst := _worst(mass[rows][:, rows])) is not None:
        raise ValueError(
            f"mass is not positive definite: some motion of {names[rows[worst]]} has no positive kinetic energy; look "
            "at the coupling terms of that row, and whether the file holds the whole matrix"
        )
    if np.any(stiff < 0):
        at = int(np.argmin(stiff))
        raise ValueError(f"stiffness of {names[at]} is {stiff[at]:g} (row {at + 1}); needs >= 0: check K's sign")
    little = 1e-9 * float(np.max(stiff[rows] / heavy[rows])) or 1.0
    if (worst := _worst(stiffness + little * mass)) is not None:
        raise ValueError(
            f"stiffness is negative in some motion of {names[worst]}; check the signs of K, and whether the file holds "
            "the whole matrix"
        )


def _worst(matrix: Matrix) -> int | None:
    """Where a matrix of positive diagonal fails to be positive definite; None if it does not."""
    if isinstance(matrix, np.ndarray):
        scale = 1 / np.sqrt(matrix.diagonal())
        value, vector = np.linalg.eigh(matrix * np.outer(scale, scale))
        return None if value[0] > 1e-14 else int(np.argmax(np.abs(vector[:, 0])))
    factors, scaled, _ = symmetric_factors(matrix)
    if factors is None:
        return int(np.argmin(abs(scaled).sum(axis=0)))
    # By Sylvester's law the pivots on the diagonal have the signs of the eigenvalues.
    pivots = factors.U.diagonal()
    if np.all(pivots > 1e-14) and np.array_equal(factors.perm_r, factors.perm_c):
        return None
    return int(np.argsort(factors.perm_c)[np.argmin(pivots)])
