"""Table 2: MRE, RMSE, FRAC, CSAC and CSF of every sensor."""

from __future__ import annotations

from matplotlib.figure import Figure

from clearance_mj.report.figures import Drawing
from clearance_mj.report.tables import MEASURES, Column, Table

from .context import Context
from .models import knows, look, name_of, test_words
from .result import Result
from .style import FONT, panel, sheet
from .texts import texts

__all__ = ["run"]

DEFINITIONS = {
    "mre": "mean over the lines of ||H_m| - |H_t|| / |H_t| (ours: the article does not define it)",
    "rmse_db": "√ mean over the lines of (20 log10 |H_m|/|H_t|)², dB (ours: the article gives no definition or unit)",
    "frac": "|Σ H_t H_m*|² / (Σ|H_t|² Σ|H_m|²) over the lines (Heylen and Lammens 1996; the only known definition)",
    "csac": "mean over the lines of CSAC over a window of nine lines (ours: it is 1 by definition for one sensor)",
    "csf": "mean over the lines of CSF over a window of nine lines (ours: the published one sums over sensors)",
}


def run(context: Context, levels=None) -> Result:
    """Compare FRFs sensor by sensor.

    Parameters
    ----------
    context : Context
        Gives test and models.
    levels : sequence of float, optional
        m/s², default: all; the middle level is shown.
    """
    levels = context.levels if levels is None else list(levels)
    rows = [row for level in levels for row in _rows(context, level)]
    published, shown = _published(context), [r for r in rows if r["level"] == context.main_level]
    caption = (
        "Table 2 as a figure, one panel for each measure, over the sensors. Squares: the article on its bench. Other "
        f"marks: ours on engine {context.engines[0]}, {test_words(context, context.main_level)}."
    )
    definitions = "; ".join(f"{m.label}: {DEFINITIONS[m.key]}" for m in MEASURES)
    return Result(
        **texts("table_2"),
        method=f"Test: {test_words(context, context.main_level)}; the CSV has every level. Definitions: {definitions}.",
        shows=_shows(context, rows, published),
        drawings=(Drawing("table_2", _draw(context, published + shown), caption, "Five measures over eight sensors."),),
        data={"table_2": published + rows},
        tables=(_means(published + shown), _sensors(context, published + shown)),
        knows=knows(context),
    )


def _published(context) -> list[dict]:
    return [
        {"level": "", "law": f"article {kind}", "engine": "", "sensor": sensor}
        | {m.key: row[f"{kind}_{m.key.removesuffix('_db')}"] for m in MEASURES}
        for kind in ("initial", "updated")
        for sensor, row in context.article.sensors.items()
    ]


def _rows(context, level) -> list[dict]:
    runs = [(case.law, case.engine, case.comparison) for case in context.cases(level)]
    nodes = [str(s.node) for s in context.dataset.rig.sensors]
    rows = []
    for law, engine, comparison in [*runs, ("repeat", "rig", context.repeat(level))]:
        columns, head = comparison.per_sensor, {"level": level, "law": law, "engine": engine}
        for i, node in enumerate(nodes):
            rows.append(head | {"sensor": node} | {m.key: float(columns[m.key][i]) for m in MEASURES})
        rows.append(head | {"sensor": "mean"} | {m.key: float(columns[m.key].mean()) for m in MEASURES})
    return rows


def _mean(rows, law, engine) -> dict:
    return next(r for r in rows if (r["law"], r["engine"], r["sensor"]) == (law, engine, "mean"))


def _shows(context, rows, published) -> str:
    best, engine = context.laws[-1].name, context.engines[0]
    target, better = _mean(published, "article updated", ""), []
    for level in dict.fromkeys(r["level"] for r in rows):
        ours = _mean([r for r in rows if r["level"] == level], best, engine)
        if all((ours[m.key] - target[m.key]) * (1 if m.perfect else -1) > 0 for m in MEASURES):
            better.append(level)
    ours = _mean([r for r in rows if r["level"] == context.main_level], best, engine)
    words = ", ".join(f"{m.label} {ours[m.key]:.4f}{' dB' * (m.unit == 'dB')} ({target[m.key]:.4f})" for m in MEASURES)
    return (
        f"Means of {name_of(best)} on {engine} at {context.main_level:g} m/s², the article's updated in brackets: "
        f"{words}. All five are better than the article's at "
        f"{', '.join(f'{level:g}' for level in better) or 'no level of'} m/s², of which FRAC is comparable and the "
        "others are by our definitions."
    )


def _draw(context, rows) -> Figure:
    figure = sheet(4.4)
    axes = figure.subplots(2, 3).ravel()
    shown = [r for r in rows if r["engine"] in ("", context.engines[0], "rig") and r["sensor"] != "mean"]
    for ax, letter, measure in zip(axes, "abcde", MEASURES):
        for law in dict.fromkeys(r["law"] for r in shown):
            found = [r for r in shown if r["law"] == law]
            style = {"ls": "-", "lw": 0.7, "ms": 4, "label": name_of(law)} | look(law)
            values = [r[measure.key] if measure.perfect == 0 else 1 - r[measure.key] for r in found]
            ax.semilogy([int(r["sensor"]) for r in found], values, **style)
        label = measure.label if measure.perfect == 0 else f"1 - {measure.label}"
        panel(ax, f"({letter})", "Sensor (number)", f"{label} ({measure.unit or '1'})")
        ax.set_xticks(range(1, len(context.dataset.rig.sensors) + 1))
    axes[-1].axis("off")
    axes[-1].legend(*axes[0].get_legend_handles_labels(), loc="center", fontsize=FONT - 1, frameon=False)
    return figure


def _means(rows) -> Table:
    columns = (Column("Model"), Column("Engine"), *(Column(m.label, m.unit, ".4f") for m in MEASURES))
    means = [r for r in rows if r["sensor"] == "mean"]
    body = tuple((name_of(r["law"]), r["engine"], *(r[m.key] for m in MEASURES)) for r in means)
    return Table("means", "Means over the sensors: published (RMSE without a unit) and ours", columns, body)


def _sensors(context, rows) -> Table:
    columns = (Column("Sensor"), Column("Model"), *(Column(m.label, m.unit, ".4f") for m in MEASURES))
    kept = [r for r in rows if r["engine"] in ("", context.engines[0]) and r["sensor"] != "mean"]
    kept.sort(key=lambda r: r["sensor"])
    body = tuple((r["sensor"], name_of(r["law"]), *(r[m.key] for m in MEASURES)) for r in kept)
    return Table("sensors", f"Every sensor: published and ours on {context.engines[0]}", columns, body)
