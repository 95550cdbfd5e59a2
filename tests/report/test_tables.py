"""The tables hold the study's numbers, and the summary says what they say."""

import csv
import dataclasses
import math

import numpy as np
import pytest

from clearance_mj import Model
from clearance_mj.report import ReportWriter, frames, registered_sections, tables
from clearance_mj.report.sections import bushings, modes_and_sensors, summary

from .conftest import changed

LEVEL = 4.0


def column(table, label, group=None):
    index = next(i for i, c in enumerate(table.columns) if c.label == label and group in (None, c.group))
    return [row[index] for row in table.rows]


def values(cells):
    return [cell.value for cell in cells]


def test_the_agreement_table_is_the_study_rows(study):
    shown, rows = summary.agreement_table(study, "modal"), [r for r in study.rows() if r["engine"] != "links"]
    assert [row[:2] for row in shown.rows] == [(r["level"], r["law"]) for r in rows]
    for measure in tables.OVERALL:
        cells = column(shown, measure.label)
        assert values(cells) == [r[measure.key] for r in rows]
        assert [c.high for c in cells[1:3]] == [r[f"{measure.key}_high"] for r in rows[1:3]]
    assert [r[-2] for r in shown.rows] == pytest.approx([20 / np.log(10) * np.sqrt(0.1 / 0.9 / 40)] * 6, rel=0.01)
    assert shown.rows[1][-1] == pytest.approx(rows[1]["rmse_db"] / rows[0]["rmse_db"])
    assert shown.rows[0][-1] == 1


def test_limits_of_a_criterion_are_those_of_its_distance_from_one(study):
    """Two levels of two seeds: ν = 2, t = 4.302653; the interval of a mean of normal logits by hand, turned round."""

    def distance(logit):
        return 1 / (1 + np.exp(-logit))

    of_level = [c for c in study.cases if (c.law, c.engine) == ("nominal", "links")]
    logarithms = {
        v: -np.log([1 / (1 - c.comparison.summary()["frac"]) - 1 for c in of_level if c.record.level == v])
        for v in (1.0, LEVEL)
    }
    variance = np.mean([np.var(x, ddof=1) for x in logarithms.values()])
    z = np.linspace(-8, 8, 4001)
    weight = np.exp(-(z**2) / 2) / np.exp(-(z**2) / 2).sum()
    expected = np.sum(weight * distance(logarithms[LEVEL].mean() + np.sqrt(variance) * z))
    middle = np.log(expected / (1 - expected))
    half = 4.302653 * np.sqrt(variance / 2 + variance**2 / 4)
    row = next(r for r in study.rows() if (r["level"], r["law"], r["engine"]) == (LEVEL, "nominal", "links"))
    assert row["frac_low"] == pytest.approx(1 - distance(middle + half))
    assert row["frac_high"] == pytest.approx(1 - distance(middle - half))


def test_improvements_are_changes_of_the_means(study):
    rows = {r["law"]: r for r in study.rows() if (r["level"], r["engine"]) == (LEVEL, "links")}
    improvements = [r for r in frames.improvements(study).to_dict("records") if r["level"] == LEVEL]
    ours = {r["quantity"]: r for r in improvements}
    assert {(r["law"], r["over"]) for r in improvements} == {("nominal", "constant")} and list(ours) == list(
        frames.IMPROVED
    )
    for quantity, key in (("RMSE", "rmse_db"), ("FRAC", "frac"), ("CSAC", "csac_per_sensor")):
        change = 100 * (rows["nominal"][key] / rows["constant"][key] - 1)
        assert ours[quantity]["change_pct"] == pytest.approx(change)
        assert ours[quantity]["change_pct_low"] < change < ours[quantity]["change_pct_high"]


def test_improvements_are_shown_of_the_laws_that_follow_the_base(study):
    turned = changed(study, laws=study.laws[::-1])
    shown = modes_and_sensors.improvement_table(turned, LEVEL)
    assert [(c.label, c.group) for c in shown.columns] == [("Quantity", ""), ("nominal", "over constant")]
    improvements = {
        r["quantity"]: r["change_pct"] for r in frames.improvements(turned).to_dict("records") if r["level"] == LEVEL
    }
    assert {row[0]: row[1].value for row in shown.rows} == improvements


