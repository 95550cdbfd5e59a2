"""Reynolds' equation of an oil film of finite width for every motion: a table over eccentricity and direction.

With w the velocity of the journal less that of a film that turns at half the spin, over the clearance, A = |w| and ψ
such that w = A (sin ψ n - cos ψ t), the film H = 1 - ε cos θ thick and p = 12 μ A (R/C)² P,

    ∂(H³ ∂P/∂θ)/∂θ + (D/L)² ∂(H³ ∂P/∂ξ)/∂ξ = sin(θ - ψ),  P = 0 at both edges ξ = ±1.

Along the bearing P is a sum of cos(q_k ξ), q_k = (k - 1/2) π, each with its equation around the bearing

    (H³ Q_k')' - (q_k D/L)² H³ Q_k = sin(θ - ψ),  mean of P along ξ = Σ 2/q_k² Q_k

(separation of variables; Hamrock, Schmid & Jacobson, Fundamentals of Fluid Film Lubrication, 2004, chapter 11). Where
oil cannot pull, the film is assumed to break and to form straight across the bearing: mean of P >= 0, with the flow
balanced where it is positive, is a complementarity problem of one dimension, solved by policy iteration.

The pressure minimises the power, so that forces are the derivatives of half of it by w. A thin film resists squeeze
far more than turning, an opening one no more: with u = (w_n, κ w_t) = |u| (sin χ n - cos χ t) the power is
12 μ R L (R/C)² C u² g, with a g that is smooth over χ in both. The table holds ln g.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numba.extending import register_jitable

from ..core.jit import jit

__all__ = ["DIRECTIONS", "RATIOS", "STEP", "THINNEST", "film_force", "film_table", "turning_share"]

AROUND = 180  # nodes around
RATIOS, STEP = 43, 1 / 7  # rows of the table, equidistant in -ln(1 - ε)
THINNEST = math.exp(-(RATIOS - 1) * STEP)  # 1 - ε of the last row
DIRECTIONS = 41  # columns of the table, χ from -π/2 to π/2; the other half is their mirror image
MAX_ITERATIONS = 60
LEAST_WAVES, MOST_WAVES = 4, 48  # cosines along the bearing; finer ones are as in a short bearing
FINE = 6.0  # q_k D/L times the length of the thin film in the finest of them


@jit(error_model="numpy")
def _solve_ring(diagonal, coupling, right, fixed, solution, work):  # type: ignore[no-untyped-def]
    """Solve a symmetric cyclic tridiagonal system where nodes are not fixed; ``coupling[i]`` joins i and i + 1.

    Sherman and Morrison's formula (Press et al., Numerical Recipes, section 2.7) closes the ring.
    """
    n = diagonal.size
    corner = 0.0 if fixed[0] or fixed[n - 1] else coupling[n - 1]
    gamma = -diagonal[0] if not fixed[0] else -1.0
    pivot = 1.0
    for i in range(n):
        a = 0.0 if i == 0 or fixed[i] or fixed[i - 1] else coupling[i - 1]
        d = 1.0 if fixed[i] else diagonal[i]
        if i == 0:
            d -= gamma
        if i == n - 1:
            d -= corner * corner / gamma
        r = 0.0 if fixed[i] else right[i]
        u = gamma if i == 0 else (corner if i == n - 1 else 0.0)
        if i == 0:
            pivot = 1.0 / d
            solution[0], work[1, 0] = r * pivot, u * pivot
        else:
            work[0, i] = a * pivot  # of the row before, over its pivot
            pivot = 1.0 / (d - a * work[0, i])
            solution[i] = (r - a * solution[i - 1]) * pivot
            work[1, i] = (u - a * work[1, i - 1]) * pivot
    for i in range(n - 2, -1, -1):
        solution[i] -= work[0, i + 1] * solution[i + 1]
        work[1, i] -= work[0, i + 1] * work[1, i + 1]
    ratio = corner / gamma
    factor = (solution[0] + ratio * solution[n - 1]) / (1.0 + work[1, 0] + ratio * work[1, n - 1])
    for i in range(n):
        solution[i] -= factor * work[1, i]


@jit(error_model="numpy")
def _set_forces(angle, cell, cube, link, rates, weights, tail, psi, cavitated, forces):  # type: ignore[no-untyped-def]
    """Write forces (n_psi, 2) outwards and along rising θ at one eccentricity.

    ``rates`` are (q_k D/L)², ``weights`` 2/q_k², ``tail`` the contribution of all finer cosines to the mean, times H³.
    """
    n, waves = angle.size, rates.size
    fixed, next_fixed = np.zeros(n, np.bool_), np.zeros(n, np.bool_)
    wedge, right, mean, flow = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    diagonal, solution, work = np.zeros(n), np.zeros(n), np.zeros((2, n))
    for m in range(psi.size):
        for i in range(n):
            wedge[i] = math.sin(angle[i] - psi[m])
            right[i] = cell[i] * wedge[i]
            if m == 0:
                fixed[i] = cavitated and wedge[i] >= 0.0
        for _ in range(MAX_ITERATIONS):
            for i in range(n):
                mean[i] = 0.0 if fixed[i] else -tail * wedge[i] / cube[i]
                flow[i] = 0.0
            for k in range(waves):
                for i in range(n):
                    diagonal[i] = -link[i] - link[i - 1] - rates[k] * cube[i] * cell[i]
                _solve_ring(diagonal, link, right, fixed, solution, work)
                for i in range(n):
                    mean[i] += weights[k] * solution[i]
                    if fixed[i]:
                        next_value = solution[i + 1] if i + 1 < n else solution[0]
                        flow[i] += weights[k] * (link[i] * next_value + link[i - 1] * solution[i - 1])
            changed = False
            for i in range(n):
                next_fixed[i] = cavitated and (flow[i] <= right[i] if fixed[i] else mean[i] < 0.0)
                changed = changed or next_fixed[i] != fixed[i]
            if not changed:
                break
            fixed[:] = next_fixed
        outwards = across = 0.0
        for i in range(n):
            outwards -= cell[i] * mean[i] * math.cos(angle[i])
            across -= cell[i] * mean[i] * math.sin(angle[i])
        forces[m, 0], forces[m, 1] = outwards, across


def film_force(ratio: float, width: float, psi: Any, cavitated: bool) -> np.ndarray:
    """Return forces on the journal outwards and along rising θ, (n, 2), over 12 μ A R L (R/C)².

    Parameters
    ----------
    ratio : float
        ε, below 1.
    width : float
        L/D.
    psi : array_like, shape (n,)
        Directions of the motion, rad.
    cavitated : bool
        True if oil cannot pull.
    """
    # Sommerfeld's substitution with a smaller ε refines cells where the film is thin, without large ones opposite.
    stretch = ((1 - ratio) / (1 + ratio)) ** 0.25
    gamma = np.arange(AROUND) * (2 * np.pi / AROUND)
    angle = 2 * np.arctan(stretch * np.tan(gamma / 2))
    edge = 2 * np.arctan(stretch * np.tan((gamma + np.pi / AROUND) / 2))
    angle, edge = np.unwrap(angle), np.unwrap(edge)
    cell = edge - np.concatenate(([edge[-1] - 2 * np.pi], edge[:-1]))
    spacing = np.concatenate((angle[1:], [angle[0] + 2 * np.pi])) - angle
    thickness = 1 - ratio * np.cos(angle)
    coupling = (1 - ratio * np.cos(angle + spacing / 2)) ** 3 / spacing
    thin = min(math.sqrt(2 * (1 - ratio) / max(ratio, 1e-9)), 1.0)
    count = min(max(LEAST_WAVES, math.ceil(FINE * width / (np.pi * thin)) + 1), MOST_WAVES)
    q = (np.arange(count) + 0.5) * np.pi
    weights = 2 / q**2
    tail = float(1 / 3 - np.sum(2 / q**4)) * width**2
    if count == MOST_WAVES:  # the ends of a long bearing are short: finer cosines equal the finest
        weights[-1] += 1 - weights.sum()
        tail = 0.0
    psi = np.ascontiguousarray(psi, dtype=float)
    forces = np.empty((psi.size, 2))
    _set_forces(angle, cell, thickness**3, coupling, (q / width) ** 2, weights, tail, psi, cavitated, forces)
    return forces


@register_jitable
def turning_share(ratio: float) -> float:
    """Return κ, the weight of turning relative to squeeze at an eccentricity ratio.

    κ⁴ is the power of turning over that of squeeze in a short bearing whose oil can pull (Ocvirk).
    """
    return math.sqrt(math.sqrt((1.0 - ratio * ratio) / (1.0 + 2.0 * ratio * ratio)))


@functools.lru_cache(maxsize=64)
def film_table(width: float, cavitated: bool) -> tuple[float, ...]:
    """Return coefficients of the cubic B-spline of ln g, row after row over ε, (RATIOS + 2) (DIRECTIONS + 2) numbers.

    Parameters
    ----------
    width : float
        L/D.
    cavitated : bool
        True if oil cannot pull.
    """
    chi = np.linspace(-np.pi / 2, np.pi / 2, DIRECTIONS)
    values = np.empty((RATIOS, DIRECTIONS))
    for i in range(RATIOS):
        ratio = -math.expm1(-STEP * i)
        squeeze, turning = np.sin(chi), np.cos(chi) / turning_share(ratio)  # w_n and -w_t where |u| = 1
        outwards, across = film_force(ratio, width, np.arctan2(squeeze, turning), cavitated).T
        values[i] = np.log(np.hypot(squeeze, turning) * (across * turning - outwards * squeeze))
    values[0] = values[0].mean()  # a centred film has no direction
    over_ratio, over_psi = _spline(RATIOS, mirrored=False), _spline(DIRECTIONS, mirrored=True)
    return tuple((over_ratio @ values @ over_psi.T).ravel().tolist())


def _spline(nodes: int, mirrored: bool) -> np.ndarray:
    """Return the matrix (nodes + 2, nodes) from values to coefficients of their cubic B-spline, mirrored or not.

    Without a mirror at the ends the outermost two pieces are one cubic ("not a knot").
    """
    system = np.zeros((nodes + 2, nodes + 2))
    for i in range(nodes):
        system[i + 1, i : i + 3] = 1 / 6, 4 / 6, 1 / 6
    end = np.array([-1.0, 0.0, 1.0] if mirrored else [1.0, -4.0, 6.0, -4.0, 1.0])
    system[0, : end.size], system[-1, -end.size :] = end, end
    return np.asarray(np.linalg.inv(system)[:, 1:-1])
