"""Agreement mode by mode and sensor by sensor, and the gain of a better law over another."""

from __future__ import annotations

import numpy as np

from ...statistics.intervals import Interval
from ...study import N_MODES, Study
from .. import frames
from ..frames import interval
from ..html import render
from ..tables import MEASURES, REPEAT, AgreementMeasure, Column, Table
from ..writer import ReportWriter
from . import section
from .parts import by_part


@section("tables", "Modes and sensors", 50)
def modes_and_sensors(study: Study, writer: ReportWriter) -> str:
    """Return Tables 1 and 2; writes the numbers of all levels and engines."""
    writer.csv("natural_frequencies", frames.modes(study))
    writer.csv("sensors", frames.sensors(study))
    writer.csv("sensor_means", frames.sensor_means(study))
    writer.csv("seeds", frames.seeds(study))
    writer.csv("improvements", frames.improvements(study))
    return by_part(study, _tables)


def _tables(study: Study) -> str:
    shown = dict.fromkeys((study.main_level, study.levels[0]))
    return render(
        "modes_and_sensors.html.j2", study=study,
        gained=improvement_table(study, study.main_level) if study.base_law != study.methods[-1] else None,
        modes=[(mode_table(study, level), not_compared(study, level)) for level in shown],
        sensors=sensor_tables(study, study.main_level),
    )  # fmt: skip


def improvement_table(study: Study, level: float) -> Table:
    """Return the improvement of the laws that follow the base law over it."""
    laws = study.methods[study.methods.index(study.base_law) + 1 :]
    gains = frames.improvements(study)
    rows = {(row["law"], row["quantity"]): row for row in gains[gains["level"] == level].to_dict("records")}
    columns = (Column("Quantity"), *(Column(law, "%", "+.1f", f"over {study.base_law}") for law in laws))
    body = tuple((quantity, *(_change(rows[law, quantity]) for law in laws)) for quantity in frames.IMPROVED)
    caption = (
        f"Change from law “{study.base_law}” to those that follow it, in percent of its value, at {level:g} "
        f"{study.unit} RMS, engine {study.main_engine}. Less is better for errors, more for MAC, FRAC, CSAC and CSF. "
        "Other levels: tables/improvements.csv."
    )
    return Table(f"improvements_level_{level:g}", caption, columns, body)


def _change(row: dict) -> Interval:
    value, low, high = (float(row[f"change_pct{end}"]) for end in ("", "_low", "_high"))
    return Interval(value, low, high, missing=str(row["no_interval"]))


def not_compared(study: Study, level: float) -> list[str]:
    """Return in words which modes of a level are not compared and why: of the test, then of the laws.

    Parameters
    ----------
    study : Study
        The study.
    level : float
        m/s², or N.
    """
    said = list(study.level_modes[level].left_out)
    for case in study.simulated(engines=[study.main_engine], records=study.records(level)):
        for _, row in case.comparison.per_mode.iterrows():
            if row["why"]:
                hz = row["test_hz"] if np.isfinite(row["test_hz"]) else row["model_hz"]
                said.append(f"law “{case.law}”, record {case.record.name}, mode near {hz:.4g} Hz: {row['why']}")
    return said


def mode_table(study: Study, level: float) -> Table:
    """Return natural frequency, relative error and MAC of each mode, with a row per model on the main engine."""
    rows = {(r["law"], r["engine"]): r for r in study.rows() if r["level"] == level}
    shown = _shown_laws(study, level)
    modes = [mode for mode in range(1, N_MODES + 1) if f"mode_{mode}_mac" in rows[shown[0]]]
    columns = [Column("Model")]
    for mode in modes:
        group = f"Mode {mode}"
        columns += [Column("f", "Hz", ".2f", group), Column("RE", "%", ".2f", group), Column("MAC", "", ".3f", group)]
    # Every row holds the test's modes.
    body: list[tuple] = [("test", *(x for m in modes for x in (rows[shown[0]][f"mode_{m}_test_hz"], None, None)))]
    for key in shown:
        cells: list[float | Interval] = []
        for name in (f"mode_{m}" for m in modes):
            error, mac = interval(rows[key], f"{name}_relative_error", 100), interval(rows[key], f"{name}_mac")
            cells += [rows[key][f"{name}_model_hz"], error, mac]
        body.append((key[0], *cells))
    caption = (
        f"Natural frequencies, relative errors and MAC at {level:g} {study.unit} RMS, engine {study.main_engine}, with "
        "95 % intervals over seeds; the other engines are in tables/natural_frequencies.csv."
    )
    return Table(f"natural_frequencies_level_{level:g}", caption, tuple(columns), tuple(body))


def sensor_tables(study: Study, level: float) -> list[Table]:
    """Return a table per measure: a row per sensor, a column per model on the main engine."""
    means = frames.sensor_means(study)
    rows = {(r["law"], r["engine"], r["sensor"]): r for r in means[means["level"] == level].to_dict("records")}
    for row in (r for r in study.rows() if r["level"] == level):
        # Means of CSAC and CSF per sensor, in the place of those over all sensors.
        measures = {key.replace("_per_sensor", ""): value for key, value in row.items() if "_per_sensor" in key}
        rows[row["law"], row["engine"], "mean"] = row | measures
    return [_sensor_table(study, level, measure, rows) for measure in (MEASURES[-1], *MEASURES[:-1])]


def _sensor_table(study: Study, level: float, measure: AgreementMeasure, rows: dict[tuple, dict]) -> Table:
    shown = _shown_laws(study, level)
    columns = (Column("Sensor"), *(Column(law, "", measure.form) for law, _ in shown))
    nodes = (*frames.sensor_names(study), "mean")
    body = tuple((node, *(interval(rows[*on, node], measure.key) for on in shown)) for node in nodes)
    unit = f" ({measure.unit})" if measure.unit else ""
    return Table(f"{measure.key}_level_{level:g}", measure.label + unit, columns, body)


def _shown_laws(study: Study, level: float) -> list[tuple[str, str]]:
    """Return rows of laws on the main engine, and the repeatability if there is one."""
    laws = [(law, study.main_engine) for law in study.methods]
    return [*laws, REPEAT] if level in study.repeatability else laws
