"""Every item, in the quick way, on the shipped records: numbers against each other, the article and the docs."""

import csv
import functools
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from clearance_mj.errors import RecordError
from clearance_mj.report.rendering import View, render
from experiments.article import Context
from experiments.article.pages import markdown
from experiments.article.registry import get_item

ROOT = Path(__file__).parents[2]
NAMES = [*(f"figure_{number:02d}" for number in range(1, 11)), "table_1", "table_2"]
DRAWN = ("figure_01", "figure_05", "figure_06")
CONTEXT = Context(ROOT / "data" / "table1_rig", quick=True)


@functools.cache
def result(name):
    return get_item(name)(CONTEXT)


def rows_of(name, file=None):
    return result(name).data[file or name]


def published(file):
    with (ROOT / "data" / "article" / file).open(encoding="utf-8") as table:
        return list(csv.DictReader(table))


@pytest.mark.parametrize("name", NAMES)
def test_no_words_of_a_figure_are_clipped(name):
    for drawing in result(name).drawings:
        canvas = FigureCanvasAgg(drawing.figure)
        canvas.draw()
        for part in (*drawing.figure.axes, *drawing.figure.legends):
            box = part.get_tightbbox(canvas.get_renderer())
            within = np.array([box.min, box.max]) / drawing.figure.bbox.size
            assert ((within > -0.005) & (within < 1.005)).all(), part


@pytest.mark.parametrize("name", NAMES)
def test_axes_have_quantity_and_unit(name):
    for drawing in result(name).drawings:
        axes = [ax for ax in drawing.figure.axes if ax.axison]
        for labels in ([ax.get_xlabel() for ax in axes], [ax.get_ylabel() for ax in axes]):
            assert any(labels) or name in DRAWN
            assert all(re.search(r"\S \(.+\)|over 1 s", label) for label in labels if label)


@pytest.mark.parametrize("name", NAMES)
def test_numbers_and_words_are_there(name):
    found = result(name)
    assert name in found.data and all(found.data.values())
    for words in (found.title, found.article, found.method, found.shows, found.differs):
        assert words and "nan" not in words.split()


