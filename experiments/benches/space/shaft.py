"""The linear bench in space: a round shaft on elastic supports, with discs, reduced to the modes of one plane.

Both planes are alike, so that they share their modes; what turns couples them by the polar inertia G of discs on the
slopes, s = y' + i z': J s̈ - i Ω Jp ṡ = moment (Genta, Dynamics of Rotating Systems, 2005, chapter 4). That of slender
sections is left out: it splits the third mode of a shaft of 28 mm and 1 m by 0.2 Hz. The elements are Timoshenko's with
the deflections of a uniform beam that its ends alone load (Przemieniecki, Theory of Matrix Structural Analysis, 1968,
sections 5.6 and 11.3), and Hutchinson's shear coefficient of a circle (J. Appl. Mech. 68, 2001).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from ..shaft import Round, mesh_of

POISSON = 0.29  # of steel
SHEAR = 6 * (1 + POISSON) ** 2 / (7 + 12 * POISSON + 4 * POISSON**2)
HIGHEST = 6e3  # Hz, of the modes that are kept; the flexibility of the rest is below 1e-2 of that of any contact here
MOST_MODES = 14


@dataclass(frozen=True)
class Disc:
    """A rigid disc on the shaft; a point mass has no inertias."""

    position: float
    mass: float
    inertia: float = 0.0  #: kg m², about a diameter
    polar_inertia: float = 0.0  #: kg m²


@dataclass(frozen=True)
class Support:
    """Springs between the shaft and the base, the same in both planes; infinite ones hold it."""

    position: float
    translation: float  #: N/m
    rotation: float = 0.0  #: N m/rad


@dataclass(frozen=True)
class Rotor(Round):
    """A round shaft as it really is, SI."""

    length: float
    diameter: float
    young_modulus: float
    density: float
    discs: tuple[Disc, ...]
    supports: tuple[Support, ...]
    damping: tuple[float, ...]  #: ratios of the modes, the last for all that follow; it does not turn

    def sheared(self, h: np.ndarray) -> np.ndarray:
        """Return Φ = 12 E I/(κ G A h²) of elements of lengths h, m."""
        return 12 * 2 * (1 + POISSON) / SHEAR * (self.diameter / 4 / h) ** 2

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the mesh, m, mass and stiffness (n, n) of deflections and slopes at its nodes, and which are free."""
        x = mesh_of(self.length, [*(d.position for d in self.discs), *(s.position for s in self.supports)])
        mass, stiffness = np.zeros((2, 2 * x.size, 2 * x.size))
        rotary = self.density * math.pi * self.diameter**4 / 64
        points, weights = np.polynomial.legendre.leggauss(4)  # exact for cubics times cubics
        lengths = np.diff(x)
        for e, (h, phi) in enumerate(zip(lengths, self.sheared(lengths))):
            at = slice(2 * e, 2 * e + 4)
            for s, weight in zip((points + 1) / 2, weights * h / 2):
                deflection, turn = _shapes(s, h, phi)
                mass[at, at] += weight * self.mass_per_length * np.outer(deflection, deflection)
                mass[at, at] += weight * rotary * np.outer(turn, turn)
            stiffness[at, at] += self.bending_stiffness * _element_stiffness(h, phi)
        for disc in self.discs:
            node = 2 * int(np.argmin(np.abs(x - disc.position)))
            mass[node, node] += disc.mass
            mass[node + 1, node + 1] += disc.inertia
        free = np.ones(2 * x.size, dtype=bool)
        for support in self.supports:
            node = 2 * int(np.argmin(np.abs(x - support.position)))
            for i, spring in enumerate((support.translation, support.rotation), node):
                if math.isinf(spring):
                    free[i] = False
                else:
                    stiffness[i, i] += spring
        return x, mass, stiffness, free

    def modes(self) -> Modes:
        """Modes of one plane without spin."""
        x, mass, stiffness, free = self.matrices()
        held = np.ix_(free, free)
        squares, vectors = scipy.linalg.eigh(stiffness[held], mass[held], subset_by_index=(0, MOST_MODES - 1))
        omega = np.sqrt(np.maximum(squares, 0.0))
        keep = omega < 2 * np.pi * HIGHEST
        shape = np.zeros((free.size, int(keep.sum())))
        shape[free] = vectors[:, keep]
        ratios = np.full(omega[keep].size, self.damping[-1])
        ratios[: len(self.damping)] = self.damping[: ratios.size]
        turning = [d for d in self.discs if d.polar_inertia]
        at = [2 * int(np.argmin(np.abs(x - d.position))) + 1 for d in turning]
        slopes = np.sqrt([d.polar_inertia for d in turning])[:, None] * shape[at]
        translation = np.tile([1.0, 0.0], x.size)
        return Modes(x, self.sheared(np.diff(x)), shape, omega[keep], ratios, shape.T @ mass @ translation, slopes)

    def frequencies(self, count: int) -> np.ndarray:
        """(count,) Hz, of one plane without spin."""
        return self.modes().omega[:count] / (2 * np.pi)

    def sag(self, positions: Sequence[float], gravity: float = 9.81) -> np.ndarray:
        """Return how far the shaft hangs down at positions under its weight, m."""
        x, mass, stiffness, free = self.matrices()
        weight = mass @ np.tile([gravity, 0.0], x.size)
        down = np.zeros(free.size)
        down[free] = np.linalg.solve(stiffness[np.ix_(free, free)], weight[free])
        return shape_rows(x, self.sheared(np.diff(x)), positions) @ down


