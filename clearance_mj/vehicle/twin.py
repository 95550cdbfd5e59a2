"""The steering's twin: half-gap, contact stiffness and friction, estimated from the car's signals while it drives.

Every half second a window of steering angle, yaw rate, lateral acceleration and speed refines a belief about the
clearance and everything else the vehicle's response depends on: cornering stiffnesses, friction of the tyres, mass,
inertia, offsets of the sensors, the steering angle's zero and lag, and slow unmodelled accelerations (crown, wind).
Their uncertainty is part of that of the half-gap.

The half-gap is identified by the step of twice its size in the wheel's angle when the side changes. The deflection
under a steady moment identifies only the stiffness of contact and tyres together, which priors separate; where friction
decides on the side, only the half-gap together with T_f/k is identified.

The model within the steering's twin: a single track with tyres that saturate, steered through the lost motion.

The lateral force of an axle over its slip angle is that of `nominal.Tyre`. The front wheels stand at servo angle,
offset and lost motion together; the aligning moment is the front force times the trail.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core.errors import ManoeuvreError
from ..core.jit import jit
from ..estimate.beliefs import Belief, Refinement, refine
from ..estimate.estimates import Estimates
from ..estimate.parameter import Parameter
from .commonroad import GRAVITY
from .lost_motion import LostMotion, lost_motion_step
from .nominal import Vehicle
from .signals import Signals

__all__ = ["N_PARAMETERS", "N_STATES", "Known", "SteeringTwin", "SteeringTwinRun", "simulate", "twin_of"]

LARGEST_GAP, SMALLEST_GAP = math.radians(5), math.radians(0.005)
SETTLING = 0.15  # s, decay time of the yaw rate's response to a wheel angle
FRONT_GAIN = 110.0  # m/s² of lateral acceleration per radian of the front wheels
CREEP_ANGLE = 2e-4  # rad RMS, creep of a wheel held by friction
CREEP = 1.5
"""times the road's RMS moment: the expected largest of its nine independent values while the yaw rate settles, to which
a wheel held by friction yields"""
STATE_NOISE = (0.02, math.radians(0.1), math.radians(0.03))
"""In m/s, rad/s and rad: standard deviation of the model error of its states in a window."""
DRIFT = {
    "lag": 2e-5, "yaw_rate_offset": 2e-5, "acceleration_offset": 2e-4, "steering_offset": 5e-6,
    "side_acceleration": 0.03, "yaw_acceleration": 0.01,
}  # fmt: skip
"""Random walk per window: crown and wind change during a drive, offsets hardly."""
SLOW_DRIFT = 2e-4
"""Random walk per window of the logarithm of parameters that are constant or change with the tyres' temperature.

