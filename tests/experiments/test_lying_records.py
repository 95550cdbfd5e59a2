"""Lies put into records and rig files: none passes in silence, or it does not matter; the page says what is said."""

import re

import pytest

from experiments.benches.lying_records import LIES, said, sound, table_cell

from ..conftest import ROOT

MATTERS = 0.1  # dB, by which FRFs may be worse than of sound records
PAGE = (ROOT / "docs" / "robustness.md").read_text("utf-8")
ROWS = dict(
    re.findall(r"^\| (.+?) \| (.+) \|$", PAGE.partition("<!-- lies -->")[2].partition("<!-- /lies -->")[0], re.M)
)


def test_no_lie_passes_in_silence():
    """Where nothing is said, FRFs are predicted as without the lie."""
    assert LIES.keys() == ROWS.keys() - {"lie"}
    silent = {lie: re.search(r"within ([0-9.]+) dB", words) for lie, words in ROWS.items() if words[:7] == "nothing"}
    assert "none" in silent
    assert all(float(found[1]) < float(silent["none"][1]) + MATTERS for found in silent.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    "lie",
    ["probe reversed", "accelerometer in g",
     *(pytest.param(lie, marks=pytest.mark.release) for lie in ("probe 1 ms late", "probe: offset of 0.15 mm"))],
)  # fmt: skip
def test_the_page_says_what_is_said(lie):
    """Numbers may differ in their last digit."""
    words = table_cell({"said": said(LIES[lie](sound())), "rmse_db": None})
    assert re.sub(r"\d[\d.]*", "…", words) == re.sub(r"\d[\d.]*", "…", ROWS[lie])