def test_rendering_without_a_backend_says_why(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    images, reason = render("<mujoco/>", [View((0, 0, 0), 1.0, 0.0, 0.0, 45.0, 0.01, (64, 64))])
    assert images == [] and "nonsense" in reason


def test_table_1_prints_the_articles_columns():
    for kind in ("initial", "updated"):
        ours = [r for r in rows_of("table_1") if r["law"] == f"article {kind}"]
        for row, article in zip(ours, published("table1_natural_frequency.csv"), strict=True):
            expected = [article["mode"], article["test_hz"], *(article[f"{kind}_{k}"] for k in ("hz", "re_pct", "mac"))]
            shown = [row[k] for k in ("mode", "test_hz", "model_hz", "relative_error_percent", "mac")]
            assert shown == [float(value) for value in expected]


def test_table_1_errors_follow_from_its_frequencies():
    ours = [r for r in rows_of("table_1") if r["engine"]]
    error = [100 * abs(r["model_hz"] / r["test_hz"] - 1) for r in ours]
    np.testing.assert_allclose([r["relative_error_percent"] for r in ours], error, rtol=1e-9)


def test_an_amplitude_law_is_within_the_articles_updated_column_at_every_level():
    limits = {int(r["mode"]): float(r["updated_re_pct"]) for r in published("table1_natural_frequency.csv")}
    ours = [r for r in rows_of("table_1") if r["law"] == "amplitude"]
    assert len(ours) == 4 * 5  # modes, levels
    for row in ours:
        assert row["relative_error_percent"] <= limits[row["mode"]]
        assert row["mac"] >= 0.95


def test_a_schedule_in_time_does_not_predict_another_record():
    """The finding that the pages state: no better than the datasheet where the gaps close, unlike a law over motion."""
    means = {r["law"]: r["rmse_db"] for r in rows_of("table_2") if r["sensor"] == "mean" and r["level"] == 5}
    assert means["ridge-as-printed"] > 0.9 * means["nominal"] > 5 * means["amplitude"]


def test_errors_of_figures_7_and_8_follow_from_their_curves_and_are_those_of_table_2():
    table = {
        (r["law"], r["engine"], r["sensor"]): r["rmse_db"]
        for r in rows_of("table_2")
        if r["level"] == CONTEXT.main_level
    }
    for name in ("figure_07", "figure_08"):
        for row in rows_of(name, f"{name}_errors"):
            curve = [r for r in rows_of(name) if r["sensor"] == row["sensor"]]
            column = "repeat_db" if row["law"] == "repeat" else f"{row['law']} {row['engine']}_db"
            difference = [float(r[column]) - float(r["test_db"]) for r in curve]
            assert np.sqrt(np.mean(np.square(difference))) == pytest.approx(row["rmse_db"], rel=1e-3)
            assert table[row["law"], row["engine"], str(row["sensor"])] == pytest.approx(row["rmse_db"], rel=1e-9)


@pytest.mark.parametrize(("name", "key"), [("figure_09", "csac"), ("figure_10", "csf")])
def test_means_of_figures_9_and_10_follow_from_their_curves_and_are_those_of_table_2(name, key):
    table = [r for r in rows_of("table_2") if r["level"] in ("", CONTEXT.main_level)]
    for row in rows_of(name, f"{name}_means"):
        for entry in (r for r in table if (r["law"], r["engine"]) == (row["law"], row["engine"])):
            assert row[f"sensor_{entry['sensor']}"] == pytest.approx(entry[key], rel=1e-9)
        if not row["law"].startswith("article"):
            column = "repeat" if row["law"] == "repeat" else f"{row['law']} {row['engine']}"
            curve = [float(r[column]) for r in rows_of(name) if r["sensor"] == 6]
            assert np.mean(curve) == pytest.approx(row["sensor_6"], rel=1e-4)


def test_translations_of_figure_4_are_those_of_the_grid():
    """b = a (16 κ + 8), κ = 0 : 0.005 : T/(4a): one more than the whole steps of 0.08 a in T = 4 s."""
    for row in rows_of("figure_04"):
        assert row["points"] == int(4 / (0.08 * 2 ** row["log2_scale"]) + 1e-9) + 1


def test_eq_17_as_printed_is_twice_the_damping():
    for name in ("figure_02", "figure_03"):
        errors = rows_of(name, f"{name}_errors")
        (printed,) = (
            r["largest_rms_error_percent"]
            for r in errors
            if (r["snr_db"], r["quantity"], r["form"]) == (100, "c", "Eq. 17 as printed")
        )
        assert printed == pytest.approx(100.0, abs=0.1)


def test_a_level_that_is_not_there():
    with pytest.raises(RecordError, match=r"no validation record has level 3; there are 0\.5, 1, 2, 5, 8"):
        get_item("figure_07")(CONTEXT, level=3.0)


def test_a_dataset_without_repeats(small_dataset, tmp_path):
    shutil.copytree(small_dataset, tmp_path / "one")
    listing = tmp_path / "one" / "dataset.toml"
    listing.write_text(listing.read_text().replace("level = 4.0", "level = 5.0", 1))
    with pytest.raises(RecordError, match="needs two records"):
        get_item("figure_05")(Context(tmp_path / "one"))


@pytest.mark.parametrize("name", ["figure_02", pytest.param("figure_07", marks=pytest.mark.slow)])
def test_csv_rows_are_the_same_again(name):
    assert get_item(name)(Context(CONTEXT.path, quick=True)).data == result(name).data


def numbers(page):
    """Numbers with a decimal point of a page's tables, by the caption and by what else is in the row."""
    found, caption = {}, ""
    for line in page.splitlines():
        cells = line.strip("| ").split(" | ")
        values = [cell for cell in cells if re.fullmatch(r"-?\d+\.\d+(e[-+]\d+)?", cell)]
        if line.startswith("|") and values:
            found[caption, *(cell for cell in cells if cell not in values)] = [float(value) for value in values]
        if line and not line.startswith("|"):
            caption = line
    return found


@pytest.mark.parametrize(
    "name", ["figure_01", "figure_07", "figure_08", "figure_09", "figure_10", "table_1", "table_2"]
)
def test_the_documentation_shows_these_numbers(name):
    """Laws and engines that the quick way has in common with the whole way, and the article's rows."""
    documented = numbers((ROOT / "docs" / "experiments" / f"{name}.md").read_text(encoding="utf-8"))
    ours = numbers(markdown(name, result(name)))
    shared = set(documented) & set(ours)
    assert len(shared) >= 5
    for row in shared:
        np.testing.assert_allclose(ours[row], documented[row], rtol=2e-3, atol=2e-3, err_msg=str(row))