It is 1 % in 20 min. Faster drift would bias the half-gap.
"""


@dataclass(frozen=True)
class SteeringTwin:
    """Initial knowledge of the twin: nominal vehicle, assumed clearance, and their standard deviations."""

    vehicle: Vehicle  #: nominal, with a rigid steering
    lost_motion: LostMotion  #: assumed initially; shaft stiffness and damping are taken as known
    gap_std: float = 0.5  #: standard deviation of the logarithm of the half-gap
    stiffness_std: float = 0.1  #: of the logarithm of the contact stiffness
    friction_std: float = 0.1  #: relative, of the friction
    gap_drift: float = 5e-5  #: of the logarithm of the half-gap, of its random walk in a window
    wear_std: float = 1e-4  #: 1/s, of the rate at which that logarithm grows: no wear is expected
    wear_drift: float = 5e-8  #: 1/s, of that rate's random walk in a window
    model_error: float = 0.025
    """standard deviation of the half-gap's logarithm from model error, which does not decrease with driving"""
    yaw_rate_noise: float = math.radians(0.1)  #: rad/s
    acceleration_noise: float = 0.05  #: m/s²
    age_std: float = 0.006  #: s, of the age of a signal about its mean
    road_moment: float = 5.0  #: N m RMS of the road on the wheels, in `road_bandwidth`
    road_bandwidth: float = 29.5  #: Hz
    unrest: float = 15.0  #: 1/s: standard deviation of the yaw rate that a wheel rattling by one radian causes
    window: float = 0.5  #: s
    period: float = 0.01  #: s, between two samples

    def __post_init__(self) -> None:
        if not 0 < self.lost_motion.half_gap <= LARGEST_GAP:
            raise ManoeuvreError(
                f"the twin's half-gap must be in 0..{LARGEST_GAP:.3g} rad to begin with, got "
                f"{self.lost_motion.half_gap!r}"
            )
        for name in ("gap_std", "stiffness_std", "window", "period", "yaw_rate_noise", "acceleration_noise"):
            if not 0 < getattr(self, name) < math.inf:
                raise ManoeuvreError(f"SteeringTwin.{name} must be finite and > 0, got {getattr(self, name)!r}")

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The estimated parameters with their priors, the clearance first."""
        p = self.lost_motion

        def offset(name: str, unit: str, std: float, start: float = 0.0) -> Parameter:
            return Parameter(name, unit, start, -10 * std, 10 * std, std, "linear")

        def factor(name: str, std: float, start: float = 1.0) -> Parameter:
            return Parameter(name, "1", start, start / 3, start * 3, std)

        return (
            Parameter("half_gap", "rad", p.half_gap, SMALLEST_GAP, LARGEST_GAP, self.gap_std),
            Parameter("stiffness", "N m/rad", p.stiffness, p.stiffness / 10, p.stiffness * 10, self.stiffness_std),
            Parameter("friction", "N m", p.friction, 0.0, max(5 * p.friction, 1.0),
                      max(self.friction_std * p.friction, 1e-3), "linear"),
            factor("cornering_front", 0.09),
            factor("cornering_rear", 0.09),
            factor("tyre_friction", 0.08, 0.9 * self.vehicle.tyre.friction),
            factor("mass", 0.06),
            factor("inertia", 0.03),
            offset("yaw_rate_offset", "rad/s", math.radians(0.2)),
            offset("acceleration_offset", "m/s²", 0.1),
            offset("steering_offset", "rad", math.radians(0.02)),
            offset("lag", "s", 0.003, 0.002),
            offset("side_acceleration", "m/s²", 0.1),
            offset("yaw_acceleration", "rad/s²", 0.02),
            offset("wear", "1/s", self.wear_std),
        )  # fmt: skip

    def start(self) -> SteeringTwinRun:
        """Begin a drive, straight ahead."""
        return SteeringTwinRun(self)


class SteeringTwinRun:
    """A twin during a drive."""

    def __init__(self, settings: SteeringTwin):
        p, play, self._settings = settings.vehicle, settings.lost_motion, settings
        self._parameters = settings.parameters
        heat = settings.road_moment**2 / (4 * settings.road_bandwidth * play.damping) if play.damping else 0.0
        self._known = Known(
            p.mass, p.yaw_inertia, p.lf, p.lr, p.cornering_front, p.cornering_rear, p.tyre.shape, p.trail,
            play.shaft_stiffness, play.damping, heat, CREEP * settings.road_moment, settings.period,
        )  # fmt: skip
        states = Belief.independent(np.zeros(N_STATES), (0.03, math.radians(0.3), play.half_gap / 2))
        self.belief = Belief.of(self._parameters).joined(states)
        """about parameters and, at the end of the last window, states"""
        walk = {"half_gap": settings.gap_drift, "wear": settings.wear_drift, "friction": SLOW_DRIFT * play.friction}
        drift = walk | DRIFT
        self._drift = np.array([drift.get(q.name, SLOW_DRIFT) for q in self._parameters] + list(STATE_NOISE))
        self._model_error = np.zeros(self._drift.size)
        self._model_error[0] = settings.model_error
        self._samples: list[tuple[float, float, float, float]] = []
        self._size, self._unrest = round(settings.window / settings.period), 0.0
        self.last: Refinement | None = None
        """refinement of the last window"""

    @property
    def estimates(self) -> Estimates:
        """Values and covariance of the parameters, the clearance's first."""
        return self.belief.drifted(self._model_error).estimates(self._parameters)

    @property
    def lost_motion(self) -> LostMotion:
        """The current estimate of the clearance."""
        gap, stiffness, friction = self.estimates.value[:3].tolist()
        return self._settings.lost_motion._replace(half_gap=gap, stiffness=stiffness, friction=friction)

    @property
    def wear(self) -> np.ndarray:
        """(3,) rate at which the half-gap grows, rad/s, and the ends of its 95 % interval."""
        estimates = self.estimates
        return np.asarray(estimates.value[0] * np.array([estimates.value[-1], *estimates.interval()[:, -1]]))

    def advance(self, seen: Signals) -> bool:
        """Take the signals of a sample, one period after the last; return True if the estimates are updated."""
        self._samples.append((seen.steering_angle, seen.speed, seen.yaw_rate, seen.lateral_acceleration))
        if len(self._samples) < self._size + 2:
            return False
        self._refine(np.array(self._samples).T)
        self._samples = self._samples[-2:]
        return True

    def _refine(self, samples: np.ndarray) -> None:
        """Refine by a window, preceded by a sample of the steering and one whose motion has been used already."""
        servo, speed = np.ascontiguousarray(samples[:2])
        prior, known = self.belief, self._known
        noise = self._noise(simulate(prior.mean[None], servo, speed, known)[0])
        measured = samples[2:, 2:]

        def residuals(points: np.ndarray) -> np.ndarray:
            residual = simulate(points, servo, speed, known)[:, :2, 1:] - measured
            return np.asarray((residual / noise).reshape(len(points), -1))

        def states(points: np.ndarray) -> np.ndarray:
            end = simulate(points, servo, speed, known)[:, 2:5, -1]
            half_gap = points[:, 0] + points[:, N_PARAMETERS - 1] * self._settings.window
            return np.column_stack((half_gap, points[:, 1:N_PARAMETERS], end))

        self.last = refine(prior, residuals)
        self.belief = self.last.belief.through(states).drifted(self._drift)

    def _noise(self, expected: np.ndarray) -> np.ndarray:
        """Return standard deviations (2, n - 1) of the measurements: noise, age, and rattling of the wheel in play."""
        p, mean = self._settings, self.belief.mean
        gap, friction = math.exp(mean[0]), mean[2]
        side = 1 / (1 + (friction / SIDE_MOMENT) ** 2)
        rattle = side / (3 / gap**2 + (expected[5] / max(self._known.heat, 1e-9)) ** 2) + (1 - side) * CREEP_ANGLE**2
        decay = math.exp(-p.period / SETTLING)
        unrest = np.empty_like(rattle)
        for i, value in enumerate(rattle.tolist()):
            self._unrest = decay * self._unrest + (1 - decay) * value
            unrest[i] = self._unrest
        age_error = p.age_std * np.gradient(expected[:2], p.period, axis=1)
        variance = np.array([[p.yaw_rate_noise], [p.acceleration_noise]]) ** 2 + age_error**2
        variance += np.array([p.unrest**2 * unrest, FRONT_GAIN**2 * rattle])
        return np.asarray(np.sqrt(variance)[:, 1:])


