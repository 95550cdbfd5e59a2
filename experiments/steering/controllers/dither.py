"""Dither: a fast oscillation on top of SMC's command that keeps the wheel moving through the clearance.

A sine whose amplitude at the wheel is about the half-gap makes of the play, averaged over its period, a smooth
characteristic (Zames and Shneydor, Dither in nonlinear systems, IEEE Trans. Automatic Control 21, 1976). Its price is
the motion of the servo, the rack and the driver's hands.
"""

import math
from dataclasses import dataclass
from pathlib import Path

from clearance_mj.vehicle.controllers import smc
from clearance_mj.vehicle.controllers.base import ControllerRun, Observation, Task, limited
from clearance_mj.vehicle.controllers.registry import Registration, register
from clearance_mj.vehicle.controllers.smc import SlidingMode


@dataclass(frozen=True)
class SlidingWithDither(SlidingMode):
    """Sliding mode control with dither on its command."""

    amplitude: float = 0.003  # rad of the command
    frequency: float = 8.0  # Hz

    def start(self, task: Task) -> ControllerRun:  # type: ignore[override]
        """Begin a run."""
        return _DitheredRun(task, super().start(task), self.amplitude, self.frequency)


class _DitheredRun(ControllerRun):
    def __init__(self, task: Task, inner: ControllerRun, amplitude: float, frequency: float):
        self._task, self._inner, self._amplitude = task, inner, amplitude
        self._turn, self._phase, self._last = 2 * math.pi * frequency * task.period, 0.0, 0.0

    def command(self, seen: Observation) -> float:
        """Return the other controller's command and the dither's."""
        self._phase += self._turn
        dithered = self._inner.command(seen) + self._amplitude * math.sin(self._phase)
        self.excess, self.depth = self._inner.excess, self._inner.depth
        self._last = limited(dithered, self._last, self._task)
        return self._last


BOUNDS = smc.BOUNDS | {"amplitude": (1e-4, 0.02), "frequency": (3.0, 25.0)}
register(
    Registration(
        "smc-dither", "SMC, dither", SlidingWithDither, bounds=BOUNDS, tuned_as="smc", colour="#ddaa33",
        line=(0, (3, 1, 1, 1)), settings_file=Path(__file__).with_name("tuned.toml"),
    )
)  # fmt: skip
