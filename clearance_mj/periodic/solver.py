"""Harmonic balance of one condensed rig, over frequency or spin, or over a factor of level, loads or gaps."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..core.equations import solved
from ..core.errors import ClearanceError
from .balance import POWERS, Balance, deepest_penetration, residual, set_gaps
from .condensed import Condensed, grid, laws_of, slopes
from .continuation import MAX_POINTS, Continuation, Motions, NoConvergence, PeriodicMotion, difference
from .dynamics import at_one_frequency, by_poles, by_stiffness
from .loops import CORNERS, bordered, loops

__all__ = ["OperatingPoint", "Solver"]

AT_REST = 4  # samples of a rig at rest
SMALLEST_LEVEL = 1e-3  # first factor of the excitation's level
ACROSS = (1e-6, 1e-5, 1e-4, 3e-4, 1e-3)  # of a motion: distances at which the other side of a wall is sought
BEFORE_CONTACT = 0.9  # fraction of the smallest gap that the first motion fills
SHARES, EXACT = (2.0, 1.2, 1.4, 1.6, 1.8), 1e-8
"""Factors of the gaps at which laws are sampled, and relative accuracy with which they must follow `POWERS`."""
SMALLER = (1.0, 0.1, 1e-2, 1e-3, 1e-4)  # factors of that motion: sliders are linear in the smallest ones alone


class OperatingPoint(NamedTuple):
    """The five numbers that determine a motion; one of them is a branch's parameter."""

    omega: float  #: 1/s, of the motion's first harmonic
    spin: float  #: rad/s
    load: float  #: factor of constant loads
    level: float  #: factor of the excitation's level
    gap: float  #: factor of all gaps


