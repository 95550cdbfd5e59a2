"""The steering: a servo, a shaft that runs through two bushings with clearance, and the lever that turns the wheels.

The servo turns the shaft's bushings; the shaft's displacement in them over the lever arm r is the wheel's error,
δ_err = x(l_j)/r at the bushing l_j where the lever's force acts. The shaft is a rig of this project, loaded there by
the aligning moment, the road's and the friction, each over r. It is reduced to one quasi-static degree of freedom
(`lost_motion`) or simulated, step by step with the vehicle, by one of this project's engines. All angles and moments
are those at the road wheel.
"""

from __future__ import annotations

import functools
import math
import re
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from ..clearance.law import ConstantLaw, Law
from ..clearance.modelled import nominal_law
from ..clearance.record import fillings_of
from ..core.checks import naming
from ..core.errors import ClearanceError, ManoeuvreError
from ..core.jit import jit
from ..core.units import quantity_of
from ..engines import Engine, get_engine
from ..engines.base import step_factor
from ..linear import linear_model
from ..rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker
from ..signals.excitation import random
from .lost_motion import LostMotion, lost_motion_step
from .plant import STEP

__all__ = ["LEVER_ARM", "STEERING_SHAFT", "Steering", "parse_gap"]

RATIO, PINION_RADIUS = 16.0, 7.1e-3  # hand-wheel angle over road-wheel angle, and m
COLUMN_STIFFNESS = 172.0  # N m/rad, at the pinion
COLUMN_INERTIA = 0.04  # kg m², about the hand wheel's axis
RACK_MASS, RACK_DAMPING = 32.0, 3920.0  # kg and N s/m
LEVER_ARM = RATIO * PINION_RADIUS  # Travel of the rack, m, per radian of the road wheel.
NOISE_PERIOD = 60.0  # s, period of the road's noise
SMALLEST_GAP = 1e-9  # m, stands for no gap, where a rig needs one


LEVER = 0.475  # m along the shaft

_CONTACT = Contact(COLUMN_STIFFNESS / PINION_RADIUS**2, 200.0)
STEERING_SHAFT = Rig(
    name="steering shaft",
    description="Shaft between steering servo and rack, in two bushings; the lever is at the second",
    beam=Beam(length=0.6, young_modulus=210e9, density=7850.0, diameter=0.010, rayleigh=(0.5, 1e-5)),
    masses=(PointMass(LEVER, RACK_MASS, "rack"),),
    bushings=tuple(Bushing(x, 4e-4, 0.012, Grease(0.0, c), _CONTACT) for x, c in ((0.33, 3.0), (LEVER, RACK_DAMPING))),
    sensors=(Sensor(1, LEVER),),
    shaker=Shaker("force", LEVER),
)
"""Steel shaft clamped at the servo, with rack mass and damping and column stiffness at the lever; the default shaft."""


def parse_gap(text: str, lever_arm: float = LEVER_ARM) -> float:
    """Return the half-gap at the road wheel, rad, of a number with a unit; the lever arm, m, converts a length.

    Such as "0.2deg", "3.5mrad" (road-wheel angle) or "0.15mm" (radial clearance of the shaft).
    """
    match = re.fullmatch(r"\s*(\d+\.?\d*(?:e[-+]?\d+)?|\.\d+)\s*(.*?)\s*", text)
    number, unit = match.groups() if match else ("", "")
    if known_unit := quantity_of(unit, ["angle", "displacement"]):
        return float(number) * known_unit[1] / (1.0 if known_unit[0] == "angle" else lever_arm)
    hint = "give an angle at the road wheel (0.2deg, 3.5mrad) or a radial clearance of the shaft (0.15mm)"
    raise ManoeuvreError(f'gap "{text}" {"has no unit" if number and not unit else "is not a gap"}; {hint}')


