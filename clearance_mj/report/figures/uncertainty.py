"""FRF bands from a law's uncertainty."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...rig import Rig
from ...signals.frf import FRF
from ...statistics.frf_bands import Band, inside
from ...study import Study
from ..style import COLOURS, TEST, Drawing, at_bushings, decibel, frequency_axis, letters, sensor_title, sheet, tidy

MAX_PANELS = 2
PARAMETERS, PREDICTION = 0.8, 0.3  # opacity of the two bands


def study_bands(study: Study) -> list[Drawing]:
    """Return the figure of a study's bands; none if no law has a covariance."""
    if not study.bands:
        return []
    bands = {name: band for name, (band, _) in study.bands.items()}
    errors = {name: error for name, (_, error) in study.bands.items()}
    return [band_drawing(study.dataset.rig, bands, errors, study.tests[study.main_record.name])]


def band_drawing(rig: Rig, bands: Mapping[str, Band], errors: Mapping[str, np.ndarray], test: FRF) -> Drawing:
    """Draw the magnitudes at the bushings, and what bands and test deviate from the fitted law."""
    rows = (at_bushings(rig) or list(range(len(rig.sensors))))[:MAX_PANELS]
    colours = dict(zip(bands, COLOURS[1:]))
    predictions = {name: band.prediction(errors[name]) for name, band in bands.items()}
    handles: list[Artist] = [Line2D([], [], color=TEST, lw=0.9, label="test")]
    handles += [Line2D([], [], color=colour, label=name) for name, colour in colours.items()]
    handles.append(Patch(facecolor=TEST, alpha=PARAMETERS, lw=0, label="dark: parameters"))
    handles.append(Patch(facecolor=TEST, alpha=PREDICTION, lw=0, label="light: and the test’s random error"))
    figure = sheet(2.2 + 1.3 * len(bands), handles, left=0.8)
    ratios = {"height_ratios": [2, *len(bands) * [1.2]], "hspace": 0.16, "wspace": 0.16}
    axes = figure.subplots(1 + len(bands), len(rows), squeeze=False, gridspec_kw=ratios)
    for letter, row, column in zip(letters(len(rows)), rows, axes.T):
        column[0].plot(test.frequency, decibel(test.functions[row]), color=TEST, lw=2.0)
        first = row == rows[0]
        tidy(column[0], f"{letter} {sensor_title(rig, row)}", "|H| (dB re 1 SI)" if first else "")
        for ax, (name, band) in zip(column[1:], bands.items()):
            column[0].plot(test.frequency, decibel(band.fitted.functions[row]), color=colours[name], lw=0.9)
            _draw_deviation(ax, band, predictions[name], test, row, colours[name])
            tidy(ax, "", f"from {name}\n(dB)" if first else "")
        for ax in column:
            frequency_axis(ax, (test.frequency[0], test.frequency[-1]), ax is column[-1])
    figure.align_ylabels(axes[:, 0])
    words = "; ".join(_words(name, band, predictions[name], test) for name, band in bands.items())
    n = len(next(iter(bands.values())).drawn)
    caption = (
        f"What the records leave open: deviations from the fitted law of {n} laws drawn from the fit’s covariance, and "
        "of a test with its random error, 95 % bands line by line; law and test under the same excitation, whose "
        f"scatter they share. {words}. {_missed_words(bands)}"
    )
    return Drawing("uncertainty", figure, caption, "FRF bands from the covariance of the identified laws.")


def _missed_words(bands: Mapping[str, Band]) -> str:
    widened = " and ".join(f"“{name}”" for name, band in bands.items() if band.missed is not None)
    outside = "What lies outside is what the law’s form cannot say."
    return f"Bands of {widened} hold what it missed of the records to identify, too. {outside}" if widened else outside


def _words(name: str, band: Band, prediction: np.ndarray, test: FRF) -> str:
    inside_percent, every = (100 * inside(limits, test) for limits in (band.limits, prediction))
    half_width = np.mean(decibel(prediction[1] / prediction[0])) / 2
    alone = "parameters alone" if band.missed is None else "parameters and what it missed"
    return (
        f"{name}: {alone} ±{np.mean(band.half_width_db):.2g} dB in the mean, test inside at {inside_percent:.0f} % of "
        f"the lines; with its random error ±{half_width:.2g} dB and {every:.0f} %"
    )


def _draw_deviation(ax: Axes, band: Band, prediction: np.ndarray, test: FRF, row: int, colour: str) -> None:
    fitted = decibel(band.fitted.functions[row])
    for limits, alpha in ((prediction, PREDICTION), (band.limits, PARAMETERS)):
        ax.fill_between(test.frequency, *(decibel(limits[:, row, 0]) - fitted), color=colour, alpha=alpha, lw=0)
    ax.plot(test.frequency, decibel(test.functions[row]) - fitted, color=TEST, lw=0.7)
