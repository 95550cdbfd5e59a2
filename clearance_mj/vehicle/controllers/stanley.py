"""The steering law of the vehicle Stanley: heading error, front axle's lateral error, damping of yaw and of steering.

With e_f and e_ψf the errors of the front axle from its foot point on the path,

    δ = -(e_ψf - ψ_ss) - atan(k e_f/(k_s + v)) + k_d (vκ - r) + k_a (δ(i) - δ(i+1)),
    ψ_ss = m v² κ l_r/(L C_f),

ψ_ss the heading of a front axle that follows a curve with side slip, from the nominal vehicle. Errors are those
when the wheel has responded to the command, as with every controller here.

Hoffmann, Tomlin, Montemerlo and Thrun, Autonomous automobile trajectory tracking for off-road driving, American
Control Conference 2007 (k_s, k_d, k_a: its k_soft, k_d,yaw and k_d,steer).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .base import Controller, Observation, Task
from .design import ModelRun
from .registry import Registration, register

__all__ = ["Stanley"]


@dataclass(frozen=True)
class Stanley(Controller):
    """Stanley's law; no model of the vehicle but its steady slip."""

    gain: float = 2.0  # k, 1/s
    softening: float = 1.0  # k_s, m/s
    yaw: float = 0.1  # k_d, s
    steer: float = 0.1  # k_a, factor on the servo's last change

    def start(self, task: Task) -> ModelRun:
        """Begin a run."""
        return _StanleyRun(task, self)


class _StanleyRun(ModelRun):
    def __init__(self, task: Task, settings: Stanley):
        super().__init__(task)
        p, self._settings, self._last_servo = task.vehicle, settings, 0.0
        self._front = p.lf
        self._slip = p.mass * p.lr / (p.wheelbase * p.cornering_front)
        self._lead_time = np.array([task.lead * task.period])

    def wheel_angle(self, seen: Observation) -> float:
        """Evaluate the law."""
        p, v = self._settings, seen.speed
        e_y, e_psi, _, yaw_rate, _, _ = self.predictor.predicted(seen).tolist()
        curvature = float(self.task.curvature(seen, self._lead_time)[0])
        lateral = e_y + self._front * math.sin(e_psi)
        heading = e_psi - self._front * curvature
        servo = float(self.predictor.state(seen)[4])
        change, self._last_servo = servo - self._last_servo, servo
        cross = math.atan(p.gain * lateral / (p.softening + v))
        return self._slip * v**2 * curvature - heading - cross + p.yaw * (v * curvature - yaw_rate) - p.steer * change


BOUNDS = {"gain": (0.3, 30.0), "softening": (0.1, 20.0), "yaw": (0.005, 1.0), "steer": (0.01, 10.0)}
register(Registration("stanley", "Stanley", Stanley, bounds=BOUNDS, colour="#000000", line="-."))
