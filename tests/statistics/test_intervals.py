"""Confidence intervals hold the known answer as often as they say."""

import math

import numpy as np
import pytest

from clearance_mj.statistics.intervals import Interval, on_power_law, over_seeds, ratio

LEVELS = {0.5: 0.1, 1.0: 0.2, 2.0: 0.7, 5.0: 1.9, 8.0: 2.2}  # Median error by level


def held(draw, expected, repeats=2000):
    """Share of the intervals of drawn errors that hold the expected one, a multiple of the median of each level."""
    hits = []
    for _ in range(repeats):
        means = over_seeds({level: median * draw() for level, median in LEVELS.items()}).means
        hits += [means[v].low <= median * expected <= means[v].high for v, median in LEVELS.items()]
    return np.mean(hits)


@pytest.mark.parametrize("scatter", [0.05, 0.3, 1.0])
def test_two_seeds_at_five_levels_hold_the_expected_lognormal_error_95_times_in_100(rng, scatter):
    """The expected error of a lognormal is its median times exp(σ²/2)."""
    assert 0.93 < held(lambda: np.exp(scatter * rng.standard_normal(2)), math.exp(scatter**2 / 2)) < 0.97


def test_errors_of_a_frequency_whose_sign_is_lost_are_held_as_well(rng):
    """|e| of a normal e without bias is far from lognormal; its expected value is σ √(2/π)."""
    assert 0.93 < held(lambda: np.abs(rng.standard_normal(2)), math.sqrt(2 / math.pi)) < 0.98


def test_by_hand():
    """Logarithms 0, 2 ln 1.1 and 1, 1: s² = ((ln 1.1)² · 2) / 2, ν = 2, t = 4.302653 (tables)."""
    found = over_seeds({1.0: [1.0, 1.21], 2.0: [math.e, math.e]})
    s2 = math.log(1.1) ** 2
    assert found.scatter == pytest.approx(math.sqrt(s2)) and found.freedom == 2
    half = 4.302653 * math.sqrt(s2 / 2 + s2**2 / 4)
    assert found.means[2.0].value == pytest.approx(math.e)
    assert found.means[2.0].low == pytest.approx(math.exp(1 + s2 / 2 - half))
    assert found.means[1.0].value == pytest.approx(1.105)
    assert found.means[1.0].high == pytest.approx(math.exp(math.log(1.1) + s2 / 2 + half))


def test_cochrans_limit_is_that_of_the_tables(rng):
    """ISO 5725-2, table 4: 0.841 for five levels of two, 0.684 for five of three."""
    for n, limit in ((2, 0.841), (3, 0.684)):
        found = over_seeds({level: rng.lognormal(size=n) for level in LEVELS})
        assert found.cochran_limit == pytest.approx(limit, abs=5e-4)


def test_cochran_refuses_equal_scatter_5_times_in_100_and_sees_one_level_that_scatters_more(rng):
    def refused(scatter):
        found = over_seeds({level: np.exp(s * rng.standard_normal(2)) for level, s in zip(LEVELS, scatter)})
        return found.cochran > found.cochran_limit

    assert 0.03 < np.mean([refused([0.1] * 5) for _ in range(2000)]) < 0.07
    assert np.mean([refused([0.1, 0.1, 0.1, 0.1, 10.0]) for _ in range(200)]) > 0.9


def test_intervals_are_doubtful_where_one_level_scatters_far_more():
    even = {level: [1.0, 1.1] for level in LEVELS}
    assert not any(i.doubtful for i in over_seeds(even).means.values())
    assert all(i.doubtful for i in over_seeds(even | {8.0: [1.0, 50.0]}).means.values())


def test_a_lost_value_and_a_single_seed_are_borne():
    found = over_seeds({1.0: [1.0, 2.0], 2.0: [math.nan, 3.0], 4.0: [math.nan, math.nan]})
    assert found.means[2.0].value == 3 and found.means[2.0].low < 3 < found.means[2.0].high
    assert math.isnan(found.means[4.0].value) and math.isnan(found.means[4.0].low)


def test_without_a_second_seed_there_is_no_interval():
    found = over_seeds({1.0: [1.0], 2.0: [3.0]})
    assert found.freedom == 0 and found.means[2.0].value == 3 and math.isnan(found.means[2.0].high)


def test_one_value_a_level_on_a_power_law_is_held_at_least_95_times_in_100(rng):
    """The residuals share their scatter with the values, so that the intervals are a little wide."""
    hits = []
    for _ in range(2000):
        found = on_power_law({level: level**1.2 * math.exp(0.2 * rng.standard_normal()) for level in LEVELS})
        hits += [found[level].low <= level**1.2 <= found[level].high for level in LEVELS]
    assert 0.95 < np.mean(hits) < 0.99


def test_three_levels_are_too_few_for_a_power_law():
    assert all(math.isnan(i.low) for i in on_power_law({1.0: 1.0, 2.0: 2.0, 5.0: 4.0}).values())


def test_ratio_of_independent_means_is_held_95_times_in_100(rng):
    hits = []
    for _ in range(2000):
        new, old = (
            over_seeds({level: factor * np.exp(0.2 * rng.standard_normal(2)) for level in LEVELS}).means[1.0]
            for factor in (0.5, 2.0)
        )
        found = ratio(new, old)
        hits.append(found.low <= 0.25 <= found.high)
    assert 0.94 < np.mean(hits) < 0.98


def test_ratio_without_an_interval_or_of_nothing():
    assert ratio(Interval(1.0), Interval(2.0)).value == 0.5
    assert math.isnan(ratio(Interval(1.0), Interval(0.0)).value)
