"""Table 1: natural frequencies, their relative errors, and MAC."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table
from clearance_mj.study import Study

from .improvement import improvements
from .models import cases, look, name_of, prior_information, rows_of, test_words
from .published import MODELS, Printed
from .result import Item, Result, legend, panel, sheet, to_table

MAC_TARGET = 0.95
COLUMNS = ["level", "law", "engine", "mode", "test_hz", "model_hz", "relative_error_percent", "mac"]


def run(item: Item, study: Study, levels: Sequence[float] | None = None) -> Result:
    """Compare natural frequencies and mode shapes at some levels (default: all); the middle level is shown."""
    rows = pd.concat([_rows(study, level) for level in levels or study.levels], ignore_index=True)
    published, main = _published(), test_words(study, study.main_level)
    shown = pd.concat([published, rows[rows["level"] == study.main_level]], ignore_index=True)
    gains, gain_table = improvements(study, ("MAC", "frequency error"))
    caption = (
        "(a) relative error of each natural frequency; (b) 1 - MAC; less is better on both. Squares: the article; "
        f"other marks: ours on engine {study.engines[0]}."
    )
    return Result(
        method=(
            "Modes of test and models are extracted from their FRFs by the least-squares complex frequency method and "
            f"paired by MAC and frequency. Test: {main}. RE = |f_m - f_t| / f_t; MAC over the eight sensors."
        ),
        shows=_shows(study, rows, published),
        drawings=(Drawing(item.name, _draw(study, shown), caption, "Errors and MAC of four modes."),),
        data={item.name: pd.concat([published, rows], ignore_index=True), f"{item.name}_improvements": gains},
        tables=(_table(shown), gain_table),
        prior_information=prior_information(study),
    )


def _published() -> pd.DataFrame:
    modes, frames = Printed.load(1).numbers, []
    for kind in MODELS:
        of_kind = modes[["test_hz", f"{kind}_hz", f"{kind}_re_pct", f"{kind}_mac"]].set_axis(COLUMNS[4:], axis=1)
        frames.append(of_kind.assign(law=f"article {kind}", engine="", mode=modes.index.astype(int)))
    return pd.concat(frames, ignore_index=True).reindex(columns=COLUMNS)


def _rows(study: Study, level: float) -> pd.DataFrame:
    rows = rows_of(cases(study, level), "per_mode")
    return rows.assign(level=level, relative_error_percent=100 * rows["relative_error"])[COLUMNS]


def _shows(study: Study, rows: pd.DataFrame, published: pd.DataFrame) -> str:
    best, engine = study.methods[-1], study.engines[0]
    updated = published[published["law"] == "article updated"].set_index("mode")["relative_error_percent"]
    ours = rows[(rows["law"] == best) & (rows["engine"] == engine)]
    main = ours[ours["level"] == study.main_level]
    within = (ours["relative_error_percent"] <= ours["mode"].map(updated)) & (ours["mac"] >= MAC_TARGET)
    met = within.groupby(ours["level"]).all()  # not where a mode was not found
    tested, printed = (", ".join(f"{hz:.2f}" for hz in of["test_hz"]) for of in (main, published[: len(main)]))
    return (
        f"Natural frequencies of the test at {study.main_level:g} m/s²: {tested} Hz (the article's: {printed} Hz). "
        f"{name_of(best)} on {engine} has errors within the article's updated column and MAC >= {MAC_TARGET} in all "
        f"four modes at {', '.join(f'{v:g}' for v in met.index[met]) or 'no level of'} m/s²; its least MAC at "
        f"{study.main_level:g} m/s² is {main['mac'].min():.6f}."
    )


def _draw(study: Study, rows: pd.DataFrame) -> Figure:
    figure = sheet(3.0)
    left, right = figure.subplots(1, 2)
    models = list(rows[rows["engine"].isin(("", study.engines[0]))].groupby("law", sort=False))
    for i, (law, of_law) in enumerate(models):
        of_law = of_law[of_law["engine"].isin(("", study.engines[0]))]
        abscissa = of_law["mode"] + 0.09 * (i - (len(models) - 1) / 2)
        style = {"ls": "none", "ms": 5, "label": name_of(law)} | look(law)
        left.semilogy(abscissa, of_law["relative_error_percent"], **style)
        right.semilogy(abscissa, 1 - of_law["mac"], **style)
    for ax, title, label in ((left, "(a)", "Relative error of frequency (%)"), (right, "(b)", "1 - MAC (1)")):
        panel(ax, title, "Mode (number)", label)
        ax.set_xticks(np.unique(rows["mode"]))
    legend(figure, left, 4)
    return figure


def _table(rows: pd.DataFrame) -> Table:
    modes, values = sorted(rows["mode"].unique()), ("relative_error_percent", "mac")
    columns = (
        Column("Model"), Column("Engine"), *(Column(f"RE {mode}", "%", ".4f") for mode in modes),
        *(Column(f"MAC {mode}", "", ".5f") for mode in modes),
    )  # fmt: skip
    shown = [
        (name_of(law), engine, *(value for name in values for value in of_case.set_index("mode")[name].reindex(modes)))
        for (law, engine), of_case in rows.groupby(["law", "engine"], sort=False)
    ]
    caption = "Relative error of the natural frequency and MAC of each mode: published and ours"
    return to_table("modes", caption, columns, shown)
