"""Every item, in the quick way, on the shipped records: numbers against each other, the article and the docs."""

import functools
import re
import shutil

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from clearance_mj.core.errors import RecordError
from clearance_mj.report.rendering import View, render
from experiments.article import ITEMS, Inputs
from experiments.article.pages import markdown
from experiments.article.published import Printed

from ..conftest import ROOT
from ..refusals import assert_refused

NAMES = [*(f"figure_{number:02d}" for number in range(1, 11)), "table_1", "table_2"]
DRAWN = ("figure_01", "figure_05", "figure_06")
QUICK = ("figure_01", "figure_02", "figure_05", "figure_07")
"""A drawing, a free decay, records and FRFs of models: one of each kind"""
INPUTS = Inputs(ROOT / "data" / "table1_rig", quick=True)


def each(names):
    """Names of which those that take longer, or are like others, are slow."""
    return [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in names]


@pytest.fixture(scope="module")
def result():
    """What an item finds, computed when it is first asked for."""
    return functools.cache(lambda name, **parameters: ITEMS[name].run(INPUTS, **parameters))


@pytest.fixture(scope="module")
def frame_of(result):
    return lambda name, file=None: result(name).data[file or name]


@pytest.mark.parametrize("name", each(NAMES))
def test_figures_are_whole_and_axes_have_quantity_and_unit(name, result):
    for drawing in result(name).drawings:
        canvas = FigureCanvasAgg(drawing.figure)
        canvas.draw()
        for part in (*drawing.figure.axes, *drawing.figure.legends):
            box = part.get_tightbbox(canvas.get_renderer())
            within = np.array([box.min, box.max]) / drawing.figure.bbox.size
            assert ((within > -0.005) & (within < 1.005)).all(), part
        axes = [ax for ax in drawing.figure.axes if ax.axison]
        for labels in ([ax.get_xlabel() for ax in axes], [ax.get_ylabel() for ax in axes]):
            assert any(labels) or name in DRAWN
            assert all(re.search(r"\S \(.+\)|over 1 s", label) for label in labels if label)


@pytest.mark.parametrize("name", each(NAMES))
def test_numbers_and_words_are_there(name, result):
    reproduced, item = result(name), ITEMS[name]
    assert name in reproduced.data and not any(frame.empty for frame in reproduced.data.values())
    for words in (item.title, item.texts["article"], reproduced.method, reproduced.shows, item.texts["differs"]):
        assert words and "nan" not in words.split()


def test_rendering_without_a_backend_says_why(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    images, reason = render("<mujoco/>", [View((0, 0, 0), 1.0, 0.0, 0.0, 45.0, 0.01, (64, 64))])
    assert images == [] and "nonsense" in reason


@pytest.mark.slow
def test_table_1_prints_the_articles_columns(frame_of):
    rows, modes = frame_of("table_1"), Printed.load(1).numbers
    for kind in ("initial", "updated"):
        shown = rows.loc[rows["law"] == f"article {kind}", ["test_hz", "model_hz", "relative_error_percent", "mac"]]
        expected = modes[["test_hz", *(f"{kind}_{key}" for key in ("hz", "re_pct", "mac"))]]
        assert shown.to_numpy().tolist() == expected.to_numpy().tolist()


@pytest.mark.slow
def test_table_1_errors_follow_from_its_frequencies(frame_of):
    ours = frame_of("table_1").query("engine != ''")
    error = 100 * abs(ours["model_hz"] / ours["test_hz"] - 1)
    np.testing.assert_allclose(ours["relative_error_percent"], error, rtol=1e-9)


@pytest.mark.slow
def test_an_amplitude_law_is_within_the_articles_updated_column_at_every_level(frame_of):
    limits = Printed.load(1).numbers["updated_re_pct"]
    ours = frame_of("table_1").query("law == 'amplitude'")
    assert len(ours) == 4 * 5  # modes, levels
    assert (ours["relative_error_percent"] <= ours["mode"].astype(str).map(limits)).all()
    assert ours["mac"].min() >= 0.95


@pytest.mark.slow
def test_a_schedule_in_time_does_not_predict_another_record(frame_of):
    """The finding that the pages state: no better than the datasheet where the gaps close, unlike a law over motion."""
    means = frame_of("table_2").query("sensor == 'mean' and level == 5").set_index("law")["rmse_db"]
    assert means["ridge-as-printed"] > 0.9 * means["nominal"] > 5 * means["amplitude"]


@pytest.mark.slow
@pytest.mark.parametrize("name, quantity, printed", [("table_1", "MAC, mode 4", 50.74), ("table_2", "RMSE", -63.41)])
def test_improvements_stand_beside_the_articles(name, quantity, printed, result, frame_of):
    """As printed in the article's text; ours are changes of the means over both records of a level."""
    gains = frame_of(name, f"{name}_improvements").query(f"quantity == '{quantity}'")
    assert gains["change_pct"].iloc[0] == printed
    level = INPUTS.study.main_level
    (ours,) = gains.query(f"law == 'amplitude' and level == {level}").itertuples()
    assert ours.change_pct_low < ours.change_pct < ours.change_pct_high
    (table,) = (table for table in result(name).tables if table.name == "improvements")
    labels = "Quantity", "article, updated, as printed", "article, updated, recomputed"
    assert tuple(column.label for column in table.columns[:3]) == labels
    (row,) = (row for row in table.rows if row[0] == quantity)
    assert row[-1].value == ours.change_pct


@pytest.mark.slow
def test_errors_of_figures_7_and_8_follow_from_their_curves_and_are_those_of_table_2(frame_of):
    level = INPUTS.study.main_level
    table = frame_of("table_2").query(f"level == {level}").set_index(["law", "engine", "sensor"])["rmse_db"]
    for name in ("figure_07", "figure_08"):
        curves = frame_of(name)
        for row in frame_of(name, f"{name}_errors").itertuples():
            curve = curves[curves["sensor"] == row.sensor]
            column = "repeat_db" if row.law == "repeat" else f"{row.law} {row.engine}_db"
            assert np.sqrt(np.mean((curve[column] - curve["test_db"]) ** 2)) == pytest.approx(row.rmse_db, rel=1e-3)
            assert table[row.law, row.engine, str(row.sensor)] == pytest.approx(row.rmse_db, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "key"), [("figure_09", "csac"), ("figure_10", "csf")])
