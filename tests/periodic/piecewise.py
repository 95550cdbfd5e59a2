"""Exact periodic motions of an oscillator on springs that begin at walls: pieces in closed form, joined by shooting.

x'' + c x' + k_i x = b_i + F cos ωt in the piece i between two walls; the force is continuous at the walls, so that the
derivative of a motion is the product of those of its pieces. It knows nothing of the package.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq, fsolve

SAMPLES = 400  # of a period, between which walls are looked for
EXACT = 1e-11  # of shooting, on place and velocity


@dataclass(frozen=True, eq=False)
class Orbit:
    """A motion that comes again after a period."""

    start: np.ndarray
    """(2,) place and velocity at t = 0"""
    monodromy: np.ndarray
    """(2, 2) derivative of place and velocity after a period by those before"""
    time: np.ndarray
    """(n,) of samples, with both ends of each piece"""
    place: np.ndarray
    """(n,)"""
    pieces: tuple[int, ...]
    """numbers of the pieces, in order"""
    lowest: float
    highest: float

    @property
    def multiplier(self) -> float:
        """Absolute value of the largest multiplier."""
        return float(np.abs(np.linalg.eigvals(self.monodromy)).max())


@dataclass(frozen=True)
class Oscillator:
    """One of mass 1, harmonically excited."""

    damping: float
    walls: tuple[float, ...]
    """(n,) increasing"""
    stiffness: tuple[float, ...]
    """(n + 1,) of the pieces from the lowest on"""
    pull: tuple[float, ...]
    """(n + 1,) constant forces b"""
    force: float
    """F"""

    def _state(self, i: int, omega: float, begun: float, state: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Place and velocity (2, n) in the piece i at times, of which at the time `begun` is given."""
        apart = state - self._steady(i, omega, np.array([begun]))[:, 0]
        return self._steady(i, omega, time) + np.einsum("ijn,j->in", self._free(i, time - begun), apart)

    def _free(self, i: int, time: np.ndarray) -> np.ndarray:
        """Derivative (2, 2, n) of place and velocity by those a time before."""
        decay, k = self.damping / 2, self.stiffness[i]
        omega = np.sqrt(complex(k - decay**2))
        c, s = np.cos(omega * time), np.sin(omega * time) / omega
        return np.real(np.exp(-decay * time) * np.array([[c + decay * s, s], [-k * s, c - decay * s]]))

    def _steady(self, i: int, omega: float, time: np.ndarray) -> np.ndarray:
        """Place and velocity (2, n) of a motion without free vibration; without a spring it drifts."""
        k, b = self.stiffness[i], self.pull[i]
        turning = self.force / (k - omega**2 + 1j * self.damping * omega) * np.exp(1j * omega * time)
        one = np.ones(time.size)
        mean = np.array([b / k * one, 0 * one]) if k else b / self.damping * np.array([time, one])
        return mean + np.array([turning.real, (1j * omega * turning).real])

    def period(self, omega: float, start: np.ndarray, periods: int = 1) -> Orbit:
        """Return the motion of some periods from a start on."""
        end, begun, state = periods * 2 * np.pi / omega, 0.0, np.asarray(start, dtype=float)
        whole, edges = np.eye(2), np.array((-np.inf, *self.walls, np.inf))
        i = int(np.searchsorted(self.walls, state[0]))
        if state[0] in self.walls:
            i = self.walls.index(state[0]) + (state[1] > 0)
        times, places, pieces, extremes = [], [], [], [state[0]]
        while begun < end:
            time = np.linspace(begun, end, max(int(SAMPLES * periods * (end - begun) / end), 16))
            time = np.union1d(time, self._turns(i, omega, begun, state, time))
            moved = self._state(i, omega, begun, state, time)
            outside = (moved[0] < edges[i]) | (moved[0] > edges[i + 1])
            beyond, stop, way = np.flatnonzero(outside[1:]) + 1, end, 0
            if beyond.size:
                first = int(beyond[0])
                way = 1 if moved[0, first] > edges[i + 1] else -1
                wall = edges[i + (way > 0)]
                from_ = time[first - 1] if first > 1 else begun + 1e-9 * (time[1] - begun)  # it begins on a wall
                stop = self._root(0, wall, (i, omega, begun, state), from_, time[first])
                time = np.append(time[:first], stop)
                moved = self._state(i, omega, begun, state, time)
            extremes += [moved[0].min(), moved[0].max()]
            whole = self._free(i, np.array([stop - begun]))[:, :, 0] @ whole
            times.append(time), places.append(moved[0]), pieces.append(i)
            begun, state = stop, moved[:, -1]
            if way:
                state = np.array([wall, state[1]])
            i += way
        path = np.concatenate(times), np.concatenate(places)
        return Orbit(state, whole, *path, tuple(pieces), min(extremes), max(extremes))

    def _root(self, row: int, value: float, motion: tuple, low: float, high: float) -> float:
        """Time at which place, row 0, or velocity, row 1, of a motion in a piece has a value."""
        off = lambda t: self._state(*motion, np.array([t]))[row, 0] - value  # noqa: E731
        return float(brentq(off, low, high, xtol=1e-14, rtol=1e-14))

    def _turns(self, i: int, omega: float, begun: float, state: np.ndarray, time: np.ndarray) -> list[float]:
        """Times at which the motion turns, between which no wall is missed."""
        speed = self._state(i, omega, begun, state, time)[1]
        at = np.flatnonzero(speed[1:] * speed[:-1] < 0)
        return [self._root(1, 0.0, (i, omega, begun, state), time[j], time[j + 1]) for j in at]

    def orbit(self, omega: float, guess: np.ndarray, periods: int = 1) -> Orbit:
        """Return the periodic motion near a guess of its start, by Newton's method."""
        start = np.asarray(guess, dtype=float)
        for _ in range(60):
            step = self.period(omega, start, periods)
            left = step.start - start
            if np.abs(left).max() < EXACT:
                return replace(step, start=start)
            start = start + np.linalg.solve(np.eye(2) - step.monodromy, left)
        raise ArithmeticError(f"no periodic motion at {omega}")

    def branch(self, omegas: np.ndarray, guess: np.ndarray) -> list[Orbit]:
        """Return the orbits at frequencies, each found from the one before."""
        orbits: list[Orbit] = []
        for omega in omegas:
            orbits.append(self.orbit(omega, orbits[-1].start if orbits else guess))
        return orbits

    def where(self, value: float, omega: float, orbit: Orbit) -> tuple[float, Orbit]:
        """Return frequency and orbit where a multiplier has a value: 1 at a fold, -1 where the period doubles."""

        def left(unknown: np.ndarray) -> np.ndarray:
            moved = self.period(unknown[2], unknown[:2])
            m = moved.monodromy
            return np.append(moved.start - unknown[:2], value**2 - value * np.trace(m) + np.linalg.det(m))

        root = fsolve(left, np.append(orbit.start, omega), xtol=1e-12)
        assert np.abs(left(root)).max() < 1e-8
        moved = self.period(root[2], root[:2])
        return float(root[2]), moved
