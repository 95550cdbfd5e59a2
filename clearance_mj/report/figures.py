"""The figures of a report. Each function draws one on a `matplotlib.figure.Figure` of its own: no global state.

Black is the test, grey the test repeated with another seed; a law keeps its colour (Okabe and Ito's palette, with the
wine red of Tol's) and an engine its line style from figure to figure. Engines beside the main one are drawn for the
best law only: with those of all laws the curves hide each other.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import matplotlib
import matplotlib.image
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import NullLocator, ScalarFormatter

from ..statistics import repeatability
from . import tables

if TYPE_CHECKING:
    from ..rig import Rig
    from ..study import Study

__all__ = [
    "Drawing",
    "contact",
    "correlation",
    "correlation_figures",
    "csac_sensors",
    "csf_sensors",
    "frf_bushings",
    "frf_figures",
    "frf_others",
    "modes",
    "rig_drawing",
    "verdict",
]

DPI = 150
WIDTH = 7.5
"""in"""
FONT = 8
"""pt"""
TEST, REPEAT, FAINT = "#000000", "#8c8c8c", "#d9d9d9"
LAWS = ("#0072b2", "#d55e00", "#882255", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
ENGINES = ("-", (0, (4, 1.5)), (0, (1, 1.2)))
LEGEND_COLUMNS = 5
MARKERS = ("o", "s", "^")
FREQUENCIES = (5, 10, 20, 50, 100, 200)
"""Hz, labelled on the frequency axis"""


@dataclass(frozen=True, eq=False)
class Drawing:
    """A figure with the words that go with it."""

    name: str
    """also the name of its file"""
    figure: Figure
    """what is drawn"""
    caption: str
    """what it shows, in words"""
    alt: str
    """text for those who cannot see it"""
    sharp: bool = True
    """to be shown as SVG: the figures of the lesser levels are many and stay PNG"""

    def png(self) -> bytes:
        """Return the figure as PNG with 150 dots per inch, in 16 shades of each colour: half the size."""
        self.figure.set_dpi(DPI)
        canvas = FigureCanvasAgg(self.figure)
        canvas.draw()
        shades = np.round(np.asarray(canvas.buffer_rgba())[..., :3] / 17.0).astype(np.uint8) * np.uint8(17)
        buffer = io.BytesIO()
        matplotlib.image.imsave(buffer, shades, format="png", dpi=DPI)
        return buffer.getvalue()

    def svg(self) -> bytes:
        """Return the figure as SVG, to a hundredth of a point; the same figure gives the same bytes."""
        buffer = io.BytesIO()
        with matplotlib.rc_context({"svg.hashsalt": self.name}):
            self.figure.savefig(buffer, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
        return _POINT.sub(lambda m: b"%c%.2f %.2f" % (m[1], float(m[2]), float(m[3])), buffer.getvalue())


_POINT = re.compile(rb"\b([ML]) (-?[0-9.]+) (-?[0-9.]+) \n")


# Looks.


def _sheet(height, handles=(), left=0.58, right=0.12, bottom=0.42, titled=0.26) -> Figure:
    """A figure of the report's width: ``height`` for its panels, their titles, margins (all in), a legend above."""
    legend_rows = -(-len(handles) // LEGEND_COLUMNS)
    top = titled + 0.17 * legend_rows
    whole = bottom + height + top
    figure = Figure(figsize=(WIDTH, whole), facecolor="white")
    figure.subplots_adjust(left=left / WIDTH, right=1 - right / WIDTH, bottom=bottom / whole, top=1 - top / whole)
    if handles:
        figure.legend(
            handles=handles,
            loc="upper center",
            ncols=-(-len(handles) // legend_rows),
            fontsize=FONT - 0.5,
            frameon=False,
            handlelength=2.4,
            columnspacing=1.6,
            labelspacing=0.3,
            borderaxespad=0.1,
        )
    return figure


def _tidy(ax, title="", ylabel="", xlabel=""):
    ax.tick_params(labelsize=FONT - 1, width=0.6, length=3)
    ax.grid(True, color=FAINT, linewidth=0.5)
    ax.set_axisbelow(True)
    for spine in ax.spines.values():
        spine.set_linewidth(0.6)
    ax.set_title(title, fontsize=FONT, loc="left", pad=3)
    ax.set_ylabel(ylabel, fontsize=FONT)
    ax.set_xlabel(xlabel, fontsize=FONT)


def _frequency_axis(ax, band, labelled):
    ax.set_xscale("log")
    ax.set_xlim(*band)
    ax.set_xticks([f for f in FREQUENCIES if band[0] <= f <= band[1]])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.tick_params(axis="x", labelbottom=labelled)
    if labelled:
        ax.set_xlabel("Frequency (Hz)", fontsize=FONT)


def _level_axis(ax, study):
    ax.set_xscale("log")
    ax.set_xticks(study.levels, [f"{level:g}" for level in study.levels])
    ax.xaxis.set_minor_locator(NullLocator())


def _law_colour(study, law) -> str:
    names = [k.name for k in study.laws]
    return LAWS[names.index(law) % len(LAWS)]


def _engine_style(study, engine) -> dict:
    i = tables.engines(study).index(engine)
    return {"linestyle": ENGINES[i % len(ENGINES)], "linewidth": 1.0 if i == 0 else 0.8}


def _engine_marker(study, engine) -> str:
    return MARKERS[tables.engines(study).index(engine) % len(MARKERS)]


def _key(study, test="", repeat="", engines=True, markers=False) -> list[Line2D]:
    """Legend: the test, the repeat, a line per law, a grey line per engine."""
    handles = [Line2D([], [], color=TEST, linewidth=2.4, label=test)] if test else []
    if repeat:
        handles.append(Line2D([], [], color=REPEAT, linewidth=1.5, label=repeat))
    handles += [Line2D([], [], color=_law_colour(study, k.name), label=f"law “{k.name}”") for k in study.laws]
    for engine in tables.engines(study) if engines else ():
        marker = {"marker": _engine_marker(study, engine), "markersize": 3.5} if markers else {}
        handles.append(
            Line2D([], [], color="#555555", **_engine_style(study, engine), **marker, label=f"engine {engine}")
        )
    return handles


def _letters(n) -> list[str]:
    return [f"({chr(ord('a') + i)})" if i < 26 else f"({i + 1})" for i in range(n)]


def _decibel(value) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return 20 * np.log10(np.abs(value))


def _phase(value) -> np.ndarray:
    """Degrees, -180 to 180, with a gap where it wraps."""
    phase = np.degrees(np.angle(value))
    phase[1:][np.abs(np.diff(phase)) > 180] = np.nan
    return phase


# What the figures of one level share.


def _drawn(study) -> list[tuple[str, str]]:
    """Laws and engines that are drawn: the best law on the other engines first, so that the main one is on top."""
    main, best = tables.main_engine(study), tables.best_law(study)
    others = [(best, engine) for engine in reversed(tables.engines(study)) if engine != main]
    return [*others, *((law.name, main) for law in study.laws)]


def _cases(study, level):
    """First case of what is drawn."""
    return [study.case(law, engine, level) for law, engine in _drawn(study)]


def _main_cases(study, level):
    return [study.case(law.name, tables.main_engine(study), level) for law in study.laws]


def _test_names(study, level) -> list[str]:
    """Names of the level's records; the laws are drawn under the excitation of the first."""
    return [r.name for r in study.dataset.validate if r.level == level]


def _sensor_title(rig: Rig, row) -> str:
    sensor = rig.sensors[row]
    inside = [i + 1 for i, b in enumerate(rig.bushings) if b.ends[0] <= sensor.position <= b.ends[1]]
    place = f", bushing {inside[0]}" if inside else f", {sensor.position:g} m"
    return f"sensor {sensor.node}{place}"


def _at_bushings(rig: Rig) -> list[int]:
    """Rows of the sensors that sit in a bushing."""
    return [
        row
        for row, sensor in enumerate(rig.sensors)
        if any(b.ends[0] <= sensor.position <= b.ends[1] for b in rig.bushings)
    ]


def _level_words(study, level) -> str:
    kind = "synthetic test" if tables.is_synthetic(study.dataset) else "test"
    return f"{level:g} {tables.excitation_unit(study)} RMS, {kind}"


def _words(study, level) -> str:
    return f"Level {_level_words(study, level)} record {_test_names(study, level)[0]}.{_engine_words(study)}"


def _engine_words(study) -> str:
    if len(tables.engines(study)) == 1:
        return ""
    main, best = tables.main_engine(study), tables.best_law(study)
    return f" Laws on engine {main}; on the others “{best}” only: where one line style shows, the engines coincide."


def _unit(study) -> str:
    return "dB re 1 m/s²/N" if tables.excitation_unit(study) == "N" else "dB re 1"


def _overlay(ax, study, level, row, transform: Callable):
    """One response of test, repeat and all models."""
    first, *others = _test_names(study, level)
    test = study.tests[first]
    for name in others[:1]:
        ax.plot(test.frequency, transform(study.tests[name].functions[row]), color=REPEAT, linewidth=0.8)
    ax.plot(test.frequency, transform(test.functions[row]), color=TEST, linewidth=2.4)
    for case in _cases(study, level):
        style = _engine_style(study, case.engine)
        ax.plot(test.frequency, transform(case.frf.functions[row]), color=_law_colour(study, case.law), **style)


def _magnitude(ax, study, level, row):
    """Overlay of magnitudes. The test fits; lines where a model is nearly zero are cut, not to squeeze the rest."""
    _overlay(ax, study, level, row, _decibel)
    test = _finite(_decibel(study.tests[_test_names(study, level)[0]].functions[row]))
    models = [_finite(_decibel(case.frf.functions[row])) for case in _cases(study, level)]
    low = min(test.min(), *(np.percentile(model, 0.5) for model in models))
    high = max(test.max(), *(model.max() for model in models))
    ax.set_ylim(low - 2, high + 2)


def _finite(values) -> np.ndarray:
    """The finite values, or a zero if there is none."""
    finite = values[np.isfinite(values)]
    return finite if finite.size else np.zeros(1)


def _coherence(ax, study, level, row, ylabel=""):
    test = study.tests[_test_names(study, level)[0]]
    if test.coherence is not None:
        ax.plot(test.frequency, test.coherence[row, 0], color=TEST, linewidth=0.7)
    _tidy(ax, ylabel=ylabel)
    ax.set_ylim(0, 1.1)
    ax.set_yticks([0, 1])


def _band(study, level):
    frequency = study.tests[_test_names(study, level)[0]].frequency
    return frequency[0], frequency[-1]


def _overlay_key(study, level):
    return _key(study, "test", "test, other seed" if len(_test_names(study, level)) > 1 else "")


def _floor_key(study, level, engines=True):
    return _key(study, repeat="repeat floor" if level in study.repeatability else "", engines=engines)


def frf_bushings(study: Study, level: float) -> Drawing | None:
    """Magnitude, phase and coherence of the sensors at the bushings.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        Which level.
    """
    rig = study.dataset.rig
    rows = _at_bushings(rig)
    if not rows:
        return None
    figure = _sheet(4.2, _overlay_key(study, level))
    ratios = {"height_ratios": (4, 2, 1), "hspace": 0.1, "wspace": 0.14}
    axes = figure.subplots(3, len(rows), squeeze=False, gridspec_kw=ratios)
    for letter, row, (magnitude, phase, coherence) in zip(_letters(len(rows)), rows, axes.T):
        _magnitude(magnitude, study, level, row)
        _overlay(phase, study, level, row, _phase)
        _tidy(magnitude, f"{letter} {_sensor_title(rig, row)}")
        _tidy(phase)
        phase.set_ylim(-190, 190)
        phase.set_yticks([-180, -90, 0, 90, 180])
        _coherence(coherence, study, level, row)
        for ax in (magnitude, phase, coherence):
            _frequency_axis(ax, _band(study, level), ax is coherence)
    for ax, label in zip(axes[:, 0], (f"|H| ({_unit(study)})", "Phase (°)", "γ² (1)")):
        ax.set_ylabel(label, fontsize=FONT)
    figure.align_ylabels(axes[:, 0])
    caption = (
        "FRFs at the bushings: magnitude, phase, and the coherence γ² of the test. Dips of a "
        "model far below the test are cut. "
        f"{_words(study, level)}"
    )
    alt = f"FRF overlay at the bushings: test and laws {_law_names(study)}, {_level_words(study, level)}."
    return Drawing(f"frf_bushings_level_{level:g}", figure, caption, alt, level == study.main_level)


def frf_others(study: Study, level: float) -> Drawing | None:
    """Magnitude and coherence of the other sensors.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        Which level.
    """
    rig = study.dataset.rig
    rows = [row for row in range(len(rig.sensors)) if row not in _at_bushings(rig)]
    if not rows:
        return None
    n_lines = -(-len(rows) // 2)
    figure = _sheet(2.1 * n_lines, _overlay_key(study, level))
    grid = figure.add_gridspec(n_lines, 2, hspace=0.2, wspace=0.14)
    for i, (letter, row) in enumerate(zip(_letters(len(rows)), rows)):
        magnitude, coherence = grid[i // 2, i % 2].subgridspec(2, 1, height_ratios=(5, 1), hspace=0.1).subplots()
        _magnitude(magnitude, study, level, row)
        first = i % 2 == 0
        _tidy(magnitude, f"{letter} {_sensor_title(rig, row)}", f"|H| ({_unit(study)})" if first else "")
        _coherence(coherence, study, level, row, "γ² (1)" if first else "")
        _frequency_axis(magnitude, _band(study, level), False)
        _frequency_axis(coherence, _band(study, level), i >= len(rows) - 2)
        figure.align_ylabels((magnitude, coherence))
    caption = (
        "FRFs at the other sensors: magnitude; strips: the coherence γ² of the test. Dips of "
        "a model far below the test are cut. "
        f"{_words(study, level)}"
    )
    alt = f"FRF overlay at the other sensors: test and laws {_law_names(study)}, {_level_words(study, level)}."
    return Drawing(f"frf_others_level_{level:g}", figure, caption, alt, level == study.main_level)


def csac_sensors(study: Study, level: float) -> Drawing:
    """Windowed CSAC of every sensor.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        Which level.
    """
    return _per_sensor(study, level, "CSAC", "csac_per_sensor")


def csf_sensors(study: Study, level: float) -> Drawing:
    """Windowed CSF of every sensor.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        Which level.
    """
    return _per_sensor(study, level, "CSF", "csf_per_sensor")


def _per_sensor(study, level, label, field) -> Drawing:
    rig = study.dataset.rig
    n = len(rig.sensors)
    n_lines = -(-n // 2)
    figure = _sheet(1.45 * n_lines, _floor_key(study, level, engines=False))
    grid = figure.add_gridspec(n_lines, 2, hspace=0.28, wspace=0.14)
    comparisons = [(_law_colour(study, c.law), c.comparison) for c in _main_cases(study, level)]
    if level in study.repeatability:
        comparisons.insert(0, (REPEAT, study.repeatability[level]))
    for row, letter in enumerate(_letters(n)):
        ax = figure.add_subplot(grid[row // 2, row % 2])
        for colour, comparison in comparisons:
            ax.plot(comparison.frequency, getattr(comparison, field)[row], color=colour, linewidth=1.0)
        _tidy(ax, f"{letter} {_sensor_title(rig, row)}", f"{label} (1)" if row % 2 == 0 else "")
        ax.set_ylim(0, 1.04)
        _frequency_axis(ax, _band(study, level), row >= n - 2)
    caption = (
        f"{label} of every sensor over frequency by our variant that takes a window "
        f"of nine lines in place of the responses; engine {tables.main_engine(study)}. "
        f"Level {_level_words(study, level)} record {_test_names(study, level)[0]}."
    )
    alt = f"{label} over frequency for each of {n} sensors, laws {_law_names(study)}, {_level_words(study, level)}."
    return Drawing(f"{label.lower()}_sensors_level_{level:g}", figure, caption, alt, level == study.main_level)


def correlation(study: Study, level: float) -> Drawing:
    """Standard CSAC and CSF over all sensors.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        Which level.
    """
    figure = _sheet(3.4, _floor_key(study, level), titled=0.08)
    axes = figure.subplots(2, 1, gridspec_kw={"hspace": 0.1})
    for ax, label, field in zip(axes, ("CSAC", "CSF"), ("csac", "csf")):
        if level in study.repeatability:
            floor = study.repeatability[level]
            ax.plot(floor.frequency, getattr(floor, field), color=REPEAT, linewidth=1.5)
        for case in _cases(study, level):
            style = _engine_style(study, case.engine) | {"color": _law_colour(study, case.law)}
            ax.plot(case.comparison.frequency, getattr(case.comparison, field), **style)
        _tidy(ax, ylabel=f"{label} over all sensors (1)")
        ax.set_ylim(0, 1.04)
        _frequency_axis(ax, _band(study, level), field == "csf")
    caption = f"CSAC and CSF as published, over all sensors at each line. {_words(study, level)}"
    alt = f"CSAC and CSF over all sensors against frequency, laws {_law_names(study)}, {_level_words(study, level)}."
    return Drawing(f"correlation_level_{level:g}", figure, caption, alt, level == study.main_level)


def frf_figures(study: Study, level: float) -> list[Drawing]:
    """FRF overlays of one level: sensors at the bushings, other sensors.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        Which level.
    """
    drawings = (frf_bushings(study, level), frf_others(study, level))
    return [drawing for drawing in drawings if drawing]


def correlation_figures(study: Study, level: float) -> list[Drawing]:
    """CSAC and CSF of one level: over all sensors, and of each.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        Which level.
    """
    return [correlation(study, level), csac_sensors(study, level), csf_sensors(study, level)]


def _law_names(study) -> str:
    return ", ".join(k.name for k in study.laws)


# Figures over level.


def verdict(study: Study) -> Drawing:
    """Distance of every measure from perfect agreement over level, with intervals, beside the repeat floor.

    Parameters
    ----------
    study : Study
        The study.
    """
    figure = _sheet(5.9, left=0.68)
    axes = figure.subplots(3, 3, gridspec_kw={"hspace": 0.5, "wspace": 0.38}).ravel()
    rows = study.rows()
    for ax, letter, measure in zip(axes, _letters(len(tables.OVERALL)), tables.OVERALL):
        _verdict_lines(ax, study, rows, measure)
        quantity = f"1 − {measure.label}" if measure.perfect else measure.label
        _tidy(ax, f"{letter} {quantity} ({measure.unit or '1'})", xlabel=f"Level ({tables.excitation_unit(study)} RMS)")
        ax.set_yscale("log")
        _level_axis(ax, study)
    for ax in axes[len(tables.OVERALL) :]:
        ax.axis("off")
    handles = _key(study, repeat="repeat floor" if study.repeatability else "", markers=True)
    axes[-2].legend(handles=handles, loc="center left", fontsize=FONT, frameon=False, handlelength=3, ncols=2)
    of = "the synthetic validation records" if tables.is_synthetic(study.dataset) else "the validation records"
    caption = (
        f"Agreement with {of} over level, less is better: means over all sensors (modes) and over the records of a "
        "level, with their 95 % intervals over seeds (bars; of the repeat floor, a band); small marks: each record. "
        f"The repeat floor compares two records of the rig at one level with different seeds.{_engine_words(study)}"
    )
    names = _law_names(study)
    return Drawing("verdict", figure, caption, f"Seven measures over level for laws {names} and the floor.")


def _verdict_lines(ax, study, rows, measure):
    floor = [r for r in rows if r["law"] == tables.FLOOR["law"]]
    if floor:
        levels, (value, low, high) = [r["level"] for r in floor], _errors(floor, measure)
        ax.fill_between(levels, low, high, color=REPEAT, alpha=0.25, linewidth=0)
        ax.plot(levels, value, color=REPEAT, linewidth=2.2, marker="D", markersize=3.5)
    drawn = _drawn(study)
    for i, (law, engine) in enumerate(drawn):
        own = [r for r in rows if (r["law"], r["engine"]) == (law, engine)]
        value, low, high = _errors(own, measure)
        aside = 1.03 ** (i - (len(drawn) - 1) / 2)  # bars of several laws side by side
        colour, levels = _law_colour(study, law), [aside * r["level"] for r in own]
        style = _engine_style(study, engine) | {"marker": _engine_marker(study, engine), "markersize": 3}
        ax.plot(levels, value, color=colour, **style)
        ax.vlines(levels, low, high, color=colour, linewidth=0.8)
        for level, comparisons in study.of_law(law, engine).items():
            seeds_of = [abs(measure.perfect - c.summary()[measure.key]) for c in comparisons]
            ax.plot([aside * level] * len(seeds_of), seeds_of, "_", color=colour, markersize=3, markeredgewidth=0.7)


def _errors(rows, measure):
    """Distance from perfect agreement: value, low, high."""
    found = [repeatability.interval_of(r, measure.key) for r in rows]
    value, *limits = np.abs(measure.perfect - np.array([(i.value, i.low, i.high) for i in found])).T
    return value, np.min(limits, axis=0), np.max(limits, axis=0)


def modes(study: Study) -> Drawing:
    """Natural frequency (backbone) and damping of every mode over level, test and laws.

    Parameters
    ----------
    study : Study
        The study.
    """
    rows = tables.mode_rows(study)
    numbers = sorted({r["mode"] for r in rows})
    figure = _sheet(1.55 * len(numbers), _key(study, "test (× each record)", markers=True))
    axes = figure.subplots(len(numbers), 2, squeeze=False, sharex=True, gridspec_kw={"hspace": 0.22, "wspace": 0.22})
    labels = {"hz": ("Natural frequency (Hz)", 1), "damping": ("Damping ratio (%)", 100)}
    letters = _letters(axes.size)
    for line, mode in zip(axes, numbers):
        of_mode = [r for r in rows if r["mode"] == mode]
        for ax, (key, (label, factor)) in zip(line, labels.items()):
            _backbones(ax, study, of_mode, key, factor)
            _tidy(ax, f"{letters.pop(0)} mode {mode}", label)
            _level_axis(ax, study)
            ax.ticklabel_format(axis="y", useOffset=False)
    for ax in axes[-1]:
        ax.set_xlabel(f"Level ({tables.excitation_unit(study)} RMS)", fontsize=FONT)
    figure.align_ylabels(axes)
    of = "synthetic test" if tables.is_synthetic(study.dataset) else "test"
    caption = (
        f"Natural frequency and damping ratio over level, {of} and laws: means over a level’s records. A line breaks "
        f"where a mode was not found.{_engine_words(study)}"
    )
    alt = f"Natural frequency and damping of {len(numbers)} modes over level, test and laws {_law_names(study)}."
    return Drawing("modes", figure, caption, alt)


def _backbones(ax, study, rows, key, factor):
    law, engine = study.laws[0].name, tables.main_engine(study)
    # Every comparison holds the test's modes; those of one law on one engine hold them once for each record.
    test = [r for r in rows if (r["law"], r["engine"]) == (law, engine)]
    ax.plot([r["level"] for r in test], [factor * r[f"test_{key}"] for r in test], "x", color=TEST, markersize=4)
    mean = [factor * _level_mean(test, level, f"test_{key}") for level in study.levels]
    ax.plot(study.levels, mean, color=TEST, linewidth=2.4)
    for law, engine in _drawn(study):
        own = [r for r in rows if (r["law"], r["engine"]) == (law, engine)]
        values = [factor * _level_mean(own, level, f"model_{key}") for level in study.levels]
        style = _engine_style(study, engine) | {"marker": _engine_marker(study, engine), "markersize": 3}
        ax.plot(study.levels, values, color=_law_colour(study, law), **style)


def _level_mean(rows, level, key) -> float:
    values = [r[key] for r in rows if r["level"] == level and np.isfinite(r[key])]
    return float(np.mean(values)) if values else np.nan


def contact(study: Study) -> Drawing:
    """Motion over the gap, time in contact and peak force over level, in every bushing.

    Parameters
    ----------
    study : Study
        The study.
    """
    rows, n = tables.contact_rows(study), len(study.dataset.rig.bushings)
    rows = [
        r | {"rms_over_gap": r["displacement_rms_m"] / r["gap_m"], "contact_pct": 100 * r["contact_share"]}
        for r in rows
    ]
    columns = {
        "rms_over_gap": "RMS displacement / gap (1)",
        "contact_pct": "Time in contact (%)",
        "contact_peak_n": "Peak contact force (N)",
    }
    figure = _sheet(1.9 * n, _key(study, "test (probes)", markers=True))
    axes = figure.subplots(n, 3, squeeze=False, sharex=True, gridspec_kw={"hspace": 0.22, "wspace": 0.32})
    letters = _letters(axes.size)
    for i, line in enumerate(axes):
        of_bushing = [r for r in rows if r["bushing"] == i + 1]
        for ax, (key, label) in zip(line, columns.items()):
            _contact_lines(ax, study, of_bushing, key)
            title = f"{letters.pop(0)} bushing {i + 1}"
            _tidy(ax, title, label, f"Level ({tables.excitation_unit(study)} RMS)" if i == n - 1 else "")
            _level_axis(ax, study)
            ax.set_ylim(bottom=0)
    caption = (
        "Motion and contact in the bushings over level: means over a level’s records. Contact is not measured."
        f"{_engine_words(study)}"
    )
    alt = f"RMS displacement over gap, time in contact and peak force over level, laws {_law_names(study)}."
    return Drawing("contact", figure, caption, alt)


def _contact_lines(ax, study, rows, key):
    test = [_level_mean([r for r in rows if r["law"] == "test"], level, key) for level in study.levels]
    ax.plot(study.levels, test, color=TEST, linewidth=2.4, marker="x", markersize=4)
    for law, engine in _drawn(study):
        own = [r for r in rows if (r["law"], r["engine"]) == (law, engine)]
        style = _engine_style(study, engine) | {"marker": _engine_marker(study, engine), "markersize": 3}
        values = [_level_mean(own, level, key) for level in study.levels]
        ax.plot(study.levels, values, color=_law_colour(study, law), **style)


# The rig.

HALF_SHAFT, DRAWN_GAP, BLOCK, PLATE = 0.10, 0.13, 0.22, -1.15
"""Across the shaft nothing is to scale: half thickness, gap, height of a bushing's halves, the base plate's top"""


def rig_drawing(rig: Rig) -> Drawing:
    """Side view of the rig, to scale along the shaft.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    figure = _sheet(2.8, left=0.15, right=0.15, titled=0.05)
    ax, length = figure.subplots(), rig.beam.length
    ax.add_patch(Rectangle((0, -HALF_SHAFT), length, 2 * HALF_SHAFT, facecolor="#cccccc", edgecolor="#444444", lw=0.8))
    ax.add_patch(
        Rectangle((-0.05 * length, -0.45), 0.05 * length, 0.9, facecolor="#eeeeee", edgecolor="#444444", hatch="////")
    )
    for i, bushing in enumerate(rig.bushings):
        _draw_bushing(ax, i, bushing, length)
    _draw_sensors(ax, rig)
    for mass in rig.masses:
        _draw_mass(ax, mass)
    _draw_shaker(ax, rig)
    _tidy(ax, xlabel="Distance from the clamp (m)")
    ax.grid(False)
    ax.set_yticks([])
    for side in ("left", "right", "top"):
        ax.spines[side].set_visible(False)
    ax.set_xlim(-0.12 * length, 1.13 * length)
    ax.set_ylim(PLATE - 0.62, 1.02)
    caption = (
        f"Rig “{rig.name}” out of its own data: to scale along the shaft, not across it; the gaps (radial) are drawn "
        f"wide. Numbered squares: accelerometers. Yellow: grease. {_shaft(rig.beam)}"
    )
    alt = f"Side view of rig {rig.name}: clamped shaft, {len(rig.bushings)} bushings, {len(rig.sensors)} sensors."
    return Drawing("rig", figure, caption, alt)


def _shaft(beam) -> str:
    across = ((beam.diameter, "diameter"), (beam.width, "width"), (beam.height, "height"))
    section = ", ".join(f"{name} {1e3 * size:.4g} mm" for size, name in across if size)
    stuff = f"E\N{NO-BREAK SPACE}= {beam.young_modulus / 1e9:.4g} GPa, ρ\N{NO-BREAK SPACE}= {beam.density:.4g} kg/m³"
    return f"Shaft: length {beam.length:.4g} m, {section}, {stuff}."


def _draw_bushing(ax, i, bushing, length):
    left, inner = bushing.ends[0], HALF_SHAFT + DRAWN_GAP
    for bottom in (HALF_SHAFT, -inner):
        ax.add_patch(Rectangle((left, bottom), bushing.length, DRAWN_GAP, facecolor="#ffee88", edgecolor="none"))
    for bottom in (inner, -inner - BLOCK):
        ax.add_patch(Rectangle((left, bottom), bushing.length, BLOCK, facecolor="#777777", edgecolor="#333333", lw=0.6))
    ax.plot([bushing.position] * 2, [-inner - BLOCK, PLATE], color="#777777", linewidth=2.5, zorder=0)
    words = f"bushing {i + 1}\ngap {1e3 * bushing.gap:.3g} mm\nlength {1e3 * bushing.length:.3g} mm"
    place = {"ha": "right", "va": "top", "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 1}}
    ax.text(bushing.position - 0.01 * length, -inner - BLOCK - 0.06, words, fontsize=FONT - 1, **place)


def _draw_sensors(ax, rig):
    """Numbered squares above the shaft, a row higher where they would cover their neighbour."""
    box = {"boxstyle": "square,pad=0.25", "facecolor": "white", "edgecolor": LAWS[0], "linewidth": 0.9}
    row, previous = 0, -np.inf
    for sensor in sorted(rig.sensors, key=lambda s: s.position):
        close = sensor.position - previous < 0.035 * rig.beam.length
        row, previous = (row + 1) % 2 if close else 0, sensor.position
        height = HALF_SHAFT + DRAWN_GAP + BLOCK + 0.15 + 0.22 * row
        ax.plot([sensor.position] * 2, [HALF_SHAFT, height], color=LAWS[0], linewidth=0.8, zorder=1)
        ax.text(sensor.position, height, f"{sensor.node}", ha="center", va="bottom", fontsize=FONT - 0.5, bbox=box)


def _draw_mass(ax, mass):
    ax.plot([mass.position], [0], "o", markersize=15, markerfacecolor="#999999", markeredgecolor="#333333")
    words = f"{mass.name or 'mass'}\n{mass.mass:.3g} kg"
    ax.text(mass.position, -0.33, words, ha="center", va="top", fontsize=FONT - 1)


def _draw_shaker(ax, rig):
    length, arrow = rig.beam.length, {"arrowstyle": "<->", "color": LAWS[1], "linewidth": 1.4}
    plate = (-0.05 * length, PLATE - 0.14), 1.1 * length, 0.14
    ax.add_patch(Rectangle(*plate, facecolor="#bbbbbb", edgecolor="#333333", lw=0.6))
    ax.plot([-0.025 * length] * 2, [-0.45, PLATE], color="#777777", linewidth=2.5, zorder=0)
    if rig.shaker.kind == "force":
        x, words = rig.shaker.position, "shaker force"
        ax.annotate("", (x, -HALF_SHAFT), (x, PLATE), arrowprops=arrow, zorder=2)
    else:
        x, words = 0.5 * length, "base acceleration: plate, clamp and bushings move together"
        ax.annotate("", (x, PLATE - 0.15), (x, PLATE - 0.55), arrowprops=arrow)
    ax.text(x + 0.02 * length, PLATE - 0.36, words, va="center", fontsize=FONT - 1, color=LAWS[1])
