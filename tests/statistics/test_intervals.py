"""Confidence intervals hold the known answer as often as they say."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearance_mj.statistics.intervals import Interval, on_power_law, over_seeds, ratio

LEVELS = {0.5: 0.1, 1.0: 0.2, 2.0: 0.7, 5.0: 1.9, 8.0: 2.2}  # Median error by level


REPEATS = 600


def held(draw, expected, repeats=REPEATS):
    """Share of the intervals of drawn errors that hold the expected one, a multiple of the median of each level.

    Of those that are given: nearly all must be.
    """
    hits = []
    for _ in range(repeats):
        means = over_seeds({level: median * draw() for level, median in LEVELS.items()}).means
        given = {v: median for v, median in LEVELS.items() if not means[v].missing}
        hits += [means[v].low <= median * expected <= means[v].high for v, median in given.items()]
    assert len(hits) > 0.95 * repeats * len(LEVELS)
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
    means = over_seeds({1.0: [1.0, 1.21], 2.0: [math.e, math.e]})
    s2 = math.log(1.1) ** 2
    assert means.scatter == pytest.approx(math.sqrt(s2)) and means.freedom == 2
    half = 4.302653 * math.sqrt(s2 / 2 + s2**2 / 4)
    assert means.means[2.0].value == pytest.approx(math.e)
    assert means.means[2.0].low == pytest.approx(math.exp(1 + s2 / 2 - half))
    assert means.means[1.0].value == pytest.approx(1.105)
    assert means.means[1.0].high == pytest.approx(math.exp(math.log(1.1) + s2 / 2 + half))


def test_cochrans_limit_is_that_of_the_tables(rng):
    """ISO 5725-2, table 4: 0.841 for five levels of two, 0.684 for five of three."""
    for n, limit in ((2, 0.841), (3, 0.684)):
        means = over_seeds({level: rng.lognormal(size=n) for level in LEVELS})
        assert means.cochran_limit == pytest.approx(limit, abs=5e-4)


def test_cochran_refuses_equal_scatter_5_times_in_100_and_sees_one_level_that_scatters_more(rng):
    def refused(scatter):
        means = over_seeds({level: np.exp(s * rng.standard_normal(2)) for level, s in zip(LEVELS, scatter)})
        return means.cochran > means.cochran_limit

    assert 0.03 < np.mean([refused([0.1] * 5) for _ in range(REPEATS)]) < 0.07
    assert np.mean([refused([0.1, 0.1, 0.1, 0.1, 10.0]) for _ in range(200)]) > 0.9


def test_intervals_are_doubtful_where_one_level_scatters_far_more():
    even = {level: [1.0, 1.1] for level in LEVELS}
    assert not any(i.doubtful for i in over_seeds(even).means.values())
    assert all(i.doubtful for i in over_seeds(even | {8.0: [1.0, 50.0]}).means.values())


def test_a_lost_value_and_a_single_seed_are_borne():
    means = over_seeds({1.0: [1.0, 2.0], 2.0: [math.nan, 3.0], 4.0: [math.nan, math.nan], 8.0: [2.0, 3.0]})
    assert means.means[2.0].value == 3 and means.means[2.0].low < 3 < means.means[2.0].high
    assert math.isnan(means.means[4.0].value) and math.isnan(means.means[4.0].low)


@pytest.mark.parametrize("errors", [{1.0: [1.0], 2.0: [3.0]}, {2.0: [3.0, 3.1]}])
def test_with_one_degree_of_freedom_or_none_there_is_no_interval_and_it_is_said(errors):
    """Student's quantile would be 12.7."""
    mean = over_seeds(errors).means[2.0]
    assert mean.value == np.mean(errors[2.0]) and math.isnan(mean.low) and math.isnan(mean.high)
    assert mean.missing.startswith("too few records of a level: ") and not mean.doubtful


