"""Predictions on the named benches after identification: RMSE and FRAC at five levels, against each bench's repeat.

    python -m experiments.benches.baseline --out results/benches [--benches all exact] [--methods output-error constant]

Rows of benches that the table already holds are replaced, others stay.
"""

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from clearance_mj.io.dataset import Dataset
from clearance_mj.study import Study
from experiments.script import run
from experiments.tables import markdown_table

from .bench import NAMED, find_bench
from .records import write_bench

METHODS = ("output-error", "constant")
COLUMNS = ("bench", "law", "level", "rmse_db", "frac", "repeat_rmse_db", "repeat_frac", "seconds")


def judge(folder: Path, methods: Sequence[str]) -> pd.DataFrame:
    """One row per law and level of a bench's dataset, on engine modal; ``seconds``: of the identification."""
    study = Study(Dataset.load(folder), methods, ("modal",))
    seconds = {}
    for method in methods:
        start = time.perf_counter()
        study.law(method)
        seconds[method] = round(time.perf_counter() - start, 1)
    rows = pd.DataFrame(study.rows())[["level", "law", "rmse_db", "frac"]]
    repeat = rows[rows["law"] == "repeat"].drop(columns="law")
    judged = rows[rows["law"] != "repeat"].merge(repeat, on="level", suffixes=("", "_of_repeat"))
    judged = judged.rename(columns={"rmse_db_of_repeat": "repeat_rmse_db", "frac_of_repeat": "repeat_frac"})
    return judged.assign(bench=folder.name, seconds=judged["law"].map(seconds))[list(COLUMNS)]


def markdown(rows: pd.DataFrame) -> str:
    """Return a line for each bench and law: RMSE in dB / FRAC at each level."""
    levels = sorted(rows["level"].unique())
    lines = [("bench", "law", *(f"{level:g}" for level in levels))]
    for (bench, law), of in rows.groupby(["bench", "law"], sort=False):
        for name, prefix in (("(repeat)", "repeat_"),) * (lines[-1][0] != bench) + ((law, ""),):
            at = of.set_index("level")
            cells = (f"{at.at[v, f'{prefix}rmse_db']:.2f} / {at.at[v, f'{prefix}frac']:.3f}" for v in levels)
            lines.append((bench, name, *cells))
    return markdown_table(lines)


def main(
    out: Path = Path("results/benches"), benches: Sequence[str] = tuple(NAMED), methods: Sequence[str] = METHODS
) -> None:
    """Make what datasets are missing, judge them and write baseline.csv and baseline.md."""
    table = out / "baseline.csv"
    for name in benches:
        folder = out / name
        if not (folder / "truth.toml").exists():
            write_bench(find_bench(name), folder)
        rows = judge(folder, methods)
        if table.exists():
            old = pd.read_csv(table)
            rows = pd.concat([old[(old["bench"] != name) | ~old["law"].isin(methods)], rows])
        rows.to_csv(table, index=False, float_format="%.4f")
        (out / "baseline.md").write_text(markdown(rows), encoding="utf-8")
        print(markdown(rows[rows["bench"] == name]), flush=True)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
