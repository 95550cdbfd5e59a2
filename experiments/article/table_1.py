"""Table 1: natural frequencies, their relative errors, and MAC."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from clearance_mj.report.figures import Drawing
from clearance_mj.report.tables import Column, Table

from .context import Context
from .models import knows, look, name_of, test_words
from .result import Result
from .style import FONT, panel, sheet
from .texts import texts

__all__ = ["MAC_TARGET", "run"]

MAC_TARGET = 0.95


def run(context: Context, levels=None) -> Result:
    """Compare natural frequencies and mode shapes.

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
        "Table 1 as a figure: (a) relative error of each natural frequency; (b) 1 - MAC, less is better on both. "
        f"Squares: the article on its bench. Other marks: ours on engine {context.engines[0]}, "
        f"{test_words(context, context.main_level)}."
    )
    return Result(
        **texts("table_1"),
        method=(
            "Modes of test and models come out of their FRFs by the same least-squares complex frequency method and "
            f"are paired by MAC and frequency. Test: {test_words(context, context.main_level)}; the CSV has every "
            "level. RE = |f_m - f_t| / f_t; MAC over the eight sensors."
        ),
        shows=_shows(context, rows, published),
        drawings=(Drawing("table_1", _draw(context, published + shown), caption, "Errors and MAC of four modes."),),
        data={"table_1": published + rows},
        tables=(_table(published + shown),),
        knows=knows(context),
    )


def _published(context) -> list[dict]:
    return [
        {"level": "", "law": f"article {kind}", "engine": "", "mode": mode, "test_hz": row["test_hz"]}
        | {"model_hz": row[f"{kind}_hz"], "relative_error_percent": row[f"{kind}_re_pct"], "mac": row[f"{kind}_mac"]}
        for kind in ("initial", "updated")
        for mode, row in context.article.modes.items()
    ]


def _rows(context, level) -> list[dict]:
    runs = [(case.law, case.engine, case.comparison) for case in context.cases(level)]
    rows = []
    for law, engine, comparison in [*runs, ("repeat", "rig", context.repeat(level))]:
        of = comparison.per_mode
        for i, mode in enumerate(of["mode"]):
            numbers = of["test_hz"][i], of["model_hz"][i], 100 * of["relative_error"][i], of["mac"][i]
            values = dict(zip(("test_hz", "model_hz", "relative_error_percent", "mac"), map(float, numbers)))
            rows.append({"level": level, "law": law, "engine": engine, "mode": int(mode), **values})
    return rows


def _of(rows, law, engine) -> list[dict]:
    return [r for r in rows if (r["law"], r["engine"]) == (law, engine)]


def _shows(context, rows, published) -> str:
    best, engine = context.laws[-1].name, context.engines[0]
    updated = {r["mode"]: r["relative_error_percent"] for r in _of(published, "article updated", "")}
    ours = _of(rows, best, engine)
    main = [r for r in ours if r["level"] == context.main_level]
    within = [r["relative_error_percent"] <= updated[r["mode"]] and r["mac"] >= MAC_TARGET for r in ours]
    missed = {r["level"] for r, fits in zip(ours, within) if not fits}  # also where a mode was not found
    met = sorted({r["level"] for r in ours} - missed)
    errors = ", ".join(f"{r['relative_error_percent']:.3f}" for r in main)
    printed = ", ".join(f"{value:.3f}" for value in updated.values())
    return (
        f"{name_of(best)} on {engine} at {context.main_level:g} m/s²: errors {errors} % in modes 1-4 (article, "
        f"updated: {printed} %), least MAC {min(r['mac'] for r in main):.6f}. Errors within the article's updated "
        f"column and MAC >= {MAC_TARGET} in all four modes at "
        f"{', '.join(f'{level:g}' for level in met) or 'no level of'} m/s²."
    )


def _draw(context, rows) -> Figure:
    figure = sheet(3.0)
    left, right = figure.subplots(1, 2)
    looks = dict.fromkeys((r["law"], r["engine"]) for r in rows if r["engine"] in ("", context.engines[0]))
    for i, (law, engine) in enumerate(looks):
        found = _of(rows, law, engine)
        place = [r["mode"] + 0.09 * (i - (len(looks) - 1) / 2) for r in found]
        style = {"ls": "none", "ms": 5, "label": name_of(law)} | look(law)
        left.semilogy(place, [r["relative_error_percent"] for r in found], **style)
        right.semilogy(place, [1 - r["mac"] for r in found], **style)
    for ax, title, label in ((left, "(a)", "Relative error of frequency (%)"), (right, "(b)", "1 - MAC (1)")):
        panel(ax, title, "Mode (number)", label)
        ax.set_xticks(np.unique([r["mode"] for r in rows]))
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=FONT - 1, frameon=False)
    return figure


def _table(rows) -> Table:
    columns = (
        Column("Model"),
        Column("Engine"),
        Column("Mode", "", "d"),
        Column("Test", "Hz", ".2f"),
        Column("Model", "Hz", ".2f"),
        Column("RE", "%", ".4f"),
        Column("MAC", "", ".5f"),
    )
    body = tuple(
        (name_of(r["law"]), r["engine"], r["mode"], r["test_hz"], r["model_hz"], r["relative_error_percent"], r["mac"])
        for r in rows
    )
    return Table("modes", "Natural frequencies: published and ours", columns, body)
