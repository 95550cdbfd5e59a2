"""Intervals of shares against published ones."""

import pytest

from clearance_mj.statistics import share_interval


def test_wilsons_interval_is_that_of_the_published_example():
    """Of 15 and 148, and of 0 and 20 (Newcombe, Statistics in Medicine 17, 1998, table I, method 3)."""
    assert share_interval(15 / 148, 148) == pytest.approx([0.0624, 0.1605], abs=1e-4)
    assert share_interval(0 / 20, 20) == pytest.approx([0.0, 0.1611], abs=1e-4)
