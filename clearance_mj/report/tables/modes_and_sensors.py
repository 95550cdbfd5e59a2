"""Per mode and per sensor: like Tables 1 and 2 of the article."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...statistics import repeatability
from ...statistics.intervals import Interval
from ..article import ARTICLE_MODELS, Article
from .study import FLOOR, MEASURES, N_MODES, excitation_unit, main_engine
from .table import Column, Table

if TYPE_CHECKING:
    from ...study import Study

__all__ = ["mode_rows", "mode_table", "seed_rows", "sensor_mean_rows", "sensor_rows", "sensor_tables"]

_ENDS = ("", "_low", "_high", "_doubtful")


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
        found = {tuple(FLOOR.values()): repeatability.floor_rows(floor)}
        for law, engine in study.combinations:
            by_level = study.of(law, engine)
            of_sensor = {level: [_of_sensor(c, i) for c in comparisons] for level, comparisons in by_level.items()}
            found[law, engine] = repeatability.mean_rows(of_sensor)
        for (law, engine), means in found.items():
            head = {"law": law, "engine": engine, "sensor": str(sensor.node)}
            rows += [{"level": level} | head | row for level, row in means.items()]
    return rows


def seed_rows(study: Study) -> list[dict]:
    """What the means are of: measures over all sensors, a row per record, law and engine.

    Parameters
    ----------
    study : Study
        The study; the repeat floor's rows have law "repeat".
    """
    return [head | comparison.summary() for head, comparison in _comparisons(study)]


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
            error, mac = (repeatability.interval_of(rows[key], f"{mode}_{name}") for name in ("relative_error", "mac"))
            percent = Interval(*(100 * x for x in (error.value, error.low, error.high)), error.doubtful)
            cells += [rows[key][f"{mode}_model_hz"], percent, mac]
        body.append(("this rig", key[0], *cells))
    caption = (
        f"Natural frequencies, relative errors and MAC at {level:g} {excitation_unit(study)} RMS, "
        f"engine {main_engine(study)}, with 95 % intervals over seeds; the other engines are in "
        "tables/natural_frequencies.csv."
    )
    return Table(f"natural_frequencies_level_{level:g}", caption, tuple(columns), tuple(body))


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


def _comparisons(study):
    """Every comparison with what it compares."""
    for level, comparison in study.floor.items():
        yield {"level": level, "record": "", **FLOOR}, comparison
    for c in study.cases:
        yield {"level": c.record.level, "record": c.record.name, "law": c.law, "engine": c.engine}, c.comparison


def _modes(comparison) -> list[dict]:
    columns = comparison.per_mode
    keys = ("test_hz", "model_hz", "relative_error_pct", "mac", "test_damping", "model_damping")
    columns = columns | {"relative_error_pct": 100 * columns["relative_error"]}
    return [{"mode": i + 1} | {key: float(columns[key][i]) for key in keys} for i in range(len(columns["mode"]))]


def _of_sensor(comparison, i) -> dict[str, float]:
    return {m.key: float(comparison.per_sensor[m.key][i]) for m in MEASURES}


def _article_modes(article, modes) -> list[tuple]:
    empty = dict.fromkeys(next(iter(article.modes.values())), np.nan)
    rows = [article.modes.get(mode, empty) for mode in modes]
    body = [("article’s rig", "test", *sum(((row["test_hz"], None, None) for row in rows), ()))]
    for model in ARTICLE_MODELS:
        cells = ((row[f"{model}_hz"], row[f"{model}_re_pct"], row[f"{model}_mac"]) for row in rows)
        body.append(("article’s rig", model, *sum(cells, ())))
    return body


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
        own = (repeatability.interval_of(rows[law, engine, node], measure.key) for law, engine in shown)
        body.append((node, *(published.get(f"{m}_{measure.article_key}", np.nan) for m in models), *own))
    unit = f" ({measure.unit}{'; the article’s without a unit' if article else ''})" if measure.unit else ""
    return Table(f"{measure.key}_level_{level:g}", measure.label + unit, tuple(columns), tuple(body))


def _shown(study, level) -> list[tuple[str, str]]:
    """Laws on the main engine, and the repeat floor if there is one."""
    laws = [(k.name, main_engine(study)) for k in study.laws]
    return [*laws, tuple(FLOOR.values())] if level in study.floor else laws
