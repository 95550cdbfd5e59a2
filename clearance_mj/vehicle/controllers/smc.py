"""Sliding mode control of the lateral error at a point ahead of the vehicle.

e = e_y + L_s (e_ψ + β_ss), β_ss the sideslip of a steady turn; s = de/dt + λ e. With the design model
d²e/dt² = f + b δ, b = C_f/m + L_s C_f l_f/I_z, the boundary-layer controller is

    δ = (-f - λ de/dt - k₁ s - k₂ sat(s/Φ)) / b.

(Slotine and Li, Applied Nonlinear Control, 1991, chapter 7.) e at the centre of gravity (L_s = 0) has poorly damped
zeros; a point a few metres ahead has not. All is evaluated for the time when the wheel has responded to the command,
which includes the servo in the design. Where the path requires faster steering than the servo's rate limit, errors are
those from an averaged path (`feasible_path`).
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

from .base import Controller, Observation, Task
from .clearance_model import PRIOR, with_clearance_model
from .design import DesignModel, ModelRun
from .feasible_path import FeasiblePath
from .registry import Registration, register

__all__ = ["SlidingMode"]


def input_gain(model: DesignModel, look_ahead: float) -> float:
    """Return d²e/dt² over the wheel angle, b, m/s², of a point L_s ahead."""
    A, _, _ = model.continuous
    return float(A[2, 4] + look_ahead * A[3, 4])


def saturation(value: float) -> float:
    """Return ``value`` within -1..1."""
    return min(max(value, -1.0), 1.0)


class SlidingRun(ModelRun):
    """The sliding surface of all sliding mode controllers; their settings have look_ahead, convergence and layer."""

    def __init__(self, task: Task, settings: Any):
        super().__init__(task)
        A, _, _ = self.model.continuous
        self._motion, self.settings = A[2:4, 2:4].tolist(), settings
        self._gain = input_gain(self.model, settings.look_ahead)
        self._path = FeasiblePath(task, self.model)
        self.sliding = 0.0
        """s at the last sample, m/s"""

    def surface(self, seen: Observation) -> tuple[float, float]:
        """Return s, m/s, and ds/dt without steering, f + λ de/dt, m/s², when the wheel has responded."""
        e_y, e_psi, lateral_speed, yaw_rate, _, _ = self.predictor.predicted(seen).tolist()
        speed, look_ahead, sideslip = seen.speed, self.settings.look_ahead, self.model.steady_sideslip
        offset, heading, curvature, turning, bending = self._path.ahead(seen)
        e_y, e_psi = e_y - offset, e_psi - heading
        error = e_y + look_ahead * (e_psi + sideslip * curvature)
        rate = lateral_speed + speed * e_psi + look_ahead * (yaw_rate - speed * curvature + sideslip * turning)
        lateral, yaw = (by_speed * lateral_speed + by_rate * yaw_rate for by_speed, by_rate in self._motion)
        drift = lateral + speed * (yaw_rate - speed * curvature)
        drift += look_ahead * (yaw - speed * turning + sideslip * bending)
        return rate + self.settings.convergence * error, drift + self.settings.convergence * rate

    def wheel_angle(self, seen: Observation) -> float:
        """Cancel the drift and approach the surface."""
        self.sliding, drift = self.surface(seen)
        self.depth = abs(self.sliding) / self.settings.layer
        return (-drift - self.reaching(self.sliding)) / self._gain

    @abstractmethod
    def reaching(self, value: float) -> float:
        """Return the reaching term, m/s², which takes s to zero."""


@dataclass(frozen=True)
class SlidingMode(Controller):
    """Sliding mode control with a boundary layer."""

    look_ahead: float = 3.0  # L_s, m
    convergence: float = 4.0  # λ, 1/s
    reaching: float = 4.0  # k₁, 1/s
    switching: float = 1.0  # k₂, m/s²
    layer: float = 0.3  # Φ, half the boundary layer, m/s

    def start(self, task: Task) -> SlidingRun:
        """Begin a run."""
        return _BoundaryLayer(task, self)


class _BoundaryLayer(SlidingRun):
    def reaching(self, value: float) -> float:
        p: SlidingMode = self.settings
        return p.reaching * value + p.switching * saturation(value / p.layer)


SURFACE_BOUNDS = {"look_ahead": (1.0, 10.0), "convergence": (1.0, 15.0)}
BOUNDS = SURFACE_BOUNDS | {"reaching": (0.5, 20.0), "switching": (0.05, 5.0), "layer": (0.05, 2.0)}
register(Registration("smc", "SMC", SlidingMode, bounds=BOUNDS, colour="#d55e00"))
_CM: dict[str, Any] = {"bounds": BOUNDS, "tuned_as": "smc", "adapt": with_clearance_model, "prior": PRIOR}
register(Registration("smc-cm", "SMC-CM", SlidingMode, colour="#0072b2", **_CM))
