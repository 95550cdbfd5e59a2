"""Running clearances under unbalance, after API Standard 617: the scaled major axis beside 75 % of the clearance.

The unbalance is scaled until the largest vibration at a probe, peak to peak and at operating speeds, is the vibration
limit of 25.4 µm √(12000/N), at most 25.4 µm, N the maximum continuous speed in rev/min. So scaled, the major axis of
the synchronous orbit, peak to peak, must leave a quarter of every diametral clearance free at all speeds up to the
trip.

Source: API Standard 617 (9th edition, 2022), 6.8.2.11, as petrobras/ross #1377 quotes it, "or 25.4 µm (1 mil),
whichever is less". The scale's bounds, 0.5 and 6, are those that petrobras/ross quoted of the 8th edition, Part 1,
4.8.2.11; #1377 has no lower one. The text of the standard is not public.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import RigError
from ..core.kinds import checks_kinds
from ..rig import Rig
from .turning import turning_shaft
from .whirling import require_round

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .whirling import Whirl

__all__ = ["RunningClearance", "running_clearance"]

RPM = 30 / math.pi
SHARE = 0.75  # of a diametral clearance that an orbit may take
LIMIT, AT_SPEED = 25.4e-6, 12000.0  # m, peak to peak, at rev/min
SCALES = 0.5, 6.0  # smallest and largest
STILL = 1e-15  # m, of vibration that is rounding


@dataclass(frozen=True, eq=False)
class RunningClearance:
    """Orbits under unbalance beside the clearances of a shaft that touches none. Made by `running_clearance`."""

    rig: Rig
    """the rig"""
    speed: np.ndarray
    """(n_speeds,) spin, rad/s, up to the trip"""
    operating: tuple[float, float]
    """rad/s, minimum operating and maximum continuous speed"""
    vibration: np.ndarray
    """(n_probes, n_speeds) m, peak to peak along y or z, the larger one, under the rig's own unbalances"""
    major: np.ndarray
    """(n_bushings, n_speeds) m, major axis, peak to peak, of the larger of both ends, under the rig's own unbalances"""

    @property
    def limit(self) -> float:
        """Vibration limit, m, peak to peak: 25.4 µm √(12000/N), at most 25.4 µm."""
        return LIMIT * min(1.0, math.sqrt(AT_SPEED / (RPM * self.operating[1])))

    @property
    def scale(self) -> float:
        """What the unbalances are multiplied by: vibration limit over the largest vibration at operating speeds."""
        return min(max(self.limit / self._largest, SCALES[0]), SCALES[1])

    @property
    def _largest(self) -> float:
        """The largest vibration at operating speeds, m."""
        first, last = self.operating
        return float(np.max(self.vibration[:, (self.speed >= first) & (self.speed <= last)]))

    @property
    def allowed(self) -> np.ndarray:
        """(n_bushings,) m, three quarters of each diametral clearance."""
        return SHARE * 2 * np.array([bushing.gap for bushing in self.rig.bushings])

    @property
    def used(self) -> np.ndarray:
        """(n_bushings, n_speeds) scaled major axis over what is allowed; above 1 the criterion is not met."""
        return self.scale * self.major / self.allowed[:, None]

    @property
    def holds(self) -> np.ndarray:
        """(n_bushings,) whether the criterion is met at all speeds."""
        return np.asarray(np.max(self.used, axis=1) <= 1)

    @property
    def scaled_rig(self) -> Rig:
        """The rig with its unbalances multiplied by `scale`, for simulations in which it touches."""
        scaled = (dataclasses.replace(u, moment=self.scale * u.moment) for u in self.rig.unbalances)
        return self.rig.replace(unbalances=tuple(scaled))

    def plot(self, touching: Whirl | None = None) -> Figure:
        """Draw scaled major axes over speed, beside what is allowed and the clearances.

        Parameters
        ----------
        touching : Whirl, optional
            Of a simulated run-up of `scaled_rig`: the major axis of every turn's motion with the spin is drawn, too.
        """
        from ..core.drawing import COLOURS, FAINT, REPEAT, TEST, canvas, key, tidy

        n = len(self.rig.bushings)
        figure = canvas(0.6 + 2.8 * n)
        panels = figure.subplots(n, 1, sharex=True, squeeze=False)[:, 0]
        for j, (ax, bushing) in enumerate(zip(panels, self.rig.bushings)):
            ax.axvspan(*(RPM * speed for speed in self.operating), color=FAINT, alpha=0.5, label="operating speeds")
            if touching is not None:
                orbits = touching.orbits(j)
                forward, backward = orbits.harmonic()
                axis = 2e6 * (np.abs(forward) + np.abs(backward))
                ax.plot(RPM * np.abs(orbits.speed), axis, ".", color=REPEAT, ms=2, label="run-up, may touch")
            ax.plot(RPM * self.speed, 1e6 * self.scale * self.major[j], color=COLOURS[0], label="without contact")
            ax.axhline(1e6 * self.allowed[j], color=COLOURS[1], label="75 % of the clearance")
            ax.axhline(2e6 * bushing.gap, color=TEST, linestyle="--", linewidth=0.9, label="diametral clearance")
            ax.set_yscale("log")
            last = ax is panels[-1]
            tidy(ax, f"bushing {j + 1}, {bushing.where}", "Major axis (µm p-p)", "Spin (rev/min)" if last else "")
        key(figure, panels[0].get_legend_handles_labels()[0])
        return figure


