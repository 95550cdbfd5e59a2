"""The simulated vehicle: the multi-body and the single-track drift model of commonroad-vehicle-models.

Both have the road-wheel angle as an input that the steering model sets, held over each step of 1 ms, instead of the
library's steering integrator and its rate limit. The set speed is held by a proportional cruise
control through the library's drive and brake torques. Axes are those of ISO 8855: x ahead, y left, yaw to the left.

The library has no aligning moment. Here it is the front axle's lateral force times a constant trail, and the lateral
force follows from the moments about the rear axle, F_yf = (b ΣF_y + I_z dr/dt)/(a + b): exact for the single track; for
the multi-body model it counts the moment of left-right differences of longitudinal tyre forces to the front axle.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from vehiclemodels.init_mb import init_mb
from vehiclemodels.init_std import init_std

from ..core.errors import ManoeuvreError, SimulationError
from ..core.jit import jit
from .commonroad import compiled_parameters, multi_body, parameters, single_track_drift

__all__ = ["STEP", "Measurement", "MultiBody", "Plant", "SingleTrackDrift", "Spread"]

STEP = 1e-3  # Step, s, of the Runge-Kutta method.
CRUISE_GAIN = 2.0  # 1/s, acceleration per deviation from the set speed
MULTI_BODY_STATES = 29


@dataclass(frozen=True)
class Spread:
    """Factors on parameters that differ between vehicles and roads."""

    mass: float = 1.0  # of the sprung mass and its moments of inertia
    stiffness: float = 1.0  # of the tyres' cornering stiffness
    friction: float = 1.0  # of the tyres' largest forces

    def __post_init__(self) -> None:
        for name, value in dataclasses.asdict(self).items():
            if not 0.2 <= value <= 2:
                raise ManoeuvreError(f"spread.{name} is a factor in 0.2..2, got {value:g}")

    @classmethod
    def random(cls, seed: int) -> Spread:
        """Draw a vehicle: mass uniform within 10 %, stiffness within 15 %, friction between 0.8 and 1.0."""
        generator = np.random.default_rng(seed)
        return cls(*(float(generator.uniform(*ends)) for ends in ((0.9, 1.1), (0.85, 1.15), (0.8, 1.0))))


class Measurement(NamedTuple):
    """Measurements on the vehicle, at the centre of gravity."""

    x: float  # m
    y: float  # m
    heading: float  # rad
    speed: float  # m/s, longitudinal
    lateral_speed: float  # m/s
    yaw_rate: float  # rad/s
    lateral_acceleration: float  # m/s², of tyres and wind, as an accelerometer reads it
    sideslip: float  # rad
    aligning_moment: float  # N m about the steering axes; positive: turns the wheels back


@dataclass(frozen=True)
class Plant(ABC):
    """A vehicle model; a state is the library's states and, last, the set speed."""

    name: ClassVar[str]
    spread: Spread = field(default_factory=Spread)  # how its parameters differ from the nominal ones
    trail: float = 0.045  # m, mechanical and pneumatic

    @functools.cached_property
    def parameters(self) -> Any:
        """The library's parameters with the spread applied."""
        p, s = parameters(), self.spread
        sprung = p.m_s * s.mass
        factors = {"p_ky1": s.stiffness, "p_dy1": s.friction, "p_dx1": s.friction}
        tire = dataclasses.replace(p.tire, **{name: getattr(p.tire, name) * factor for name, factor in factors.items()})
        inertia = {name: getattr(p, name) * s.mass for name in ("I_z", "I_Phi_s", "I_y_s")}
        return dataclasses.replace(p, m=p.m - p.m_s + sprung, m_s=sprung, tire=tire, **inertia)

    @functools.cached_property
    def _compiled(self) -> np.ndarray:
        return compiled_parameters(self.parameters)

    @abstractmethod
    def _states(self, core: list[float]) -> list[float]:
        """Return the library's states for [x, y, wheel angle, speed, heading, yaw rate, sideslip]."""

    def start(self, speed: float, pose: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Return the state of the vehicle driving straight at a constant speed, m/s, from x, y, m, and heading, rad."""
        x, y, heading = pose
        return np.array([*self._states([x, y, 0.0, speed, heading, 0.0, 0.0]), speed], dtype=float)

    def advance(self, state: np.ndarray, wheel_angle: ArrayLike, load: ArrayLike | None = None) -> np.ndarray:
        """Return the state after n ms with road-wheel angles (n,), rad; `SimulationError` if it is no longer finite.

        The load (n, 3), zero by default, is that of a `Disturbance`: side force, N, and yaw moment, N m, about the
        centre of gravity, lateral component of gravity, m/s². The force is spread over the masses as gravity is.
        """
        angles = np.ascontiguousarray(wheel_angle, dtype=float)
        loads = np.zeros((angles.size, 3)) if load is None else np.ascontiguousarray(load, dtype=float)
        if loads.shape != (angles.size, 3):
            raise ManoeuvreError(f"load must have shape ({angles.size}, 3), a row for each angle, got {loads.shape}")
        new_state = _runge_kutta(state.copy(), angles, loads, STEP, self._compiled)
        if not math.isfinite(new_state.sum()):
            raise SimulationError(
                f"plant {self.name}: the motion is no longer finite after x = {state[0]:.1f} m, {state[3]:.1f} m/s: "
                "a wheel left the ground or locked; drive more slowly or a longer path"
            )
        return new_state

    def measure(self, state: np.ndarray, side_force: float = 0.0) -> Measurement:
        """Return the measurements under a side force, N; accelerometers do not show gravity."""
        return Measurement._make(_read_sensors(state, side_force, self.trail, self._compiled))


@dataclass(frozen=True)
class MultiBody(Plant):
    """Multi-body model, 29 states: roll, pitch, four wheels, suspension, combined-slip tyres (BMW 320i)."""

    name: ClassVar[str] = "multi-body"

    def _states(self, core: list[float]) -> list[float]:
        return init_mb(core, self.parameters)


@dataclass(frozen=True)
class SingleTrackDrift(Plant):
    """Single-track drift model, 9 states: combined-slip tyres, wheel spin, no roll or load transfer (BMW 320i)."""

    name: ClassVar[str] = "single-track"

    def _states(self, core: list[float]) -> list[float]:
        return init_std(core, self.parameters)


@jit(error_model="numpy")
def _rates(x: np.ndarray, p: Any, u: np.ndarray, load: np.ndarray, out: np.ndarray) -> None:
    """Write the rates of the library's states under cruise control; wheel angle and set speed are constant."""
    n = x.size - 1
    u[0], u[1] = 0.0, CRUISE_GAIN * (x[n] - x[3])
    rate = multi_body(x, u, p) if n == MULTI_BODY_STATES else single_track_drift(x, u, p)
    for i in range(n):
        out[i] = rate[i]
    out[n] = 0.0
    acceleration = load[0] / p.m + load[2]
    out[5] += load[1] / p.I_z  # no product of inertia: I_xz_s is 0
    if n == MULTI_BODY_STATES:
        for i in (10, 15, 20):  # lateral speeds of body and axles
            out[i] += acceleration
    elif acceleration != 0.0:
        out[3] += acceleration * math.sin(x[6])
        out[6] += acceleration * math.cos(x[6]) / x[3]


@jit(error_model="numpy")
def _runge_kutta(
    x: np.ndarray, wheel_angle: np.ndarray, loads: np.ndarray, h: float, records: np.ndarray
) -> np.ndarray:
    """Return the state after classical fourth-order Runge-Kutta steps, one for each wheel angle and load."""
    n, p = x.size, records[0]
    k1, k2, k3, k4, u = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.zeros(2)
    for step in range(wheel_angle.size):
        x[2], load = wheel_angle[step], loads[step]
        _rates(x, p, u, load, k1)
        for dt, previous, rates in ((h / 2, k1, k2), (h / 2, k2, k3), (h, k3, k4)):
            _rates(x + dt * previous, p, u, load, rates)
        x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return x


@jit(error_model="numpy")
def _read_sensors(x: np.ndarray, side_force: float, trail: float, records: np.ndarray) -> tuple[float, ...]:
    """Return the fields of `Measurement`."""
    rate, p = np.empty(x.size), records[0]
    _rates(x.copy(), p, np.zeros(2), np.zeros(3), rate)
    if x.size - 1 == MULTI_BODY_STATES:
        speed, lateral_speed = x[3], x[10]
        force = p.m_s * rate[10] + p.m_uf * rate[15] + p.m_ur * rate[20] + p.m * x[5] * x[3]
    else:
        cosine, sine = math.cos(x[6]), math.sin(x[6])
        lateral_speed = x[3] * sine
        speed = math.sqrt(x[3] ** 2 - lateral_speed**2)
        force = p.m * (rate[3] * sine + x[3] * cosine * (rate[6] + x[5]))
    slip, acceleration = math.atan2(lateral_speed, speed), (force + side_force) / p.m
    moment = trail * (p.b * force + p.I_z * rate[5]) / (p.a + p.b)
    return x[0], x[1], x[4], speed, lateral_speed, x[5], acceleration, slip, moment