def test_means_of_figures_9_and_10_follow_from_their_curves_and_are_those_of_table_2(name, key, frame_of):
    table = frame_of("table_2")
    table = table[table["level"].isna() | (table["level"] == INPUTS.study.main_level)]
    for row in frame_of(name, f"{name}_means").to_dict("records"):
        for entry in table[(table["law"] == row["law"]) & (table["engine"] == row["engine"])].to_dict("records"):
            assert row[f"sensor_{entry['sensor']}"] == pytest.approx(entry[key], rel=1e-9)
        if not row["law"].startswith("article"):
            column = "repeat" if row["law"] == "repeat" else f"{row['law']} {row['engine']}"
            assert frame_of(name).query("sensor == 6")[column].mean() == pytest.approx(row["sensor_6"], rel=1e-4)


@pytest.mark.parametrize("name", each(["figure_02", "figure_03"]))
def test_eq_17_as_printed_is_twice_the_damping(name, frame_of):
    errors = frame_of(name, f"{name}_errors")
    (printed,) = errors.query("snr_db == 100 and quantity == 'c' and form == 'Eq. 17 as printed'").itertuples()
    assert printed.largest_rms_error_percent == pytest.approx(100.0, abs=0.1)


def test_a_level_that_is_not_there():
    with pytest.raises(RecordError, match=r"no validation record has level 3; there are 0\.5, 1, 2, 5, 8"):
        ITEMS["figure_07"].run(INPUTS, level=3.0)


def test_a_dataset_without_repeats(small_dataset, tmp_path):
    shutil.copytree(small_dataset, tmp_path / "one")
    listing = tmp_path / "one" / "dataset.toml"
    listing.write_text(listing.read_text().replace("level = 4.0", "level = 5.0", 1))
    assert_refused(RecordError, "needs two records", lambda: ITEMS["figure_05"].run(Inputs(tmp_path / "one")))


SLOW = (pytest.param(name, marks=pytest.mark.slow) for name in ("figure_02", "figure_07"))


@pytest.mark.parametrize("name", ["figure_05", *SLOW])
def test_csv_rows_are_the_same_again(name, result):
    reproduced = result(name), ITEMS[name].run(Inputs(INPUTS.path, quick=True))
    first, again = ({file: frame.to_csv() for file, frame in each.data.items()} for each in reproduced)
    assert again == first


def numbers(page):
    """Numbers with a decimal point of a page's tables, by the caption and by what else is in the row."""
    table_numbers, caption = {}, ""
    for line in page.splitlines():
        cells = line.strip("| ").split(" | ")
        values = [cell for cell in cells if re.fullmatch(r"-?\d+\.\d+(e[-+]\d+)?", cell)]
        if line.startswith("|") and values:
            table_numbers[caption, *(cell for cell in cells if cell not in values)] = [float(value) for value in values]
        if line and not line.startswith("|"):
            caption = line
    return table_numbers


@pytest.mark.parametrize("name", each(["figure_01", *(f"figure_{i:02d}" for i in range(7, 11)), "table_1", "table_2"]))
def test_the_documentation_shows_these_numbers(name, result):
    """Laws and engines that the quick way has in common with the whole way, and the article's rows."""
    documented = numbers((ROOT / "docs" / "experiments" / f"{name}.md").read_text(encoding="utf-8"))
    ours = numbers(markdown(ITEMS[name], result(name)))
    shared = set(documented) & set(ours)
    assert len(shared) >= 5
    for row in shared:
        np.testing.assert_allclose(ours[row], documented[row], rtol=2e-3, atol=2e-3, err_msg=str(row))


def test_calibration_finds_the_shipped_rig_and_a_family(result):
    """From a quarter of 8 starts, 4.5 cm between the rigs of the family."""
    data = result("calibrate_table1", starts=8, step=0.015).data
    rows, family = data["calibrate_table1"], data["calibrate_table1_family"]
    assert (abs(rows["calibrated"] - rows["shipped_rig"]) < rows["std"]).all()
    assert len(family) >= 5 and (family["chi2"] < 1e-6).all()
    assert family["masses[0].mass"].max() > 2 * family["masses[0].mass"].min()
    page = (ROOT / "docs" / "experiments" / "calibrate_table1.md").read_text(encoding="utf-8")
    assert all(f"| {value:.5g} |" in page for value in rows["calibrated"])


def test_sensor_placement_reaches_brute_force_and_its_page_says_so(result, frame_of):
    ratio = frame_of("sensor_placement", "sensor_placement_layouts").set_index("layout")["determinant_over_best"]
    assert ratio["exchange"] >= 0.99 and ratio["rig file"] < ratio["exchange"]
    assert frame_of("sensor_placement").query("layout == 'rig file'")["contribution"].sum() == pytest.approx(4)
    page = (ROOT / "docs" / "experiments" / "sensor_placement.md").read_text(encoding="utf-8")
    assert page == markdown(ITEMS["sensor_placement"], result("sensor_placement"))
