"""The steering's shaft simulated by an engine, step by step beside the vehicle."""

from __future__ import annotations

import numpy as np

from ..clearance.law import Law
from ..engines import Engine
from ..engines.base import step_factor
from ..rig import Rig
from .plant import STEP

__all__ = ["SimulatedShaft"]


class SimulatedShaft:
    """An engine's shaft over a run, loaded at the lever; in the frame of the bushings, which the servo turns.

    Parameters
    ----------
    engine : Engine
        Simulates it.
    rig : Rig
        The shaft with its clearance; the shaker's position is the lever's, and one of the bushings is there.
    law : Law
        Of the contacts.
    datasheet : Rig
        The shaft with its own gap, where a Hertz contact is stiffest.
    lever_arm : float
        r, m.
    friction : float
        Coulomb friction of the road wheel, N m.
    """

    def __init__(self, engine: Engine, rig: Rig, law: Law, datasheet: Rig, lever_arm: float, friction: float):
        self._factor = step_factor(1 / STEP, min(engine.largest_step(shaft, law) for shaft in (rig, datasheet)))
        self._run = engine.start(rig, law, "force", STEP / self._factor)
        self._arm, self._limit = lever_arm, friction / lever_arm
        lever = rig.shaker.position
        bushing = [b.position for b in rig.bushings].index(lever)
        self._mass, self._gap = sum(m.mass for m in rig.point_masses if m.position == lever), rig.bushings[bushing].gap
        # Displacement, contact force, grease force.
        self._columns = len(rig.sensors) + bushing + len(rig.bushings) * np.arange(3)
        self._turning, self._speed, self._last = 0.0, 0.0, np.zeros(3)

    def advance(self, turn: np.ndarray, moment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lost motion, rad, and contact side after each step.

        Parameters
        ----------
        turn : ndarray, shape (n,)
            How far the servo turns in each step, rad.
        moment : ndarray, shape (n,)
            That turns the wheel back, N m.
        """
        arm, limit = self._arm, self._limit
        displacement = np.empty(turn.size)
        for i in range(turn.size):
            inertia = self._mass * arm * (turn[i] - self._turning) / STEP**2
            # Friction takes what would stop the rack in this step, up to its limit.
            push = moment[i] / arm + self._last[1] + self._last[2]
            stop = push - self._mass * (self._speed + arm * turn[i] / STEP) / STEP
            friction = min(max(stop, -limit), limit)
            out = self._run.advance(np.full(self._factor, friction - moment[i] / arm - inertia))
            previous, self._last = self._last[0], out[-1, self._columns]
            self._turning, displacement[i] = turn[i], self._last[0]
            self._speed = (displacement[i] - previous) / STEP
        return displacement / arm, -np.sign(displacement * (np.abs(displacement) > self._gap)).astype(np.int8)
