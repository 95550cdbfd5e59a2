"""How well the laws agree with the rig: the verdict, in sentences and as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...statistics import repeatability
from .study import FLOOR, OVERALL, engines, excitation_unit, main_engine
from .table import Column, Table

if TYPE_CHECKING:
    from ...study import Study

__all__ = ["best_law", "verdict", "verdict_table"]


def best_law(study: Study) -> str:
    """The law with the least RMSE at the main level on the main engine; the last law if none has one.

    Parameters
    ----------
    study : Study
        The study.
    """
    found = _finite_rmse(study.rows(), study.main_level, main_engine(study))
    return min(found, key=found.get) if found else study.laws[-1].name


def verdict(study: Study) -> list[str]:
    """The result in sentences, from the numbers: the best law at the main level, all laws at all levels, the engines.

    Parameters
    ----------
    study : Study
        The study.

    Returns
    -------
    list of str
    """
    rows, engine = study.rows(), main_engine(study)
    over_levels = _over_levels(study, rows, engine) if len(study.levels) > 1 else []
    spread = _engine_spread(study, rows) if len(engines(study)) > 1 else []
    return [_at_main_level(study, rows, engine), *over_levels, *spread]


def verdict_table(study: Study, engine: str) -> Table:
    """Every law on one engine at every level, beside the repeat floor.

    Parameters
    ----------
    study : Study
        The study.
    engine : str
        Which engine.
    """
    rows = [r for r in study.rows() if r["engine"] in (engine, FLOOR["engine"])]
    columns = (
        Column("Level", excitation_unit(study), "g"),
        Column("Law"),
        *(Column(m.label, m.unit, m.form) for m in OVERALL),
        Column("RMSE / floor", "", ".2f"),
    )
    floor = {level: _floor_rmse(rows, level) for level in study.levels}
    body = tuple(
        (
            *(r["level"], r["law"], *(repeatability.interval_of(r, m.key) for m in OVERALL)),
            _ratio(r["rmse_db"], floor[r["level"]]),
        )
        for r in rows
    )
    caption = (
        f"Agreement with the validation records, engine {engine}: means over all sensors (modes) and over the records "
        "of a level; below each, its 95 % interval over seeds."
    )
    return Table(f"verdict_{engine}", caption, columns, body)


def _at_main_level(study, rows, engine) -> str:
    level = f"At {study.main_level:g} {excitation_unit(study)} RMS"
    found = _finite_rmse(rows, study.main_level, engine)
    if not found:
        return f"{level} no law has an RMSE on engine {engine}."
    law = min(found, key=found.get)
    sentence = f"{level} the best law, “{law}”, misses the rig by {found[law]:.2f} dB RMS on engine {engine}"
    floor = _floor_rmse(rows, study.main_level)
    if not floor > 0:
        return f"{sentence}; no second record tells how closely the rig repeats itself."
    return f"{sentence}, {found[law] / floor:.2g} times what the rig repeats itself ({floor:.2f} dB)."


def _over_levels(study, rows, engine) -> list[str]:
    unit = excitation_unit(study)
    spans, best = [], {}
    for law, on in (*((k.name, engine) for k in study.laws), tuple(FLOOR.values())):
        found = [_finite_rmse(rows, level, on).get(law) for level in study.levels]
        found = [rmse for rmse in found if rmse is not None]
        if found:
            words = "the rig repeats itself within" if on == FLOOR["engine"] else f"“{law}” misses by"
            spans.append(f"{words} {min(found):.2f} to {max(found):.2f} dB")
    for level in study.levels:
        if found := _finite_rmse(rows, level, engine):
            best.setdefault(min(found, key=found.get), []).append(f"{level:g}")
    if not best:
        return []
    leaders = "; ".join(f"“{law}” at {', '.join(levels)} {unit}" for law, levels in best.items())
    return [
        f"Over all levels, {study.levels[0]:g} to {study.levels[-1]:g} {unit} RMS: {'; '.join(spans)}.",
        f"Least RMSE: {leaders}.",
    ]


def _engine_spread(study, rows) -> list[str]:
    spreads = []
    for level in study.levels:
        for law in study.laws:
            found = [r["rmse_db"] for r in rows if (r["law"], r["level"]) == (law.name, level)]
            spreads.append((float(np.ptp(found)), level, law.name))
    spreads = [s for s in spreads if np.isfinite(s[0])]
    if not spreads:
        return []
    spread, level, law = max(spreads)
    where = f"“{law}” at {level:g} {excitation_unit(study)}"
    return [f"The RMSE of a law differs between engines by at most {spread:.2f} dB ({where})."]


def _finite_rmse(rows, level, engine) -> dict[str, float]:
    found = {r["law"]: r["rmse_db"] for r in rows if (r["level"], r["engine"]) == (level, engine)}
    return {law: rmse for law, rmse in found.items() if np.isfinite(rmse)}


def _floor_rmse(rows, level) -> float:
    return next((r["rmse_db"] for r in rows if r["level"] == level and r["law"] == FLOOR["law"]), np.nan)


def _ratio(value, floor) -> float:
    return value / floor if floor > 0 else np.nan
