"""FRFs of test and laws: over level, and overlaid at one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ...core.drawing import COLOURS, FONT, REPEAT, TEST, decibel, key, of_curves, phase, tidy
from ...signals.frf_error import random_db, why_unknown
from ...study import Study
from ..style import Drawing, at_bushings, finite, frequency_axis, letters, sensor_title, sheet
from ..waterfall import STEP, draw_levels
from .looks import Looks

_PAIR: tuple[dict[str, Any], ...] = ({"color": TEST, "lw": 2.0}, {"color": COLOURS[1], "lw": 0.9})
SECOND = "test, other seed"
CUT = (
    "the coherence γ² of the test. Band: the test’s magnitude ± the RMS of its random error. Dips of a model far below "
    "the test are cut."
)


def frf_bushings(study: Study, level: float) -> Drawing | None:
    """Draw magnitude, phase and coherence of the sensors at the bushings."""
    panels = _Panels(study, level)
    if not (rows := at_bushings(panels.looks.rig)):
        return None
    figure = sheet(4.2, panels.key())
    ratios = {"height_ratios": (4, 2, 1), "hspace": 0.1, "wspace": 0.14}
    axes = figure.subplots(3, len(rows), squeeze=False, gridspec_kw=ratios)
    for letter, row, (magnitude, angle, coherence) in zip(letters(len(rows)), rows, axes.T):
        panels.fill(magnitude, angle, coherence, row, letter, row == rows[0])
        for ax in (magnitude, angle, coherence):
            frequency_axis(ax, panels.band, ax is coherence)
    figure.align_ylabels(axes[:, 0])
    caption = f"FRFs at the bushings: magnitude, phase, and {CUT} {panels.looks.words(level)}"
    alt = f"FRF overlay at the bushings: test and laws {panels.looks.laws}, {panels.looks.level_words(level)}."
    name = panels.looks.name("frf_bushings", level)
    return Drawing(name, figure, caption, alt, level == study.main_level, chart=True)


def frf_others(study: Study, level: float) -> Drawing | None:
    """Draw magnitude and coherence of the other sensors."""
    panels = _Panels(study, level)
    rig = panels.looks.rig
    if not (rows := [row for row in range(len(rig.sensors)) if row not in at_bushings(rig)]):
        return None
    n_lines = -(-len(rows) // 2)
    figure = sheet(2.1 * n_lines, panels.key())
    grid = figure.add_gridspec(n_lines, 2, hspace=0.2, wspace=0.14)
    for i, (letter, row) in enumerate(zip(letters(len(rows)), rows)):
        cell = grid[i // 2, i % 2].subgridspec(2, 1, height_ratios=(5, 1), hspace=0.1)
        magnitude, coherence = np.ravel(np.asarray(cell.subplots()))
        angle = figure.add_subplot(cell[0], visible=False)  # on the page's chart only
        panels.fill(magnitude, angle, coherence, row, letter, i % 2 == 0)
        angle.set_ylabel("Phase (°)")
        for ax in (magnitude, angle):
            frequency_axis(ax, panels.band, False)
        frequency_axis(coherence, panels.band, i >= len(rows) - 2)
        figure.align_ylabels((magnitude, coherence))
    caption = f"FRFs at the other sensors: magnitude; strips: {CUT} {panels.looks.words(level)}"
    alt = f"FRF overlay at the other sensors: test and laws {panels.looks.laws}, {panels.looks.level_words(level)}."
    return Drawing(panels.looks.name("frf_others", level), figure, caption, alt, level == study.main_level, chart=True)


class _Panels:
    """Panels of one level: test, second test and models."""

    def __init__(self, study: Study, level: float):
        self.looks = Looks(study)
        self.tests = [study.tests[r.name] for r in study.records(level)][:2]
        self.models = [(c.frf, self.looks.line(c.law, c.engine)) for c in self.looks.cases(level)]
        frequency = self.tests[0].frequency
        self.band = float(frequency[0]), float(frequency[-1])

    def key(self) -> list[Line2D]:
        return self.looks.key("test", SECOND if len(self.tests) > 1 else "")

    def overlay(self, ax: Axes, row: int, transform: Callable[[np.ndarray], np.ndarray]) -> None:
        """Draw one response of test, repeat and all models."""
        test = self.tests[0]
        for other in self.tests[1:]:
            ax.plot(test.frequency, transform(other.functions[row]), color=REPEAT, linewidth=0.8, label=SECOND)
        ax.plot(test.frequency, transform(test.functions[row]), color=TEST, linewidth=2.4, label="test")
        for frf, look in self.models:
            ax.plot(test.frequency, transform(frf.functions[row]), **look)

    def fill(self, magnitude: Axes, angle: Axes, coherence: Axes, row: int, letter: str, labelled: bool) -> None:
        """Draw one sensor in its three panels."""
        self.magnitude(magnitude, row, letter)
        self.phase(angle, row)
        self.coherence(coherence, row)
        if labelled:
            labels = f"|H| ({self.looks.magnitude})", "Phase (°)", "γ² (1)"
            for ax, label in zip((magnitude, angle, coherence), labels):
                ax.set_ylabel(label, fontsize=FONT)

    def magnitude(self, ax: Axes, row: int, letter: str) -> None:
        """Fit the axis to the test; lines where a model is nearly zero are cut, not to squeeze the rest."""
        if not why_unknown(self.tests[0]):
            middle, error = decibel(self.tests[0].functions[row]), random_db(self.tests[0])[row, 0]
            ax.fill_between(self.tests[0].frequency, middle - error, middle + error, color=REPEAT, alpha=0.4, lw=0)
        self.overlay(ax, row, decibel)
        test = finite(decibel(self.tests[0].functions[row]))
        models = [finite(decibel(frf.functions[row])) for frf, _ in self.models]
        low = min(test.min(), *(np.percentile(model, 0.5) for model in models))
        ax.set_ylim(low - 2, max(test.max(), *(model.max() for model in models)) + 2)
        tidy(ax, f"{letter} {sensor_title(self.looks.rig, row)}")

    def phase(self, ax: Axes, row: int) -> None:
        self.overlay(ax, row, phase)
        tidy(ax)
        ax.set(ylim=(-190, 190), yticks=(-180, -90, 0, 90, 180))

    def coherence(self, ax: Axes, row: int) -> None:
        test = self.tests[0]
        if test.coherence is not None:
            ax.plot(test.frequency, test.coherence[row, 0], color=TEST, linewidth=0.7, label="test")
        tidy(ax)
        ax.set(ylim=(0, 1.1), yticks=(0, 1))


def study_waterfall(study: Study) -> Drawing:
    """Draw FRFs of the test and of the best law at the bushings' sensors over the levels of a study."""
    law, engine, curves = study.best_law, study.main_engine, {}
    for level in study.levels:
        spectra = study.test(study.records(level)[0]), study.case(law, engine, level).frf
        curves[level] = [(frf.frequency, decibel(frf.functions)) for frf in spectra]
    looks = Looks(study)
    src, labels = looks.test, (looks.test, f"law “{law}”, engine {engine}")
    pair = [look | {"label": label} for look, label in zip(_PAIR, labels)]
    figure = draw_levels(study.dataset.rig, curves, "|H|", looks.magnitude, study.unit, looks=pair)
    key(figure, of_curves(dict(zip(labels, _PAIR))), 2)
    caption = (
        f"FRFs over level, {src} and the best law: each pair {STEP:g} dB above the one of the level before. Resonances "
        "shift and flatten where the shaft begins to touch its bushings."
    )
    alt = f"FRF magnitudes of the {src} and law {law} at {len(study.levels)} levels, one above the other."
    return Drawing(f"waterfall{study.suffix}", figure, caption, alt, chart=True)
