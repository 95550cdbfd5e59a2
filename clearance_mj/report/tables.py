"""The numbers of a report: tidy rows, which go into CSV files, and the tables that are made of them."""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .. import seeds
from ..engines import get_engine
from ..intervals import Interval, ratio
from ..io.files import replacing
from .article import ARTICLE_MODELS, PRINTED, Article

if TYPE_CHECKING:
    from ..io.dataset import Dataset
    from ..study import Study

__all__ = [
    "MEASURES",
    "OVERALL",
    "Column",
    "Measure",
    "Table",
    "best_law",
    "contact_rows",
    "contact_table",
    "engine_rows",
    "engine_table",
    "engines",
    "excitation_unit",
    "improvement_rows",
    "improvement_table",
    "is_synthetic",
    "main_engine",
    "mode_rows",
    "mode_table",
    "parameter_rows",
    "parameter_table",
    "record_rows",
    "record_table",
    "seed_rows",
    "sensor_mean_rows",
    "sensor_rows",
    "sensor_tables",
    "verdict",
    "verdict_table",
    "write_csv",
]

N_MODES = 4
"""Modes of the article's Table 1"""
FLOOR = {"law": "repeat", "engine": "rig"}
"""How `Study.rows` names the second record of a level compared with the first"""


@dataclass(frozen=True)
class Measure:
    """A measure of the agreement of FRFs."""

    key: str
    """name in a comparison's summary"""
    label: str
    """name in tables"""
    unit: str
    """of its values"""
    form: str
    """format of its numbers"""
    perfect: float
    """its value for equal FRFs"""
    article_key: str
    """name in the article's table"""


MEASURES = (
    Measure("rmse_db", "RMSE", "dB", ".2f", 0.0, "rmse"),
    Measure("frac", "FRAC", "", ".4f", 1.0, "frac"),
    Measure("csac", "CSAC", "", ".4f", 1.0, "csac"),
    Measure("csf", "CSF", "", ".4f", 1.0, "csf"),
    Measure("mre", "MRE", "", ".3f", 0.0, "mre"),
)
"""Of a sensor"""
OVERALL = (
    *MEASURES,
    Measure("relative_error", "frequency error", "", ".2%", 0.0, ""),
    Measure("mac", "MAC", "", ".4f", 1.0, ""),
)
"""Of all sensors, and of the modes"""


@dataclass(frozen=True)
class Column:
    """A column of a table to read."""

    label: str
    """heading"""
    unit: str = ""
    """of its numbers"""
    form: str = ""
    """format of its numbers, such as ".2f"; empty for words"""
    group: str = ""
    """heading that it shares with its neighbours"""


@dataclass(frozen=True)
class Table:
    """A table to read: nan where a value could not be had, None where there is nothing to have.

    Cells are words, numbers, or numbers with an `Interval`.
    """

    name: str
    """also the name of its file"""
    caption: str
    """what it shows, in words"""
    columns: tuple[Column, ...]
    """headings"""
    rows: tuple[tuple, ...]
    """one cell for each column"""


def engines(study: Study) -> list[str]:
    """Engines of a study, in the order in which they were asked for.

    Parameters
    ----------
    study : Study
        The study.
    """
    return list(dict.fromkeys(c.engine for c in study.cases))


def main_engine(study: Study) -> str:
    """The engine that tables show where there is room for one: "links" if it was run, else the first.

    Parameters
    ----------
    study : Study
        The study.
    """
    return "links" if "links" in engines(study) else engines(study)[0]


def best_law(study: Study) -> str:
    """The law with the least RMSE at the main level on the main engine; the last law if none has one.

    Parameters
    ----------
    study : Study
        The study.
    """
    found = _finite_rmse(study.rows(), study.main_level, main_engine(study))
    return min(found, key=found.get) if found else study.laws[-1].name


def excitation_unit(study: Study) -> str:
    """Unit of the levels: m/s² for a shaken base, N for a force.

    Parameters
    ----------
    study : Study
        The study.
    """
    return "N" if study.dataset.validate[0].excitation_kind == "force" else "m/s²"


def is_synthetic(dataset: Dataset) -> bool:
    """Whether any record's provenance says that it was computed, not measured.

    Parameters
    ----------
    dataset : Dataset
        The dataset.
    """
    return any("synthetic" in str(r.provenance).lower() for r in dataset.records)


