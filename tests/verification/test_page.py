"""The verification page, and that what it shows was held to what it says."""

import pytest

from ..conftest import Measured
from .page import page


def test_page():
    rows = []
    kept = Measured(rows)
    kept.equal("period (s)", 2.0001, 2.0, "2π/ω", rel=1e-3)
    kept.below("phase: error", 1.23456e-3, 0.01, "ODE solver", "rad")
    kept.above("order", 2.98765, 2.5, "theory")
    lines = page({"Oscillator": rows}).splitlines()
    assert lines[lines.index("## Oscillator") + 4 :] == [
        "| period (s) | 2 | 2.0001 | ± 0.001 relative | 2π/ω |",
        "| phase: error | 0 | 0.00123 rad | < 0.01 rad | ODE solver |",
        "| order |  | 2.99 | > 2.5 | theory |",
    ]


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
