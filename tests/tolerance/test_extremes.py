"""The largest value of a long time out of a short record: synthetic peaks whose distribution is known."""

import numpy as np
import pytest
import scipy.stats

from clearance_mj.tolerance.extremes import LEAST_PEAKS, SHAPE_PRIOR, decluster, largest_value


def record(peaks):
    """Return a record in which every peak is a cluster of its own."""
    value = np.zeros(3 * len(peaks))
    value[::3] = peaks
    return value


def test_clusters_end_where_it_stays_below_for_a_run():
    value = np.array([0, 3, 1, 5, 0, 0, 0, 4, 0, 0, 6, 2], dtype=float)
    assert decluster(value, 2.5, 2).tolist() == [5, 4, 6]
    assert decluster(value, 2.5, 3).tolist() == [5, 6] and decluster(value, 6.0, 2).size == 0


def test_interval_holds_the_largest_value_nine_times_in_ten():
    """Shapes are drawn from the prior, so that the posterior is exact; the largest is that of 60 records."""
    rng = np.random.default_rng(5)
    inside, below, count = 0, 0, 400
    for _ in range(count):
        law = scipy.stats.genpareto(np.clip(rng.normal(*SHAPE_PRIOR), -0.55, 0.45), scale=2.0)
        largest_peak = largest_value(record(law.rvs(60, random_state=rng)), 1, 60.0, least=0.0)
        largest = law.rvs(rng.poisson(3600), random_state=rng).max()
        inside += largest_peak.low <= largest <= largest_peak.high
        below += largest <= largest_peak.median
    assert inside / count == pytest.approx(0.9, abs=0.04)  # ± 2.7 standard deviations of the share
    assert below / count == pytest.approx(0.5, abs=0.07)


def test_probability_over_a_limit_is_that_of_the_quantiles():
    value = record(np.random.default_rng(1).exponential(3.0, 80))
    largest_peak = largest_value(value, 1, 60.0)
    again = largest_value(value, 1, 60.0, limits=(largest_peak.low, largest_peak.median, largest_peak.high, 0.0))
    assert again.exceeded[:3] == pytest.approx([0.95, 0.5, 0.05], abs=1e-4)
    assert again.exceeded[3] == pytest.approx(1.0)


def test_many_exponential_peaks_give_their_closed_form():
    """Of N exponential peaks a record, the largest of R records has the median ln(R N/ln 2), a Gumbel distribution."""
    rng, medians = np.random.default_rng(2), []
    for _ in range(40):
        medians.append(largest_value(record(rng.exponential(1.0, 1000)), 1, 60.0).median)
    assert np.mean(medians) == pytest.approx(np.log(60 * 1000 / np.log(2)), rel=0.05)


def test_misfit_is_anderson_and_darlings():
    """Excesses of another distribution, two values only, lie far from any generalised Pareto distribution."""
    rng = np.random.default_rng(3)
    good = largest_value(record(rng.exponential(1.0, 60)), 1, 60.0, least=0.0)
    assert good.misfit < 2.5 < largest_value(record(rng.choice([1.0, 1.001], 60)), 1, 60.0, least=0.0).misfit


def test_too_few_peaks_say_nothing():
    largest_peak = largest_value(record(np.ones(LEAST_PEAKS - 1)), 1, 60.0, least=0.0, limits=(2.0,))
    assert largest_peak.peaks == LEAST_PEAKS - 1
    assert np.isnan([largest_peak.median, largest_peak.low, largest_peak.high, largest_peak.exceeded[0]]).all()
