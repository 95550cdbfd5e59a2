"""The verification page, and that what it shows was held to what it says."""

import pytest

from .page import ABSENT, KEPT, Measured, page


@pytest.fixture
def kept():
    kept = Measured([])
    kept.equal("period (s)", 2.0001, 2.0, "2π/ω", rel=1e-3)
    kept.below("phase: error", 1.23456e-3, 0.01, "ODE solver", "rad")
    kept.above("order", 2.98765, 2.5, "theory")
    return kept


def test_page(kept):
    text = page({"Oscillator": kept.rows})
    assert "\n3 cases.\n" in text
    assert "\n| Oscillator | 3 | 84% | order |\n" in text
    lines = text.splitlines()
    assert lines[lines.index("## Oscillator") + 4 :] == [
        "| period (s) | 2 | 2.0001 | ± 0.001 relative | 5.0% | 2π/ω |",
        "| phase: error | 0 | 0.00123 rad | < 0.01 rad | 12.3% | ODE solver |",
        "| order |  | 2.99 | > 2.5 | 83.7% | theory |",
    ]


def test_rows_of_records_that_are_not_there_stay(kept):
    before = page({"Oscillator": kept.rows, "A record": kept.rows[:1], "Another": kept.rows[1:]})
    text = page({"Oscillator": kept.rows, "A record": [], "New": []}, before)
    assert "\n3 cases.\n" in text
    assert "\n| A record | not run | | |\n" in text
    assert text.partition("## A record\n\n")[2].startswith(f"{KEPT}| what | ")
    assert text.count("| period (s) | 2 |") == 2
    assert text.endswith(f"## New\n\n{ABSENT}")
    again = page({"Oscillator": kept.rows, "A record": [], "New": []}, text)
    assert again == text


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