class Solver(Continuation):
    """Newton's method and continuation over one number of a `OperatingPoint`; rotating parts follow the frequency."""

    loops = loops(residual, deepest_penetration, True)

    def __init__(self, system: Condensed, harmonics: int, samples: int, spin: float = 0.0):
        self.system, self.harmonics, self.samples = system, harmonics, samples
        self.grid = grid(harmonics, samples)
        self.rows, count = system.basis.shape
        self.least = 1e-3 * system.size
        self.size = count * (2 * harmonics + 1)
        self.slopes = slopes(system.laws, samples, harmonics)
        self.jacobian = np.zeros((self.size + 1, self.size + 1))
        varies = system.order > 0 and system.driven.turns
        self.linear = by_stiffness(system.driven) if varies else by_poles(system.driven, spin)
        self.take("omega", OperatingPoint(0.0, spin, 1.0, 1.0, 1.0))

    def take(self, over: str, at: OperatingPoint) -> None:
        """Make one number of a state the continuation parameter; the others are those of ``at``."""
        self.over, self.at = over, at
        fixed, rate = np.array(at), np.zeros(len(at))
        turns, linear = self.system.order / self.system.periods, self.linear
        rate[OperatingPoint._fields.index(over)] = 1.0
        if turns and over in ("omega", "spin"):
            rate[:2] = (1.0, 1 / turns) if over == "omega" else (turns, 1.0)
        elif over == "spin" and self.system.driven.turns:
            linear = by_stiffness(self.system.driven)
        elif not rate[:2].any():
            linear = at_one_frequency(linear, at.omega, at.spin)
        fixed[rate != 0] = 0.0
        numbers, widened, self.laws = self.system.laws.numbers, np.zeros((len(POWERS), 0)), self.system.laws
        if over == "gap" or at.gap != 1:
            widened, self.laws = self._widening, self.laws._replace(numbers=numbers.copy())
        self._equations = Balance(
            linear, self.laws, self.slopes, self.grid, self.system.basis, self.system.owner, fixed, rate, numbers,
            widened, self.tolerance, self.least, self.bent, self.longest, self.jacobian,
        )  # fmt: skip

    @property
    def equations(self) -> Balance:
        """The balance with the present tolerance and step control, for the compiled loops."""
        return self._equations._replace(tolerance=self.tolerance, bent=self.bent, longest=self.longest)

    def state(self, parameter: float) -> OperatingPoint:
        """Return the state at a value of the branch's parameter."""
        return OperatingPoint(*(self._equations.fixed + parameter * self._equations.rate).tolist())

    def frequency(self, motion: PeriodicMotion) -> float:
        """Return the angular frequency of a motion's first harmonic, 1/s."""
        return self.state(motion.parameter).omega

    @property
    def over_name(self) -> str:
        """Name of the parameter, as in `Branch.over`."""
        return "frequency" if self.over == "omega" else self.over

    def forced_multipliers(self, values: np.ndarray) -> np.ndarray:
        """Return the Floquet multipliers that decide the stability of a forced motion: all."""
        return values

    def spin_of(self, omega: float) -> float:
        """Return the shaft's spin at a frequency, rad/s."""
        return omega * self.system.periods / self.system.order if self.system.order else self.at.spin

    def all_points(self, motion: PeriodicMotion) -> np.ndarray:
        """Return the harmonics (n_rows, K) of all rows, m."""
        return np.asarray(self.system.basis @ motion.z + motion.y)

    @cached_property
    def _widening(self) -> np.ndarray:
        """Change (4, n) of the laws' numbers by powers of the factor of all gaps."""
        rig, law, factors = self.system.rig, self.system.model.law, np.array(SHARES)
        gaps = (rig.with_gap([share * b.gap for b in rig.bushings]) for share in (1.0, *SHARES))
        numbers = np.array([laws_of(each, law).numbers for each in gaps])  # those of the system have memory in use
        with np.errstate(invalid="ignore"):
            changes = np.nan_to_num(numbers[1:] - numbers[0])
        change = np.zeros((len(POWERS), changes.shape[1]))
        change[0] = changes[0] / (factors[0] - 1)
        nonlinear = np.abs(changes - np.outer(factors - 1, change[0])).max(axis=0) > EXACT * np.abs(changes).max(axis=0)
        powers = factors[:, None] ** np.array(POWERS, dtype=float) - 1
        change[:, nonlinear] = np.linalg.lstsq(powers, changes[:, nonlinear], rcond=None)[0]
        if (np.abs(powers @ change - changes) > EXACT * np.abs(changes).max(axis=0)).any():
            raise ClearanceError(
                f"rig {rig.name!r}: a filling is another one in another gap; give rigs of several gaps"
            )
        return change

    def _residual(self, parameter: float, z: np.ndarray, y: np.ndarray, diff: bool) -> tuple[np.ndarray, ...]:
        """Return the residual of the balance, forces and remainder of the displacements."""
        return residual(self.equations, float(parameter), z, y, diff)

    def derivative(self, parameter: float, z: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the derivative (size, size) of the residual by the unknowns."""
        self._residual(parameter, z, y, True)
        return self.jacobian[:-1, :-1]

    def depth(self, parameter: float, z: np.ndarray, y: np.ndarray) -> float:
        """Return the largest penetration of any end over a period, m; below 0 the smallest distance from a wall."""
        return float(deepest_penetration(self._equations, parameter, z, y))

    def walls_at(self, parameter: float) -> None:
        """Set the walls of `laws` to their distances at a parameter."""
        set_gaps(self._equations, self.state(parameter).gap)

    def touches(self, motion: PeriodicMotion) -> bool:
        """Return True if an end is beyond a wall at any sample of a period."""
        return self.depth(motion.parameter, motion.z, motion.y) > 0

    def first(self, omega: float, most: int = MAX_POINTS) -> PeriodicMotion:
        """Return the motion at a frequency that grows out of the static equilibrium with the level of the excitation.

        Parameters
        ----------
        omega : float
            1/s.
        most : int
            Largest number of motions at ever larger levels.

        Raises
        ------
        NoConvergence
            If it does not reach the level.
        """
        z, y = self._raise_parameter("level", *self._at_rest(omega), omega, most)
        return self.solved_at(omega, z, y, self.scale_of(z))

    def rest(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the equilibrium under constant loads, turning as at a frequency: z (r, 1) and y (n_rows, 1), m.

        Raises
        ------
        NoConvergence
            If the loads are not reached.
        """
        still = Solver(self.system.undriven, 0, AT_REST, self.spin_of(omega))
        still.at = self.at._replace(spin=still.at.spin)
        return still.raised_to_loads(omega)

    def raised_to_loads(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Return coordinates z and remainder y under all loads and no excitation."""
        z = np.zeros((self.system.basis.shape[1], 2 * self.harmonics + 1))
        with suppress(NoConvergence):
            # In the gap a rig that walls alone restrain is free, so that no branch leads from there.
            if self.system.pressed.any() and not self.system.rig.moves_across:
                return self._solve_against_walls(omega)
        return self._raise_parameter("load", z, np.zeros((self.rows, z.shape[1])), omega)

    def _solve_against_walls(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Return z and y of `raised_to_loads`, from the walls against which the loads press."""
        before, system = (self.over, self.at), self.system
        x = np.zeros((self.rows, 2 * self.harmonics + 1))
        x[:, 0] = system.sag
        for j in np.flatnonzero(system.pressed).tolist():
            lower, upper = system.rig.bushings[j].walls
            rows = np.unique(system.laws.rows_of(j)[:, 1])
            x[rows, 0] += np.where(x[rows, 0] > 0, upper, lower)
        self.raise_over("load", omega)
        try:
            z, y = system.split(x)
            motion = self.solved_at(1.0, z, y, self.scale_of(z))
        finally:
            self.take(*before)
        return motion.z, motion.y

    def _raise_parameter(
        self, over: str, z: np.ndarray, y: np.ndarray, omega: float, most: int = MAX_POINTS
    ) -> tuple[np.ndarray, np.ndarray]:
        """Raise loads or excitation from nearly nothing to their full value, around folds."""
        before, full = (self.over, self.at), float(getattr(self.at, over))
        self.raise_over(over, omega, 0.0 if over == "load" else 1.0)
        try:
            if (motion := self._first_motion(z, y, full)) is None:
                return z, y
            if motion.parameter < full:
                lowest = 1e-3 * motion.parameter  # folds may lead below where it began
                *_, motion = self.within(motion, lowest, full, most=most)
                if abs(motion.parameter / full - 1.0) > 1e-9:
                    raise NoConvergence(omega)
        except NoConvergence:
            raise NoConvergence(omega) from None
        finally:
            self.take(*before)
        return motion.z, motion.y

    def raise_over(self, what: str, omega: float, level: float = 1.0) -> None:
        """Make another number of a `OperatingPoint` the parameter, at a frequency, 1/s, and factor of the level."""
        self.take(what, self.at._replace(omega=omega, spin=self.spin_of(omega), level=level))

    def growing(self, omega: float) -> PeriodicMotion:
        """Return a motion near the static equilibrium at a frequency; the factor of the level becomes the parameter.

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
        self.raise_over("level", omega)
        if (motion := self._first_motion(z, y, math.inf)) is None:
            raise NoConvergence(omega)
        return motion

    def _at_rest(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        shape = self.system.basis.shape[1], 2 * self.harmonics + 1
        z, y = np.zeros(shape), np.zeros((self.rows, shape[1]))
        if self.system.driven.weight.any():
            z[:, :1], y[:, :1] = self.rest(omega)
        return z, y

    def _first_motion(self, z: np.ndarray, y: np.ndarray, most: float) -> PeriodicMotion | None:
        """Return the motion at a small fraction of loads or excitation, at most 1; None if these move nothing."""
        z_0, _, y_0 = self._residual(0.0, z, y, False)
        z_1, _, y_1 = self._residual(1.0, z, y, False)
        dz, dy = z_0 - z_1, y_1 - y_0
        size = float(np.abs((self.system.basis @ dz + dy) @ self.grid.basis.T).max())
        if size == 0:
            return None
        factor = BEFORE_CONTACT * self.system.size / size
        least = min(most, max(SMALLEST_LEVEL, factor) if not z.any() else SMALLEST_LEVEL)
        for small in (least * smaller for smaller in SMALLER):
            start, near = z + small * dz, y + small * dy
            with suppress(NoConvergence):
                return self.solved_at(small, start, near, self.scale_of(start))
        raise NoConvergence(least)

    def followed(
        self, start: PeriodicMotion, most: int, step: float, ends: tuple[float, float], wanted: float, deep: float
    ) -> Motions:  # fmt: skip
        """Return a motion and those after it, until one beyond a parameter rises and penetrates a wall deeply.

        Parameters
        ----------
        start : Motion
            First motion, with its tangent along the branch.
        most : int
            Largest number of motions.
        step : float
            First step, relative to parameter and motion.
        ends : tuple of float
            Parameters below and above which they end too.
        wanted : float
            The parameter beyond which motions are not needed.
        deep : float
            Penetration, m.
        """
        blocks = (each for each, _ in self.pieces(start, *ends, most, step, wanted, deep))
        return Motions(*map(np.concatenate, zip(Motions.of([start]), *blocks)))

    def across_wall(self, motion: PeriodicMotion) -> PeriodicMotion | None:
        """Return a motion of the branch on the other side of a wall.

        Where a circular orbit meets a round wall, the branch may turn by more than a right angle, as its phase does.
        """
        touches, direction = self.touches(motion), motion.tangent
        for reach in ACROSS:
            omega = motion.parameter * (1 + reach * direction[-1])
            z = motion.z + reach * motion.scale * direction[:-1].reshape(motion.z.shape)
            if (self.depth(omega, z, motion.y) > 0) != touches:
                return self._solve_beyond(motion, omega, z, -1.0 if touches else 1.0)
        return None

    def _solve_beyond(self, motion: PeriodicMotion, omega: float, z: np.ndarray, side: float) -> PeriodicMotion | None:
        """Return a motion on the branch with the tangent of a point across the wall, on its side."""
        self._residual(omega, z, motion.y, True)
        pivots = np.empty(self.size + 1, dtype=int)
        factors, _ = bordered(self.jacobian, motion.tangent, omega / motion.scale, pivots)
        direction = solved(factors, pivots, np.append(np.zeros(self.size), 1.0))
        direction /= np.linalg.norm(direction)
        dz = motion.scale * direction[:-1].reshape(z.shape)
        farther = self.depth(omega, z + CORNERS[-1] * dz, motion.y) - self.depth(omega, z, motion.y)
        direction = direction if side * farther > 0 else -direction
        for step in reversed(CORNERS):
            guess = z + step * motion.scale * direction[:-1].reshape(z.shape)
            beyond = self.solve(omega * (1 + step * direction[-1]), guess, motion.y, direction, motion.scale)
            if beyond is not None and side * self.depth(beyond.parameter, beyond.z, beyond.y) > 0:
                along = np.sign(beyond.tangent @ difference(motion, beyond)) or 1.0
                return replace(beyond, tangent=along * beyond.tangent)
        return None
