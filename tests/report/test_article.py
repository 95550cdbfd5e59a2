"""The article's tables as loaded are the repository's CSV files."""

import csv
import shutil
from pathlib import Path

from clearance_mj.report.article import load_article

DATA = Path(__file__).parents[2] / "data" / "article"


def rows(name):
    with (DATA / name).open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_number_of_table_1_is_loaded():
    article = load_article([DATA])
    printed = rows("table1_natural_frequency.csv")
    assert [str(mode) for mode in article.modes] == [row.pop("mode") for row in printed]
    assert list(article.modes.values()) == [{k: float(v) for k, v in row.items()} for row in printed]
    assert article.modes[3]["updated_hz"] == 91.65


def test_every_number_of_table_2_is_loaded():
    article = load_article([DATA])
    printed = rows("table2_frf_errors.csv")
    assert list(article.sensors) == [row.pop("sensor") for row in printed]
    assert list(article.sensors.values()) == [{k: float(v) for k, v in row.items()} for row in printed]
    assert article.sensors["6"]["updated_rmse"] == 0.0976


def test_the_repository_holds_the_tables():
    assert load_article() == load_article([DATA])


def test_a_folder_without_both_tables_is_passed_over(tmp_path):
    shutil.copy(DATA / "table1_natural_frequency.csv", tmp_path)
    assert load_article([tmp_path]) is None
    assert load_article([tmp_path, DATA]) == load_article([DATA])
