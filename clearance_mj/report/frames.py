"""The numbers of a study as data frames, for CSV files, figures and tables."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from ..core.errors import ClearanceError
from ..core.plain_numbers import find_numbers, get_number
from ..engines import get_engine
from ..identify.structure.priors import parameter_words
from ..io.dataset import Record
from ..rig import Rig
from ..signals.comparison import Comparison
from ..statistics import repeatability
from ..statistics.intervals import Interval, ratio
from ..study import N_MODES, Study
from ..study.conditions import condition_of
from .tables import MEASURES, REPEAT

__all__ = [
    "contact", "contact_limits", "engines", "families", "improvements", "interval", "laws", "modes", "parameters",
    "records", "seeds", "sensor_means", "sensors",
]  # fmt: skip

IMPROVED = {
    **{f"MAC, mode {mode}": f"mode_{mode}_mac" for mode in range(1, N_MODES + 1)},
    "frequency error": "relative_error", "MRE": "mre", "RMSE": "rmse_db", "FRAC": "frac", "CSAC": "csac_per_sensor",
    "CSF": "csf_per_sensor",
}  # fmt: skip
"""Quantities that a better law improves, and their names in `Study.rows`"""
CONTACT = {"displacement_rms": "_m", "displacement_peak": "_m", "contact_share": "", "contact_peak": "_n"}
"""statistics of a clearance, and the ends of their columns' names"""
_MODE = ["mode", "test_hz", "model_hz", "relative_error_pct", "mac", "test_damping", "model_damping", "why"]
_KEYS = [m.key for m in MEASURES]


def interval(row: dict, key: str, factor: float = 1.0) -> Interval:
    """Return a measure of a row of `Study.rows` or `sensor_means` with its interval, times the factor of its unit."""
    pooled = repeatability.interval_of(row, key)
    return Interval(factor * pooled.value, factor * pooled.low, factor * pooled.high, pooled.doubtful, pooled.missing)


def _stack(study: Study, part: Callable[[Comparison], pd.DataFrame]) -> pd.DataFrame:
    """Return a part of every comparison, with columns in front that say which."""
    parts = [
        _prepend(part(comparison), **group.columns, level=level, record="", law=REPEAT[0], engine=REPEAT[1])
        for group in study.parts
        for level, comparison in group.repeatability.items()
    ]
    parts += [
        _prepend(part(c.comparison), **head, level=c.record.level, record=c.record.name, law=c.law, engine=c.engine)
        for head, c in ((group.columns, c) for group in study.parts for c in group.cases)
    ]
    return pd.concat(parts, ignore_index=True)


def _prepend(frame: pd.DataFrame, **head: Any) -> pd.DataFrame:
    return frame.assign(**head)[[*head, *frame.columns]]


def modes(study: Study) -> pd.DataFrame:
    """Return natural frequencies of test and model: a row per record, law, engine and mode."""

    def part(comparison: Comparison) -> pd.DataFrame:
        frame = pd.DataFrame(comparison.per_mode)
        return frame.assign(mode=range(1, len(frame) + 1), relative_error_pct=100 * frame["relative_error"])[_MODE]

    return _stack(study, part)


def sensors(study: Study) -> pd.DataFrame:
    """Return measures of every sensor: a row per record, law, engine and sensor."""
    nodes = sensor_names(study)
    return _stack(study, lambda c: pd.DataFrame(c.per_sensor).assign(sensor=nodes)[["sensor", *_KEYS]])


def sensor_names(study: Study) -> list[str]:
    """Return what rows call each sensor: its node, of a rig in space with the direction."""
    rig = study.dataset.rig
    return rig.sensor_labels if rig.moves_across else [str(s.node) for s in rig.sensors]


def seeds(study: Study) -> pd.DataFrame:
    """Return what means are of: measures over all sensors, a row per record, law and engine."""
    return _stack(study, lambda c: pd.DataFrame([c.summary()]))


def sensor_means(study: Study) -> pd.DataFrame:
    """Return means over seeds of every sensor's measures, with intervals: a row per level, law, engine and sensor."""
    if study.parts != (study,):
        return pd.concat([sensor_means(part).assign(**part.columns) for part in study.parts], ignore_index=True)
    rows: list[dict] = []
    for (sensor, law, engine), of_pair in sensors(study).groupby(["sensor", "law", "engine"], sort=False):
        by_level: dict[Any, Any] = {level: part[_KEYS].to_dict("records") for level, part in of_pair.groupby("level")}
        first = {level: seeds[0] for level, seeds in by_level.items()}
        means = repeatability.repeat_rows(first) if (law, engine) == REPEAT else repeatability.mean_rows(by_level)
        rows += [{"level": level, "law": law, "engine": engine, "sensor": sensor} | m for level, m in means.items()]
    nodes = {name: i for i, name in enumerate(sensor_names(study))}
    return pd.DataFrame(rows).sort_values("sensor", key=lambda column: column.map(nodes), kind="stable")


