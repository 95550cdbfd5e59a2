"""Self-excited whirl over the shaft's speed: its frequency is unknown, its phase fixed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .condensed import Condensed
from .continuation import Continuation, PeriodicMotion
from .dynamics import by_stiffness
from .solver import OperatingPoint, Solver
from .vibrations import turned

__all__ = ["WhirlSolver"]

NEARBY = 1e-6  # relative step of the difference quotients by frequency and speed


class WhirlSolver(Continuation):
    """Newton's method and continuation of a periodic motion without excitation, along the shaft's speed.

    Unknown are the harmonics of the coordinates and the whirl's frequency, in metres over a frequency of reference.
    The coordinate ``leader`` has no sine in its fundamental.
    """

    def __init__(self, system: Condensed, harmonics: int, samples: int, reference: float):
        self.inner = Solver(system, harmonics, samples)
        self.inner.linear = by_stiffness(system.driven)
        self.inner.take("omega", self.state(0.0))
        self.system, self.harmonics, self.samples, self.rows = system, harmonics, samples, self.inner.rows
        self.grid, self.least, self.leader = self.inner.grid, self.inner.least, 0
        self.laws, self.shape = self.inner.laws, (system.basis.shape[1], 2 * harmonics + 1)
        self.over = self.over_name = "speed"
        self.reference = reference / system.size
        self.size = self.inner.size + 1
        self.jacobian = np.zeros((self.size + 1, self.size + 1))

    def parts(self, z: np.ndarray) -> tuple[float, np.ndarray]:
        """Return frequency, 1/s, and harmonics (r, K) of the coordinates, m, of the unknowns."""
        return float(z[-1]) * self.reference, z[:-1].reshape(self.shape)

    def unknowns(self, omega: float, z: np.ndarray) -> np.ndarray:
        """Return the unknowns of a frequency and harmonics."""
        return np.append(z.ravel(), omega / self.reference)

    def frequency(self, motion: PeriodicMotion) -> float:
        """Return the whirl's angular frequency, 1/s."""
        return self.parts(motion.z)[0]

    def state(self, parameter: float) -> OperatingPoint:
        """Return the state at a speed; its frequency is left at 0."""
        return OperatingPoint(0.0, parameter, 1.0, 0.0, 1.0)

    def walls_at(self, parameter: float) -> None:
        """Leave the walls where they stand: speed does not move them."""

    def all_points(self, motion: PeriodicMotion) -> np.ndarray:
        """Return the harmonics (n_rows, K) of all rows, m."""
        return np.asarray(self.system.basis @ self.parts(motion.z)[1] + motion.y)

    def depth(self, motion: PeriodicMotion) -> float:
        """Return the largest penetration, m, below 0 in the gap."""
        return self.inner.depth(0.0, self.parts(motion.z)[1], motion.y)

    def forced_multipliers(self, values: np.ndarray) -> np.ndarray:
        """Return the Floquet multipliers but the one that is always 1, as the phase of a whirl is free."""
        return np.delete(values, np.abs(values - 1).argmin())

    def _balance(self, speed: float, omega: float, z: np.ndarray, y: np.ndarray, diff: bool) -> tuple[np.ndarray, ...]:
        self.inner.equations.fixed[1] = speed
        return self.inner._residual(omega, z, y, diff)

    def _residual(self, parameter: float, z: np.ndarray, y: np.ndarray, diff: bool) -> tuple[np.ndarray, ...]:
        omega, harmonics = self.parts(z)
        if not omega > 0:
            return np.full(self.size, np.inf), y, y
        residual, force, y_new = self._balance(parameter, omega, harmonics, y, diff)
        if diff:
            inner, full, n = self.inner.jacobian, self.jacobian, self.size - 1
            full[:n, :n] = inner[:n, :n]
            for column, speed, w in ((n, parameter, omega * (1 + NEARBY)), (n + 1, parameter * (1 + NEARBY), omega)):
                difference = self._balance(speed, w, harmonics, y, False)[0] - residual
                full[:n, column] = difference.ravel() / (NEARBY * (parameter if column > n else omega / self.reference))
            full[n:] = 0.0
            full[n, self.leader * harmonics.shape[1] + 2] = 1.0
        return np.append(residual, harmonics[self.leader, 2]), force, y_new

    def solve_onset(
        self, speed: float, omega: float, z: np.ndarray, y: np.ndarray, amplitude: np.ndarray
    ) -> PeriodicMotion | None:
        """Return the whirl of a small amplitude, harmonics (r, K), at its onset, with the tangent to larger ones.

        The speed of that amplitude is solved for; None if Newton's method fails.
        """
        self.leader = int(np.abs(amplitude[:, 1]).argmax())
        row = np.append(self.unknowns(0.0, amplitude), 0.0)
        row /= np.linalg.norm(row)
        whirl = self.solve(speed, self.unknowns(omega, z + amplitude), y, row, self.least)
        if whirl is None:
            return None
        return replace(whirl, tangent=whirl.tangent * (np.sign(whirl.tangent @ row) or 1.0))

    def start(self, speed: float, omega: float, z: np.ndarray, y: np.ndarray) -> PeriodicMotion | None:
        """Return the whirl at a speed, near a guess of frequency and harmonics; None if Newton's method fails."""
        fundamental = z[:, 1] - 1j * z[:, 2]
        self.leader = int(np.abs(fundamental).argmax())
        turn = -np.angle(fundamental[self.leader])
        shifted = turned(z, turn), turned(y, turn)
        row = np.append(np.zeros(self.size), 1.0)
        return self.solve(speed, self.unknowns(omega, shifted[0]), shifted[1], row, self.scale_of(z))