def write_csv(path, rows: Iterable[dict]):
    """Write rows as CSV with every digit; a row may lack a column.

    Parameters
    ----------
    path : Path
        The file.
    rows : iterable of dict
        Their keys, in the order of their first appearance, are the columns.
    """
    rows = list(rows)
    header = list(dict.fromkeys(key for row in rows for key in row))
    with replacing(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, header, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


# The verdict.


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


def _finite_rmse(rows, level, engine) -> dict[str, float]:
    found = {r["law"]: r["rmse_db"] for r in rows if (r["level"], r["engine"]) == (level, engine)}
    return {law: rmse for law, rmse in found.items() if np.isfinite(rmse)}


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


def _floor_rmse(rows, level) -> float:
    return next((r["rmse_db"] for r in rows if r["level"] == level and r["law"] == FLOOR["law"]), np.nan)


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
            *(r["level"], r["law"], *(seeds.interval_of(r, m.key) for m in OVERALL)),
            _ratio(r["rmse_db"], floor[r["level"]]),
        )
        for r in rows
    )
    caption = (
        f"Agreement with the validation records, engine {engine}: means over all sensors (modes) and over the records "
        "of a level; below each, its 95 % interval over seeds."
    )
    return Table(f"verdict_{engine}", caption, columns, body)


def _ratio(value, floor) -> float:
    return value / floor if floor > 0 else np.nan


# Per mode and per sensor: Tables 1 and 2 of the article.


def mode_rows(study: Study, article: Article | None = None) -> list[dict]:
    """Natural frequencies of test and model: a row per record, law, engine and mode.

    Parameters
    ----------
    study : Study
        The study; the repeat floor's rows have law "repeat".
    article : Article, optional
        Its Table 1 is put in front, with laws "article initial" and "article updated".
    """
    rows = []
    for model in ARTICLE_MODELS if article else ():
        for mode, row in article.modes.items():
            rows.append(
                {"level": "", "record": "article", "law": f"article {model}", "engine": "", "mode": mode}
                | {"test_hz": row["test_hz"], "model_hz": row[f"{model}_hz"]}
                | {"relative_error_pct": row[f"{model}_re_pct"], "mac": row[f"{model}_mac"]}
            )
    return rows + [head | row for head, comparison in _comparisons(study) for row in _modes(comparison)]


def _modes(comparison) -> list[dict]:
    columns = comparison.per_mode
    keys = ("test_hz", "model_hz", "relative_error_pct", "mac", "test_damping", "model_damping")
    columns = columns | {"relative_error_pct": 100 * columns["relative_error"]}
    return [{"mode": i + 1} | {key: float(columns[key][i]) for key in keys} for i in range(len(columns["mode"]))]


def sensor_rows(study: Study, article: Article | None = None) -> list[dict]:
    """Measures of every sensor: a row per record, law, engine and sensor.

    Parameters
    ----------
    study : Study
        The study; the repeat floor's rows have law "repeat".
    article : Article, optional
        Its Table 2 is put in front, with laws "article initial" and "article updated".
    """
    rows = []
    for model in ARTICLE_MODELS if article else ():
        for sensor, row in article.sensors.items():
            head = {"level": "", "record": "article", "law": f"article {model}", "engine": "", "sensor": sensor}
            rows.append(head | {m.key: row[f"{model}_{m.article_key}"] for m in MEASURES})
    nodes = [str(s.node) for s in study.dataset.rig.sensors]
    for head, comparison in _comparisons(study):
        columns = comparison.per_sensor
        for i, node in enumerate(nodes):
            rows.append(head | {"sensor": node} | {m.key: float(columns[m.key][i]) for m in MEASURES})
    return rows


def sensor_mean_rows(study: Study) -> list[dict]:
    """Means over the seeds of every sensor's measures, with intervals: a row per level, law, engine and sensor.

    Parameters
    ----------
    study : Study
        The study; the repeat floor's rows have law "repeat".
    """
    rows = []
    for i, sensor in enumerate(study.dataset.rig.sensors):
        floor = {level: _of_sensor(comparison, i) for level, comparison in study.floor.items()}
        found = {tuple(FLOOR.values()): seeds.floor_rows(floor)}
        for law, engine in study.combinations:
            by_level = study.of(law, engine)
            of_sensor = {level: [_of_sensor(c, i) for c in comparisons] for level, comparisons in by_level.items()}
            found[law, engine] = seeds.mean_rows(of_sensor)
        for (law, engine), means in found.items():
            head = {"law": law, "engine": engine, "sensor": str(sensor.node)}
            rows += [{"level": level} | head | row for level, row in means.items()]
    return rows


