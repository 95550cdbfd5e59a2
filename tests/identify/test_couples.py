"""The share of forces that acts as couples: drawn lines whose share is known, at every noise and with outliers."""

import numpy as np
import pytest

from clearance_mj.identify.structure.couples import WhiteLines, likeliest_end_moment_ratio

SHARES = np.array([0.0, 0.015, 0.05, 0.1, 0.2, 0.35, 0.5])
CHANNELS, UNKNOWNS, COUPLES = 9, 3, 2


def drawn(rng, fraction, n=600, outliers=0.0):
    """Lines of unknowns that are far above the noise, with couples of a share of them."""
    complex_ = lambda *shape: (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)  # noqa: E731
    gains, coupled = 100 * complex_(n, CHANNELS, UNKNOWNS), 30 * complex_(n, CHANNELS, COUPLES)
    noise = complex_(n, CHANNELS)
    noise[rng.random(n) < outliers] *= 20
    measured = gains @ complex_(n, UNKNOWNS, 1) + fraction * coupled @ complex_(n, COUPLES, 1) + noise[:, :, None]
    return WhiteLines(gains, measured[:, :, 0], coupled, 1.0)


@pytest.mark.parametrize("ratio", SHARES)
def test_the_share_that_acts_is_the_likeliest(rng, ratio):
    assert likeliest_end_moment_ratio([drawn(rng, ratio), drawn(rng, ratio)], SHARES, 2.0) == ratio


def test_outliers_are_no_couples(rng):
    assert likeliest_end_moment_ratio([drawn(rng, 0.05, outliers=0.02)], SHARES, 2.0) == 0.05


def test_some_of_the_lines_are_enough(rng):
    lines = drawn(rng, 0.2, n=1000).thinned(300)
    assert len(lines.gains) == len(lines.measured) == len(lines.coupled) == 250
    assert likeliest_end_moment_ratio([lines], SHARES, 2.0) == 0.2
