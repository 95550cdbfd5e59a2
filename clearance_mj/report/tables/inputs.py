"""What went into a study: fitted parameters, engines with their time steps, records."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from ...engines import get_engine
from .study import engines
from .table import Column, Table

if TYPE_CHECKING:
    from ...study import Study

__all__ = ["engine_rows", "engine_table", "parameter_rows", "parameter_table", "record_rows", "record_table"]


def parameter_rows(study: Study) -> list[dict]:
    """Fitted parameters of every law, with their standard deviations and the rig file's value where it has one.

    Parameters
    ----------
    study : Study
        The study.
    """
    return [
        {
            "law": knowledge.name,
            "parameter": p["name"],
            "unit": p["unit"],
            "value": p["value"],
            "standard_deviation": p["value"] * p["relative_std"],
            "relative_std_pct": 100 * p["relative_std"],
            "rig_file": _datasheet(study.dataset.rig, p["name"]),
        }
        for knowledge in study.laws
        for p in knowledge.parameters
    ]


def parameter_table(study: Study) -> Table:
    """Fitted parameters with their standard deviations.

    Parameters
    ----------
    study : Study
        The study.
    """
    columns = (
        Column("Law"),
        Column("Parameter"),
        Column("Unit"),
        Column("Fitted", "", ".5g"),
        Column("± standard deviation", "", ".2g"),
        Column("relative", "%", ".2g"),
        Column("Rig file", "", ".5g"),
    )
    keys = ("law", "parameter", "unit", "value", "standard_deviation", "relative_std_pct", "rig_file")
    body = tuple(tuple(row[key] for key in keys) for row in parameter_rows(study))
    return Table("parameters", "Fitted parameters, the same at every bushing.", columns, body)


def engine_rows(study: Study) -> list[dict]:
    """Time step of every engine under every law: the shortest and the longest over the records.

    Parameters
    ----------
    study : Study
        The study.
    """
    rows = []
    for engine in engines(study):
        settings = ", ".join(f"{name} {value}" for name, value in dataclasses.asdict(get_engine(engine)).items())
        for law in (k.name for k in study.laws):
            found = [c.statistics["step"] for c in study.cases if (c.engine, c.law) == (engine, law)]
            row = {"engine": engine, "settings": settings, "law": law}
            rows.append(row | {"step_min_s": min(found), "step_max_s": max(found)})
    return rows


def engine_table(study: Study) -> Table:
    """Time step of every engine under every law.

    Parameters
    ----------
    study : Study
        The study.
    """
    columns = (
        Column("Engine"),
        Column("Settings"),
        Column("Law"),
        Column("Time step", "µs", ".3g"),
        Column("Rate", "kHz", ".1f"),
    )
    words = ("engine", "settings", "law")
    body = tuple(
        (*(r[key] for key in words), 1e6 * r["step_min_s"], 1e-3 / r["step_min_s"]) for r in engine_rows(study)
    )
    caption = (
        "Time step that each engine chose, from the highest frequency of its model. Safety: share of the stability "
        "limit 2/ω; resolution: phase in rad that the fastest mode or contact may turn in a step."
    )
    return Table("engines", caption, columns, body)


def record_rows(study: Study) -> list[dict]:
    """Records of the dataset and what each was used for.

    Parameters
    ----------
    study : Study
        The study.
    """
    return [
        {
            "record": r.name,
            "role": r.role,
            "excitation": r.description,
            "level": np.nan if r.level is None else r.level,
            "unit": "N" if r.excitation_kind == "force" else "m/s²",
            "duration_s": r.duration,
            "fs_hz": r.fs,
            "seed": "" if r.seed is None else r.seed,
        }
        for r in study.dataset.records
    ]


def record_table(study: Study) -> Table:
    """Records of the dataset and what each was used for.

    Parameters
    ----------
    study : Study
        The study.
    """
    columns = (
        Column("Record"),
        Column("Used to"),
        Column("Excitation"),
        Column("Level", "RMS", "g"),
        Column("Unit"),
        Column("Duration", "s", "g"),
        Column("Rate", "Hz", "g"),
        Column("Seed"),
    )
    body = tuple(tuple(row.values()) for row in record_rows(study))
    return Table("records", "Records: what each was used for.", columns, body)


def _datasheet(rig, name) -> float:
    """Value of a parameter named like "grease stiffness" in the rig file, at the first bushing; nan if not there."""
    part, _, field = name.partition(" ")
    value = getattr(getattr(rig.bushings[0], part, None), field.replace(" ", "_"), None)
    return value if isinstance(value, float) else np.nan