def test_an_interval_that_would_say_nothing_is_not_given():
    """Modes that were hardly extracted: errors of 1e-9 in one record and 0.3 in the other."""
    mean = over_seeds({1.0: [1e-9, 0.3], 2.0: [0.01, 0.012]}).means[2.0]
    assert math.isnan(mean.low) and "scatters too much from record to record" in mean.missing


def test_three_seeds_at_one_level_are_enough():
    mean = over_seeds({2.0: [3.0, 3.1, 3.2]}).means[2.0]
    assert not mean.missing and 2.5 < mean.low < 3.0 < 3.2 < mean.high < 3.7


LOGITS = st.lists(st.floats(1e-15, 1.0), min_size=2, max_size=3)


@given(st.dictionaries(st.floats(0.1, 100.0), LOGITS, min_size=2, max_size=5))
def test_the_interval_of_an_error_that_cannot_exceed_1_stays_within_0_and_1(errors):
    for mean in over_seeds(errors, largest=1.0).means.values():
        assert mean.missing or 0 <= mean.low <= mean.high <= 1
    for mean in on_power_law({level: values[0] for level, values in errors.items()}, largest=1.0).values():
        assert mean.missing or 0 <= mean.low <= mean.value <= mean.high <= 1


@pytest.mark.parametrize("scatter", [0.1, 0.5, 1.0])
def test_intervals_of_an_error_that_cannot_exceed_1_hold_the_expected_one_95_times_in_100(rng, scatter):
    """Errors whose logits are normal about those of 0.02 to 0.6; the expected errors by a million draws."""
    middle = {level: math.log(p / (1 - p)) for level, p in zip(LEVELS, (0.02, 0.1, 0.3, 0.5, 0.6))}
    many = scatter * rng.standard_normal(1_000_000)
    expected = {level: float(np.mean(1 / (1 + np.exp(-m - many)))) for level, m in middle.items()}
    hits = []
    for _ in range(REPEATS):
        drawn = {v: 1 / (1 + np.exp(-m - scatter * rng.standard_normal(2))) for v, m in middle.items()}
        means = over_seeds(drawn, largest=1.0).means
        hits += [means[v].low <= expected[v] <= means[v].high for v in LEVELS]
    assert 0.93 < np.mean(hits) < 0.975


def test_small_errors_have_the_same_interval_whether_they_can_exceed_1_or_not():
    errors = {1.0: [1e-4, 1.2e-4], 2.0: [3e-4, 2.5e-4]}
    free, bound = (over_seeds(errors, largest=largest).means[2.0] for largest in (math.inf, 1.0))
    assert (bound.low, bound.high) == pytest.approx((free.low, free.high), rel=1e-3)


def test_one_value_a_level_on_a_power_law_is_held_at_least_95_times_in_100(rng):
    """The residuals share their scatter with the values, so that the intervals are a little wide."""
    hits = []
    for _ in range(REPEATS):
        law_of_level = on_power_law({level: level**1.2 * math.exp(0.2 * rng.standard_normal()) for level in LEVELS})
        hits += [law_of_level[level].low <= level**1.2 <= law_of_level[level].high for level in LEVELS]
    assert 0.95 < np.mean(hits) < 0.99


def test_three_levels_are_too_few_for_a_power_law():
    assert all(math.isnan(i.low) for i in on_power_law({1.0: 1.0, 2.0: 2.0, 5.0: 4.0}).values())


def test_ratio_of_independent_means_is_held_95_times_in_100(rng):
    hits = []
    for _ in range(REPEATS):
        new, old = (
            over_seeds({level: factor * np.exp(0.2 * rng.standard_normal(2)) for level in LEVELS}).means[1.0]
            for factor in (0.5, 2.0)
        )
        interval = ratio(new, old)
        hits.append(interval.low <= 0.25 <= interval.high)
    assert 0.94 < np.mean(hits) < 0.98


def test_ratio_without_an_interval_or_of_nothing():
    assert ratio(Interval(1.0), Interval(2.0)).value == 0.5
    assert math.isnan(ratio(Interval(1.0), Interval(0.0)).value)