def _of_sensor(comparison, i) -> dict[str, float]:
    return {m.key: float(comparison.per_sensor[m.key][i]) for m in MEASURES}


def seed_rows(study: Study) -> list[dict]:
    """What the means are of: measures over all sensors, a row per record, law and engine.

    Parameters
    ----------
    study : Study
        The study; the repeat floor's rows have law "repeat".
    """
    return [head | comparison.summary() for head, comparison in _comparisons(study)]


def _comparisons(study):
    """Every comparison with what it compares."""
    for level, comparison in study.floor.items():
        yield {"level": level, "record": "", **FLOOR}, comparison
    for c in study.cases:
        yield {"level": c.record.level, "record": c.record.name, "law": c.law, "engine": c.engine}, c.comparison


def mode_table(study: Study, level: float, article: Article | None = None) -> Table:
    """Like the article's Table 1, with a row per model: natural frequency, relative error and MAC of each mode.

    Parameters
    ----------
    study : Study
        The study; the laws are shown on its main engine.
    level : float
        Which level.
    article : Article, optional
        Its numbers go in front.
    """
    rows = {(r["law"], r["engine"]): r for r in study.rows() if r["level"] == level}
    shown = _shown(study, level)
    modes = [mode for mode in range(1, N_MODES + 1) if f"mode_{mode}_mac" in rows[shown[0]]]
    columns = [Column("Rig"), Column("Model")]
    for mode in modes:
        group = f"Mode {mode}"
        columns += [Column("f", "Hz", ".2f", group), Column("RE", "%", ".2f", group), Column("MAC", "", ".3f", group)]
    body = _article_modes(article, modes) if article else []
    # Every row holds the test's modes.
    body.append(("this rig", "test", *sum(((rows[shown[0]][f"mode_{m}_test_hz"], None, None) for m in modes), ())))
    for key in shown:
        cells = []
        for mode in (f"mode_{m}" for m in modes):
            error, mac = (seeds.interval_of(rows[key], f"{mode}_{name}") for name in ("relative_error", "mac"))
            percent = Interval(*(100 * x for x in (error.value, error.low, error.high)), error.doubtful)
            cells += [rows[key][f"{mode}_model_hz"], percent, mac]
        body.append(("this rig", key[0], *cells))
    caption = (
        f"Natural frequencies, relative errors and MAC at {level:g} {excitation_unit(study)} RMS, "
        f"engine {main_engine(study)}, with 95 % intervals over seeds; the other engines are in "
        "tables/natural_frequencies.csv."
    )
    return Table(f"natural_frequencies_level_{level:g}", caption, tuple(columns), tuple(body))


def _article_modes(article, modes) -> list[tuple]:
    empty = dict.fromkeys(next(iter(article.modes.values())), np.nan)
    rows = [article.modes.get(mode, empty) for mode in modes]
    body = [("article’s rig", "test", *sum(((row["test_hz"], None, None) for row in rows), ()))]
    for model in ARTICLE_MODELS:
        cells = ((row[f"{model}_hz"], row[f"{model}_re_pct"], row[f"{model}_mac"]) for row in rows)
        body.append(("article’s rig", model, *sum(cells, ())))
    return body


def sensor_tables(study: Study, level: float, article: Article | None = None) -> list[Table]:
    """Like the article's Table 2, one table per measure: a row per sensor, a column per model.

    Parameters
    ----------
    study : Study
        The study; the laws are shown on its main engine.
    level : float
        Which level.
    article : Article, optional
        Its numbers go in front, for sensors with the same numbers.
    """
    rows = {(r["law"], r["engine"], r["sensor"]): r for r in sensor_mean_rows(study) if r["level"] == level}
    means = {(r["law"], r["engine"], "mean"): _as_sensor(r) for r in study.rows() if r["level"] == level}
    in_articles_order = (MEASURES[-1], *MEASURES[:-1])
    return [_sensor_table(study, level, measure, rows | means, article) for measure in in_articles_order]


_ENDS = ("", "_low", "_high", "_doubtful")


