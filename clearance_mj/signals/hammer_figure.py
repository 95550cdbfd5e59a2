"""The figure of a hammer test: its hits, their pulses, a response with its window, and the force's spectrum."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from ..core.drawing import ALARM, COLOURS, REPEAT, TEST, canvas, envelope, tidy

if TYPE_CHECKING:
    from .hammer import HammerTest

__all__ = ["hammer_figure"]

SHOWN = 6  # lengths of a touch of each block that the pulses are drawn for


def hammer_figure(test: HammerTest) -> Figure:
    """Draw what was averaged and what was left out.

    Parameters
    ----------
    test : HammerTest
        The test.
    """
    figure, first = canvas(4.6), test.blocks[0]
    (hits, pulses), (response, spectrum) = figure.subplots(2, 2)
    starts = np.cumsum([0.0, *(record.duration for record in test.records)])
    for start, record in zip(starts, test.records):
        hits.plot(*envelope(start + record.time, record.excitation), color=TEST, lw=0.7)
    for faulty, marker, colour, label in ((False, "o", COLOURS[0], "averaged"), (True, "x", ALARM, "left out")):
        at = [(starts[hit.record] + hit.time, hit.peak) for hit in test.hits if bool(hit.fault) == faulty]
        if at:
            hits.plot(*zip(*at), marker, color=colour, ms=5, label=f"{label}: {len(at)}")
    used = [hit for hit in test.hits if not hit.fault]
    for hit, block in zip(used, test.blocks):
        record, width = test.records[hit.record], hit.pulse[1] - hit.pulse[0]
        part = np.arange(
            max(0, hit.start, hit.pulse[0] - width), min(hit.pulse[0] + SHOWN * width, record.excitation.size)
        )
        time = 1e3 * (part - hit.pulse[0]) / record.fs
        pulses.plot(time, record.excitation[part], color=REPEAT, lw=1.6)
        pulses.plot(time, block.excitation[part - hit.start], color=COLOURS[0], lw=0.8)
    response.plot(*envelope(first.time, first.acceleration[0]), color=TEST, lw=0.7)
    frequency, level = test.spectrum
    spectrum.plot(frequency, 20 * np.log10(np.maximum(level, 1e-6)), color=COLOURS[0], lw=1.0)
    spectrum.axvspan(*test.frf.frequency[[0, -1]], color=REPEAT, alpha=0.25, lw=0, label="lines of the FRFs")
    spectrum.set_ylim(-60, 3)
    tidy(hits, "Hits", "Force (N)", "Time (s)")
    tidy(pulses, "Touches that are averaged (grey: without windows)", "Force (N)", "Time (ms)")
    tidy(response, "First block that is averaged", f"Acceleration {test.frf.responses[0]} (m/s²)", "Time (s)")
    tidy(spectrum, "Force over frequency", "Level (dB)", "Frequency (Hz)")
    for ax in (hits, spectrum):
        ax.legend(fontsize=7, frameon=False)
    return figure
