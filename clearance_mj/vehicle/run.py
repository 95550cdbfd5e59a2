"""Simulation of a vehicle along a path under a controller, and the metrics of the run.

Steering effort: rate and reversals of an angle.
"""

from __future__ import annotations

import math
import time as clock
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import scipy.signal

from ..core.errors import SimulationError
from .controllers.base import Controller, Observation, Task
from .controllers.compensation import Direction
from .disturbances import Disturbance
from .nominal import Vehicle
from .path import Path
from .plant import STEP, Plant
from .sensors import IdealSensors, Sensors
from .steering import Steering

__all__ = ["FAST_STEERING", "REVERSAL", "RateSpectrum", "Run", "effort", "follow_path", "nominal_task", "rate_spectrum"]

LARGEST_ERROR = 5.0  # m, lateral error at which a run stops, having left the path


@dataclass(frozen=True, eq=False)
class Run:
    """Histories of a run, one sample for each command."""

    time: np.ndarray  # (n,) s
    position: np.ndarray  # (n, 2) of the centre of gravity, m
    s: np.ndarray  # (n,) m, arc length of the foot point
    e_y: np.ndarray  # (n,) m, lateral position error
    e_psi: np.ndarray  # (n,) rad, heading error
    yaw_rate: np.ndarray  # (n,) rad/s
    yaw_rate_error: np.ndarray  # (n,) rad/s, from v κ at the foot point
    lateral_acceleration: np.ndarray  # (n,) m/s²
    sideslip: np.ndarray  # (n,) rad
    command: np.ndarray  # (n,) rad, road-wheel angle that the controller commands
    servo_angle: np.ndarray  # (n,) rad, before the clearance, at the end of each period
    wheel_angle: np.ndarray  # (n,) rad, at the end of each period
    contact: np.ndarray  # (n,) -1, 0, 1: the side of the clearance in contact at the end of each period
    depth: np.ndarray  # (n,) |s|/Φ of a sliding mode, NaN without one
    controller_time: np.ndarray = field(repr=False)  # (n,) s of computing for each command; differs in a repeated run

    def metrics(self) -> dict[str, float]:
        """Return the metrics by which controllers are compared.

        Peak, RMS and 95th percentile of |e_y| (m) and |e_ψ| (rad); peak yaw rate and its error (rad/s), lateral
        acceleration (m/s²) and sideslip (rad); peak rate (rad/s) and total variation (rad) of the wheel angle and RMS
        of its rate above 3 Hz (rad/s); the servo's effort: RMS of its rate, all and above 3 Hz (rad/s), and number of
        its reversals by more than 1° of the hand wheel; number of times the contact changed sides; fraction of the time
        that a sliding mode was outside its boundary layer, NaN for other controllers.
        """
        metrics = {}
        for name in ("e_y", "e_psi"):
            values = np.abs(getattr(self, name))
            metrics[f"peak_{name}"] = values.max()
            metrics[f"rms_{name}"] = np.sqrt(np.mean(values**2))
            metrics[f"p95_{name}"] = np.percentile(values, 95)
        peaks = ("yaw_rate", "yaw_rate_error", "lateral_acceleration", "sideslip")
        metrics |= {f"peak_{name}": np.abs(getattr(self, name)).max() for name in peaks}
        steps, sides = np.diff(self.wheel_angle), self.contact[self.contact != 0]
        metrics["peak_steer_rate"] = np.abs(steps / np.diff(self.time)).max()
        metrics["steer_variation"] = np.abs(steps).sum()
        period = self.time[1] - self.time[0]
        metrics["fast_wheel_rate"] = rate_spectrum(self.wheel_angle, period).rms_above(FAST_STEERING)
        metrics |= {f"servo_{name}": value for name, value in effort(self.servo_angle, period).items()}
        metrics["contact_reversals"] = np.count_nonzero(np.diff(sides))
        metrics["outside_layer"] = np.mean(np.where(np.isnan(self.depth), np.nan, self.depth > 1))
        return {name: float(value) for name, value in metrics.items()}

    def wheel_rate_spectrum(self) -> RateSpectrum:
        """Estimate the power spectral density of the road wheel's rate, by Welch's method."""
        return rate_spectrum(self.wheel_angle, self.time[1] - self.time[0])

    def servo_rate_spectrum(self) -> RateSpectrum:
        """Estimate the power spectral density of the servo's rate, by Welch's method."""
        return rate_spectrum(self.servo_angle, self.time[1] - self.time[0])

    def timing(self) -> dict[str, float]:
        """Return median and worst computing time of a command, s; the first ones, which compile, are left out."""
        settled = self.controller_time[5:]
        return {"median": float(np.median(settled)), "worst": float(settled.max())}


