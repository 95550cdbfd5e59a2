"""Campbell diagrams: natural frequencies of a turning shaft over its spin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..core.kinds import checks_kinds
from ..linear import Poles
from ..rig import Rig
from .api_617 import RPM, draw_margins, with_margins
from .turning import TurningShaft, rising, turning_shaft

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

__all__ = ["Campbell", "campbell", "whirl_names"]

WHIRLS = 0.5  # sense above which a motion is forward, and below whose negative it is backward
BACKWARD = -0.999  # sense below which a motion is backward everywhere, so that unbalance does no work on it
SHOWN = 1.25  # largest drawn frequency over the largest spin
TINY = 1e-12  # damping ratio


def whirl_names(sense: np.ndarray) -> np.ndarray:
    """Return "forward", "backward" or "in a plane" for each sense of a motion, see `TurningShaft.sense`.

    Parameters
    ----------
    sense : ndarray
        1 forward, -1 backward, 0 in a plane.
    """
    return np.select([sense > WHIRLS, sense < -WHIRLS], ["forward", "backward"], "in a plane")


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
    """(n_modes, n_speeds), below 0 where the motion is unstable"""
    sense: np.ndarray
    """(n_modes, n_speeds) 1 forward, -1 backward, 0 in a plane; at rest that of the next speed"""
    operating: tuple[float, float] | None = None
    """rad/s, minimum operating speed and maximum continuous speed, from which margins count; None: not known"""

    @property
    def threshold(self) -> float | None:
        """Lowest spin, rad/s, above which the shaft is unstable; None where it is stable at all speeds."""
        return self.shaft.threshold(self.speed)

    @property
    def criticals(self) -> pd.DataFrame:
        """Critical speeds up to the highest speed: a row for each, with the columns of `with_margins`.

        ``damping_ratio`` is that of the damped motion at this spin, and ``amplification_factor`` half its inverse, as
        by half-power points of an isolated peak; 0 for a backward whirl, which no unbalance excites.
        """
        import pandas as pd

        critical = self.shaft.critical_motions
        value, motion = critical
        undamped = [critical.selected([j]) for j in np.flatnonzero(value.imag <= self.speed[-1]).tolist()]
        damped = np.array([_continue_poles(each, self.shaft.poles(each.value[0].imag)).value[0] for each in undamped])
        speed, sense = (part[: damped.size] for part in (value.imag, self.shaft.sense(motion)))
        damping = -damped.real / np.abs(damped)
        factor = np.where(sense > BACKWARD, 0.5 / np.maximum(damping, TINY), 0.0)
        columns = {"spin_rad_s": speed, "spin_rev_min": RPM * speed, "whirl": whirl_names(sense)}
        columns |= {"damping_ratio": damping, "amplification_factor": factor}
        return with_margins(pd.DataFrame(columns), self.operating)

    def plot(self) -> Figure:
        """Draw frequencies over spin up to a little above 1X, with critical speeds on it and unstable motions."""
        from ..core.drawing import COLOURS, FONT, REPEAT, TEST, canvas, key, tidy

        figure = canvas(3.8)
        ax = figure.subplots()
        rpm, whirls, criticals = RPM * self.speed, whirl_names(self.sense), self.criticals
        draw_margins(ax, self.operating, criticals)
        styles = {"forward": (COLOURS[0], "-"), "backward": (COLOURS[1], "--"), "in a plane": (REPEAT, "-.")}
        for name, (colour, style) in styles.items():
            lines = np.where(whirls == name, self.frequency, np.nan)
            if np.isfinite(lines).any():
                ax.plot(rpm, lines.T, style, color=colour, linewidth=1.6, label=name)
        unstable = self.damping_ratio < 0
        if self.threshold is not None:
            ax.plot(np.tile(rpm, len(unstable))[unstable.ravel()], self.frequency[unstable], "x", color=TEST,
                    markersize=5, label="grows by itself")  # fmt: skip
        ax.plot(rpm, rpm / 60, color=TEST, linewidth=0.9, linestyle=":", label="spin (1X)")
        for at, name in zip(criticals.spin_rev_min, criticals.whirl):
            ax.plot(at, at / 60, "o", color=TEST, mfc=styles[name][0], markersize=5, label="critical speed")
            ha, x, y = ("left", 4, -9) if name == "backward" else ("right", -4, 5)
            ax.annotate(f"{at:.0f}", (at, at / 60), (x, y), textcoords="offset points", fontsize=FONT - 1, ha=ha)
        ax.set(xlim=rpm[[0, -1]], ylim=(0.0, max(SHOWN * rpm[-1] / 60, 1.1 * float(np.min(self.frequency)))))
        tidy(ax, "", "Natural frequency (Hz)", "Spin (rev/min)")
        key(figure, ax.get_legend_handles_labels()[0])
        return figure


@checks_kinds
def campbell(
    rig: Rig, speeds: Sequence[float] | np.ndarray, n: int = 8, n_modes: int = 16,
    operating: tuple[float, float] | None = None,
) -> Campbell:  # fmt: skip
    """Follow the natural frequencies of a rig's shaft over its spin, its bushings filled and not in contact.

    Parameters
    ----------
    rig : Rig
        A rig with a beam or one shaft, round or square.
    speeds : sequence of float
        Rising spins, rad/s.
    n : int
        Number of followed modes, the lowest ones at the first speed.
    n_modes : int
        Modes of each plane in the shaft's reduction.
    operating : tuple of float, optional
        rad/s, minimum operating speed and maximum continuous speed, from which separation margins count.

    Raises
    ------
    RigError
        If speeds do not rise, or the structure is no such shaft.
    """
    speed, shaft = rising(speeds), turning_shaft(rig, n_modes)
    followed = [shaft.poles(speed[0]).selected(slice(n))]
    for spin in speed[1:]:
        followed.append(_continue_poles(followed[-1], shaft.poles(spin)))
    value = np.array([poles.value for poles in followed]).T
    sense = np.array([shaft.sense(poles.motion) for poles in followed]).T
    if speed[0] == 0:  # the planes of two equal modes of a shaft at rest are arbitrary
        sense[:, 0] = sense[:, min(1, speed.size - 1)]
    return Campbell(shaft, speed, value.imag / (2 * np.pi), -value.real / np.abs(value), sense, operating)


def _continue_poles(before: Poles, now: Poles) -> Poles:
    """Select the poles that continue others: nearest in frequency and motion."""
    unit = [poles.motion / np.linalg.norm(poles.motion, axis=0) for poles in (before, now)]
    mac = np.abs(unit[0].conj().T @ unit[1]) ** 2
    distance = np.abs(np.log(now.value.imag / before.value.imag[:, None]))
    return now.selected(linear_sum_assignment(distance + 0.1 * (1 - mac))[1])