@checks_kinds
def running_clearance(
    rig: Rig, speeds: Sequence[float] | np.ndarray, operating: Sequence[float], n_modes: int = 16
) -> RunningClearance:
    """Find the orbits of a shaft under its unbalances over its speed, for the clearance criterion of API Standard 617.

    The bushings are filled and not in contact; vibration is read at the rig's sensors, along y and z.

    Parameters
    ----------
    rig : Rig
        With ``motion = "spatial"``, bushings and unbalances.
    speeds : sequence of float
        Rising spins, rad/s, up to the trip speed; close enough to show every resonance.
    operating : sequence of float, length 2
        rad/s, minimum operating speed and maximum continuous speed.
    n_modes : int
        Modes of each plane in the shaft's reduction.

    Raises
    ------
    RigError
        If something of this is missing, no speed is an operating speed, or nothing vibrates at one.
    RecordError
        If the rig is planar or has no bushings.
    """
    require_round(rig)
    speed = np.array(speeds, dtype=float)
    if speed.ndim != 1 or speed.size < 2 or not np.isfinite(speed).all() or np.any(np.diff(speed) <= 0):
        raise RigError(f"speeds must be rising spins in rad/s, got {speeds!r}")
    first, last = map(float, operating)
    if not 0 <= first < last or not np.any((speed >= first) & (speed <= last)):
        ends = speed[[0, -1]]
        raise RigError(
            f"operating speeds {first:g} to {last:g} rad/s: must rise, with some of the speeds "
            f"({ends[0]:g} to {ends[1]:g} rad/s) between them"
        )
    if not rig.unbalances:
        raise RigError(f"rig {rig.name!r} has no unbalances, under which API 617 asks for its orbits; give one")
    shaft, n_probes = turning_shaft(rig, n_modes), len(rig.sensors)
    points = [float(sensor.position) for sensor in rig.sensors]
    points += [float(b.position) + side * b.length / 2 for b in rig.bushings for side in (-1, 1)]
    moved = np.zeros((speed.size, len(points), 2), dtype=complex)
    for u in rig.unbalances:
        moved += np.exp(1j * u.phase) * shaft.unbalance_response(speed, float(u.position), u.moment, points)
    y, z = moved[:, :, 0].T, moved[:, :, 1].T
    vibration = 2 * np.maximum(np.abs(y), np.abs(z))[:n_probes]
    axis = (np.abs(y + 1j * z) + np.abs(y - 1j * z))[n_probes:].reshape(-1, 2, speed.size)
    found = RunningClearance(rig, speed, (first, last), vibration, np.max(axis, axis=1))
    if not found._largest > STILL:
        raise RigError(f"rig {rig.name!r}: no sensor moves at operating speeds, so there is nothing to scale")
    return found
