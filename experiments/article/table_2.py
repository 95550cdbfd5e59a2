"""Table 2: MRE, RMSE, FRAC, CSAC and CSF of every sensor."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.figure import Figure

from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import MEASURES, Column, Table
from clearance_mj.study import Study

from .improvement import improvements
from .models import cases, look, name_of, prior_information, rows_of, test_words
from .published import MODELS, Printed
from .result import FONT, Item, Result, panel, sheet, to_table

DEFINITIONS = {
    "mre": "mean of ||H_m| - |H_t|| / |H_t|", "rmse_db": "√ mean of (20 log10 |H_m|/|H_t|)²",
    "frac": "|Σ H_t H_m*|² / (Σ|H_t|² Σ|H_m|²) (Heylen and Lammens 1996)",
    "csac": "mean of CSAC over a window of nine lines", "csf": "mean of CSF over a window of nine lines",
}  # fmt: skip
KEYS = [measure.key for measure in MEASURES]
COLUMNS = ["level", "law", "engine", "sensor", *KEYS]


def run(item: Item, study: Study, levels: Sequence[float] | None = None) -> Result:
    """Compare FRFs sensor by sensor at some levels (default: all); the middle level is shown."""
    rows = pd.concat([_rows(study, level) for level in levels or study.levels], ignore_index=True)
    published, main = _published(), test_words(study, study.main_level)
    shown = pd.concat([published, rows[rows["level"] == study.main_level]], ignore_index=True)
    gains, gain_table = improvements(study, [m.label for m in MEASURES])
    caption = (
        "Each measure over the sensors; less is better in every panel. Squares: the article; other marks: ours on "
        f"engine {study.engines[0]}."
    )
    definitions = "; ".join(f"{m.label}: {DEFINITIONS[m.key]}" for m in MEASURES)
    return Result(
        method=f"Test: {main}. Definitions over the lines, ours but for FRAC: {definitions}.",
        shows=_shows(study, rows, published),
        drawings=(Drawing(item.name, _draw(study, shown), caption, "Five measures over eight sensors."),),
        data={item.name: pd.concat([published, rows], ignore_index=True), f"{item.name}_improvements": gains},
        tables=(_means(shown), gain_table),
        prior_information=prior_information(study),
    )


def _published() -> pd.DataFrame:
    sensors, frames = Printed.load(2).numbers, []
    for kind in MODELS:
        of_kind = sensors[[f"{kind}_{key.removesuffix('_db')}" for key in KEYS]].set_axis(KEYS, axis=1)
        frames.append(of_kind.assign(law=f"article {kind}", engine="", sensor=sensors.index))
    return pd.concat(frames, ignore_index=True).reindex(columns=COLUMNS)


def _rows(study: Study, level: float) -> pd.DataFrame:
    rows = rows_of(cases(study, level), "per_sensor")
    rows["sensor"] = [s.node for s in study.dataset.rig.sensors] * (len(rows) // len(study.dataset.rig.sensors))
    frames = []
    for (law, engine), of_case in rows.groupby(["law", "engine"], sort=False):
        means = pd.DataFrame([of_case[KEYS].mean().to_dict() | {"law": law, "engine": engine, "sensor": "mean"}])
        frames.append(pd.concat([of_case.astype({"sensor": str}), means]).assign(level=level))
    return pd.concat(frames)[COLUMNS]


def _shows(study: Study, rows: pd.DataFrame, published: pd.DataFrame) -> str:
    best, engine = study.methods[-1], study.engines[0]
    means = rows[(rows["law"] == best) & (rows["engine"] == engine) & (rows["sensor"] == "mean")].set_index("level")
    target = published[(published["law"] == "article updated") & (published["sensor"] == "mean")].iloc[0]
    sign = pd.Series({m.key: 1 if m.perfect else -1 for m in MEASURES})
    better = ((means[KEYS] - target[KEYS].astype(float)) * sign > 0).all(axis=1)
    return (
        f"All five means of {name_of(best)} on {engine} are better than the article's updated ones at "
        f"{', '.join(f'{level:g}' for level in better.index[better]) or 'no level of'} m/s²; only FRAC is comparable."
    )


def _draw(study: Study, rows: pd.DataFrame) -> Figure:
    figure = sheet(4.4)
    axes = figure.subplots(2, 3).ravel()
    shown = rows[rows["engine"].isin(("", study.engines[0], "rig")) & (rows["sensor"] != "mean")]
    for ax, letter, measure in zip(axes, "abcde", MEASURES):
        for law, of_law in shown.groupby("law", sort=False):
            style = {"ls": "-", "lw": 0.7, "ms": 4, "label": name_of(law)} | look(law)
            values = of_law[measure.key] if measure.perfect == 0 else 1 - of_law[measure.key]
            ax.semilogy(of_law["sensor"].astype(int), values, **style)
        label = measure.label if measure.perfect == 0 else f"1 - {measure.label}"
        panel(ax, f"({letter})", "Sensor (number)", f"{label} ({measure.unit or '1'})")
        ax.set_xticks(range(1, len(study.dataset.rig.sensors) + 1))
    axes[-1].axis("off")
    axes[-1].legend(*axes[0].get_legend_handles_labels(), loc="center", fontsize=FONT - 1, frameon=False)
    return figure


def _means(rows: pd.DataFrame) -> Table:
    means = rows[rows["sensor"] == "mean"]
    shown = means.assign(law=means["law"].map(name_of))[["law", "engine", *KEYS]]
    caption = "Means over the sensors: published (RMSE without a unit) and ours"
    columns = Column("Model"), Column("Engine"), *(Column(m.label, m.unit, ".4f") for m in MEASURES)
    return to_table("means", caption, columns, shown)