def _as_sensor(row) -> dict:
    """A row of the study with the means of the sensors' own CSAC and CSF in the place of those over all sensors."""
    swapped = {f"{m}{end}": row[f"{m}_per_sensor{end}"] for m in ("csac", "csf") for end in _ENDS}
    return row | swapped


def _sensor_table(study, level, measure, rows, article) -> Table:
    models, shown = ARTICLE_MODELS if article else (), _shown(study, level)
    columns = [Column("Sensor")]
    columns += [Column(model, "", measure.form, "article’s rig") for model in models]
    columns += [Column(law, "", measure.form, "this rig") for law, _ in shown]
    body = []
    for node in (*(str(s.node) for s in study.dataset.rig.sensors), "mean"):
        published = article.sensors.get(node, {}) if article else {}
        own = (seeds.interval_of(rows[law, engine, node], measure.key) for law, engine in shown)
        body.append((node, *(published.get(f"{m}_{measure.article_key}", np.nan) for m in models), *own))
    unit = f" ({measure.unit}{'; the article’s without a unit' if article else ''})" if measure.unit else ""
    return Table(f"{measure.key}_level_{level:g}", measure.label + unit, tuple(columns), tuple(body))


def _shown(study, level) -> list[tuple[str, str]]:
    """Laws on the main engine, and the repeat floor if there is one."""
    laws = [(k.name, main_engine(study)) for k in study.laws]
    return [*laws, tuple(FLOOR.values())] if level in study.floor else laws


def _mean(values) -> float:
    """Mean of the finite values; nan if there is none."""
    finite = [v for v in values if np.isfinite(v)]
    return float(np.mean(finite)) if finite else np.nan


# What a better model gains: the article's claims.


def improvement_rows(study: Study, article: Article | None = None) -> list[dict]:
    """Change from a model to a better one in percent of the former: a row per level, law over another, and quantity.

    Parameters
    ----------
    study : Study
        The study; every law beside the base is compared with it, on the main engine.
    article : Article, optional
        Its updated over its initial model goes in front, as printed and as its own tables give it.
    """
    rows, base, engine = [], _base_law(study), main_engine(study)
    for basis, changes in (("printed", PRINTED), ("recomputed", article.improvements())) if article else ():
        head = {"level": "", "law": f"article updated, {basis}", "over": "article initial"}
        rows += [head | {"quantity": quantity, "change_pct": change} for quantity, change in changes.items()]
    found = {(r["level"], r["law"]): r for r in study.rows() if r["engine"] == engine}
    for (level, law), row in found.items():
        if law == base:
            continue
        for quantity, key in _IMPROVED.items():
            change = ratio(*(seeds.interval_of(r, key) for r in (row, found[level, base])))
            low, value, high = (100 * (x - 1) for x in (change.low, change.value, change.high))
            row_of = {"level": level, "law": law, "over": base, "quantity": quantity, "change_pct": value}
            rows.append(row_of | {"change_pct_low": low, "change_pct_high": high})
    return rows


_IMPROVED = {
    **{f"MAC, mode {mode}": f"mode_{mode}_mac" for mode in range(1, N_MODES + 1)},
    "frequency error": "relative_error",
    "MRE": "mre",
    "RMSE": "rmse_db",
    "FRAC": "frac",
    "CSAC": "csac_per_sensor",
    "CSF": "csf_per_sensor",
}
"""Quantities of which the article claims improvements, in its order, and where a study has them"""


def _base_law(study) -> str:
    """What stands for the article's initial model: the best constants, else the first law."""
    names = [k.name for k in study.laws]
    return "constant" if "constant" in names else names[0]


def improvement_table(study: Study, level: float, article: Article | None = None) -> Table:
    """Improvement of the better models over constant parameters, the article's beside ours.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        Which level.
    article : Article, optional
        Its numbers go in front.
    """
    rows, base, names = improvement_rows(study, article), _base_law(study), [k.name for k in study.laws]
    lesser = names[: names.index(base)]
    laws = list(dict.fromkeys(r["law"] for r in rows if r["level"] in (level, "") and r["law"] not in lesser))
    columns = [Column("Quantity")]
    for law in laws:
        group = "article" if law.startswith("article") else f"this rig, over {base}"
        columns.append(Column(law.removeprefix("article updated, "), "%", "+.1f", group))
    cells = {(r["law"], r["quantity"]): _change(r) for r in rows if r["level"] in (level, "")}
    body = tuple((quantity, *(cells.get((law, quantity)) for law in laws)) for quantity in _IMPROVED)
    caption = (
        f"Change from the initial to the updated model, in percent of the initial model’s value, at {level:g} "
        f"{excitation_unit(study)} RMS, engine {main_engine(study)}. Less is better for errors, more for MAC, FRAC, "
        "CSAC and CSF. Other levels: tables/improvements.csv."
    )
    return Table(f"improvements_level_{level:g}", caption, tuple(columns), body)