def test_natural_frequencies_are_those_of_the_comparisons(study):
    shown = modes_and_sensors.mode_table(study, LEVEL)
    assert [row[0] for row in shown.rows] == ["test", "nominal", "constant", "repeat"]
    assert column(shown, "f", "Mode 2") == pytest.approx([40 * 0.94 * 1.001, 40, 40 * 0.955, 40 * 0.94 * 1.002])
    of_level = [c for c in study.cases if (c.law, c.engine, c.record.level) == ("constant", "links", LEVEL)]
    for i in range(4):
        error = np.mean([100 * c.comparison.per_mode["relative_error"][i] for c in of_level])
        mac = np.mean([c.comparison.per_mode["mac"][i] for c in of_level])
        assert column(shown, "RE", f"Mode {i + 1}")[2].value == pytest.approx(error)
        assert column(shown, "MAC", f"Mode {i + 1}")[2].value == pytest.approx(mac)


def test_sensor_tables_are_means_over_the_records_of_the_level(study):
    of_level = [c for c in study.cases if (c.law, c.engine, c.record.level) == ("nominal", "links", LEVEL)]
    assert len(of_level) == 2
    shown_tables = {t.name: t for t in modes_and_sensors.sensor_tables(study, LEVEL)}
    assert list(shown_tables) == [f"{key}_level_4" for key in ("mre", "rmse_db", "frac", "csac", "csf")]
    for measure in tables.MEASURES:
        shown = shown_tables[f"{measure.key}_level_4"]
        expected = np.mean([c.comparison.per_sensor[measure.key] for c in of_level], axis=0)
        assert values(column(shown, "nominal")) == pytest.approx([*expected, expected.mean()])
        floor = study.repeatability[LEVEL].per_sensor[measure.key]
        assert values(column(shown, "repeat")[:-1]) == pytest.approx(list(floor))


def test_parameters_have_standard_deviations_and_the_rig_files_values(study):
    assert [*frames.parameters(study).itertuples(index=False, name=None)] == [
        ("constant", "contact stiffness", "N/m", 8.1e3, pytest.approx(405), pytest.approx(5), 7.8e3),
        ("constant", "grease damping", "N s/m", 2.5, pytest.approx(0.5), pytest.approx(20), 3.0),
    ]


def test_contact_is_over_the_gap_and_in_percent(study):
    shown = bushings.contact_table(study)
    row = next(row for row in shown.rows if row[:2] == (LEVEL, "constant"))
    assert row[2:] == pytest.approx((4e-5 / 3e-4, 16e-5 / 3e-4, 4.0, 8.0))
    test = next(row for row in shown.rows if row[:2] == (LEVEL, "test"))
    motion = [r.response().displacement for r in study.dataset.validate if r.level == LEVEL]
    assert (test[2], test[4:]) == (pytest.approx(np.mean([m.std() for m in motion]) / 3e-4), (None, None))


def test_every_engine_tells_its_time_step(study):
    rows = [*frames.engines(study).itertuples(index=False)]
    assert [(r[0], r[2], r[3]) for r in rows] == [
        (engine, law, pytest.approx(1e-6 * step))
        for engine, step in (("links", 20), ("modal", 50))
        for law in ("nominal", "constant")
    ]
    assert "safety" in rows[0][1]


def test_records_tell_what_they_were_used_for(study):
    used = frames.records(study)[["record", "role"]].values.tolist()
    assert used == [[r.name, r.role] for r in study.dataset.records]


def test_the_summary_says_what_the_numbers_say(study):
    rows = {(r["level"], r["law"], r["engine"]): r["rmse_db"] for r in study.rows()}
    rmse, floor = rows[LEVEL, "constant", "links"], rows[LEVEL, "repeat", "rig"]
    first, over_levels, least, engines = summary.sentences(study)
    assert first == (
        f"At 4 m/s² RMS, law “constant” misses the rig by {rmse:.2f} dB RMS on engine links, "
        f"{rmse / floor:.2g} times what the rig repeats itself ({floor:.2f} dB); "
        "the random error of the test’s FRFs alone would be 0.46 dB."
    )
    low, high = sorted(rows[level, "nominal", "links"] for level in (1.0, LEVEL))
    assert f"“nominal” misses by {low:.2f} to {high:.2f} dB" in over_levels
    assert least == "Least RMSE: “constant” at 1, 4 m/s²."
    spread = max(
        abs(rows[level, law, "links"] - rows[level, law, "modal"])
        for level in (1.0, LEVEL)
        for law in ("nominal", "constant")
    )
    assert f"at most {spread:.2f} dB" in engines


def test_the_summary_changes_with_the_numbers(study, build):
    """But not the law that is spoken of: validation records do not choose it."""
    _, _, least, _ = summary.sentences(build(offset=0.2))
    assert least == "Least RMSE: “nominal” at 1, 4 m/s²."
    assert "law “constant” misses" in summary.sentences(build(offset=0.2))[0]


