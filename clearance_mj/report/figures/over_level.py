"""Figures over level: agreement, modes, contact."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from ...study import Study
from .. import frames
from ..style import FONT, REPEAT, TEST, Drawing, letters, level_axis, sheet, tidy
from ..tables import OVERALL, AgreementMeasure
from ..tables import REPEAT as REPEAT_ROW
from .looks import Looks


def agreement(study: Study) -> Drawing:
    """Draw the distance of every measure from perfect agreement, with intervals, and the repeatability."""
    looks = Looks(study)
    figure = sheet(5.9, left=0.68)
    axes = figure.subplots(3, 3, gridspec_kw={"hspace": 0.5, "wspace": 0.38}).ravel()
    for ax, letter, measure in zip(axes, letters(len(OVERALL)), OVERALL):
        _agreement_lines(ax, looks, measure)
        quantity = f"1 − {measure.label}" if measure.perfect else measure.label
        tidy(ax, f"{letter} {quantity} ({measure.unit or '1'})", xlabel=looks.level_label)
        ax.set_yscale("log")
        level_axis(ax, study.levels)
    for ax in axes[len(OVERALL) :]:
        ax.axis("off")
    handles = looks.key(repeat="repeatability" if study.repeatability else "", markers=True)
    axes[-2].legend(handles=handles, loc="center left", fontsize=FONT, frameon=False, handlelength=3, ncols=2)
    data = "the synthetic validation records" if study.is_synthetic else "the validation records"
    caption = (
        f"Agreement with {data} over level, less is better: means over all sensors (modes) and over the records of a "
        "level, with their 95 % intervals over seeds (bars; of the repeatability, a band); small marks: each record. "
        f"The repeatability compares two records of the rig at one level with different seeds.{looks.engine_words}"
    )
    alt = f"Seven measures over level for laws {looks.laws} and the repeatability."
    return Drawing(f"verdict{study.suffix}", figure, caption, alt)


def _agreement_lines(ax: Axes, looks: Looks, measure: AgreementMeasure) -> None:
    study = looks.study
    levels, value, low, high = _errors(study, *REPEAT_ROW, measure)
    if levels.size:
        ax.fill_between(levels, low, high, color=REPEAT, alpha=0.25, linewidth=0)
        ax.plot(levels, value, color=REPEAT, linewidth=2.2, marker="D", markersize=3.5)
    for i, (law, engine) in enumerate(looks.drawn):
        levels, value, low, high = _errors(study, law, engine, measure)
        aside = 1.03 ** (i - (len(looks.drawn) - 1) / 2)  # bars of several laws side by side
        ax.plot(aside * levels, value, **looks.line(law, engine, marker=True))
        ax.vlines(aside * levels, low, high, color=looks.colour(law), linewidth=0.8)
        for level, comparisons in study.of_law(law, engine).items():
            each = [abs(measure.perfect - c.summary()[measure.key]) for c in comparisons]
            ax.plot([aside * level] * len(each), each, "_", color=looks.colour(law), markersize=3, markeredgewidth=0.7)


def _errors(study: Study, law: str, engine: str, measure: AgreementMeasure) -> np.ndarray:
    """Return level, distance from perfect agreement, and its limits, (4, n_levels)."""
    rows = [r for r in study.rows() if (r["law"], r["engine"]) == (law, engine)]
    errors = [(r["level"], frames.interval(r, measure.key)) for r in rows]
    table = np.array([(level, i.value, i.low, i.high) for level, i in errors]).reshape(-1, 4).T
    value, *limits = np.abs(measure.perfect - table[1:])
    return np.array([table[0], value, np.min(limits, axis=0), np.max(limits, axis=0)])


def modes(study: Study) -> Drawing:
    """Draw natural frequency (backbone) and damping of every mode, test and laws."""
    looks, rows = Looks(study), frames.modes(study)
    numbers = sorted(rows["mode"].unique())
    figure = sheet(1.55 * len(numbers), looks.key("test (× each record)", markers=True))
    axes = figure.subplots(len(numbers), 2, squeeze=False, sharex=True, gridspec_kw={"hspace": 0.22, "wspace": 0.22})
    labels = {"hz": ("Natural frequency (Hz)", 1), "damping": ("Damping ratio (%)", 100)}
    for ax, letter, (mode, name) in zip(axes.flat, letters(axes.size), ((m, n) for m in numbers for n in labels)):
        label, factor = labels[name]
        of_mode = rows[rows["mode"] == mode]
        # Every comparison holds the test's modes; those of one law on one engine hold them once for each record.
        test = _rows_of(of_mode, study.methods[0], study.main_engine)
        ax.plot(test["level"], factor * test[f"test_{name}"], "x", color=TEST, markersize=4)
        ax.plot(study.levels, factor * _means(test, f"test_{name}", study), color=TEST, linewidth=2.4)
        _law_lines(ax, looks, of_mode, f"model_{name}", factor)
        tidy(ax, f"{letter} mode {mode}", label, looks.level_label if mode == numbers[-1] else "")
        level_axis(ax, study.levels)
        ax.ticklabel_format(axis="y", useOffset=False)
    figure.align_ylabels(axes)
    caption = (
        f"Natural frequency and damping ratio over level, {looks.test} and laws: means over a level’s records. A line "
        f"breaks where a mode was not found.{looks.engine_words}"
    )
    alt = f"Natural frequency and damping of {len(numbers)} modes over level, test and laws {looks.laws}."
    return Drawing(f"modes{study.suffix}", figure, caption, alt)


def contact(study: Study) -> Drawing:
    """Draw motion over the gap, time in contact and peak force over level, in every bushing."""
    looks, rows = Looks(study), frames.contact(study)
    rows["rms_over_gap"] = rows["displacement_rms_m"] / rows["gap_m"]
    rows["contact_pct"] = 100 * rows["contact_share"]
    columns = {"rms_over_gap": "RMS displacement / gap (1)", "contact_pct": "Time in contact (%)"}
    columns["contact_peak_n"] = "Peak contact force (N)"
    n = len(looks.rig.bushings)
    figure = sheet(1.9 * n, looks.key("test (probes)", markers=True))
    axes = figure.subplots(n, 3, squeeze=False, sharex=True, gridspec_kw={"hspace": 0.22, "wspace": 0.32})
    panels = ((bushing, name) for bushing in range(1, n + 1) for name in columns)
    for ax, letter, (bushing, name) in zip(axes.flat, letters(axes.size), panels):
        of_bushing = rows[rows["bushing"] == bushing]
        test = _means(_rows_of(of_bushing, "test", REPEAT_ROW[1]), name, study)
        ax.plot(study.levels, test, color=TEST, linewidth=2.4, marker="x", markersize=4)
        _law_lines(ax, looks, of_bushing, name)
        tidy(ax, f"{letter} bushing {bushing}", columns[name], looks.level_label if bushing == n else "")
        level_axis(ax, study.levels)
        ax.set_ylim(bottom=0)
    caption = (
        "Motion and contact in the bushings over level: means over a level’s records. Contact is not measured."
        f"{looks.engine_words}"
    )
    alt = f"RMS displacement over gap, time in contact and peak force over level, laws {looks.laws}."
    return Drawing(f"contact{study.suffix}", figure, caption, alt)


def _law_lines(ax: Axes, looks: Looks, rows: pd.DataFrame, name: str, factor: float = 1.0) -> None:
    for law, engine in looks.drawn:
        means = _means(_rows_of(rows, law, engine), name, looks.study)
        ax.plot(looks.study.levels, factor * means, **looks.line(law, engine, marker=True))


def _rows_of(rows: pd.DataFrame, law: str, engine: str) -> pd.DataFrame:
    return rows[(rows["law"] == law) & (rows["engine"] == engine)]


def _means(rows: pd.DataFrame, name: str, study: Study) -> np.ndarray:
    """Return the mean of the finite values of each level."""
    return rows.groupby("level")[name].mean().reindex(study.levels).to_numpy(float)
