"""Contributions to sensor readings outside of the time loop: the base's motion and forces in clearances."""

from __future__ import annotations

import numpy as np

from ..rig import Rig
from ..rig.instruments import Kinds, input_kinds
from ..rig.sensing import base_readings, clearance_of
from .base import in_columns

__all__ = ["Completion"]


class Completion:
    """Adds the contributions of the base's motion and the clearances' forces to the columns of sensors.

    The base begins at rest. With its acceleration a at the steps, its velocity and displacement are the running sums
    (u₊ - u₋)/(2h) and u of u₊ - 2u + u₋ = h² a, the scheme of the modes.
    """

    def __init__(self, rig: Rig, kinds: Kinds, step: float) -> None:
        inputs = input_kinds(kinds)
        self.step, self.state = step, np.zeros((2, len(inputs)))  # velocity in the last step's middle, displacement
        orders = np.array([s.order for s in rig.sensors])
        gains = np.array([base_readings(rig, i) * ((orders < 2) & (kind == "base")) for i, kind in enumerate(inputs)])
        self.shares = np.concatenate([gains * (orders == order) for order in (1, 0)])
        self.base_moves = bool(gains.any())
        """True if a sensor reads the base's motion"""
        n_sensors = len(rig.sensors)
        self.forces: list[tuple[int, int, float]] = []
        """column of a sensor, that of a force, and the factor"""
        for i, sensor in enumerate(rig.sensors):
            if (j := clearance_of(rig, sensor)) is not None:
                directions = sensor.unit_direction[1:] if rig.bushings[j].is_round else np.ones(1)
                for row, c in enumerate(directions, rig.clearance_rows[j].start):
                    self.forces += [(i, n_sensors + k * rig.n_rows + row, sensor.gain * c) for k in (1, 2) if c]

    def push(self, acceleration: np.ndarray) -> np.ndarray:
        """Integrate the base's accelerations; return velocities, then displacements (n, 2 n_inputs) at the steps."""
        acceleration = in_columns(acceleration)
        between = self.state[0] + self.step * np.cumsum(acceleration, axis=0)
        place = self.state[1] + self.step * np.cumsum(between, axis=0)
        motion = between - self.step / 2 * acceleration, place - self.step * between
        if acceleration.size:
            self.state = np.array([between[-1], place[-1]])
        return np.column_stack(motion)

    def add(self, columns: np.ndarray, base: np.ndarray | None) -> None:
        """Complete the columns of `Run.advance` (n, columns) in place; ``base`` is of `push` if the base moves."""
        for sensor, force, factor in self.forces:
            columns[:, sensor] += factor * columns[:, force]
        if base is not None:
            columns[:, : self.shares.shape[1]] += base @ self.shares
