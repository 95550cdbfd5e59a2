"""Harmonic balance of one condensed rig in space: forced or under unbalance, over frequency, speed or level."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..condensed import grid
from ..continuation import CORNERS, Follower, Motion, NoConvergence
from .balance import round_balance
from .condensed import UNBALANCE, RoundCondensed, round_slopes
from .elements import depths
from .linear import Dynamics, SteadySpin, VaryingSpin

__all__ = ["RoundSolver"]

NEARBY = 1e-6  # share of the parameter by which derivatives by it are found
AT_REST = 4  # samples of a rig at rest
SMALLEST_LEVEL = 1e-3  # share of the excitation from which on it is raised
ACROSS = (1e-6, 1e-5, 1e-4, 3e-4, 1e-3)  # of a motion: how far the other side of a wall is looked for
BEFORE_CONTACT = 0.9  # share of the smallest gap that the first motion fills


class RoundSolver(Follower):
    """Newton's method and continuation along frequency, or speed where the excitation is an unbalance.

    While a branch's first motion is looked for, the parameter is a share of the weight, then of the excitation.
    """

    def __init__(self, system: RoundCondensed, harmonics: int, samples: int, spin: float):
        self.system, self.harmonics, self.samples = system, harmonics, samples
        self.grid = grid(harmonics, samples)
        self.rows, count = system.basis.shape
        self.least = 1e-3 * system.size
        self.size = count * (2 * harmonics + 1)
        self.slopes = round_slopes(system.laws, self.rows // 2, samples, harmonics)
        self.jacobian = np.zeros((self.size + 1, self.size + 1))
        self.spin = spin
        driven = system.driven
        varies = system.kind == UNBALANCE and (driven.model.gyroscopic.any() or driven.model.circulatory.any())
        self.dynamics: Dynamics = VaryingSpin(driven) if varies else SteadySpin(driven, spin)
        self.raised = ""  # what the parameter is a share of: "weight", "level", or nothing
        self.at = 0.0  # the frequency, 1/s, then

    def frequency(self, motion: Motion) -> float:
        """Return the angular frequency of a motion's first harmonic, 1/s."""
        return self.at if self.raised else motion.omega

    def share(self, motion: Motion) -> float:
        """Return the share of the excitation's level at which a motion is."""
        return motion.omega if self.raised == "level" else 1.0

    def spin_of(self, omega: float) -> float:
        """Return the shaft's spin at a frequency, rad/s."""
        return omega if self.system.kind == UNBALANCE else self.spin

    def _balance(self, parameter: float, z: np.ndarray, y: np.ndarray, want: bool) -> tuple[np.ndarray, ...]:
        omega = self.at if self.raised else parameter
        weight, level = 1.0, 1.0
        if self.raised == "weight":
            weight, level = parameter, 0.0
        elif self.raised == "level":
            level = parameter
        return self.balance_at(omega, self.spin_of(omega), weight, level, z, y, want)

    def balance_at(
        self, omega: float, spin: float, weight: float, level: float, z: np.ndarray, y: np.ndarray, want: bool
    ) -> tuple[np.ndarray, ...]:
        """Return what is left of the balance, forces and displacements beside at shares of weight and excitation."""
        system = self.system
        compliance, driven = self.dynamics.seen(omega, spin, weight, level)
        return round_balance(
            compliance, driven, system.basis, system.owner, self.grid, system.laws, self.slopes, omega, spin, z, y,
            want, self.jacobian,
        )  # fmt: skip

    def _left(self, parameter: float, z: np.ndarray, y: np.ndarray, want: bool) -> tuple[np.ndarray, ...]:
        found = self._balance(parameter, z, y, want)
        if want:
            nearby = parameter * (1 + NEARBY)
            changed = self._balance(nearby, z, y, False)[0]
            self.jacobian[: self.size, -1] = (changed - found[0]).ravel() / (nearby - parameter)
        return found

    def first(self, omega: float) -> Motion:
        """Return the motion at a frequency that grows out of the static equilibrium with the level of the excitation.

        Raises
        ------
        NoConvergence
            If it does not reach the level.
        """
        z, y = self._raised("level", *self._at_rest(omega), omega)
        return self.solved_at(omega, z, y, self._scale(z))

    def rest(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Return where the rig rests under its weight, turning as at a frequency: z (r, 1) and y (2 n_points, 1), m.

        Raises
        ------
        NoConvergence
            If the weight is not reached.
        """
        return RoundSolver(self.system.undriven, 0, AT_REST, self.spin).raised_to_weight(omega)

    def raised_to_weight(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates and what is beside them under the whole weight and no excitation."""
        z = np.zeros((self.system.basis.shape[1], 2 * self.harmonics + 1))
        return self._raised("weight", z, np.zeros((self.rows, z.shape[1])), omega)

    def coupling(self) -> float:
        """Return the largest compliance of a coordinate times the stiffness of what acts there; see `Follower`."""
        return float(np.abs(self.jacobian[: self.size, : self.size]).max())

    def depth(self, z: np.ndarray, y: np.ndarray) -> float:
        """Return the largest penetration of any end over a period, m; below 0 how far the nearest is from its wall."""
        x = ((self.system.basis @ z + y) @ self.grid.basis.T).reshape(-1, 2, self.samples)
        return float(depths(self.system.laws, x[len(self.system.rig.bushings) :]).max())

    def touches(self, motion: Motion) -> bool:
        """Return whether an end is beyond its wall at any sample of a period."""
        return self.depth(motion.z, motion.y) > 0

    def _around_corner(self, motion: Motion) -> Motion | None:
        """Return a motion beyond a corner: of those that go on along the tangent, or of the branch on the other side.

        Where a circle meets the wall all around it, the branch may turn by more than a right angle, as its phase does.
        """
        if (found := super()._around_corner(motion)) is not None:
            return found
        touches, direction = self.depth(motion.z, motion.y) > 0, motion.tangent
        for reach in ACROSS:
            omega = motion.omega * (1 + reach * direction[-1])
            z = motion.z + reach * motion.scale * direction[:-1].reshape(motion.z.shape)
            if (self.depth(z, motion.y) > 0) != touches:
                return self._beyond(motion, omega, z, -1.0 if touches else 1.0)
        return None

    def _beyond(self, motion: Motion, omega: float, z: np.ndarray, side: float) -> Motion | None:
        """Return a motion on the branch whose tangent is that at a point across the wall, to its side."""
        self._left(omega, z, motion.y, True)
        factors = self._factors(motion.tangent, motion.scale, omega)
        way = self._solved(factors, np.append(np.zeros(self.size), 1.0))
        way /= np.linalg.norm(way)
        by_way = motion.scale * way[:-1].reshape(z.shape)
        farther = self.depth(z + CORNERS[-1] * by_way, motion.y) - self.depth(z, motion.y)
        way = way if side * farther > 0 else -way
        for step in reversed(CORNERS):
            guess = z + step * motion.scale * way[:-1].reshape(z.shape)
            found = self.solve(omega * (1 + step * way[-1]), guess, motion.y, way, motion.scale)
            if found is not None and side * self.depth(found.z, found.y) > 0:
                return self._turned(found, motion, 1.0)
        return None

    def _scale(self, z: np.ndarray) -> float:
        return max(float(np.linalg.norm(z)), self.least)

    def _raised(self, what: str, z: np.ndarray, y: np.ndarray, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Raise weight or excitation from nearly nothing to all of it, around folds."""
        self.raised, self.at = what, omega
        try:
            return self._along_share(z, y, omega)
        finally:
            self.raised = ""

    def over_level(self, omega: float) -> None:
        """Make the share of the excitation's level the parameter, at a frequency, from now on.

        Parameters
        ----------
        omega : float
            1/s.
        """
        self.raised, self.at = "level", omega

    def growing(self, omega: float) -> Motion:
        """Return a motion near the static equilibrium at a frequency, the share of the level being the parameter.

        Parameters
        ----------
        omega : float
            1/s.

        Raises
        ------
        NoConvergence
            If there is none, or the excitation moves nothing.
        """
        z, y = self._at_rest(omega)
        self.over_level(omega)
        if (motion := self._first_share(z, y, np.inf)) is None:
            raise NoConvergence(omega)
        return motion

    def _at_rest(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        shape = self.system.basis.shape[1], 2 * self.harmonics + 1
        z, y = np.zeros(shape), np.zeros((self.rows, shape[1]))
        if self.system.driven.model.weight.any():
            z[:, :1], y[:, :1] = self.rest(omega)
        return z, y

    def _first_share(self, z: np.ndarray, y: np.ndarray, most: float) -> Motion | None:
        """Return the motion at a small share of weight or excitation, at most 1; None if these move nothing."""
        left, _, moved = self._balance(0.0, z, y, False)
        ahead, _, further = self._balance(1.0, z, y, False)
        way, beside = left - ahead, further - moved
        size = float(np.abs((self.system.basis @ way + beside) @ self.grid.basis.T).max())
        if size == 0:
            return None
        least = min(
            most, max(SMALLEST_LEVEL, BEFORE_CONTACT * self.system.size / size) if not z.any() else SMALLEST_LEVEL
        )
        start, near = z + least * way, y + least * beside
        return self.solved_at(least, start, near, self._scale(start))

    def _along_share(self, z: np.ndarray, y: np.ndarray, omega: float) -> tuple[np.ndarray, np.ndarray]:
        if (motion := self._first_share(z, y, 1.0)) is None:
            return z, y
        if motion.omega < 1.0:
            try:
                *_, motion = self.within(motion, 1e-3 * motion.omega, 1.0)
            except NoConvergence:
                raise NoConvergence(omega) from None
            if abs(motion.omega - 1.0) > 1e-9:
                raise NoConvergence(omega)
        return motion.z, motion.y

    def branch(self, start: float, stop: float) -> Iterator[Motion]:
        """Yield motions from a frequency, 1/s, on until the branch leaves the range between it and another one.

        Raises
        ------
        NoConvergence
            Where Newton's method finds no next motion; what was yielded stays.
        """
        yield from self.within(self.first(start), min(start, stop), max(start, stop), stop > start)
