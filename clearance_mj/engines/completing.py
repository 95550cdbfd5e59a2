"""What sensors read that a loop over time does not know: motions against the ground, and forces in clearances."""

from __future__ import annotations

import numpy as np

from ..rig import Rig
from ..rig.instruments import Kinds, each_kind
from ..rig.sensing import base_shares, clearance_of
from .base import in_columns

__all__ = ["Completion"]


class Completion:
    """Adds to the columns of sensors what the base's own motion and the clearances' forces are of their readings.

    The base begins at rest. With its acceleration a at the steps, its velocity and displacement are the running sums
    (u₊ - u₋)/(2h) and u of u₊ - 2u + u₋ = h² a, the scheme of the modes.
    """

    def __init__(self, rig: Rig, kinds: Kinds, step: float) -> None:
        of_inputs = each_kind(kinds)
        self.step, self.state = step, np.zeros((2, len(of_inputs)))  # velocity in the last step's middle, displacement
        orders = np.array([s.order for s in rig.sensors])
        shares = np.array([base_shares(rig, i) * ((orders < 2) & (kind == "base")) for i, kind in enumerate(of_inputs)])
        self.shares = np.concatenate([shares * (orders == order) for order in (1, 0)])
        self.base_moves = bool(shares.any())
        """whether a sensor reads the base's own motion"""
        n_sensors = len(rig.sensors)
        self.forces: list[tuple[int, int, float]] = []
        """column of a sensor, that of a force, and the factor"""
        for i, sensor in enumerate(rig.sensors):
            if (j := clearance_of(rig, sensor)) is not None:
                along = sensor.unit_direction[1:] if rig.bushings[j].is_round else np.ones(1)
                for row, share in enumerate(along, rig.clearance_rows[j].start):
                    self.forces += [(i, n_sensors + k * rig.n_rows + row, sensor.gain * share) for k in (1, 2) if share]

    def push(self, acceleration: np.ndarray) -> np.ndarray:
        """Return velocities, then displacements of the base (n, 2 n_inputs) at the next steps, of its accelerations."""
        acceleration = in_columns(acceleration)
        between = self.state[0] + self.step * np.cumsum(acceleration, axis=0)
        place = self.state[1] + self.step * np.cumsum(between, axis=0)
        found = between - self.step / 2 * acceleration, place - self.step * between
        if acceleration.size:
            self.state = np.array([between[-1], place[-1]])
        return np.column_stack(found)

    def add(self, columns: np.ndarray, base: np.ndarray | None) -> None:
        """Complete what `Run.advance` returns (n, columns), in place, with what `push` returns if the base moves."""
        for sensor, force, factor in self.forces:
            columns[:, sensor] += factor * columns[:, force]
        if base is not None:
            columns[:, : self.shares.shape[1]] += base @ self.shares
