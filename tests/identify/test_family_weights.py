"""Weights of families where all of them miss the records, and intervals that hold what families differ by."""

from types import SimpleNamespace

import numpy as np
import pytest

from clearance_mj.estimate import Estimates, Parameter
from clearance_mj.estimate.loss import UnknownScale
from clearance_mj.identify.methods.bench import between_families


def test_losses_of_blocks_make_the_scale():
    """Known answer: the sums over blocks, by hand, and their mean."""
    residuals = np.array([0.1, -2.0, 3.0, 0.5, 1.0])
    loss = UnknownScale(np.array([0, 2]))
    by_hand = 2 * (np.sqrt(1 + residuals**2) - 1)
    assert loss.losses(residuals) == pytest.approx([by_hand[:2].sum(), by_hand[2:].sum()])
    assert loss.losses(residuals).sum() / 5 == pytest.approx(float(loss.scale(residuals)))


def test_what_families_differ_by_is_in_the_interval():
    """Law of total variance about the likeliest: 0.2 (ln 1.25)² on top of the likeliest family's own."""
    gap = Parameter("bushings[0].gap", "m", 3e-4, 1e-4, 6e-4, 0.2, "log")

    def family(value: float, weight: float) -> SimpleNamespace:
        estimates = Estimates.of([gap], np.array([value]), np.array([[1e-4]]))
        return SimpleNamespace(fit=SimpleNamespace(estimates=estimates, values={gap.name: value}), weight=weight)

    between = between_families([family(3e-4, 0.8), family(3.75e-4, 0.2)])
    assert between == pytest.approx(np.array([[0.2 * np.log(1.25) ** 2]]))
