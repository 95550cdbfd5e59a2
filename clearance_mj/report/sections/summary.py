"""Agreement of the laws with the rig: in sentences, over level, and as a table."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from ...study import Study
from .. import frames
from ..figures import agreement
from ..frames import interval
from ..html import render
from ..tables import OVERALL, REPEAT, Column, Table
from ..writer import ReportWriter
from . import section
from .parts import by_part


@section("summary", "Summary", 20)
def summary(study: Study, writer: ReportWriter) -> str:
    """Return the summary; writes verdict.csv and seed_scatter.csv."""
    writer.csv("verdict", study.rows())
    writer.csv("seed_scatter", study.scatter_rows())
    return by_part(study, lambda part: _summary(part, writer))


def _summary(study: Study, writer: ReportWriter) -> str:
    tested = [r for r in study.scatter_rows() if np.isfinite(r["cochran_limit"])]
    others = [engine for engine in study.engines if engine != study.main_engine]
    return render(
        "summary.html.j2", sentences=sentences(study), drawing=writer.figure(agreement(study)),
        main=agreement_table(study, study.main_engine), tested=len(tested),
        others={engine: agreement_table(study, engine) for engine in others},
        uneven=sum(r["cochran"] > r["cochran_limit"] for r in tested),
        freedom=max((r["degrees_of_freedom"] for r in tested), default=0),
        repeated=bool(study.repeatability), missing=missing_intervals(study),
    )  # fmt: skip


def missing_intervals(study: Study) -> list[str]:
    """Return why some values have no interval, each reason once, those of sensors' measures too.

    Parameters
    ----------
    study : Study
        The study.
    """
    rows = [*study.rows(), *frames.sensor_means(study).to_dict("records")]
    return sorted({str(v) for row in rows for key, v in row.items() if str(key).endswith("_no_interval") and v})


def agreement_table(study: Study, engine: str) -> Table:
    """Return every law on one engine at every level, with the repeatability."""
    rows = [r for r in study.rows() if r["engine"] in (engine, REPEAT[1])]
    repeat = {r["level"]: r["rmse_db"] for r in rows if r["law"] == REPEAT[0]}
    columns = [Column("Level", study.unit, "g"), Column("Law"), *(Column(m.label, m.unit, m.form) for m in OVERALL)]
    columns += [Column("RMSE by random error", "dB", ".2f"), Column("RMSE / repeat", "", ".2f")]
    body = []
    for r in rows:
        within = repeat.get(r["level"], np.nan)
        ratio = r["rmse_db"] / within if within > 0 else np.nan
        body.append((r["level"], r["law"], *(interval(r, m.key) for m in OVERALL), r["random_db"], ratio))
    caption = (
        f"Agreement with the validation records, engine {engine}: means over all sensors (modes) and over the records "
        f"of a level; below each, its 95 % interval over seeds. {_rig_sentence(study)}"
    )
    return Table(f"agreement_{engine}", caption, tuple(columns), tuple(body))


def _rig_sentence(study: Study) -> str:
    """Return a sentence on the rig on which each law is simulated."""
    if not (laws := " and ".join(f"“{law.name}”" for law in study.laws if law.finds_rig)):
        return "All laws are simulated on the rig file’s rig."
    others = ", all others on the rig file’s" if len(study.laws) > laws.count("“") else ""
    return f"Law {laws} is simulated on the rig that was identified with it{others}."


def sentences(study: Study) -> list[str]:
    """Return the result in sentences: the study's best law at the main level, all laws at all levels, the engines."""
    rmse = pd.DataFrame(study.rows()).set_index(["level", "law", "engine"])["rmse_db"]
    shown = [(law, study.main_engine) for law in study.methods]
    on_main = rmse.unstack(["law", "engine"]).reindex(columns=pd.MultiIndex.from_tuples([*shown, REPEAT]))
    texts = [_at_main_level(study, on_main)]
    if len(study.levels) > 1:
        texts += _over_levels(study, on_main)
    spread = rmse.drop(REPEAT[0], level="law", errors="ignore").groupby(["level", "law"], sort=False)
    width = spread.max() - spread.min()
    if len(study.engines) > 1 and width.notna().any():
        level, law = max(width.dropna().index, key=lambda key: (width[key], *key))
        case = f"“{law}” at {level:g} {study.unit}"
        texts.append(f"The RMSE of a law differs between engines by at most {width.max():.2f} dB ({case}).")
    return texts


def _at_main_level(study: Study, rmse: pd.DataFrame) -> str:
    level = f"At {study.main_level:g} {study.unit} RMS"
    least, repeat = rmse.loc[study.main_level, (study.best_law, study.main_engine)], rmse.loc[study.main_level, REPEAT]
    if not np.isfinite(least):
        return f"{level}, law “{study.best_law}” has no RMSE on engine {study.main_engine}."
    sentence = f"{level}, law “{study.best_law}” misses the rig by {least:.2f} dB RMS on engine {study.main_engine}"
    chance = study.case(study.best_law, study.main_engine, study.main_level).comparison.summary()["random_db"]
    alone = f"the random error of the test’s FRFs alone would be {chance:.2f} dB" if np.isfinite(chance) else ""
    if not repeat > 0:
        end = f", but {alone}" if alone else ""
        return f"{sentence}; no second record shows how closely the rig repeats itself{end}."
    end = f"; {alone}" if alone else ""
    return f"{sentence}, {least / repeat:.2g} times what the rig repeats itself ({repeat:.2f} dB){end}."


def _over_levels(study: Study, rmse: pd.DataFrame) -> list[str]:
    spans = []
    shown: list[Any] = rmse.columns[rmse.notna().any()].tolist()
    for law, engine in shown:
        words = "the rig repeats itself within" if engine == REPEAT[1] else f"“{law}” misses by"
        spans.append(f"{words} {rmse[law, engine].min():.2f} to {rmse[law, engine].max():.2f} dB")
    laws = rmse.drop(columns=[REPEAT]).dropna(how="all")
    if laws.empty:
        return []
    leader = laws.idxmin(axis=1)
    best: dict[Any, Any] = dict(leader.groupby(leader, sort=False).groups)
    leaders = "; ".join(f"“{law}” at {', '.join(f'{v:g}' for v in at)} {study.unit}" for (law, _), at in best.items())
    first, last = study.levels[0], study.levels[-1]
    return [f"Over all levels, {first:g} to {last:g} {study.unit} RMS: {'; '.join(spans)}.", f"Least RMSE: {leaders}."]
