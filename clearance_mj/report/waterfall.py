"""Waterfalls: FRFs or spectra over level, one level above the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
import scipy.signal
from matplotlib.figure import Figure
from matplotlib.transforms import Affine2D

from ..rig import Rig
from ..signals.frf import FRF
from ..signals.response import Response
from .style import FONT, Drawing, at_bushings, canvas, decibel, sensor_title, tidy

__all__ = ["STEP", "draw_levels", "frf_waterfall", "spectrum_waterfall"]

STEP = 20.0  # dB between the FRFs of two levels
DYNAMIC = 60.0  # dB of a spectrum that are drawn below its peak, and between the spectra of two levels
RESOLUTION = 0.5
"""Hz between the lines of spectra"""
Curves = Mapping[float, Sequence[tuple[np.ndarray, np.ndarray]]]


def frf_waterfall(rig: Rig, frfs: Mapping[float, FRF]) -> Drawing:
    """Draw FRFs by level (m/s² or N) at the bushings' sensors (or the last sensor), each 20 dB above the last."""
    curves = {level: [(frf.frequency, decibel(frf.functions))] for level, frf in frfs.items()}
    base = next(iter(frfs.values())).quantity == "acceleration/acceleration"
    figure = draw_levels(rig, curves, "|H|", "dB re 1" if base else "dB re 1 m/s²/N", "m/s²" if base else "N")
    caption = f"FRFs over level, each curve {STEP:g} dB above the one of the level before."
    return Drawing("waterfall", figure, caption, f"FRF magnitudes at {len(frfs)} levels, one above the other.")


def spectrum_waterfall(
    rig: Rig, responses: Mapping[float, Response], drop: float = 0.0, most: float = 220.0
) -> Drawing:
    """Draw amplitude spectra under sines by level (m/s² or N) at the bushings' sensors, over the excitation's.

    Each level is 60 dB above the last; ``drop`` s at the start are left out, frequencies end at ``most`` Hz.
    """
    curves = {}
    for level, response in responses.items():
        steady = response.channels[:, response.time >= drop]
        settings = {"nperseg": min(round(response.fs / RESOLUTION), steady.shape[1]), "scaling": "spectrum"}
        frequency, power = scipy.signal.welch(steady, response.fs, "hann", **settings)
        shown = frequency <= most
        curves[level] = [(frequency[shown], decibel(np.sqrt(power[:, shown]) / level))]
    unit = "m/s²" if next(iter(responses.values())).kind == "base" else "N"
    reference = "dB re 1" if unit == "m/s²" else "dB re 1 m/s²/N"
    figure = draw_levels(rig, curves, "Acceleration / excitation", reference, unit, DYNAMIC, DYNAMIC)
    caption = (
        f"Spectra of the acceleration over the excitation's RMS, the upper {DYNAMIC:g} dB of each, and each "
        f"{DYNAMIC:g} dB above the one of the level before."
    )
    return Drawing("waterfall", figure, caption, f"Spectra at {len(responses)} levels, one above the other.")


def draw_levels(
    rig: Rig, curves: Curves, quantity: str, reference: str, unit: str, step: float = STEP, dynamic: float = np.inf,
    looks: Sequence[dict[str, Any]] = (),
) -> Figure:  # fmt: skip
    """Draw curves of every level at the bushings' sensors (or the last), the lowest level below.

    Curves are (frequency, values of every sensor in dB) with their unit ``reference``, ``step`` dB apart and drawn to
    ``dynamic`` dB below their peak; ``looks`` are their lines, with label, by default a colour for each level.
    """
    rows = at_bushings(rig) or [len(rig.sensors) - 1]
    figure = canvas(1.4 + 0.62 * len(curves))
    colours = matplotlib.colormaps["cividis"](np.linspace(0, 0.9, len(curves)))
    axes = figure.subplots(1, len(rows), squeeze=False, sharey=True)[0]
    for ax, row in zip(axes, rows):
        for i, (level, of_level) in enumerate(curves.items()):
            styles = looks or [{"color": colours[i], "lw": 1.0, "label": ""}] * len(of_level)
            for (frequency, value), look in zip(of_level, styles):
                shown = np.maximum(value[row], value[row].max() - dynamic)
                label = ", ".join(filter(None, (look["label"], f"{level:g} {unit}")))
                up = Affine2D().translate(0, step * i) + ax.transData
                ax.plot(frequency, shown, **look | {"label": label}, transform=up)
            if ax is axes[-1]:
                ax.annotate(f"{level:g} {unit}", (1, shown[-1] + step * i), xycoords=("axes fraction", "data"),
                            xytext=(3, 0), textcoords="offset points", va="center", fontsize=FONT - 1)  # fmt: skip
        label = f"{quantity}, {step:g} dB up per level ({reference})" if ax is axes[0] else ""
        tidy(ax, sensor_title(rig, row), label, "Frequency (Hz)")
        ax.set_xlim(frequency[0], frequency[-1])
    return figure
