"""Compensation of the steering clearance: an estimate of the lost motion, subtracted from any controller's command.

The shaft holds the wheel against a moment T and the wheel stays behind the servo by h σ + T/k: half-gap h, contact side
σ = sign T, contact stiffness k. T is the aligning moment plus friction that opposes the wheel's motion,
T = T_a + T_f sign(dδ/dt): without friction the side follows the aligning moment (torque-driven), with much of it the
motion (friction-driven). While the side is not known, σ = 0, the estimate keeps its last value.

The stiffness of a steering without clearance belongs to the nominal vehicle that all controllers know
(`nominal_vehicle`); what is compensated is the rest, so that without clearance nothing is.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from ..clearance.law import Law, table_values
from ..errors import ManoeuvreError
from ..rig import Rig
from .controller import Controller, Observation, Run, Task, limited

__all__ = ["BacklashInverse", "ClearanceModel", "Compensated", "Estimate", "LostMotion", "secant_stiffness"]

GRAVITY = 9.81
"""m/s²"""


class Estimate(ABC):
    """Lost motion over a drive."""

    @abstractmethod
    def advance(self, angle: float, state: np.ndarray) -> float:
        """Wheel angle less servo angle once the wheel will have answered the next command, rad.

        Parameters
        ----------
        angle : float
            Road-wheel angle that is wanted by then, rad.
        state : ndarray, shape (6,)
            State of the design model predicted for then.
        """


@dataclass(frozen=True)
class LostMotion(ABC):
    """A model of the lost motion, as a controller is given it."""

    @abstractmethod
    def start(self, task: Task) -> Estimate:
        """Begin a drive, in the middle of the gap.

        Parameters
        ----------
        task : Task
            What the controller is told.
        """


@dataclass(frozen=True)
class Compensated(Controller):
    """A controller whose commands are corrected for the lost motion; it is tuned without."""

    controller: Controller
    """what asks for the angle"""
    lost_motion: LostMotion
    """what is added to it"""

    def start(self, task):
        """Begin a drive."""
        return _CompensatedRun(task, self)


class _CompensatedRun(Run):
    def __init__(self, task, law):
        self._task, self._last = task, 0.0
        self._inner, self._estimate = law.controller.start(task), law.lost_motion.start(task)

    def command(self, seen: Observation) -> float:
        state = self._inner.predicted(self._inner.state(seen), seen)
        angle = self._inner.command(seen)
        self._last = limited(angle - self._estimate.advance(angle, state), self._last, self._task)
        return self._last


@dataclass(frozen=True)
class ClearanceModel(LostMotion):
    """The reduced clearance model, fed by the aligning moment that the nominal single track predicts."""

    half_gap: float
    """h, rad at the road wheel"""
    compliance: float = 0.0
    """1/k less that of the nominal vehicle's steering, rad/(N m) at the road wheel"""
    friction: float = 0.0
    """T_f, N m at the road wheel"""
    threshold: float = 10.0
    """N m below which the side is taken as not known"""
    slack: float = np.radians(0.1)
    """rad by which the servo turns back before its direction counts as changed: about twice its noise"""

    def __post_init__(self):
        _check(self, "half_gap", 0 <= self.half_gap < math.inf, "a finite angle >= 0 rad")
        _check(self, "compliance", math.isfinite(self.compliance), "finite, rad/(N m)")
        _check(self, "friction", 0 <= self.friction < math.inf, "finite and >= 0 N m")

    def start(self, task):
        """Begin a drive, in the middle of the gap."""
        return _ClearanceEstimate(self, task)


class _ClearanceEstimate(Estimate):
    def __init__(self, model, task):
        p, self._model, self._speed = task.vehicle, model, task.speed
        self._lf, self._trail, self._stiffness = p.lf, p.trail, p.cornering_front
        self._largest = p.friction * p.mass * GRAVITY * p.lr / (p.lf + p.lr)
        self._direction, self._lost = Direction(model.slack), 0.0

    def advance(self, angle, state):
        _, _, lateral_speed, yaw_rate, _, _ = state.tolist()
        force = self._stiffness * (angle - (lateral_speed + self._lf * yaw_rate) / self._speed)
        force = min(max(force, -self._largest), self._largest)
        moment = self._trail * force + self._model.friction * self._direction.advance(state[4])
        if abs(moment) > self._model.threshold:
            self._lost = -math.copysign(self._model.half_gap, moment) - moment * self._model.compliance
        return self._lost


@dataclass(frozen=True)
class BacklashInverse(LostMotion):
    """The inverse of plain play: half a gap towards the direction of motion, whatever the moment."""

    half_gap: float
    """rad at the road wheel"""
    slack: float = np.radians(0.1)
    """rad, as in `ClearanceModel`"""

    def __post_init__(self):
        _check(self, "half_gap", 0 <= self.half_gap < math.inf, "a finite angle >= 0 rad")

    def start(self, task):
        """Begin a drive, in the middle of the gap."""
        return _InverseEstimate(self)


class _InverseEstimate(Estimate):
    def __init__(self, model):
        self._half_gap, self._direction = model.half_gap, Direction(model.slack)

    def advance(self, angle, state):
        return -self._half_gap * self._direction.advance(state[4])


class Direction:
    """Direction of a signal, deaf to noise: it changes once the signal has turned back by a slack.

    Parameters
    ----------
    slack : float
        In the signal's unit.
    """

    def __init__(self, slack: float):
        self._slack, self._extreme, self._sign = slack, 0.0, 0

    def advance(self, value: float) -> int:
        """Return the direction with the next value: -1, 1, or 0 before the first motion.

        Parameters
        ----------
        value : float
            Of the signal.
        """
        back = value - self._extreme
        if abs(back) > self._slack:
            self._sign = 1 if back > 0 else -1
        if back * self._sign > 0:
            self._extreme = value
        return self._sign


def secant_stiffness(law: Law, rig: Rig, bushing: int, force: float) -> float:
    """Contact force over penetration of a bushing under a steady force, N/m: what a law says a clearance model's k is.

    Parameters
    ----------
    law : Law
        Such as an identified one; of a schedule in time the mean stiffness is taken, of one in amplitude that at gap
        plus penetration.
    rig : Rig
        Gives the gap.
    bushing : int
        Index of the bushing.
    force : float
        N.

    Raises
    ------
    ManoeuvreError
        If the law has no contact there that could carry the force.
    """
    table, gap = law.table(len(rig.bushings)), rig.bushings[bushing].gap
    mean, exponent = float(np.mean(table.k[:, bushing])), float(table.exponent[bushing])

    def excess(penetration):
        k = table_values(table, bushing, gap + penetration)[0] if table.by_amplitude else mean
        return k * penetration**exponent - force

    deepest = 1e3 * gap
    if excess(deepest) < 0:
        raise ManoeuvreError(f"the law's contact at bushings[{bushing}] does not carry {force:g} N")
    return force / scipy.optimize.brentq(excess, 0.0, deepest, xtol=1e-12)


def _check(model, name, condition, rule):
    if not condition:
        raise ManoeuvreError(f"{type(model).__name__}.{name} must be {rule}, got {getattr(model, name)!r}")