@dataclass(frozen=True)
class Steering:
    """Servo, shaft with clearance, and lever."""

    half_gap: float = 0.0  # rad at the road wheel: the bushings' clearance over the lever arm
    fidelity: str | Engine = "play"  # quasi-static lost motion; or an engine, such as "modal", that simulates the shaft
    friction: float = 0.0  # N m, Coulomb's, of the road wheel; below the aligning moment the clearance is torque-driven
    road_moment: float = 0.0  # N m RMS, of the road on the wheel
    road_band: tuple[float, float] = (0.5, 30.0)  # Hz, its band
    frequency: float = 6.0  # Hz, natural, of the second-order servo
    damping: float = 0.7  # of the servo, of critical
    rate_limit: float = 0.4  # rad/s at the road wheel, largest speed of the servo; 0.4 is that of commonroad's vehicle
    torque_limit: float = math.inf  # N m at the road wheel, largest of the servo's motor
    lever_arm: float = LEVER_ARM  # r, m
    shaft: Rig = STEERING_SHAFT  # its shaker's position is the lever's, and one of its bushings is there
    wear: float = 0.0  # rad/s, growth of the half-gap; with the fidelity "play" only
    law: Law | None = None  # of the contact, such as an identified one; None: the shaft's datasheet values

    def __post_init__(self) -> None:
        self._engine()
        for name, (low, high) in _RANGES.items():
            if not low <= getattr(self, name) <= high:
                raise ManoeuvreError(f"steering.{name} must be in {low:g}..{high:g}, got {getattr(self, name):g}")
        if self.wear and self.fidelity != "play":
            raise ManoeuvreError(f'steering.wear needs the fidelity "play", got {self.fidelity!r}')
        if self.shaft.shaker.position not in [b.position for b in self.shaft.bushings]:
            raise ManoeuvreError(f"rig {self.shaft.name!r}: the lever (shaker.position) must be at one of its bushings")

    @property
    def lever(self) -> int:
        """Index of the bushing at the lever."""
        return [b.position == self.shaft.shaker.position for b in self.shaft.bushings].index(True)

    @functools.cached_property
    def rig(self) -> Rig:
        """The shaft with this clearance."""
        return self.shaft.with_gap(max(self.half_gap * self.lever_arm, SMALLEST_GAP))

    @functools.cached_property
    def datasheet_law(self) -> ConstantLaw:
        """Stiffness and damping of the shaft's contacts."""
        return nominal_law(self.shaft)

    @property
    def contact_law(self) -> Law:
        """The law, or the datasheet's."""
        return self.law or self.datasheet_law

    @functools.cached_property
    def lost_motion(self) -> LostMotion:
        """The shaft reduced to its deflection under the lever's force; a Hertz contact at its datasheet's gap."""
        rig, arm2 = self.rig, self.lever_arm**2
        model = linear_model(rig)
        deflection = model.at_bushings / model.omega**2 @ model.input("force")
        squared = (deflection / deflection[self.lever]) ** 2
        grease_k, grease_c = np.transpose([g.small_motion() for g in fillings_of(self.shaft, self.contact_law)])
        stiffness, damping = 1 / deflection[self.lever] + sum(squared * grease_k), sum(squared * grease_c)
        contact = self.contact_law.largest([b.gap for b in self.shaft.bushings])[0][self.lever]
        return LostMotion(*map(float, (self.half_gap, contact * arm2, stiffness * arm2, damping * arm2, self.friction)))

    def start(self, seed: int = 0) -> SteeringRun:
        """Begin a run with the wheels straight and the shaft centred; the seed is that of the road's noise."""
        motor = Motor(self.torque_limit, COLUMN_INERTIA * RATIO**2, RACK_DAMPING * self.lever_arm**2, self.friction)
        servo = ServoStep.of(self.frequency, self.damping, self.rate_limit, motor)
        engine, road = self._engine(), np.zeros(1)
        shaft: SteeringShaft = QuasiStaticShaft(self.lost_motion, self.wear)
        if engine:
            shaft = SimulatedShaft(engine, self.rig, self.contact_law, self.shaft, self.lever_arm, self.friction)
        if self.road_moment > 0:
            road = random(NOISE_PERIOD, 1 / STEP, self.road_band, self.road_moment, seed, "force").value
        return SteeringRun(servo, shaft, road)

    def _engine(self) -> Engine | None:
        """Return the engine that simulates the shaft, or None."""
        with naming('steering.fidelity is "play" or an engine', ClearanceError, ManoeuvreError):
            return None if self.fidelity == "play" else get_engine(self.fidelity)


_RANGES = {
    "half_gap": (0.0, math.radians(5)), "friction": (0.0, 1e4), "road_moment": (0.0, 1e3), "frequency": (0.5, 50.0),
    "damping": (0.1, 2.0), "rate_limit": (0.01, 100.0), "wear": (0.0, 1.0), "torque_limit": (1.0, math.inf),
    "lever_arm": (0.01, 1.0),
}  # fmt: skip


Lost = tuple[np.ndarray, np.ndarray]  # lost motion, rad, and contact side after each step


class Motor(NamedTuple):
    """The servo's motor and its load apart from the aligning moment; at the road wheel."""

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
        """Discretise a servo of a natural frequency, Hz, and a damping ratio."""
        natural = 2 * np.pi * frequency
        decay, damped = natural * damping, natural * np.emath.sqrt(1 - damping**2)
        cos, sin = np.cos(damped * STEP).real, (np.sin(damped * STEP) / damped).real if damped else STEP
        flow = np.exp(-decay * STEP) * np.array([[cos + decay * sin, sin], [-(natural**2) * sin, cos - decay * sin]])
        return cls(flow, float(rate_limit), Motor(*map(float, motor)))


