"""After API Standard 617: response to unbalance, separation margins of critical speeds, running clearances.

A critical speed Nc with an amplification factor AF of 2.5 or more must lie below the minimum operating speed by
min(17 (1 - 1/(AF - 1.5)), 16) % of that, or above the maximum continuous speed by min(10 + 17 (1 - 1/(AF - 1.5)), 26) %
of that. AF = Nc/(N2 - N1), with N1 and N2 the speeds around the peak at which the response is 0.707 of it. Source: API
RP 684, SP6.8.2.1 and SP6.8.2.10, as petrobras/ross has them.

Running clearances: the scaled major axis is compared with 75 % of the clearance.
The unbalance is scaled until the largest vibration at a probe, peak to peak and at operating speeds, is the vibration
limit of 25.4 µm √(12000/N), at most 25.4 µm, N the maximum continuous speed in rev/min. So scaled, the major axis of
the synchronous orbit, peak to peak, must be at most three quarters of every diametral clearance at all speeds up to
the trip.

Source: API Standard 617 (9th edition, 2022), 6.8.2.11, as petrobras/ross #1377 quotes it, "or 25.4 µm (1 mil),
whichever is less". The scale's bounds, 0.5 and 6, are those that petrobras/ross quoted of the 8th edition, Part 1,
4.8.2.11; #1377 has no lower one. The text of the standard is not public.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.signal

from ..core.errors import RigError
from ..core.kinds import checks_kinds
from ..rig import Rig
from ..rig.sensing import sensor_points
from .turning import TurningShaft, rising, turning_shaft
from .whirling import require_round

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .whirling import Whirl

__all__ = [
    "RunningClearance", "UnbalanceResponse", "draw_margins", "running_clearance", "unbalance_response", "with_margins",
]  # fmt: skip

RPM = 30 / math.pi
SHARE = 0.75  # largest orbit over a diametral clearance
LIMIT, AT_SPEED = 25.4e-6, 12000.0  # m, peak to peak, at rev/min
SCALES = 0.5, 6.0  # smallest and largest
STILL = 1e-15  # m, vibration within rounding
NEAR = np.geomspace(1e-5, 0.3, 120)  # distances to a critical speed, over it, at which spins are added
LATE = 0.75  # of the largest drawn speed, beyond which text is on the left of a peak
PROMINENT = 0.01  # of a probe's largest amplitude: least prominence of a peak
HALF_POWER = 0.5**0.5
DAMPED = 2.5  # amplification factor below which a response is critically damped and needs no margin


def with_margins(criticals: pd.DataFrame, operating: Sequence[float] | None) -> pd.DataFrame:
    """Return a table of critical speeds with their separation margins and those that API 617 requires.

    Parameters
    ----------
    criticals : DataFrame
        Table with columns ``spin_rad_s`` and ``amplification_factor``, nan where that is not known.
    operating : sequence of float, length 2, optional
        rad/s, minimum operating speed and maximum continuous speed; None: nothing is added.

    Returns
    -------
    DataFrame
        With ``separation_margin_percent`` of the nearer operating speed, 0 between them, ``required_margin_percent``,
        and ``margin``: "met", "not met" or "not known".

    Raises
    ------
    RigError
        If operating speeds fall or are not above 0.
    """
    if operating is None:
        return criticals
    first, last = map(float, operating)
    if not 0 < first <= last < math.inf:
        raise RigError(f"operating speeds {first:g} to {last:g} rad/s: must be above 0 and not fall")
    at, factor = (criticals[name].to_numpy(dtype=float) for name in ("spin_rad_s", "amplification_factor"))
    actual = 100 * np.where(at < first, 1 - at / first, np.maximum(at / last - 1, 0.0))
    by_factor = np.minimum(17 * (1 - 1 / (np.maximum(factor, DAMPED) - 1.5)), 16.0) + 10.0 * (at > last)
    required = np.where(factor < DAMPED, 0.0, by_factor)
    met = np.select([np.isnan(required), actual >= required], ["not known", "met"], "not met")
    return criticals.assign(separation_margin_percent=actual, required_margin_percent=required, margin=met)


def draw_margins(ax: Axes, operating: tuple[float, float] | None, criticals: pd.DataFrame) -> None:
    """Draw operating speeds as a band over spin in rev/min, with the largest required margins at both sides.

    Parameters
    ----------
    ax : Axes
        Axes with the spin along x.
    operating : tuple of float, optional
        rad/s, minimum operating speed and maximum continuous speed.
    criticals : DataFrame
        Critical speeds, see `with_margins`.
    """
    from ..core.drawing import COLOURS, FAINT

    if operating is None:
        return
    first, last = (RPM * speed for speed in operating)
    ax.axvspan(first, last, color=FAINT, alpha=0.6, label="operating speeds")
    for side, sign in ((first, -1), (last, 1)):
        required = sign * criticals.required_margin_percent[sign * (criticals.spin_rev_min - side) > 0].max() / 100
        if abs(required) > 0:  # nan where there is none
            ax.axvspan(side, side * (1 + required), color=COLOURS[5], alpha=0.3, lw=0, label="required margin")


@dataclass(frozen=True, eq=False)
class UnbalanceResponse:
    """Synchronous motion at probes under a rig's unbalances over the speed. Made by `unbalance_response`."""

    shaft: TurningShaft
    """the shaft"""
    speed: np.ndarray
    """(n_speeds,) spin, rad/s: the given ones, and more of them near critical speeds"""
    planes: dict[str, str]
    """position of each probe, such as "node 7, x = 0.6 m", by its node and direction, such as "7:+Z" """
    motion: np.ndarray
    """(n_probes, n_speeds) m, complex: a probe reads the real part of it e^(iφ), φ the shaft's angle from its mark"""
    operating: tuple[float, float] | None = None
    """rad/s, minimum operating speed and maximum continuous speed, from which margins count; None: not known"""

    @property
    def amplitude(self) -> np.ndarray:
        """(n_probes, n_speeds) m, peak to peak."""
        return 2 * np.abs(self.motion)

    @property
    def phase_lag(self) -> np.ndarray:
        """(n_probes, n_speeds) degrees, 0 to 360, by which the shaft turns from its mark to a probe's maximum."""
        return np.asarray(np.degrees(-np.angle(self.motion)) % 360)

    @property
    def criticals(self) -> pd.DataFrame:
        """Critical speeds, which are the peaks at the probes: a row for each, see `with_margins`.

        ``amplification_factor`` is the peak's speed over the distance of its half-power points; nan where one of them
        is beyond the speeds or another, higher peak.
        """
        import pandas as pd

        index, tables = np.arange(self.speed.size), []
        for probe, size, lag in zip(self.planes, self.amplitude, self.phase_lag):
            tops, properties = scipy.signal.find_peaks(size, prominence=max(PROMINENT * size.max(), STILL))
            bases = size[tops], properties["left_bases"], properties["right_bases"]
            ends = np.array(scipy.signal.peak_widths(size, tops, 1 - HALF_POWER, bases)[2:])
            has_half_power = np.interp(ends, index, size) < 1.001 * HALF_POWER * size[tops]
            below, above = np.where(has_half_power, np.interp(ends, index, self.speed), np.nan)
            speed, factor = self.speed[tops], self.speed[tops] / (above - below)
            columns = {"probe": probe, "spin_rad_s": speed, "spin_rev_min": RPM * speed}
            columns |= {"amplitude_um_pp": 1e6 * size[tops], "phase_lag_deg": lag[tops], "amplification_factor": factor}
            tables.append(pd.DataFrame(columns))
        return with_margins(pd.concat(tables, ignore_index=True), self.operating)

    def plot(self) -> Figure:
        """Draw amplitude and phase over spin at each plane of probes, with critical speeds, margins and clearances."""
        from ..core.drawing import COLOURS, FONT, TEST, bode, key

        curves: dict[str, list[tuple[str, np.ndarray, dict[str, Any]]]] = {plane: [] for plane in self.planes.values()}
        for (probe, plane), motion in zip(self.planes.items(), self.motion):
            style = {"color": COLOURS["ZYX".index(probe[-1])], "ls": "--" if probe[-1] == "Y" else "-"}
            curves[plane].append((f"along {probe[-1].lower()}", 2e6 * motion, style))
        figure, axes = bode(curves, RPM * self.speed, "Amplitude (µm p-p)")
        rig, criticals = self.shaft.rig, self.criticals
        gaps = {rig.probe_labels[rows.start]: bushing for rows, bushing in zip(rig.clearance_rows, rig.bushings)}
        for (above, below), plane in zip(axes, curves):
            draw_margins(above, self.operating, criticals)
            of_plane = criticals[criticals.probe.map(self.planes) == plane].round({"spin_rev_min": 0})
            for row in of_plane.drop_duplicates("spin_rev_min").itertuples():  # one of two probes that peak together
                at, words = row.spin_rev_min, f"{row.spin_rev_min:.0f} rev/min, AF {row.amplification_factor:.3g}"
                above.plot(at, row.amplitude_um_pp, "o", color=TEST, ms=3.5, label="critical speed")
                side, ha = (-6, "right") if at > LATE * RPM * self.speed[-1] else (6, "left")
                place = {"xytext": (side, -2), "textcoords": "offset points", "ha": ha}
                above.annotate(words, (at, row.amplitude_um_pp), fontsize=FONT - 1, **place)
                below.axvline(at, color=TEST, lw=0.7, ls=":")
            for bushing in (gaps[probe] for probe in gaps if self.planes[probe] == plane):
                above.axhline(2e6 * bushing.gap, color=TEST, lw=0.9, ls=":", label="diametral clearance")
        key(figure, [line for ax in axes[:, 0] for line in ax.get_legend_handles_labels()[0]], 5)
        return figure