def twin_of(vehicle: Vehicle, lost_motion: LostMotion, stiffness: float, period: float = 0.01) -> SteeringTwin:
    """Return a twin of a vehicle whose front axle includes a steering stiffness, N m/rad, as by `with_steering`."""
    compliant = vehicle.cornering_front
    rigid = dataclasses.replace(vehicle, cornering_front=compliant / (1 - compliant * vehicle.trail / stiffness))
    return SteeringTwin(rigid, lost_motion, period=period)


SIDE_MOMENT = 5.0  # N m, aligning moment below which the side of the contact cannot be relied on
N_PARAMETERS, N_STATES = 15, 3
STEPS_PER_SAMPLE = 2  # integration steps of the twin's model in a sample


class Known(NamedTuple):
    """Quantities that the twin takes as known; the others vary by factors and offsets."""

    mass: float  # kg
    yaw_inertia: float  # kg m²
    lf: float  # m
    lr: float  # m
    cornering_front: float  # N/rad, of the axle with a rigid steering
    cornering_rear: float  # N/rad
    shape: float  # C of the tyres
    trail: float  # m
    shaft_stiffness: float  # N m/rad
    damping: float  # N m s/rad
    heat: float  # N m rad: mean square of the road's moment, over four times its bandwidth and the damping
    creep: float  # N m, reduction of the friction by the road's moment
    period: float  # s, of the samples


