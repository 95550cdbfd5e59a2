"""Figures of a motion over level: phase portraits and Poincaré sections.

Velocities are those of a cubic spline through the displacements. A section under a sine is stroboscopic: the state
once a period, when the sine passes zero upwards. Random excitation has no period; its section is where the velocity
passes zero, and each turning point is drawn over the one before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import CubicSpline

from ..core.errors import RecordError
from ..rig import Rig
from ..signals.frf import estimate_frf
from ..signals.response import Response
from .style import COLOURS, FAINT, FONT, REPEAT, TEST, WIDTH, Drawing, canvas, tidy
from .waterfall import frf_waterfall, spectrum_waterfall

__all__ = ["drawings", "phase_portraits", "poincare_sections", "stroboscopic", "turning_points"]

BINS = 70  # of the density of a random motion, along displacement and velocity


def stroboscopic(response: Response, frequency: float, drop: float = 0.0) -> np.ndarray:
    """Return states (2, n_periods, n_rows), m and m/s, once in every period of a sine (Hz) from phase 0.

    ``drop`` s at the start are left out until the motion is steady; a RecordError says if no period is left.
    """
    spline = _spline(response)
    first, last = np.ceil(drop * frequency - 1e-9), np.floor(spline.x[-1] * frequency + 1e-9)
    if last < max(first, 1):
        raise RecordError(f"no period of {frequency:g} Hz is left of {response.duration:g} s after {drop:g} s")
    moments = np.arange(first, last + 1) / frequency
    return np.stack((spline(moments), spline(moments, 1)))


def turning_points(response: Response, row: int, drop: float = 0.0) -> np.ndarray:
    """Return displacements (n,), m, of a row where its velocity passes zero, in order; ``drop`` s are left out."""
    spline = _spline(response, row)
    moments = spline.derivative().roots(extrapolate=False)
    return spline(moments[moments >= drop])


def _spline(response: Response, row: int | slice = slice(None)) -> CubicSpline:
    if response.displacement is None:
        raise RecordError("the response has no displacements at the bushings, so its motion there cannot be drawn")
    return CubicSpline(response.time, response.displacement[row].T)


def _path(response: Response, row: int, drop: float) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement and velocity of a row, mm and mm/s."""
    spline = _spline(response, row)
    time = response.time[response.time >= drop]
    return 1e3 * spline(time), 1e3 * spline(time, 1)


def drawings(
    rig: Rig, responses: Mapping[float, Response], frequency: float | None = None, drop: float = 0.0
) -> list[Drawing]:
    """Draw phase portraits, Poincaré sections, and a waterfall: of spectra under a sine, else of FRFs."""
    if frequency:
        waterfall = spectrum_waterfall(rig, responses, drop)
    else:
        waterfall = frf_waterfall(rig, {level: estimate_frf(response) for level, response in responses.items()})
    sections = (draw(rig, responses, frequency, drop) for draw in (phase_portraits, poincare_sections))
    return [*sections, waterfall]


def phase_portraits(
    rig: Rig, responses: Mapping[float, Response], frequency: float | None = None, drop: float = 0.0
) -> Drawing:
    """Draw velocity over displacement at every bushing, a column for each level (m/s² or N); ``drop`` s are left out.

    Of a sine (frequency in Hz) the path is drawn as a line, of random motion its density.
    """

    def draw(ax: Axes, j: int, response: Response) -> None:
        if frequency:
            ax.plot(*_path(response, j, drop), color=COLOURS[0], lw=0.6)
        else:
            ax.hist2d(*_path(response, j, drop), bins=BINS, norm="log", cmap="cividis_r")

    figure = _grid(rig, responses, draw, "Displacement (mm)", "Velocity (mm/s)")
    curve = f"the path under a sine of {frequency:g} Hz" if frequency else "density of the random motion, dark: often"
    caption = f"Phase portraits at the bushings: {curve}. Relative to the bushing; dashed: its gap."
    return Drawing("phase_portraits", figure, caption, f"Velocity over displacement at {len(rig.bushings)} bushings.")


def poincare_sections(
    rig: Rig, responses: Mapping[float, Response], frequency: float | None = None, drop: float = 0.0
) -> Drawing:
    """Draw Poincaré sections at every bushing, a column for each level (m/s² or N); ``drop`` s are left out.

    Of a sine (frequency in Hz) the section is stroboscopic, else it is where the velocity passes zero.
    """

    def draw(ax: Axes, j: int, response: Response) -> None:
        if frequency:
            x, y = 1e3 * stroboscopic(response, frequency, drop)[..., j]
            ax.plot(*_path(response, j, drop), color=REPEAT, lw=0.5, alpha=0.6)
        else:
            turns = 1e3 * turning_points(response, j, drop)
            x, y = turns[:-1], turns[1:]
            ax.axhspan(*np.nan_to_num(1e3 * rig.row_walls[j], neginf=x.min(), posinf=x.max()), color=FAINT, lw=0)
        ax.plot(x, y, ".", color=COLOURS[0], ms=4 if frequency else 1.5, mew=0)

    if frequency:
        labels = "Displacement (mm)", "Velocity (mm/s)"
        words = f"once a period of the sine of {frequency:g} Hz, when it passes zero upwards, on the path (grey)"
    else:
        labels = "Turning point (mm)", "Next turning point (mm)"
        words = (
            "where the velocity passes zero, each turning point over the one before: ripples near the rising diagonal, "
            "swings from side to side near the falling one; grey: within the gap"
        )
    figure = _grid(rig, responses, draw, *labels)
    caption = f"Poincaré sections at the bushings: {words}. Relative to the bushing; dashed: its gap."
    return Drawing("poincare_sections", figure, caption, f"Poincaré sections at {len(rig.bushings)} bushings.")


def _grid(
    rig: Rig, responses: Mapping[float, Response], draw: Callable[[Axes, int, Response], None], xlabel: str, ylabel: str
) -> Figure:
    """Draw a panel for each row of a clearance and level (column), with the gap."""
    rows, columns = rig.n_rows, len(responses)
    figure = canvas(0.4 + 1.75 * rows, max(WIDTH, 1.5 * columns))
    axes = figure.subplots(rows, columns, squeeze=False)
    for j, (line, bushing, (axis, _)) in enumerate(zip(axes, rig.bushing_of_row, rig.row_axes)):
        along = f" {axis} (mrad)" if axis.startswith("R") else f" {axis.lower()}" if rig.moves_across else ""
        for ax, (level, response) in zip(line, responses.items()):
            draw(ax, j, response)
            for wall in filter(np.isfinite, rig.row_walls[j]):
                ax.axvline(1e3 * wall, color=TEST, lw=0.7, ls="--")
            first, last = ax is line[0], j == rows - 1
            tidy(ax, "", ylabel if first else "", xlabel if last else "")
            unit = "m/s²" if response.kind == "base" else "N"
            ax.set_title(f"bushing {bushing + 1}{along}, {level:g} {unit}", fontsize=FONT - 1, loc="left", pad=3)
    return figure
