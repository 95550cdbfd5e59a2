"""Campbell diagrams: natural frequencies of a turning shaft over its spin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..core.errors import RigError
from ..core.kinds import checks_kinds
from ..rig import Rig
from .turning import Poles, TurningShaft, turning_shaft

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Campbell", "campbell"]

WHIRLS = 0.5  # sense above which a motion counts as forward, and below the negative as backward


@dataclass(frozen=True, eq=False)
class Campbell:
    """Natural frequencies of a turning shaft over its spin; each row of an array is one mode, followed over speed."""

    shaft: TurningShaft
    """the shaft"""
    speed: np.ndarray
    """(n_speeds,) spin Ω, rad/s"""
    frequency: np.ndarray
    """(n_modes, n_speeds) Hz, of the damped motion"""
    damping_ratio: np.ndarray
    """(n_modes, n_speeds), below 0 where the motion grows"""
    sense: np.ndarray
    """(n_modes, n_speeds) 1 forward, -1 backward, 0 in a plane"""

    @property
    def threshold(self) -> float | None:
        """Lowest spin, rad/s, above which the shaft whirls by itself; None where it is stable at all speeds."""
        return self.shaft.threshold(self.speed)

    @property
    def critical_speeds(self) -> np.ndarray:
        """(m,) rad/s, up to the highest speed: spins that are a natural frequency of the undamped shaft."""
        found = self.shaft.critical_speeds
        return found[found <= self.speed[-1]]

    def plot(self) -> Figure:
        """Draw frequencies over spin, with the line of the spin itself, and where motions grow."""
        from ..core.drawing import COLOURS, REPEAT, TEST, canvas, key, tidy

        figure = canvas(3.6)
        ax = figure.subplots()
        rpm = self.speed * 30 / np.pi
        shown = {"forward": COLOURS[0], "backward": COLOURS[1], "in a plane": REPEAT}
        senses = self.sense.copy()
        senses[:, :1] = self.sense[:, 1:2]  # of two equal modes of a shaft at rest, the planes are any
        for frequency, sense in zip(self.frequency, senses):
            kind = np.select([sense > WHIRLS, sense < -WHIRLS], ["forward", "backward"], "in a plane")
            for name, colour in shown.items():
                ax.plot(rpm, np.where(kind == name, frequency, np.nan), color=colour, linewidth=1.6)
        for name, colour in shown.items():
            if name != "in a plane" or not (np.abs(senses) > WHIRLS).all():
                ax.plot([], [], color=colour, label=name)
        growing = self.damping_ratio < 0
        if self.threshold is not None:
            ax.plot(np.tile(rpm, len(growing))[growing.ravel()], self.frequency[growing], "x", color=TEST,
                    markersize=5, label="grows by itself")  # fmt: skip
        ax.plot(rpm, rpm / 60, color=TEST, linewidth=0.9, linestyle="--", label="spin")
        ax.set_ylim(0.0, 1.1 * float(np.max(self.frequency)))
        tidy(ax, "", "Natural frequency (Hz)", "Spin (rev/min)")
        key(figure, ax.get_legend_handles_labels()[0])
        return figure


@checks_kinds
def campbell(rig: Rig, speeds: Sequence[float] | np.ndarray, n: int = 8, n_modes: int = 16) -> Campbell:
    """Follow the natural frequencies of a rig's shaft over its spin, its bushings filled and not in contact.

    Parameters
    ----------
    rig : Rig
        A rig with a beam or one shaft, round or square.
    speeds : sequence of float
        Rising spins, rad/s.
    n : int
        Number of modes that are followed, the lowest ones at the first speed.
    n_modes : int
        Modes of each plane in the shaft's reduction.

    Raises
    ------
    RigError
        If speeds do not rise, or the structure is no such shaft.
    """
    speed = np.array(speeds, dtype=float)
    if speed.ndim != 1 or not speed.size or not np.isfinite(speed).all() or np.any(np.diff(speed) <= 0):
        raise RigError(f"speeds must be rising spins in rad/s, got {speeds!r}")
    shaft = turning_shaft(rig, n_modes)
    followed = [shaft.poles(speed[0])]
    followed[0] = Poles(followed[0].value[:n], followed[0].motion[:, :n])
    for spin in speed[1:]:
        followed.append(_next(followed[-1], shaft.poles(spin)))
    value = np.array([poles.value for poles in followed]).T
    sense = np.array([shaft.sense(poles.motion) for poles in followed]).T
    return Campbell(shaft, speed, value.imag / (2 * np.pi), -value.real / np.abs(value), sense)


def _next(before: Poles, now: Poles) -> Poles:
    """Those of the poles that continue others: alike in frequency and motion."""
    unit = [poles.motion / np.linalg.norm(poles.motion, axis=0) for poles in (before, now)]
    alike = np.abs(unit[0].conj().T @ unit[1]) ** 2
    apart = np.abs(np.log(now.value.imag / before.value.imag[:, None]))
    order = linear_sum_assignment(apart + 0.1 * (1 - alike))[1]
    return Poles(now.value[order], now.motion[:, order])
