"""The article's tables as loaded are the repository's CSV files."""

import csv

import pytest

from experiments.article.published import FILES, FOLDER, Printed, improvements


@pytest.mark.parametrize(("number", "cell"), [(1, ("3", "updated_hz", 91.65)), (2, ("6", "updated_rmse", 0.0976))])
def test_every_number_is_loaded(number, cell):
    row, column, value = cell
    table = Printed.load(number).numbers
    assert table.at[row, column] == value
    with (FOLDER / FILES[number]).open(newline="") as file:
        header, *rows = csv.reader(file)
    assert [table.index.name, *table.columns] == header and list(table.index) == [r[0] for r in rows]
    assert table.to_numpy().tolist() == [[float(value) for value in r[1:]] for r in rows]


def test_tables_3_and_4():
    """As printed."""
    assert Printed.load(3).numbers.at["lateral_position_error_peak", "smc_cm"] == 0.025
    assert Printed.load(4).numbers.at["lateral_position_error_peak", "mpc"] == 0.12


def test_improvements_by_hand():
    """From the tables; the text divides by the new value."""
    by_hand = {"MAC, mode 1": 75.2, "MAC, mode 2": 45.1, "MAC, mode 3": 63.9, "MAC, mode 4": 103.0}
    by_hand |= {"frequency error": 100 * (3.9382 / 11.3119 - 1)}
    by_hand |= {"MRE": -27.68, "RMSE": -63.41, "FRAC": 18.74, "CSAC": 7.01, "CSF": 14.12}
    assert improvements() == pytest.approx(by_hand, abs=0.05)