@jit
def _axle_force(slip: float, stiffness: float, largest: float, shape: float) -> float:
    return largest * math.sin(shape * math.atan(stiffness / (shape * largest) * slip))


@jit
def simulate(points: np.ndarray, servo: np.ndarray, speed: np.ndarray, known: Known) -> np.ndarray:
    """Return measured yaw rate and acceleration, lateral speed, yaw rate, lost motion, moment (n_points, 6, n).

    For points (n_points, `N_PARAMETERS` + `N_STATES`): logarithms of half-gap and contact stiffness, friction,
    logarithms of factors on both cornering stiffnesses, of friction of the tyres, of factors on mass and yaw inertia
    per mass; offsets of yaw rate, acceleration and steering angle, lag of the steering angle, unmodelled lateral
    and angular acceleration; rate of wear, of no effect here; lateral speed, yaw rate and lost motion at
    the first sample. Servo angles and speeds (n + 1,) begin one sample earlier.
    """
    n = servo.size - 1
    out = np.empty((points.shape[0], 6, n))
    h, dt = known.period / STEPS_PER_SAMPLE, known.period
    lf, lr, trail, shape = known.lf, known.lr, known.trail, known.shape
    for q in range(points.shape[0]):
        x = points[q]
        mass = known.mass * math.exp(x[6])
        inertia = known.yaw_inertia * math.exp(x[6] + x[7])
        front, rear = known.cornering_front * math.exp(x[3]), known.cornering_rear * math.exp(x[4])
        load = math.exp(x[5]) * mass * GRAVITY / (lf + lr)
        largest_front, largest_rear = load * lr, load * lf
        friction = max(x[2] - known.creep, 0.0)
        play = LostMotion(math.exp(x[0]), math.exp(x[1]), known.shaft_stiffness, known.damping, friction)
        lag = min(max(x[11] / dt, 0.0), 1.0)
        vy, r, d = x[15], x[16], x[17]
        previous = servo[1] + lag * (servo[0] - servo[1])
        for i in range(n):
            v = speed[i + 1]
            current = servo[i + 1] + lag * (servo[i] - servo[i + 1])
            following = current
            if i < n - 1:
                following = servo[i + 2] + lag * (servo[i + 1] - servo[i + 2])
            delta = current + d + x[10]
            force = _axle_force(delta - math.atan2(vy + lf * r, v), front, largest_front, shape)
            rear_force = _axle_force(-math.atan2(vy - lr * r, v), rear, largest_rear, shape)
            out[q, 0, i] = r + x[8]
            out[q, 1, i] = (force * math.cos(delta) + rear_force) / mass + x[9]
            out[q, 2, i], out[q, 3, i], out[q, 4, i], out[q, 5, i] = vy, r, d, trail * force
            if i == n - 1:
                break
            for j in range(1, STEPS_PER_SAMPLE + 1):
                moment = trail * force
                angle = current + (following - current) * j / STEPS_PER_SAMPLE
                d, _ = lost_motion_step(d, angle - previous, moment, h, play)
                previous = angle
                delta = angle + d + x[10]
                force = _axle_force(delta - math.atan2(vy + lf * r, v), front, largest_front, shape)
                rear_force = _axle_force(-math.atan2(vy - lr * r, v), rear, largest_rear, shape)
                c = math.cos(delta)
                vm = vy + h / 2 * ((force * c + rear_force) / mass - v * r + x[12])
                rm = r + h / 2 * ((lf * force * c - lr * rear_force) / inertia + x[13])
                force = _axle_force(delta - math.atan2(vm + lf * rm, v), front, largest_front, shape)
                rear_force = _axle_force(-math.atan2(vm - lr * rm, v), rear, largest_rear, shape)
                vy += h * ((force * c + rear_force) / mass - v * rm + x[12])
                r += h * ((lf * force * c - lr * rear_force) / inertia + x[13])
    return out