def _change(row) -> Interval:
    return Interval(row["change_pct"], row.get("change_pct_low", np.nan), row.get("change_pct_high", np.nan))


# Bushings.


def contact_rows(study: Study) -> list[dict]:
    """Motion and contact in every bushing: a row per record, law, engine and bushing; law "test" is what probes saw.

    Parameters
    ----------
    study : Study
        The study.
    """
    gaps = [b.gap for b in study.dataset.rig.bushings]
    rows = []
    for record in study.dataset.validate:
        displacement = record.response().displacement
        if displacement is not None:
            rms, peak = displacement.std(axis=0), np.abs(displacement).max(axis=0)
            head = {"level": record.level, "record": record.name, "law": "test", "engine": FLOOR["engine"]}
            rows += _bushings(head, gaps, rms, peak, [np.nan] * len(gaps), [np.nan] * len(gaps))
    for c in study.cases:
        keys = ("displacement_rms", "displacement_peak", "contact_share", "contact_peak")
        head = {"level": c.record.level, "record": c.record.name, "law": c.law, "engine": c.engine}
        rows += _bushings(head, gaps, *(c.statistics[key] for key in keys))
    return rows


def _bushings(head, gaps, *columns) -> list[dict]:
    names = ("gap_m", "displacement_rms_m", "displacement_peak_m", "contact_share", "contact_peak_n")
    return [head | {"bushing": i + 1} | dict(zip(names, map(float, row))) for i, row in enumerate(zip(gaps, *columns))]


def contact_table(study: Study) -> Table:
    """Motion over the gap, share of the time in contact and peak force by level; means over a level's records.

    Parameters
    ----------
    study : Study
        The study.
    """
    rows, engine = contact_rows(study), main_engine(study)
    n_bushings = len(study.dataset.rig.bushings)
    columns = [Column("Level", excitation_unit(study), "g"), Column("Law")]
    for i in range(n_bushings):
        group = f"Bushing {i + 1}"
        columns += [
            Column("RMS / gap", "", ".2f", group),
            Column("peak / gap", "", ".2f", group),
            Column("contact", "% time", ".1f", group),
            Column("peak force", "N", ".2f", group),
        ]
    body = []
    for level in study.levels:
        for law, on in (("test", FLOOR["engine"]), *((k.name, engine) for k in study.laws)):
            cells = []
            for i in range(n_bushings):
                found = [r for r in rows if _is(r, level=level, law=law, engine=on, bushing=i + 1)]
                cells += _contact_cells(found, law == "test")
            body.append((level, law, *cells))
    caption = (
        f"Motion and contact in the bushings, engine {engine}. RMS, peak and contact are means over a level’s "
        "records; probes at the bushings give the test’s motion, its contact is not measured. "
        "The other engines are in tables/contact.csv."
    )
    return Table("contact", caption, tuple(columns), tuple(body))


def _contact_cells(found, measured) -> list:
    rms = _mean(r["displacement_rms_m"] / r["gap_m"] for r in found)
    peak = _mean(r["displacement_peak_m"] / r["gap_m"] for r in found)
    if measured:
        return [rms, peak, None, None]
    share, force = (_mean(r[key] for r in found) for key in ("contact_share", "contact_peak_n"))
    return [rms, peak, 100 * share, force]


def _is(row, **values) -> bool:
    return all(row[key] == value for key, value in values.items())


# What went in.


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


def _datasheet(rig, name) -> float:
    """Value of a parameter named like "grease stiffness" in the rig file, at the first bushing; nan if not there."""
    part, _, field = name.partition(" ")
    value = getattr(getattr(rig.bushings[0], part, None), field.replace(" ", "_"), None)
    return value if isinstance(value, float) else np.nan


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
