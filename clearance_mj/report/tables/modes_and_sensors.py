"""Agreement mode by mode and sensor by sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...statistics import repeatability
from ...statistics.intervals import Interval
from .study import FLOOR, MEASURES, N_MODES, excitation_unit, main_engine
from .table import Column, Table

if TYPE_CHECKING:
    from ...study import Study

__all__ = ["mode_rows", "mode_table", "seed_rows", "sensor_mean_rows", "sensor_rows", "sensor_tables"]

_ENDS = ("", "_low", "_high", "_doubtful")


def mode_rows(study: Study) -> list[dict]:
    """Natural frequencies of test and model: a row per record, law, engine and mode.

    Parameters
    ----------
    study : Study
        The study; the repeat floor's rows have law "repeat".
    """
    return [head | row for head, comparison in _comparisons(study) for row in _modes(comparison)]


def sensor_rows(study: Study) -> list[dict]:
    """Measures of every sensor: a row per record, law, engine and sensor.

    Parameters
    ----------
    study : Study
        The study; the repeat floor's rows have law "repeat".
    """
    rows = []
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
        floor = {level: _of_sensor(comparison, i) for level, comparison in study.repeatability.items()}
        found = {tuple(FLOOR.values()): repeatability.floor_rows(floor)}
        for law, engine in study.combinations:
            by_level = study.of_law(law, engine)
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


def mode_table(study: Study, level: float) -> Table:
    """Natural frequency, relative error and MAC of each mode, with a row per model.

    Parameters
    ----------
    study : Study
        The study; the laws are shown on its main engine.
    level : float
        Which level.
    """
    rows = {(r["law"], r["engine"]): r for r in study.rows() if r["level"] == level}
    shown = _shown(study, level)
    modes = [mode for mode in range(1, N_MODES + 1) if f"mode_{mode}_mac" in rows[shown[0]]]
    columns = [Column("Model")]
    for mode in modes:
        group = f"Mode {mode}"
        columns += [Column("f", "Hz", ".2f", group), Column("RE", "%", ".2f", group), Column("MAC", "", ".3f", group)]
    # Every row holds the test's modes.
    body = [("test", *sum(((rows[shown[0]][f"mode_{m}_test_hz"], None, None) for m in modes), ()))]
    for key in shown:
        cells = []
        for mode in (f"mode_{m}" for m in modes):
            error, mac = (repeatability.interval_of(rows[key], f"{mode}_{name}") for name in ("relative_error", "mac"))
            percent = Interval(*(100 * x for x in (error.value, error.low, error.high)), error.doubtful)
            cells += [rows[key][f"{mode}_model_hz"], percent, mac]
        body.append((key[0], *cells))
    caption = (
        f"Natural frequencies, relative errors and MAC at {level:g} {excitation_unit(study)} RMS, "
        f"engine {main_engine(study)}, with 95 % intervals over seeds; the other engines are in "
        "tables/natural_frequencies.csv."
    )
    return Table(f"natural_frequencies_level_{level:g}", caption, tuple(columns), tuple(body))


def sensor_tables(study: Study, level: float) -> list[Table]:
    """One table per measure: a row per sensor, a column per model.

    Parameters
    ----------
    study : Study
        The study; the laws are shown on its main engine.
    level : float
        Which level.
    """
    rows = {(r["law"], r["engine"], r["sensor"]): r for r in sensor_mean_rows(study) if r["level"] == level}
    means = {(r["law"], r["engine"], "mean"): _as_sensor(r) for r in study.rows() if r["level"] == level}
    return [_sensor_table(study, level, measure, rows | means) for measure in (MEASURES[-1], *MEASURES[:-1])]


def _comparisons(study):
    """Every comparison with what it compares."""
    for level, comparison in study.repeatability.items():
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


def _as_sensor(row) -> dict:
    """A row of the study with the means of the sensors' own CSAC and CSF in the place of those over all sensors."""
    swapped = {f"{m}{end}": row[f"{m}_per_sensor{end}"] for m in ("csac", "csf") for end in _ENDS}
    return row | swapped


def _sensor_table(study, level, measure, rows) -> Table:
    shown = _shown(study, level)
    columns = (Column("Sensor"), *(Column(law, "", measure.form) for law, _ in shown))
    nodes = (*(str(s.node) for s in study.dataset.rig.sensors), "mean")
    body = tuple(
        (node, *(repeatability.interval_of(rows[*shown_law, node], measure.key) for shown_law in shown))
        for node in nodes
    )
    unit = f" ({measure.unit})" if measure.unit else ""
    return Table(f"{measure.key}_level_{level:g}", measure.label + unit, columns, body)


def _shown(study, level) -> list[tuple[str, str]]:
    """Laws on the main engine, and the repeat floor if there is one."""
    laws = [(k.name, main_engine(study)) for k in study.laws]
    return [*laws, tuple(FLOOR.values())] if level in study.repeatability else laws