@dataclass(frozen=True, eq=False)
class RunningClearance:
    """Orbits under unbalance of a shaft without contact, and its clearances. Made by `running_clearance`."""

    rig: Rig
    """the rig"""
    speed: np.ndarray
    """(n_speeds,) spin, rad/s, up to the trip"""
    operating: tuple[float, float]
    """rad/s, minimum operating and maximum continuous speed"""
    vibration: np.ndarray
    """(n_probes, n_speeds) m, peak to peak along y or z, the larger one, under the rig's unbalances"""
    major: np.ndarray
    """(n_bushings, n_speeds) m, major axis, peak to peak, of the larger of both ends, under the rig's unbalances"""

    @property
    def limit(self) -> float:
        """Vibration limit, m, peak to peak: 25.4 µm √(12000/N), at most 25.4 µm."""
        return LIMIT * min(1.0, math.sqrt(AT_SPEED / (RPM * self.operating[1])))

    @property
    def scale(self) -> float:
        """Factor of the unbalances: vibration limit over the largest vibration at operating speeds."""
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
        """(n_bushings, n_speeds) scaled major axis over the allowed one; above 1 the criterion is not met."""
        return self.scale * self.major / self.allowed[:, None]

    @property
    def holds(self) -> np.ndarray:
        """(n_bushings,) True if the criterion is met at all speeds."""
        return np.asarray(np.max(self.used, axis=1) <= 1)

    @property
    def scaled_rig(self) -> Rig:
        """The rig with its unbalances multiplied by `scale`, for simulations with contact."""
        scaled = (dataclasses.replace(u, moment=self.scale * u.moment) for u in self.rig.unbalances)
        return self.rig.replace(unbalances=tuple(scaled))

    def plot(self, touching: Whirl | None = None) -> Figure:
        """Draw scaled major axes over speed, with the allowed ones and the clearances.

        Parameters
        ----------
        touching : Whirl, optional
            Whirl of a simulated run-up of `scaled_rig`: the synchronous major axis of every turn is drawn, too.
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
def unbalance_response(
    rig: Rig, speeds: Sequence[float] | np.ndarray, operating: tuple[float, float] | None = None, n_modes: int = 16
) -> UnbalanceResponse:
    """Compute the response of probes to a rig's unbalances over its speed, with bushings filled and not in contact.

    Probes are the displacement probes of the bushings, and the positions and directions of the sensors.

    Parameters
    ----------
    rig : Rig
        Turning rig, with unbalances.
    speeds : sequence of float
        Rising spins, rad/s; near critical speeds more of them are added.
    operating : tuple of float, optional
        rad/s, minimum operating speed and maximum continuous speed, from which separation margins count.
    n_modes : int
        Modes of each plane in the shaft's reduction.

    Raises
    ------
    RigError
        If the rig has no unbalances or its structure is no turning shaft, or speeds do not rise.
    """
    speed, shaft = rising(speeds), turning_shaft(rig, n_modes)
    model = shaft.model
    places = (*sensor_points(rig), *(rig.bushings[j].position for j in rig.bushing_of_row))
    rows_of = zip((*rig.sensor_labels, *rig.probe_labels), places, (*model.at_sensors, *model.at_probes({})))
    at = [(label, rig.linear.place(point)[1], row) for label, point, row in rows_of if "R" not in label]  # no angles
    planes = {label: f"node {label.split(':')[0]}, x = {x:.4g} m" for label, x, _ in at}
    rows = {label: row for label, _, row in at}  # a probe counts before a sensor
    if not rows:
        raise RigError(f"rig {rig.name!r}: its sensors and probes read angles alone; give a sensor that reads bending")
    near = np.multiply.outer(shaft.critical_speeds, np.concatenate((1 - NEAR, 1 + NEAR)))
    speed = np.union1d(speed, near[(near > speed[0]) & (near < speed[-1])])
    motion = np.array([*rows.values()]) @ shaft.under_unbalances(speed)
    return UnbalanceResponse(shaft, speed, planes, motion, operating)


@checks_kinds
def running_clearance(
    rig: Rig, speeds: Sequence[float] | np.ndarray, operating: Sequence[float], n_modes: int = 16
) -> RunningClearance:
    """Compute the orbits of a shaft under its unbalances over its speed, for the clearance criterion of API 617.

    The bushings are filled and not in contact; vibration is read at the rig's sensors, along y and z.

    Parameters
    ----------
    rig : Rig
        Turning rig, with round bushings and unbalances.
    speeds : sequence of float
        Rising spins, rad/s, up to the trip speed; close enough to show every resonance.
    operating : sequence of float, length 2
        rad/s, minimum operating speed and maximum continuous speed.
    n_modes : int
        Modes of each plane in the shaft's reduction.

    Raises
    ------
    RigError
        If bushings, unbalances or a spin are missing, no speed is an operating speed, or nothing vibrates at one.
    RecordError
        If the rig is planar or has no bushings.
    """
    require_round(rig)
    speed = rising(speeds)
    first, last = map(float, operating)
    if not 0 <= first <= last or not np.any((speed >= first) & (speed <= last)):
        ends = speed[[0, -1]]
        raise RigError(
            f"operating speeds {first:g} to {last:g} rad/s: must rise, with some of the speeds "
            f"({ends[0]:g} to {ends[1]:g} rad/s) between them"
        )
    for j, bushing in enumerate(rig.bushings):
        if not bushing.is_round:
            other = f"bushings[{j}] is a {bushing.default_shape}"
            raise RigError(f"a running clearance is of round bushings alone, and {other} of rig {rig.name!r}")
    shaft, n_probes = turning_shaft(rig, n_modes), len(rig.sensors)
    points = [float(sensor.position) for sensor in rig.sensors]
    points += [float(b.position) + side * b.length / 2 for b in rig.bushings for side in (-1, 1)]
    y, z = np.moveaxis(shaft.shapes(points) @ shaft.under_unbalances(speed), 1, 0)
    vibration = 2 * np.maximum(np.abs(y), np.abs(z))[:n_probes]
    axis = (np.abs(y + 1j * z) + np.abs(y - 1j * z))[n_probes:].reshape(-1, 2, speed.size)
    clearance = RunningClearance(rig, speed, (first, last), vibration, np.max(axis, axis=1))
    if not clearance._largest > STILL:
        raise RigError(f"rig {rig.name!r}: no sensor moves at operating speeds, so there is nothing to scale")
    return clearance
