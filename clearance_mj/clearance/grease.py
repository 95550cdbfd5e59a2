"""Grease in a bushing: Bouc-Wen hysteresis (Eq. 9) with a squeeze film, for compiled loops.

Bouc-Wen does not depend on rate, so its state is advanced over the displacement increment of a step.
"""

from __future__ import annotations

import numba
import numpy as np

from ..errors import LawError
from ..rig import Rig
from .law import Law

__all__ = ["bouc_wen_step", "film_damping", "grease_step", "grease_table"]

STIFFNESS, ELASTIC, A, BETA, GAMMA, EXPONENT, DAMPING, INVERSE_FILM, FILM_LIMIT = range(9)


def grease_table(rig: Rig, law: Law) -> np.ndarray:
    """Grease parameters of every bushing as compiled loops read them.

    Parameters
    ----------
    rig : Rig
        The rig.
    law : Law
        Its grease, if it has one, replaces the rig's.

    Returns
    -------
    ndarray, shape (n_bushings, 9)
        Columns k, λ, A, β, γ, n, c, 1/h (0 without film), ε.

    Raises
    ------
    LawError
        If the law holds grease for another number of bushings.
    """
    n = len(rig.bushings)
    greases = [b.grease for b in rig.bushings] if law.grease is None else list(law.grease)
    if len(greases) == 1:
        greases *= n
    if len(greases) != n:
        raise LawError(f"the law holds grease for {len(greases)} bushings, the rig has {n}; give one or {n}")
    rows = [
        (
            *(g.stiffness, g.elastic_ratio, g.amplitude, g.beta, g.gamma, g.exponent, g.damping),
            *(1 / g.film_height if g.film_height else 0.0, g.film_limit),
        )
        for g in greases
    ]
    return np.array(rows).reshape(n, 9)


@numba.njit(cache=True, nogil=True, inline="always")
def bouc_wen_step(z, dx, a, beta, gamma, exponent):
    """Advance the Bouc-Wen state z over the displacement dx by the midpoint rule (second order in dx).

    Parameters
    ----------
    z, dx : float
        State and displacement increment, m.
    a, beta, gamma, exponent : float
        A, β and γ, 1/mⁿ, and n.
    """
    half = z + 0.5 * dx * _slope(z, dx, a, beta, gamma, exponent)
    return z + dx * _slope(half, dx, a, beta, gamma, exponent)


@numba.njit(cache=True, nogil=True, inline="always")
def _slope(z, dx, a, beta, gamma, exponent):
    """dz/dx = A - |z|ⁿ (γ + β sign(dx z))."""
    size = z * z if exponent == 2.0 else abs(z) ** exponent
    return a - size * (gamma + (beta if dx * z > 0.0 else -beta))


@numba.njit(cache=True, nogil=True, inline="always")
def film_damping(x, damping, inverse_film, limit):
    """Return the squeeze-film damping c / max(1 - |x|/h, ε)², N s/m.

    Parameters
    ----------
    x : float
        Displacement, m.
    damping : float
        c of the centred shaft, N s/m.
    inverse_film : float
        1/h, 1/m; 0 without film.
    limit : float
        ε.
    """
    thin = max(1.0 - abs(x) * inverse_film, limit)
    return damping / (thin * thin)


@numba.njit(cache=True, nogil=True, inline="always")
def grease_step(row, x, dx, z):
    """Return state, elastic force and damping of one bushing's grease after its motion by dx to x.

    Parameters
    ----------
    row : ndarray, shape (9,)
        The bushing's row of `grease_table`.
    x, dx : float
        Displacement after the motion, and the motion, m.
    z : float
        Bouc-Wen state before it, m.

    Returns
    -------
    tuple of float
        z (m), λ k x + (1-λ) k z (N) and c(x) (N s/m).
    """
    z = bouc_wen_step(z, dx, row[A], row[BETA], row[GAMMA], row[EXPONENT])
    elastic = row[STIFFNESS] * (row[ELASTIC] * x + (1.0 - row[ELASTIC]) * z)
    return z, elastic, film_damping(x, row[DAMPING], row[INVERSE_FILM], row[FILM_LIMIT])
