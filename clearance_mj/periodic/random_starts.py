"""Random states marched in time by the modal engine until their motion repeats."""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from ..engines.modal import Modal, ModalRun, SideBySide
from ..linear import linear_model
from .branch import Branch

__all__ = ["LANES", "PERIODIC", "March"]

LANES = 8  # starts that are integrated together
REACH = 3.0  # largest displacement of a start, over the largest motion of the known branches
PERIODIC = 1e-5  # relative difference below which two states are equal
DECAYED = 20.0  # powers of e by which a motion that never touches counts as decayed
MIN_PERIODS, MAX_PERIODS = 200, 20000  # that a march waits for the decay


class March:
    """Time integration of random states under one excitation."""

    def __init__(
        self, known: tuple[Branch, ...], frequency: float, lanes: int, random: np.random.Generator, reach: float | None
    ):
        first, self.lanes = known[0], lanes
        self.samples, self.omega = first.n_samples // first.periods, 2 * np.pi * frequency
        engine, period = Modal(modes=first.n_modes), 1 / frequency
        self.steps = math.ceil(period / self.samples / engine.largest_step(first.model.rig, first.model.law))
        self.step = period / self.samples / self.steps
        begun = (engine.start(first.model.rig, first.model.law, first.kind, self.step) for _ in range(LANES))
        runs = [cast(ModalRun, run) for run in begun]
        self.together, self.at_points = SideBySide(runs), runs[0].linear.at_rows
        self.modes = linear_model(first.model.rig, first.n_modes).omega
        angle = 2 * np.pi * np.arange(self.samples * self.steps) / (self.samples * self.steps)
        turning = np.exp(1j * np.outer(np.arange(1, first.level.shape[1] + 1), angle))
        self.excitation = np.ascontiguousarray((first.level[0] @ turning).real)
        if reach is None:
            most = max(each.amplitude("clearance_displacement").max() for each in known)
            reach = REACH * max(most, min(b.gap - abs(b.offset) for b in first.model.rig.bushings))
        self._draw_states(random, reach)

    def _draw_states(self, random: np.random.Generator, reach: float) -> None:
        """Set states with the same average energy in every mode, with displacements up to a reach, m."""
        q, v, before = self.together.motion[:3]
        speed = random.standard_normal(q.shape)
        place = random.standard_normal(q.shape) / np.maximum(self.modes, self.omega)[:, None]
        extent = np.hypot(self.at_points @ place, self.at_points @ speed / self.omega).max(axis=0)
        scale = reach * random.uniform(size=q.shape[1]) / extent
        q[:], v[:] = scale * place, scale * speed
        before[:] = q - self.step * v

    def waits(self, decay: float) -> int:
        """Return the number of excitation periods in which a motion with a decay rate, 1/s, vanishes."""
        return int(np.clip(DECAYED * self.omega / (2 * np.pi * max(decay, 1e-12)), MIN_PERIODS, MAX_PERIODS))

    def settled(self, periods: int, longest: int) -> list[tuple[int, np.ndarray]]:
        """Return for each start the number of periods after which it repeats, 0 for never, and these periods.

        The motion at the points: (n_points, samples).
        """
        states = np.full((2 * max(periods, 2), 2 * len(self.together.motion.q), LANES), np.nan)
        repeats = np.zeros(LANES, dtype=int)
        for _ in range(longest):
            states = np.roll(states, 1, axis=0)
            self.together.advance(self.excitation)
            q, v = self.together.motion[:2]
            states[0] = np.concatenate((q * self.omega, v))
            repeats = _repetition(states, periods)
            if repeats[: self.lanes].all():
                break
        motion = np.empty((periods * self.samples, len(self.at_points), LANES))
        for i in range(len(motion)):
            motion[i] = self.at_points @ self.together.motion.q
            j = i % self.samples * self.steps
            self.together.advance(self.excitation[j : j + self.steps])
        return [(nu, motion[: nu * self.samples, :, lane].T) for lane, nu in enumerate(repeats[: self.lanes])]


def _repetition(states: np.ndarray, periods: int) -> np.ndarray:
    """Return (lanes,) the period of states (last first, n, lanes) in excitation periods, 0 beyond ``periods``."""
    size = np.linalg.norm(states, axis=1).max(axis=0)
    period = np.zeros(states.shape[2], dtype=int)
    for nu in range(periods, 0, -1):
        change = np.linalg.norm(states[:-nu] - states[nu:], axis=1)[:periods]
        period[(change <= PERIODIC * size).all(axis=0)] = nu
    return period