@jit
def _advance_servo(
    state: np.ndarray, command: float, servo: ServoStep, load: np.ndarray, in_contact: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return servo angle and turn in each step; the load, N m, acts in contact; state (angle, speed) is updated."""
    angles, turns = np.empty(load.size), np.empty(load.size)
    largest_turn = servo.rate_limit * STEP
    for i in range(load.size):
        error = state[0] - command
        angle = command + servo.flow[0, 0] * error + servo.flow[0, 1] * state[1]
        speed = servo.flow[1, 0] * error + servo.flow[1, 1] * state[1]
        turn = min(max(angle - state[0], -largest_turn), largest_turn)
        speed = min(max(speed, -servo.rate_limit), servo.rate_limit)
        if servo.motor.torque_limit < np.inf:
            speed, unlimited = _limit_by_torque(speed, state[1], load[i], in_contact, servo.motor), speed
            if speed != unlimited:
                speed = min(max(speed, -servo.rate_limit), servo.rate_limit)
                turn = speed * STEP
        previous = state[0]
        state[0] += turn
        state[1] = speed
        angles[i], turns[i] = state[0], state[0] - previous
    return angles, turns


@jit
def _limit_by_torque(speed: float, previous: float, load: float, in_contact: bool, motor: Motor) -> float:
    """Return the speed after a step, rad/s, as far as the motor's torque allows against damping and load."""
    friction = motor.friction if in_contact else 0.0
    resistance = motor.damping * previous + (load if in_contact else 0.0)
    torque = motor.inertia * (speed - previous) / STEP + resistance + friction * np.sign(speed)
    if abs(torque) <= motor.torque_limit:
        return speed
    reachable = previous + (math.copysign(motor.torque_limit, torque) - resistance) / motor.inertia * STEP
    return math.copysign(max(abs(reachable) - friction / motor.inertia * STEP, 0.0), reachable)


class SteeringShaft(Protocol):
    """The shaft with clearance over a run."""

    def advance(self, turn: np.ndarray, moment: np.ndarray) -> Lost:
        """Return lost motion and contact side in steps of servo turns (rad) and aligning moments (N m)."""


class QuasiStaticShaft:
    """The reduced clearance, from the middle of the gap, which wear, rad/s, widens."""

    def __init__(self, model: LostMotion, wear: float = 0.0):
        self._model, self._wear, self._lost = model, wear, np.zeros(1)

    def advance(self, turn: np.ndarray, moment: np.ndarray) -> Lost:
        """Return lost motion and contact side of the reduced clearance."""
        if self._wear:
            self._model = self._model._replace(half_gap=self._model.half_gap + self._wear * turn.size * STEP)
        return _lost_motion(self._lost, turn, moment, self._model)


@jit
def _lost_motion(state: np.ndarray, turn: np.ndarray, moment: np.ndarray, p: LostMotion) -> Lost:
    out, contact = np.empty(turn.size), np.empty(turn.size, dtype=np.int8)
    for i in range(turn.size):
        state[0], contact[i] = lost_motion_step(state[0], turn[i], moment[i], STEP, p)
        out[i] = state[0]
    return out, contact


class SimulatedShaft:
    """An engine's shaft, loaded at the lever; in the frame of the bushings, which the servo turns.

    The step is also stable for the rig with its datasheet's gap, where a Hertz contact is stiffest.
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
        """Return lost motion and contact side of the engine."""
        arm, limit = self._arm, self._limit
        displacement = np.empty(turn.size)
        for i in range(turn.size):
            inertia = self._mass * arm * (turn[i] - self._turning) / STEP**2
            # Friction stops the rack within this step, up to its limit.
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

    def __init__(self, servo: ServoStep, shaft: SteeringShaft, road: np.ndarray):
        self.contact, self.servo = np.zeros(0, dtype=np.int8), np.zeros(0)
        self._servo, self._shaft, self._road = servo, shaft, road
        self._state, self._steps, self._in_contact = np.zeros(2), 0, False

    @property
    def angle(self) -> float:
        """The servo's angle now, rad."""
        return float(self._state[0])

    def advance(self, command: float, aligning_moment: float, duration: float) -> np.ndarray:
        """Return the road-wheel angle, rad (n,), after each millisecond of a command, rad, and aligning moment, N m."""
        n = round(duration / STEP)
        if n < 1 or abs(n * STEP - duration) > 1e-9:
            raise ManoeuvreError(f"steering advances by whole milliseconds, got {duration:g} s")
        moment = aligning_moment + self._road.take(np.arange(self._steps, self._steps + n), mode="wrap")
        self.servo, turn = _advance_servo(self._state, command, self._servo, moment, self._in_contact)
        self._steps += n
        lost_motion, self.contact = self._shaft.advance(turn, moment)
        self._in_contact = bool(self.contact[-1])
        return self.servo + lost_motion