def nominal_task(path: Path, speed: float, trail: float = 0.045, **settings: Any) -> Task:
    """Return the default task of controllers: BMW 320i, the steering's datasheet without clearance.

    Speed in m/s, trail of the aligning moment that reaches the shaft in m; settings are other fields of `Task`.
    """
    steering = Steering().lost_motion
    vehicle = Vehicle.bmw320i(trail).with_steering(steering.stiffness + steering.shaft_stiffness)
    return Task(vehicle, path, speed, **settings)


def follow_path(
    plant: Plant, steering: Steering, controller: Controller, task: Task, sensors: Sensors | None = None,
    seed: int = 0, disturbance: Disturbance | None = None,
) -> Run:  # fmt: skip
    """Simulate a vehicle along the task's path, from its start to its end; `SimulationError` if it leaves the path.

    The seed is that of the noise of sensors, road and disturbance; without sensors the controller sees the
    truth.
    """
    path, period = task.path, task.period
    x, y = path.position(0.0)
    state = plant.start(task.speed, (float(x), float(y), float(path.heading(0.0))))
    wheel, run = steering.start(seed), controller.start(task)
    sensing = (sensors or IdealSensors()).start(task, seed)
    s, command, rows = 0.0, 0.0, []
    samples, steps = int(1.5 * path.length / task.speed / period), round(period / STEP)
    history = disturbance.load(task.speed, samples * steps, seed) if disturbance else np.zeros((samples * steps, 3))
    for k in range(samples):
        loads = history[k * steps : (k + 1) * steps]
        m = plant.measure(state, loads[0, 0])
        s, e_y, heading, curvature = path.locate(m.x, m.y, s)
        if s >= path.length - task.speed * period:
            break
        if abs(e_y) > LARGEST_ERROR:
            raise SimulationError(
                f"the vehicle left the path at s = {s:.1f} m, t = {k * period:.2f} s: {e_y:+.1f} m off"
            )
        e_psi = (m.heading - heading + np.pi) % (2 * np.pi) - np.pi
        true = Observation(s, e_y, e_psi, m.lateral_speed, m.yaw_rate, m.speed)
        seen = sensing.observe(true, m, wheel.angle, command)
        start = clock.perf_counter()
        command = run.command(seen)
        seconds = clock.perf_counter() - start
        angles = wheel.advance(command, m.aligning_moment, period)
        state = plant.advance(state, angles, loads)
        motion = m.yaw_rate, m.yaw_rate - m.speed * curvature, m.lateral_acceleration, m.sideslip
        steering_values = command, wheel.angle, angles[-1], wheel.contact[-1], run.depth
        rows.append((k * period, m.x, m.y, s, e_y, e_psi, *motion, *steering_values, seconds))
    columns = np.array(rows).T
    return Run(columns[0], columns[1:3].T, *columns[3:])


REVERSAL = math.radians(1.0 / 16.0)
"""Angle at the road wheel, rad, by which a reversal turns back: 1° of the hand wheel."""
FAST_STEERING = 3.0  # Hz, above which no path asks for steering: a slalom at 80 km/h needs 0.35 Hz, a driver up to 2.
SEGMENT = 256  # samples of a segment of the spectrum, 2.56 s at 100 Hz


class RateSpectrum(NamedTuple):
    """One-sided power spectral density of an angle's rate."""

    frequency: np.ndarray  # (n_f,) Hz
    density: np.ndarray  # (n_f,) (rad/s)²/Hz

    def rms_above(self, frequency: float) -> float:
        """Return the RMS of the rate's part above a frequency, Hz, in rad/s."""
        step = self.frequency[1] - self.frequency[0]
        return float(np.sqrt(self.density[self.frequency > frequency].sum() * step))


def rate_spectrum(angle: np.ndarray, period: float) -> RateSpectrum:
    """Estimate the spectrum of the rate of an angle, rad (n,), sampled at a period, s.

    Welch's method on the differences from sample to sample: Hann windows of 256 samples that overlap by half; a shorter
    history is one segment. Welch, IEEE Trans. Audio Electroacoust. 15, 1967.
    """
    rate = np.diff(angle) / period
    return RateSpectrum(*scipy.signal.welch(rate, 1 / period, "hann", min(SEGMENT, rate.size), detrend="constant"))


def effort(angle: np.ndarray, period: float) -> dict[str, float]:
    """Return RMS rate and its part above `FAST_STEERING`, rad/s, and the number of reversals of an angle, rad (n,).

    A reversal is a change of direction by more than `REVERSAL`; the period of sampling is in s.
    """
    direction = Direction(REVERSAL)
    signs = np.array([direction.advance(value) for value in (angle - angle[0]).tolist()])
    return {
        "rms_rate": float(np.sqrt(np.mean((np.diff(angle) / period) ** 2))),
        "fast_rate": rate_spectrum(angle, period).rms_above(FAST_STEERING),
        "reversals": float(np.count_nonzero(np.diff(signs[signs != 0]))),
    }
