"""Three rigs made up after the identification was finished: what each law predicts there, against the repeatability."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import pandas as pd
from matplotlib.figure import Figure

from clearance_mj.report import report_study
from clearance_mj.study import Study
from experiments.script import run
from experiments.tables import markdown_table
from experiments.testrig import generate

RIGS = ("iwan", "lugre", "mixed")
LAWS = {"constant": "#d55e00", "amplitude": "#009e73", "output-error": "#0072b2"}
ENGINES = {"modal": "-", "links": "--"}
MEASURES = ("rmse_db", "ratio_to_repeat", "frac", "csac", "csf")


def study_of(name: str, out: Path, engines) -> Study:
    """Make the rig's records, if they are not there yet, and study them."""
    dataset = out / name / "dataset"
    if not dataset.exists():
        generate(dataset, name)
    return report_study(dataset, out / name / "study", engines, tuple(LAWS), progress=True)


def table(name: str, study: Study) -> pd.DataFrame:
    """One row per level, law and engine, and the repeatability."""
    rows = pd.DataFrame(study.rows())
    repeat = rows[rows["law"] == "repeat"].set_index("level")["rmse_db"]
    rows["ratio_to_repeat"] = rows["rmse_db"] / rows["level"].map(repeat)
    return rows.assign(rig=name)[["rig", "level", "law", "engine", *MEASURES]]


def draw(rows: pd.DataFrame) -> Figure:
    """RMSE over level, one panel for each rig."""
    names, levels = rows["rig"].unique(), sorted(rows["level"].unique())
    lines = {("repeat", "rig"): {"color": "black", "lw": 3, "alpha": 0.4, "label": "rig again, other seed"}}
    for law, colour in LAWS.items():
        for engine, dashes in ENGINES.items():
            style = {"color": colour, "ls": dashes, "marker": "o", "ms": 3, "lw": 1.2, "label": f"{law}, {engine}"}
            lines[law, engine] = style
    figure = Figure(figsize=(7.5, 3.6), layout="constrained")
    panels = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
    for ax, name in zip(panels, names):
        for (law, engine), style in lines.items():
            of_case = rows[(rows["rig"] == name) & (rows["law"] == law) & (rows["engine"] == engine)]
            if len(of_case):
                ax.loglog(of_case["level"], of_case["rmse_db"], **style)
        ax.set_title(f'rig "{name}"', fontsize=9, loc="left")
        ax.set_xlabel("level (m/s² RMS)")
        ax.minorticks_off()
        ax.set_xticks(levels, [f"{v:g}" for v in levels])
        ax.grid(alpha=0.3)
    ticks = (0.05, 0.1, 0.2, 0.5, 1, 2, 5)
    panels[0].set_yticks(ticks, [f"{v:g}" for v in ticks])
    panels[0].set_ylabel("RMSE of FRF magnitudes (dB)")
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=7, frameon=False
    )
    return figure


def markdown(rows: pd.DataFrame) -> str:
    """Return a line for each rig and level; where there are two numbers, one for each engine."""
    rmse = rows.set_index(["rig", "level", "law", "engine"])["rmse_db"]
    engines = [e for e in ENGINES if e in set(rows["engine"])]
    lines = [("rig", "level (m/s²)", "repeat (dB)", *(f"{law} (dB)" for law in LAWS))]
    for rig, level in rows[["rig", "level"]].drop_duplicates().itertuples(index=False):
        cells = (" / ".join(f"{rmse[rig, level, law, e]:.2f}" for e in engines) for law in LAWS)
        lines.append((rig, f"{level:g}", f"{rmse[rig, level, 'repeat', 'rig']:.2f}", *cells))
    return markdown_table(lines)


def main(
    out: Path = Path("results/other_rigs"), rigs: Sequence[Literal[*RIGS]] = RIGS,
    engines: Sequence[Literal[*ENGINES]] = tuple(ENGINES),
) -> None:  # fmt: skip
    """Study the rigs and write other_rigs.csv, other_rigs.md and other_rigs.png."""
    rows = pd.concat([table(name, study_of(name, out, engines)) for name in rigs])
    rows.to_csv(out / "other_rigs.csv", index=False)
    (out / "other_rigs.md").write_text(markdown(rows), encoding="utf-8")
    draw(rows).savefig(out / "other_rigs.png", dpi=150)
    print(markdown(rows))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
