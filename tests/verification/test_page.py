"""The verification page, and that what it shows was held to what it says."""

import csv

import pytest

from ..conftest import ROOT
from .page import ABSENT, Measured, cases, page


@pytest.fixture
def kept():
    kept = Measured([])
    kept.equal("period (s)", 2.0001, 2.0, "2π/ω", rel=1e-3)
    kept.below("phase: error", 1.23456e-3, 0.01, "ODE solver", "rad")
    kept.above("order", 2.98765, 2.5, "theory")
    return kept


def test_page(kept):
    text = page({"Oscillator": kept.rows}, "cases.csv")
    assert "{download}`verification.csv <cases.csv>` (UTF-8) lists the 3 cases" in text
    assert text.splitlines()[-1] == "| Oscillator | 3 | order |  | 2.99 | > 2.5 | 83.7% | theory |"
    assert ABSENT not in text


def test_every_case_is_in_the_file(kept):
    assert cases({"Oscillator": kept.rows}).splitlines() == [
        "subject,quantity,target,measured,allowed,used (%),source",
        "Oscillator,period (s),2,2.0001,± 0.001 relative,5.0,2π/ω",
        "Oscillator,phase: error,0,0.00123 rad,< 0.01 rad,12.3,ODE solver",
        "Oscillator,order,,2.99,> 2.5,83.7,theory",
    ]


def test_rows_of_records_that_are_not_there_stay(kept):
    before = cases({"Oscillator": kept.rows, "A record, lost": kept.rows[:1], "Another": kept.rows[1:]})
    groups = {"Oscillator": kept.rows[:2], "A record, lost": [], "New": []}
    text = page(groups, "cases.csv")
    assert "lists the 2 cases" in text
    assert "\n| A record, lost | not run |  |" in text and text.endswith(ABSENT)
    file = cases(groups, before)
    assert file == cases({"Oscillator": kept.rows[:2], "A record, lost": kept.rows[:1]})
    assert cases(groups, file) == file


def test_the_page_and_its_file_agree():
    """As many rows of each subject as the page says, and each of its cases, with the numbers."""
    with (ROOT / "docs" / "verification.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    table = [line[2:-2].split(" | ") for line in (ROOT / "docs" / "verification.md").read_text("utf-8").splitlines()
             if line.startswith("| ")][1:]  # fmt: skip
    counts = {subject: int(n) for subject, n, *_ in table if n != "not run"}
    assert counts == {subject: sum(row[0] == subject for row in rows) for subject in counts}
    for subject, n, *cells, used, source in table:
        assert n == "not run" or [subject, *cells, used.rstrip("%"), source] in rows


def test_a_figure_outside_what_is_allowed_fails():
    kept = Measured([])
    for check in (
        lambda: kept.equal("", 2.01, 2.0, "", rel=1e-3),
        lambda: kept.equal("", 2.01, 2.0, "", abs=1e-3),
        lambda: kept.below("", 0.01, 0.01, ""),
        lambda: kept.below("", float("nan"), 0.01, ""),
        lambda: kept.above("", 2.5, 2.5, ""),
    ):
        with pytest.raises(AssertionError):
            check()
