"""Figures of a motion over level: phase portraits, Poincaré sections, waterfalls.

Velocities are those of a cubic spline through the displacements. A section under a sine is stroboscopic: the state
once a period, when the sine passes zero upwards. Random excitation has no period; its section is where the velocity
passes zero, and each turning point is drawn over the one before.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
import scipy.signal
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.interpolate import CubicSpline

from ..errors import RecordError
from ..rig import Rig
from ..signals.frf import FRF, estimate_frf
from ..signals.response import Response
from . import figures, tables
from .figures import FAINT, FONT, LAWS, REPEAT, TEST, WIDTH, Drawing, _tidy

if TYPE_CHECKING:
    from ..study import Study

__all__ = [
    "drawings",
    "frf_waterfall",
    "phase_portraits",
    "poincare_sections",
    "spectrum_waterfall",
    "stroboscopic",
    "study_waterfall",
    "turning_points",
]

STEP = 20.0
"""dB between the FRFs of two levels"""
BINS = 70
"""of the density of a random motion, along displacement and velocity"""
DYNAMIC = 60.0
"""dB of a spectrum that are drawn below its peak, and between the spectra of two levels"""
RESOLUTION = 0.5
"""Hz between the lines of spectra"""


def stroboscopic(response: Response, frequency: float, drop: float = 0.0) -> np.ndarray:
    """States at the bushings once in every period of a sine that begins at phase 0.

    Parameters
    ----------
    response : Response
        With displacements.
    frequency : float
        Of the sine, Hz.
    drop : float
        s at the start that are left out until the motion is steady.

    Returns
    -------
    ndarray, shape (2, n_periods, n_bushings)
        Displacement, m, and velocity, m/s.

    Raises
    ------
    RecordError
        If the response has no displacements or no period is left.
    """
    spline = _spline(response)
    first, last = np.ceil(drop * frequency - 1e-9), np.floor(spline.x[-1] * frequency + 1e-9)
    if last < max(first, 1):
        raise RecordError(f"no period of {frequency:g} Hz is left of {response.duration:g} s after {drop:g} s")
    moments = np.arange(first, last + 1) / frequency
    return np.stack((spline(moments), spline(moments, 1)))


def turning_points(response: Response, bushing: int, drop: float = 0.0) -> np.ndarray:
    """Displacements at a bushing where its velocity passes zero, in their order.

    Parameters
    ----------
    response : Response
        With displacements.
    bushing : int
        Index of the bushing.
    drop : float
        s at the start that are left out.

    Returns
    -------
    ndarray, shape (n,)
        m.

    Raises
    ------
    RecordError
        If the response has no displacements.
    """
    spline = _spline(response, bushing)
    moments = spline.derivative().roots(extrapolate=False)
    return spline(moments[moments >= drop])


def _spline(response, bushing=slice(None)) -> CubicSpline:
    if response.displacement is None:
        raise RecordError("the response has no displacements at the bushings, so its motion there cannot be drawn")
    return CubicSpline(response.time, response.displacement[bushing].T)


def _path(response, bushing, drop):
    """Displacement and velocity at a bushing, mm and mm/s."""
    spline = _spline(response, bushing)
    time = response.time[response.time >= drop]
    return 1e3 * spline(time), 1e3 * spline(time, 1)


def drawings(
    rig: Rig, responses: Mapping[float, Response], frequency: float | None = None, drop: float = 0.0
) -> list[Drawing]:
    """Draw phase portraits, Poincaré sections, and the waterfall that the excitation allows: spectra, or FRFs of noise.

    Parameters
    ----------
    rig, responses, frequency, drop
        As in `phase_portraits`.

    Returns
    -------
    list of Drawing
    """
    if frequency:
        waterfall = spectrum_waterfall(rig, responses, drop)
    else:
        waterfall = frf_waterfall(rig, {level: estimate_frf(response) for level, response in responses.items()})
    sections = (draw(rig, responses, frequency, drop) for draw in (phase_portraits, poincare_sections))
    return [*sections, waterfall]


def phase_portraits(
    rig: Rig, responses: Mapping[float, Response], frequency: float | None = None, drop: float = 0.0
) -> Drawing:
    """Draw velocity over displacement at every bushing, a column for each level.

    Parameters
    ----------
    rig : Rig
        The rig.
    responses : mapping of float to Response
        By level, m/s² or N.
    frequency : float, optional
        Of a sine, Hz: the path is drawn as a line. Otherwise the motion is random and its density is drawn.
    drop : float
        s at the start that are left out.
    """

    def draw(ax, j, response):
        if frequency:
            ax.plot(*_path(response, j, drop), color=LAWS[0], lw=0.6)
        else:
            ax.hist2d(*_path(response, j, drop), bins=BINS, norm="log", cmap="cividis_r")

    figure = _grid(rig, responses, draw, "Displacement (mm)", "Velocity (mm/s)")
    what = f"the path under a sine of {frequency:g} Hz" if frequency else "density of the random motion, dark: often"
    caption = f"Phase portraits at the bushings: {what}. Relative to the bushing; dashed: its gap."
    return Drawing("phase_portraits", figure, caption, f"Velocity over displacement at {len(rig.bushings)} bushings.")


def poincare_sections(
    rig: Rig, responses: Mapping[float, Response], frequency: float | None = None, drop: float = 0.0
) -> Drawing:
    """Draw Poincaré sections at every bushing, a column for each level.

    Parameters
    ----------
    rig : Rig
        The rig.
    responses : mapping of float to Response
        By level, m/s² or N.
    frequency : float, optional
        Of a sine, Hz: the section is stroboscopic. Otherwise it is where the velocity passes zero.
    drop : float
        s at the start that are left out.
    """

    def draw(ax, j, response):
        if frequency:
            x, y = 1e3 * stroboscopic(response, frequency, drop)[..., j]
            ax.plot(*_path(response, j, drop), color=REPEAT, lw=0.5, alpha=0.6)
        else:
            turns = 1e3 * turning_points(response, j, drop)
            x, y = turns[:-1], turns[1:]
            ax.axhspan(-1e3 * rig.bushings[j].gap, 1e3 * rig.bushings[j].gap, color=FAINT, lw=0)
        ax.plot(x, y, ".", color=LAWS[0], ms=4 if frequency else 1.5, mew=0)

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


def _grid(rig, responses, draw, xlabel, ylabel) -> Figure:
    """A panel for each bushing (row) and level (column), with the gap."""
    rows, columns = len(rig.bushings), len(responses)
    size = max(WIDTH, 1.5 * columns), 0.4 + 1.75 * rows
    figure = Figure(figsize=size, layout="constrained", facecolor="white")
    axes = figure.subplots(rows, columns, squeeze=False)
    for j, (line, bushing) in enumerate(zip(axes, rig.bushings)):
        for ax, (level, response) in zip(line, responses.items()):
            draw(ax, j, response)
            for side in (-1, 1):
                ax.axvline(side * 1e3 * bushing.gap, color=TEST, lw=0.7, ls="--")
            first, last = ax is line[0], j == rows - 1
            _tidy(ax, "", ylabel if first else "", xlabel if last else "")
            ax.set_title(f"bushing {j + 1}, {level:g} {_unit(response)}", fontsize=FONT - 1, loc="left", pad=3)
    return figure


def _unit(response) -> str:
    return "m/s²" if response.kind == "base" else "N"


def frf_waterfall(rig: Rig, frfs: Mapping[float, FRF]) -> Drawing:
    """Draw FRFs at the bushings' sensors (or the last, if none sits there) over level, each level 20 dB above the last.

    Parameters
    ----------
    rig : Rig
        The rig.
    frfs : mapping of float to FRF
        By level, m/s² or N.
    """
    curves = {level: [(frf.frequency, figures._decibel(frf.functions))] for level, frf in frfs.items()}
    some = next(iter(frfs.values()))
    base = some.quantity == "acceleration/acceleration"
    figure = _waterfall(rig, curves, "|H|", "dB re 1" if base else "dB re 1 m/s²/N", "m/s²" if base else "N")
    caption = f"FRFs over level, each curve {STEP:g} dB above the one of the level before."
    return Drawing("waterfall", figure, caption, f"FRF magnitudes at {len(frfs)} levels, one above the other.")


def spectrum_waterfall(
    rig: Rig, responses: Mapping[float, Response], drop: float = 0.0, most: float = 220.0
) -> Drawing:
    """Draw amplitude spectra at the bushings' sensors, over the excitation's, each level 60 dB above the last.

    Parameters
    ----------
    rig : Rig
        The rig.
    responses : mapping of float to Response
        By level, m/s² or N; under a sine.
    drop : float
        s at the start that are left out.
    most : float
        Highest frequency, Hz.
    """
    curves = {}
    for level, response in responses.items():
        steady = response.acceleration[:, response.time >= drop]
        settings = {"nperseg": min(round(response.fs / RESOLUTION), steady.shape[1]), "scaling": "spectrum"}
        frequency, power = scipy.signal.welch(steady, response.fs, "hann", **settings)
        shown = frequency <= most
        curves[level] = [(frequency[shown], figures._decibel(np.sqrt(power[:, shown]) / level))]
    unit = _unit(next(iter(responses.values())))
    reference = "dB re 1" if unit == "m/s²" else "dB re 1 m/s²/N"
    figure = _waterfall(rig, curves, "Acceleration / excitation", reference, unit, DYNAMIC, DYNAMIC)
    caption = (
        f"Spectra of the acceleration over the excitation's RMS, the upper {DYNAMIC:g} dB of each, and each "
        f"{DYNAMIC:g} dB above the one of the level before."
    )
    return Drawing("waterfall", figure, caption, f"Spectra at {len(responses)} levels, one above the other.")


def study_waterfall(study: Study) -> Drawing:
    """Draw FRFs of the test and of the best law at the bushings' sensors over the levels of a study.

    Parameters
    ----------
    study : Study
        The study.
    """
    law, engine, curves = tables.best_law(study), tables.main_engine(study), {}
    for level in study.levels:
        pair = study.tests[figures._test_names(study, level)[0]], study.case(law, engine, level).frf
        curves[level] = [(frf.frequency, figures._decibel(frf.functions)) for frf in pair]
    unit = tables.excitation_unit(study)
    figure = _waterfall(study.dataset.rig, curves, "|H|", figures._unit(study), unit, looks=_PAIR)
    of = "synthetic test" if tables.is_synthetic(study.dataset) else "test"
    handles = [Line2D([], [], **_PAIR[0], label=of), Line2D([], [], **_PAIR[1], label=f"law “{law}”, engine {engine}")]
    figure.legend(handles=handles, loc="outside upper center", ncols=2, fontsize=FONT, frameon=False)
    caption = (
        f"FRFs over level, {of} and the best law: each pair {STEP:g} dB above the one of the level before. Resonances "
        "shift and flatten where the shaft begins to touch its bushings."
    )
    alt = f"FRF magnitudes of the {of} and law {law} at {len(study.levels)} levels, one above the other."
    return Drawing("waterfall", figure, caption, alt)


_PAIR = ({"color": TEST, "lw": 2.0}, {"color": LAWS[1], "lw": 0.9})


def _waterfall(rig, curves, quantity, reference, unit, step=STEP, dynamic=np.inf, looks=None) -> Figure:
    """Curves of every level, the lowest level below; a colour for each level unless looks for each curve are given."""
    rows = figures._at_bushings(rig) or [len(rig.sensors) - 1]
    figure = Figure(figsize=(WIDTH, 1.4 + 0.62 * len(curves)), layout="constrained", facecolor="white")
    colours = matplotlib.colormaps["cividis"](np.linspace(0, 0.9, len(curves)))
    axes = figure.subplots(1, len(rows), squeeze=False, sharey=True)[0]
    for ax, row in zip(axes, rows):
        for i, (level, of_level) in enumerate(curves.items()):
            own = looks or [{"color": colours[i], "lw": 1.0}] * len(of_level)
            for (frequency, value), look in zip(of_level, own):
                shown = np.maximum(value[row], value[row].max() - dynamic)
                ax.plot(frequency, shown + step * i, **look)
            if ax is axes[-1]:
                ax.annotate(f"{level:g} {unit}", (1, shown[-1] + step * i), xycoords=("axes fraction", "data"),
                            xytext=(3, 0), textcoords="offset points", va="center", fontsize=FONT - 1)  # fmt: skip
        label = f"{quantity}, {step:g} dB up per level ({reference})" if ax is axes[0] else ""
        _tidy(ax, figures._sensor_title(rig, row), label, "Frequency (Hz)")
        ax.set_xlim(frequency[0], frequency[-1])
    return figure