@dataclass(frozen=True)
class Modes:
    """Modes of unit modal mass of one plane, relative to the base."""

    mesh: np.ndarray  # (n_nodes,) m
    sheared: np.ndarray  # (n_nodes - 1,) Φ of each element
    shape: np.ndarray  # (2 n_nodes, n) deflection and turn of the section at each node
    omega: np.ndarray  # (n,) rad/s
    damping: np.ndarray  # (n,) ratios
    participation: np.ndarray  # (n,) Φᵀ M r: modal force per acceleration of gravity
    slopes: np.ndarray  # (r, n) S with SᵀS = Φᵀ G Φ, one row for each disc

    def at(self, positions: Sequence[float] | np.ndarray) -> np.ndarray:
        """(n_positions, n) deflections of the modes."""
        return shape_rows(self.mesh, self.sheared, positions) @ self.shape


def shape_rows(mesh: np.ndarray, sheared: np.ndarray, positions: Sequence[float] | np.ndarray) -> np.ndarray:
    """(n_positions, 2 n_nodes) of deflections."""
    rows = np.zeros((len(positions), 2 * mesh.size))
    for row, x in zip(rows, positions):
        e = min(int(np.searchsorted(mesh, x, side="right")) - 1, mesh.size - 2)
        h = mesh[e + 1] - mesh[e]
        row[2 * e : 2 * e + 4] = _shapes((x - mesh[e]) / h, h, sheared[e])[0]
    return rows


def _shapes(s: float, h: float, phi: float) -> tuple[np.ndarray, np.ndarray]:
    """Return deflection and turn of the section at a share ``s`` of an element, of those at its ends."""
    deflection = np.array([
        1 - 3 * s**2 + 2 * s**3 + phi * (1 - s), h * (s - 2 * s**2 + s**3 + phi / 2 * (s - s**2)),
        3 * s**2 - 2 * s**3 + phi * s, h * (s**3 - s**2 - phi / 2 * (s - s**2)),
    ])  # fmt: skip
    turn = np.array([
        6 * (s**2 - s) / h, 1 - 4 * s + 3 * s**2 + phi * (1 - s), 6 * (s - s**2) / h, 3 * s**2 - 2 * s + phi * s,
    ])  # fmt: skip
    return deflection / (1 + phi), turn / (1 + phi)


def _element_stiffness(h: float, phi: float) -> np.ndarray:
    """Return the matrix over E I."""
    matrix = np.array([[12, 6, -12, 6], [6, 4 + phi, -6, 2 - phi], [-12, -6, 12, -6], [6, 2 - phi, -6, 4 + phi]])
    return matrix * np.outer([1, h, 1, h], [1, h, 1, h]) / (h**3 * (1 + phi))
