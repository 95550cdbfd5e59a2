"""Figure of what a law's uncertainty makes of its FRFs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..errors import LawError
from ..frf import FRF
from ..rig import Rig
from ..uncertainty import Band, draw_laws, frf_band
from .figures import (
    FONT,
    LAWS,
    TEST,
    Drawing,
    _at_bushings,
    _decibel,
    _frequency_axis,
    _letters,
    _sensor_title,
    _sheet,
    _tidy,
)

if TYPE_CHECKING:
    from ..study import Study

__all__ = ["bands", "draw", "drawings"]

DRAWN = 40
"""laws for a band in the report"""
ENGINE = "modal"
MOST_PANELS = 2


def bands(study: Study, n: int = DRAWN, progress: bool = False) -> dict[str, Band]:
    """Bands of every law of a study that has a covariance, at the main level's first record.

    Parameters
    ----------
    study : Study
        The study.
    n : int
        Laws to draw.
    progress : bool
        Show progress bars.
    """
    record = next(r for r in study.dataset.validate if r.level == study.main_level)
    found = {}
    for knowledge in study.laws:
        try:
            laws = draw_laws(record.rig, knowledge.name, knowledge.parameters, n)
        except LawError:
            continue
        words = f"band: {knowledge.name}" if progress else None
        found[knowledge.name] = frf_band(record.rig, record.excitation(), knowledge.law, laws, ENGINE, progress=words)
    return found


def drawings(study: Study) -> list[Drawing]:
    """Return the figure of a study's bands; none if no law has a covariance.

    Parameters
    ----------
    study : Study
        The study.
    """
    found = bands(study)
    if not found:
        return []
    test = next(r.name for r in study.dataset.validate if r.level == study.main_level)
    return [draw(study.dataset.rig, found, study.tests[test])]


def draw(rig: Rig, found: Mapping[str, Band], test: FRF | None = None) -> Drawing:
    """Draw the magnitudes at the bushings, and what the band and the test deviate from the fitted law.

    Parameters
    ----------
    rig : Rig
        The rig.
    found : mapping of str to Band
        Bands by the names of their laws.
    test : FRF, optional
        The test on the same lines.
    """
    rows = (_at_bushings(rig) or list(range(len(rig.sensors))))[:MOST_PANELS]
    colours = dict(zip(found, LAWS[1:]))
    handles = [Patch(facecolor=colours[name], label=f"{name}: fitted and 95 % band") for name in found]
    if test is not None:
        handles.append(Line2D([], [], color=TEST, lw=0.9, label="test"))
    figure = _sheet(2.0 + 1.3 * len(found), handles, left=0.8)
    ratios = {"height_ratios": [2, *len(found) * [1.2]], "hspace": 0.16, "wspace": 0.16}
    axes = figure.subplots(1 + len(found), len(rows), squeeze=False, gridspec_kw=ratios)
    for letter, row, column in zip(_letters(len(rows)), rows, axes.T):
        _magnitudes(column[0], found, test, row, colours)
        _tidy(column[0], f"{letter} {_sensor_title(rig, row)}")
        for ax, (name, band) in zip(column[1:], found.items()):
            _deviation(ax, band, test, row, colours[name])
            _tidy(ax)
        for ax in column:
            frequency = next(iter(found.values())).fitted.frequency
            _frequency_axis(ax, (frequency[0], frequency[-1]), ax is column[-1])
    axes[0, 0].set_ylabel("|H| (dB re 1 SI)", fontsize=FONT)
    for ax, name in zip(axes[1:, 0], found):
        ax.set_ylabel(f"from {name}\n(dB)", fontsize=FONT)
    figure.align_ylabels(axes[:, 0])
    told = "; ".join(_told(name, band, test) for name, band in found.items())
    n = len(next(iter(found.values())).drawn)
    caption = (
        f"What the records leave open about the parameters: 95 % bands of the FRFs of {n} laws drawn from the fit's "
        f"covariance, under the test's excitation; below, deviations from the fitted law. {told}. Outside the band the "
        "test shows what the law's form cannot say, and its own noise."
    )
    return Drawing("uncertainty", figure, caption, "FRF bands from the covariance of the identified laws.")


def _told(name, band, test) -> str:
    words = f"{name}: mean half width {np.mean(band.half_width_db):.2g} dB"
    if test is None:
        return words
    low, high = band.limits
    inside = np.mean((low <= np.abs(test.value)) & (np.abs(test.value) <= high))
    return f"{words}, test inside at {100 * inside:.0f} % of the lines"


def _magnitudes(ax, found, test, row, colours):
    if test is not None:
        ax.plot(test.frequency, _decibel(test.value[row]), color=TEST, lw=2.0)
    for name, band in found.items():
        ax.fill_between(band.fitted.frequency, *_decibel(band.limits[:, row]), color=colours[name], alpha=0.4, lw=0)
        ax.plot(band.fitted.frequency, _decibel(band.fitted.value[row]), color=colours[name], lw=0.9)


def _deviation(ax, band, test, row, colour):
    fitted = _decibel(band.fitted.value[row])
    ax.fill_between(band.fitted.frequency, *(_decibel(band.limits[:, row]) - fitted), color=colour, alpha=0.6, lw=0)
    if test is not None:
        ax.plot(test.frequency, _decibel(test.value[row]) - fitted, color=TEST, lw=0.7)
