"""A running steering simulation, in steps of 1 ms: the servo turns, the shaft loses motion behind it."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from ..clearance.law import Law
from ..core.errors import ManoeuvreError
from ..core.jit import jit
from ..engines import Engine
from ..engines.base import step_factor
from ..rig import Rig
from .lost_motion import LostMotion, lost_motion_step
from .plant import STEP

Lost = tuple[np.ndarray, np.ndarray]  # lost motion, rad, and contact side after each step


class Motor(NamedTuple):
    """The servo's motor, and what loads it besides the aligning moment; at the road wheel."""

    torque_limit: float  # N m
    inertia: float  # kg m²
    damping: float  # N m s/rad
    friction: float  # N m


class ServoStep(NamedTuple):
    """Second-order servo over one step."""

    flow: np.ndarray  # (2, 2) exact, of (angle less command, speed)
    rate_limit: float  # rad/s
    motor: Motor

    @classmethod
    def of(cls, frequency: float, damping: float, rate_limit: float, motor: Motor) -> ServoStep:
        """Discretise a servo of a natural frequency, Hz, and a share of the critical damping."""
        natural = 2 * np.pi * frequency
        decay, turn = natural * damping, natural * np.emath.sqrt(1 - damping**2)
        cos, sin = np.cos(turn * STEP).real, (np.sin(turn * STEP) / turn).real if turn else STEP
        flow = np.exp(-decay * STEP) * np.array([[cos + decay * sin, sin], [-(natural**2) * sin, cos - decay * sin]])
        return cls(flow, float(rate_limit), Motor(*map(float, motor)))


@jit
def _serve(
    state: np.ndarray, command: float, servo: ServoStep, load: np.ndarray, in_contact: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Servo angle after each step under a load, N m, felt in contact, and turns; state (angle, speed) moves on."""
    out, turns = np.empty(load.size), np.empty(load.size)
    reach = servo.rate_limit * STEP
    for i in range(load.size):
        error = state[0] - command
        angle = command + servo.flow[0, 0] * error + servo.flow[0, 1] * state[1]
        speed = servo.flow[1, 0] * error + servo.flow[1, 1] * state[1]
        turn = min(max(angle - state[0], -reach), reach)
        speed = min(max(speed, -servo.rate_limit), servo.rate_limit)
        if servo.motor.torque_limit < np.inf:
            speed, wanted = _held_back(speed, state[1], load[i], in_contact, servo.motor), speed
            if speed != wanted:
                speed = min(max(speed, -servo.rate_limit), servo.rate_limit)
                turn = speed * STEP
        before = state[0]
        state[0] += turn
        state[1] = speed
        out[i], turns[i] = state[0], state[0] - before
    return out, turns


@jit
def _held_back(wanted: float, before: float, load: float, in_contact: bool, motor: Motor) -> float:
    """Speed after a step, rad/s: the wanted one, or what the motor's torque allows against damping and load."""
    friction = motor.friction if in_contact else 0.0
    against = motor.damping * before + (load if in_contact else 0.0)
    torque = motor.inertia * (wanted - before) / STEP + against + friction * np.sign(wanted)
    if abs(torque) <= motor.torque_limit:
        return wanted
    free = before + (math.copysign(motor.torque_limit, torque) - against) / motor.inertia * STEP
    return math.copysign(max(abs(free) - friction / motor.inertia * STEP, 0.0), free)


class Shaft(Protocol):
    """The shaft with clearance over a run."""

    def advance(self, turn: np.ndarray, moment: np.ndarray) -> Lost:
        """Steps in which the servo turns (rad) and a moment turns the wheel back (N m)."""


class QuasiStaticShaft:
    """The reduced clearance, from the middle of the gap, which wear widens by rad/s."""

    def __init__(self, model: LostMotion, wear: float = 0.0):
        self._model, self._wear, self._lost = model, wear, np.zeros(1)

    def advance(self, turn: np.ndarray, moment: np.ndarray) -> Lost:
        """Steps of the reduced clearance."""
        if self._wear:
            self._model = self._model._replace(half_gap=self._model.half_gap + self._wear * turn.size * STEP)
        return _lost_motion(self._lost, turn, moment, self._model)


@jit
def _lost_motion(lost: np.ndarray, turn: np.ndarray, moment: np.ndarray, p: LostMotion) -> Lost:
    out, contact = np.empty(turn.size), np.empty(turn.size, dtype=np.int8)
    for i in range(turn.size):
        lost[0], contact[i] = lost_motion_step(lost[0], turn[i], moment[i], STEP, p)
        out[i] = lost[0]
    return out, contact


class SimulatedShaft:
    """An engine's shaft, loaded at the lever; in the frame of the bushings, which the servo turns.

    The step holds for the rig with its own gap too (``datasheet``), where a Hertz contact is stiffest.
    """

    def __init__(self, engine: Engine, rig: Rig, law: Law, datasheet: Rig, lever_arm: float, friction: float):
        self._factor = step_factor(1 / STEP, min(engine.largest_step(shaft, law) for shaft in (rig, datasheet)))
        self._run = engine.start(rig, law, "force", STEP / self._factor)
        self._arm, self._limit = lever_arm, friction / lever_arm
        lever = rig.shaker.position
        bushing = [b.position == lever for b in rig.bushings].index(True)
        self._mass, self._gap = sum(m.mass for m in rig.point_masses if m.position == lever), rig.bushings[bushing].gap
        # Displacement, contact force, grease force.
        self._columns = len(rig.sensors) + bushing + len(rig.bushings) * np.arange(3)
        self._turning, self._speed, self._last = 0.0, 0.0, np.zeros(3)

    def advance(self, turn: np.ndarray, moment: np.ndarray) -> Lost:
        """Steps of the engine."""
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


class SteeringRun:
    """A running steering simulation; after `advance`, `servo` and `contact` are the servo's angle and σ over it."""

    def __init__(self, servo: ServoStep, shaft: Shaft, road: np.ndarray):
        self.contact, self.servo = np.zeros(0, dtype=np.int8), np.zeros(0)
        self._servo, self._shaft, self._road = servo, shaft, road
        self._state, self._steps, self._in_contact = np.zeros(2), 0, False

    @property
    def angle(self) -> float:
        """The servo's angle now, rad."""
        return float(self._state[0])

    def advance(self, command: float, aligning_moment: float, duration: float) -> np.ndarray:
        """Road-wheel angle after each millisecond, rad (n,), under a held command (rad) and aligning moment (N m)."""
        n = round(duration / STEP)
        if n < 1 or abs(n * STEP - duration) > 1e-9:
            raise ManoeuvreError(f"steering advances by whole milliseconds, got {duration:g} s")
        moment = aligning_moment + self._road.take(np.arange(self._steps, self._steps + n), mode="wrap")
        self.servo, turn = _serve(self._state, command, self._servo, moment, self._in_contact)
        self._steps += n
        lost, self.contact = self._shaft.advance(turn, moment)
        self._in_contact = bool(self.contact[-1])
        return self.servo + lost
