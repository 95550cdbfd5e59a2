"""CSAC and CSF over frequency, sensor by sensor: Figures 9 and 10."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from clearance_mj.report.figures import Drawing
from clearance_mj.report.tables import Column, Table

from .context import Context
from .models import MODELS, REPEAT, knows, main_cases, name_of, place, test_words
from .result import Result
from .style import FONT, panel, sheet
from .texts import texts

__all__ = ["criterion_over_frequency"]

COLUMNS = 2


def criterion_over_frequency(context: Context, name: str, criterion: str, level) -> Result:
    """Draw a criterion over frequency for every sensor.

    Parameters
    ----------
    context : Context
        Gives test and models.
    name : str
        The item.
    criterion : str
        "csac" or "csf".
    level : float or None
        m/s²; the middle level for None.
    """
    words, level = texts(name), context.main_level if level is None else level
    means = _means(context, level, criterion)
    label = criterion.upper()
    caption = (
        f"{words['title']}, over a window of nine lines (4 Hz) in place of the responses. Engine {context.engines[0]}; "
        f"test: {test_words(context, level)}."
    )
    return Result(
        **words,
        method=(
            f"{label} sums over responses, where one response alone gives "
            f"{'1 by definition' if criterion == 'csac' else 'a ratio of magnitudes only'}. For a criterion of one "
            "sensor a window of nine lines around each line takes the place of the responses. Models and test as in "
            f"Figure 7: {test_words(context, level)}."
        ),
        shows=_shows(means, label, context.engines[0]),
        drawings=(Drawing(name, _draw(context, level, criterion), caption, f"{label} of each sensor over frequency."),),
        data={name: _lines(context, level, criterion), f"{name}_means": means},
        tables=(_table(context, means, label),),
        knows=knows(context),
    )


def _per_sensor(comparison, criterion) -> np.ndarray:
    return getattr(comparison, f"{criterion}_per_sensor")


def _lines(context, level, criterion) -> list[dict]:
    found = {"repeat": context.repeat(level)}
    found |= {f"{case.law} {case.engine}": case.comparison for case in context.cases(level)}
    frequency = found["repeat"].frequency
    return [
        {"sensor": sensor.node, "frequency_hz": f"{frequency[line]:g}"}
        | {name: f"{_per_sensor(comparison, criterion)[row, line]:.6g}" for name, comparison in found.items()}
        for row, sensor in enumerate(context.dataset.rig.sensors)
        for line in range(frequency.size)
    ]


def _means(context, level, criterion) -> list[dict]:
    """Mean over the lines of each model and sensor, the article's first."""
    nodes = [str(s.node) for s in context.dataset.rig.sensors]
    rows = []
    for kind in ("initial", "updated"):
        values = {node: row[f"{kind}_{criterion}"] for node, row in context.article.sensors.items()}
        rows.append({"law": f"article {kind}", "engine": "", **{f"sensor_{node}": v for node, v in values.items()}})
    runs = [(case.law, case.engine, case.comparison) for case in context.cases(level)]
    for law, engine, comparison in [*runs, ("repeat", "rig", context.repeat(level))]:
        means = _per_sensor(comparison, criterion).mean(axis=1)
        values = dict(zip((f"sensor_{node}" for node in nodes), means.tolist()))
        whole = {"sensor_mean": float(means.mean()), "over_all_sensors": float(getattr(comparison, criterion).mean())}
        rows.append({"law": law, "engine": engine, **values, **whole})
    return rows


def _draw(context, level, criterion) -> Figure:
    n = len(context.dataset.rig.sensors)
    figure = sheet(0.5 + 1.35 * -(-n // COLUMNS))
    axes = figure.subplots(-(-n // COLUMNS), COLUMNS, sharex=True, sharey=True)
    repeat = context.repeat(level)
    for row, ax in zip(range(n), axes.flat):
        ax.plot(repeat.frequency, _per_sensor(repeat, criterion)[row], **REPEAT)
        for case in main_cases(context, level):
            model = MODELS[case.law]
            ax.plot(repeat.frequency, _per_sensor(case.comparison, criterion)[row], label=model.label, **model.line)
        title, first = f"({chr(ord('a') + row)}) {place(context, row)}", row % COLUMNS == 0
        last = row >= n - COLUMNS
        panel(ax, title, "Frequency (Hz)" if last else "", f"{criterion.upper()} (1)" if first else "")
        ax.set_xlim(0, repeat.frequency[-1])
        ax.set_ylim(0, 1.05)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, fontsize=FONT - 1, frameon=False)
    return figure


def _shows(means, label, engine) -> str:
    ours = [m for m in means if m["engine"] in (engine, "rig")]
    words = "; ".join(f"{name_of(m['law'])} {m['sensor_mean']:.4f}" for m in ours)
    article = {m["law"]: m["sensor_mean"] for m in means if m["law"].startswith("article")}
    printed = " and ".join(f"{value:.4f} ({law.removeprefix('article ')})" for law, value in article.items())
    return f"Mean {label} over sensors and lines on {engine}: {words}. The article prints {printed}."


def _table(context, means, label) -> Table:
    nodes = [s.node for s in context.dataset.rig.sensors]
    columns = (
        Column("Model"),
        Column("Engine"),
        *(Column(f"sensor {node}", "", ".4f") for node in nodes),
        Column("mean", "", ".4f"),
        Column("over all sensors, as published", "", ".4f"),
    )
    keys = [*(f"sensor_{node}" for node in nodes), "sensor_mean", "over_all_sensors"]
    rows = tuple((name_of(m["law"]), m["engine"], *(m.get(key) for key in keys)) for m in means)
    return Table("means", f"Mean {label} over the lines: published (Table 2) and ours", columns, rows)
