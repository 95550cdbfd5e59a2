"""Weights of families where all of them miss the records, and intervals that hold what families differ by."""

import numpy as np
import pytest

from clearance_mj.estimate import Estimates, Parameter, UnknownScale


def test_losses_of_blocks_make_the_scale():
    """Known answer: the sums over blocks, by hand, and their mean."""
    residuals = np.array([0.1, -2.0, 3.0, 0.5, 1.0])
    loss = UnknownScale(np.array([0, 2]))
    by_hand = 2 * (np.sqrt(1 + residuals**2) - 1)
    assert loss.losses(residuals) == pytest.approx([by_hand[:2].sum(), by_hand[2:].sum()])
    assert loss.losses(residuals).sum() / 5 == pytest.approx(float(loss.scale(residuals)))


def test_what_rivals_differ_by_is_in_the_interval():
    """Law of total variance about the likeliest: 0.2 (ln 1.25)² on top of its own."""
    gap = Parameter("bushings[0].gap", "m", 3e-4, 1e-4, 6e-4, 0.2, "log")
    offset = Parameter("bushings[0].offset", "m", 0.0, -1e-4, 1e-4, 1e-5)
    likeliest = Estimates.of([gap, offset], np.array([3e-4, 1e-5]), np.diag([1e-4, 1e-12]))
    with_rivals = likeliest.with_rivals([(0.2, {gap.name: 3.75e-4, "bushings[1].gap": 1.0})])
    assert with_rivals.covariance == pytest.approx(
        np.diag([1e-4 + 0.2 * np.log(1.25) ** 2, 1e-12]), rel=1e-9, abs=1e-20
    )
    assert with_rivals.value.tolist() == likeliest.value.tolist()
