"""Lies put into records and rig files: none passes in silence, or it does not matter; the page has the messages."""

import re

import pytest

from experiments.benches.lying_records import CASES, LIES, from_csv, markdown, said, sound, table_cell

from ..conftest import ROOT

MATTERS = 0.1  # dB, by which FRFs may be worse than of sound records
PAGE = (ROOT / "docs" / "robustness.md").read_text("utf-8")
ROWS = from_csv(ROOT / "docs" / CASES)


def test_the_table_of_the_page_is_that_of_the_file():
    assert PAGE.partition("<!-- lies -->\n")[2].partition("<!-- /lies -->")[0] == markdown([*ROWS.items()])


def test_no_lie_passes_in_silence():
    """Where nothing is said, FRFs are predicted as without the lie."""
    assert [*LIES] == [*ROWS]
    silent = {lie: re.search(r"within ([0-9.]+) dB", words) for lie, words in ROWS.items() if words[:7] == "nothing"}
    assert "none" in silent and all(float(row[1]) < float(silent["none"][1]) + MATTERS for row in silent.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    "lie",
    ["probe reversed", "accelerometer in g",
     *(pytest.param(lie, marks=pytest.mark.release) for lie in ("probe 1 ms late", "probe: offset of 0.15 mm"))],
)  # fmt: skip
def test_the_file_has_the_messages(lie):
    """Numbers may differ in their last digit."""
    words = table_cell({"said": said(LIES[lie](sound())), "rmse_db": None})
    assert re.sub(r"\d[\d.]*", "…", words) == re.sub(r"\d[\d.]*", "…", ROWS[lie])