def contact(study: Study) -> pd.DataFrame:
    """Return motion and contact in every bushing: a row per record, law, engine and bushing.

    Gaps are those of the rig that the law is simulated on; those of the test are the rig file's.
    """
    parts: list[tuple[Record, str, str, Rig, dict]] = []
    for record in study.driven:
        if (probes := record.response().displacement) is not None:
            moved = probes.reshape(len(study.dataset.rig.bushings), -1, record.size)
            rms, peak = np.sqrt(moved.var(axis=2).sum(axis=1)), np.linalg.norm(moved, axis=1).max(axis=1)
            seen = dict(zip(CONTACT, (rms, peak, np.nan, np.nan)))
            parts.append((record, "test", REPEAT[1], study.dataset.rig, seen))
    parts += [(c.record, c.law, c.engine, study.law(c.law).rig, c.statistics) for c in study.cases]
    frames = [
        pd.DataFrame({
            **condition(study, record), "level": record.level, "record": record.name, "law": law, "engine": engine,
            "bushing": range(1, len(rig.bushings) + 1), "gap_m": [b.gap for b in rig.bushings],
            **{f"{name}{unit}": statistics[name] for name, unit in CONTACT.items()},
        })
        for record, law, engine, rig, statistics in parts
    ]  # fmt: skip
    return pd.concat(frames, ignore_index=True)


def condition(study: Study, record: Record) -> dict[str, str | float]:
    """Return the columns that tell how a record was tested; none of a rig in a plane."""
    return condition_of(record).columns if study.dataset.rig.moves_across else {}


def improvements(study: Study) -> pd.DataFrame:
    """Return the change from the base law to another in percent of the former: a row per level, law and quantity."""
    if study.parts != (study,):
        return pd.concat([improvements(part).assign(**part.columns) for part in study.parts], ignore_index=True)
    row_of = {(r["level"], r["law"]): r for r in study.rows() if r["engine"] == study.main_engine}
    rows = []
    for (level, law), row in row_of.items():
        for quantity, key in IMPROVED.items() if law != study.base_law else ():
            change = ratio(interval(row, key), interval(row_of[level, study.base_law], key))
            value, low, high = (100 * (x - 1) for x in (change.value, change.low, change.high))
            rows.append((level, law, study.base_law, quantity, value, low, high, change.missing))
    columns = ["level", "law", "over", "quantity", "change_pct", "change_pct_low", "change_pct_high", "no_interval"]
    return pd.DataFrame(rows, columns=columns)


def parameters(study: Study) -> pd.DataFrame:
    """Return fitted parameters with their standard deviations, and the rig file's values.

    That of a parameter of all bushings is the first bushing's.
    """
    data = study.dataset.rig.to_dict()
    rows = [
        (law.name, parameter_words(p["name"]), p["unit"], p["value"], std,
         100 * std / abs(p["value"]) if p["value"] else np.nan, _in_rig_file(data, p["name"]))
        for law in study.laws
        for p in law.parameters
        for std in [p["relative_std"] * (1.0 if p.get("varies") == "linear" else abs(p["value"]))]
    ]  # fmt: skip
    columns = ["law", "parameter", "unit", "value", "standard_deviation", "relative_std_pct", "rig_file"]
    return pd.DataFrame(rows, columns=columns)


def _in_rig_file(data: dict, name: str) -> float:
    """Return the value of a path or of words such as "grease stiffness, bushings[1]"; nan if not there."""
    words, _, place = name.partition(", ")
    path = f"{place or 'bushings[0]'}.{words.replace(' ', '.', 1).replace(' ', '_')}" if " " in words else words
    try:
        value = get_number(data, find_numbers(data, path)[0])
    except ClearanceError:
        return np.nan
    return np.nan if value is None else value


def laws(study: Study) -> pd.DataFrame:
    """Return what each law was given, and the rig that it is simulated on: a row per law."""
    rows = [{"law": k.name, "given": k.prior_information, "simulated_on": k.simulated_on} for k in study.laws]
    return pd.DataFrame(rows)


def contact_limits(study: Study) -> pd.DataFrame:
    """Return the time in contact in the main record, %, with its interval: a row per law and bushing."""
    return pd.DataFrame([
        {"law": law, "bushing": j + 1} | dict(zip(("contact_pct", "low_pct", "high_pct"), (100 * ratios).tolist()))
        for law, (band, _) in study.bands.items() if band.contact is not None
        for j, ratios in enumerate(np.vstack((band.contact[:1], band.contact_limits)).T)
    ])  # fmt: skip


def families(study: Study) -> pd.DataFrame:
    """Return the families of contact and grease that methods compared: a row per law and family, likeliest first."""
    columns = ["law", "bushing", "contact", "grease", "weight", "log_evidence", "misfit", "held_out"]
    return pd.DataFrame([{"law": k.name, **family} for k in study.laws for family in k.families], columns=columns)


def engines(study: Study) -> pd.DataFrame:
    """Return the time step of every engine under every law: the shortest and the longest over the records."""
    steps = pd.DataFrame([{"engine": c.engine, "law": c.law, "step": c.statistics["step"]} for c in study.cases])
    step_range = steps.groupby(["engine", "law"], sort=False)["step"].agg(step_min_s="min", step_max_s="max")
    settings = {
        name: ", ".join(f"{key} {value}" for key, value in dataclasses.asdict(get_engine(name)).items())
        for name in study.engines
    }
    frame = step_range.loc[[(engine, law) for engine in study.engines for law in study.methods]].reset_index()
    frame.insert(1, "settings", frame["engine"].map(settings))
    return frame


def records(study: Study) -> pd.DataFrame:
    """Return the records of the dataset and what each was used for."""
    return pd.DataFrame([
        {"record": r.name, "role": r.role, "excitation": r.description, **condition(study, r),
         "level": np.nan if r.level is None else r.level, "unit": "N" if r.excitation_kind == "force" else "m/s²",
         "duration_s": r.duration, "fs_hz": r.fs, "seed": "" if r.seed is None else r.seed}
        for r in study.dataset.records
    ])  # fmt: skip