def test_without_a_second_record_there_is_no_repeatability(build):
    single = build(floors=())
    assert summary.sentences(single)[0].endswith(
        "no second record shows how closely the rig repeats itself, but the random error of the test’s FRFs alone "
        "would be 0.46 dB."
    )
    assert all(math.isnan(row[-1]) for row in summary.agreement_table(single, "links").rows)
    assert [row[0] for row in modes_and_sensors.mode_table(single, LEVEL).rows] == ["test", "nominal", "constant"]


def lost(study, **columns):
    """The study with nan in columns of every comparison of law "constant"."""

    def change(case):
        if case.law != "constant":
            return case
        gone = {field: getattr(case.comparison, field).assign(**{key: np.nan}) for field, key in columns.items()}
        return dataclasses.replace(case, comparison=dataclasses.replace(case.comparison, **gone))

    return changed(study, cases=[change(c) for c in study.cases])


def test_a_mode_that_was_not_found_is_nan_in_the_table(study):
    shown = modes_and_sensors.mode_table(lost(study, per_mode="mac"), LEVEL)
    assert math.isnan(column(shown, "MAC", "Mode 1")[2].value)
    assert math.isfinite(column(shown, "f", "Mode 1")[2])


def test_csv_holds_every_digit_of_every_row(study, tmp_path):
    rows = frames.sensors(study).to_dict("records")
    tables.write_csv(tmp_path / "sensors.csv", rows)
    with (tmp_path / "sensors.csv").open(newline="", encoding="utf-8") as file:
        read = list(csv.DictReader(file))
    assert len(read) == len(rows) == 3 * (len(study.cases) + len(study.repeatability))
    for row, back in zip(rows, read):
        assert [float(back[m.key]) for m in tables.MEASURES] == [row[m.key] for m in tables.MEASURES]
        assert (back["law"], back["engine"], back["sensor"]) == (row["law"], row["engine"], row["sensor"])


def test_the_report_says_which_rig_each_law_was_simulated_on(study, tmp_path):
    """One law here has a rig of its own, with a gap of 0.36 mm and an offset, and two families were compared for it."""
    bushing = dataclasses.replace(study.dataset.rig.bushings[0], gap=3.6e-4, offset=2e-5)
    rows = (
        {"name": "bushings[0].offset", "unit": "m", "value": 2e-5, "relative_std": 4e-6, "varies": "linear"},
        {"name": "bushings[0].gap", "unit": "m", "value": 3.6e-4, "relative_std": 0.01},
        {"name": "grease stiffness, bushings[0]", "unit": "N/m", "value": 3e3, "relative_std": 0.1},
        {"name": "grease slipping stiffness 1, bushings[0]", "unit": "N/m", "value": 3e2, "relative_std": 0.1},
    )  # fmt: skip
    numbers = {"log_evidence": -10.0, "misfit": 0.5, "held_out": 0.75}
    families = tuple(
        {"contact": contact, "grease": "Bouc-Wen", "weight": weight} | numbers
        for contact, weight in (("power law", 0.9), ("linear", 0.1))
    )
    nominal, constant = study.laws
    model = Model(study.dataset.rig.replace(bushings=(bushing,)), constant.model.law)
    own_rig = dataclasses.replace(constant, model=model, finds_rig=True, parameters=rows, families=families)
    with_own_rig = changed(study, laws=(nominal, own_rig))
    caption = summary.agreement_table(with_own_rig, "links").caption
    assert caption.endswith(
        "Law “constant” is simulated on the rig that was identified with it, all others on the rig file’s."
    )
    assert summary.agreement_table(study, "links").caption.endswith("on the rig file’s rig.")
    assert frames.laws(with_own_rig)["simulated_on"].tolist() == ["the rig file’s rig", "the rig identified with it"]
    contact = frames.contact(with_own_rig).groupby("law")["gap_m"].unique()
    assert {law: list(gaps) for law, gaps in contact.items()} == {
        "nominal": [3e-4], "constant": [3.6e-4], "test": [3e-4],
    }  # fmt: skip
    shown = frames.parameters(with_own_rig)
    assert shown["standard_deviation"].tolist() == pytest.approx([4e-6, 3.6e-6, 300, 30])
    assert shown["relative_std_pct"].tolist() == pytest.approx([20, 1, 10, 10])
    assert shown["rig_file"].tolist() == pytest.approx([math.nan, 3e-4, 4000, math.nan], nan_ok=True)
    sections, writer = dict(registered_sections()), ReportWriter(tmp_path)
    page = sections["about"].write(with_own_rig, writer) + sections["bushings"].write(with_own_rig, writer)
    assert "what each model was allowed to know" in page and "the rig identified with it" in page
    assert "Families of laws" in page and "<td>power law</td>" in page
