"""Oil film of a bearing of finite width: Reynolds' equation on a grid, with Reynolds' condition where the film breaks.

Of a shaft that is parallel to its bearing, at an eccentricity ε from the angle θ' = 0 on, the film is H = 1 - ε cos θ'
clearances thick. With p = 12 μ A (R/C)² P, and A and ψ such that A cos ψ = ε (Ω/2 - φ') and A sin ψ = ε',

    ∂(H³ ∂P/∂θ')/∂θ' + (D/L)² ∂(H³ ∂P/∂ξ)/∂ξ = sin(θ' - ψ),  P >= 0,  P = 0 at both edges ξ = ±1 and in grooves,

so that the forces in any motion are A times those of one table over ε and ψ. Where P is 0 the film may be thinner than
the gap: P >= 0 with the flow balanced wherever P > 0 is a complementarity problem, solved by policy iteration.

Sources: Hamrock, Schmid & Jacobson, Fundamentals of Fluid Film Lubrication, 2004, chapters 7 to 11; Bokanowski, Maroso
& Zidani, SIAM J. Numer. Anal. 47, 2009.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

AROUND, ALONG = 144, 12  # cells of the grid: around, and along one half of the bearing
MAX_ITERATIONS = 60


@dataclass(frozen=True)
class Grid:
    """Reynolds' operator at one eccentricity."""

    angle: np.ndarray  # (n,) θ' of the cells' middles
    operator: scipy.sparse.csr_array  # of P, cell after cell along ξ from the middle to the edge, for each angle
    open: np.ndarray  # (n ALONG,) cells that are in no groove


def grid(eccentricity: float, width: float, grooves: tuple[float, ...] = (), groove: float = 0.0) -> Grid:
    """Return the operator for L/D = ``width``; grooves have their middles at angles θ' and span ``groove``, rad."""
    step, across = 2 * np.pi / AROUND, 1 / ALONG
    angle = (np.arange(AROUND) + 0.5) * step
    cube = (1 - eccentricity * np.cos(angle)) ** 3
    between = (1 - eccentricity * np.cos(angle + step / 2)) ** 3
    ring = scipy.sparse.diags_array(between) @ (scipy.sparse.eye_array(AROUND).tocsr()[np.roll(range(AROUND), -1)])
    around = (ring + ring.T - scipy.sparse.diags_array(between + np.roll(between, 1))) / step**2
    diagonal, neighbours = np.full(ALONG, -2.0), np.ones(ALONG - 1)
    diagonal[[0, -1]] = -1.0, -3.0  # the middle is a line of symmetry; the edge is half a cell away
    along = scipy.sparse.diags_array((diagonal, neighbours, neighbours), offsets=(0, 1, -1)) / (width * across) ** 2
    full = scipy.sparse.kron(around, scipy.sparse.eye_array(ALONG))
    full += scipy.sparse.kron(scipy.sparse.diags_array(cube), along)
    apart = np.abs((angle[:, None] - np.array(grooves) + np.pi) % (2 * np.pi) - np.pi)
    return Grid(angle, full.tocsr(), np.repeat(np.all(apart > groove / 2, axis=1), ALONG))


def pressure(on: Grid, psi: float, cavitated: bool = True) -> np.ndarray:
    """Return P (AROUND, ALONG) of one half of the bearing; without cavitation it may be negative."""
    wedge = np.repeat(np.sin(on.angle - psi), ALONG)
    held, solution = ~on.open, np.zeros(wedge.size)
    for _ in range(MAX_ITERATIONS):
        free = np.flatnonzero(~held)
        solution = np.zeros(wedge.size)
        solution[free] = scipy.sparse.linalg.spsolve(on.operator[free][:, free].tocsc(), wedge[free])
        if not cavitated:
            break
        # A cell is held where P would be negative, and let go where the film would push against its being held.
        following = ~on.open | np.where(held, on.operator @ solution <= wedge, solution < 0)
        if np.array_equal(following, held):
            break
        held = following
    return solution.reshape(AROUND, ALONG)


def force(on: Grid, psi: float, cavitated: bool = True) -> tuple[float, float]:
    """Return forces on the shaft outwards and along rising θ', over 12 μ A R L (R/C)²."""
    mean = pressure(on, psi, cavitated).mean(axis=1) * 2 * np.pi / AROUND
    return -float(mean @ np.cos(on.angle)), -float(mean @ np.sin(on.angle))
