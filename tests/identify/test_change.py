"""Changes against closed forms: the Kalman filter's update, the likelihood ratio of two means; none without one."""

import numpy as np
import pytest
import scipy.stats

from clearance_mj.estimate.beliefs import Belief, refine
from clearance_mj.identify.follow.changes import Changes, WindowLikelihood, fused, observed


def seen(values, std):
    return [WindowLikelihood(np.eye(1) / std**2, np.array([v]) / std**2) for v in values]


def test_observed_and_fused_are_the_kalman_filters_update():
    rng = np.random.default_rng(0)
    rows, data = rng.standard_normal((40, 3)), rng.standard_normal(40)
    before = Belief.independent([1.0, -1.0, 0.3], [0.5, 2.0, 1.0])
    after = refine(before, lambda x: x @ rows.T - data).belief
    update = observed(before, after)
    assert update.precision == pytest.approx(rows.T @ rows, rel=1e-8)
    assert update.weighted == pytest.approx(rows.T @ data, rel=1e-7)
    again = fused(before, update)
    assert again.mean == pytest.approx(after.mean, rel=1e-8)
    assert again.covariance == pytest.approx(after.covariance, rel=1e-8)


def test_a_step_has_the_likelihood_ratio_of_two_means():
    """Of n values before and m after, each of variance s²: size over its deviation s √(1/n + 1/m)."""
    rng, std = np.random.default_rng(1), 0.1
    values = np.concatenate((rng.normal(0.0, std, 30), rng.normal(0.5, std, 6)))
    changes = Changes(Belief.independent([0.0], [1e3]), np.array([1e3]))
    for each in seen(values, std):
        changes.observations.append(each)
    change, excess = changes.likeliest(np.eye(1), np.array([0.2]))
    size, spread = values[30:].mean() - values[:30].mean(), std * np.sqrt(1 / 30 + 1 / 6)
    assert (change.kind, change.windows) == (0, 6)
    assert (change.size, change.std, excess) == pytest.approx((size, spread, (size - 0.2) / spread), rel=1e-6)
    assert change.before == pytest.approx(values[:30].mean(), rel=1e-6)
    assert change.after.mean == pytest.approx(values[30:].mean(), rel=1e-4)


def test_the_kind_that_changed_is_named():
    """Two parameters that windows tell only together, 0.9 correlated: still the one that moved."""
    covariance = 0.01 * np.array([[1.0, 0.9], [0.9, 1.0]])
    precision, rng = np.linalg.inv(covariance), np.random.default_rng(2)
    changes = Changes(Belief.independent([0.0, 0.0], [10.0, 10.0]), np.array([10.0, 10.0]))
    for i in range(40):
        y = rng.multivariate_normal([0.0, 0.4 if i >= 35 else 0.0], covariance)
        changes.observations.append(WindowLikelihood(precision, precision @ y))
    change, _ = changes.likeliest(np.eye(2), np.zeros(2))
    assert (change.kind, change.windows) == (1, 5)
    assert change.size == pytest.approx(0.4, abs=3 * 0.1 * np.sqrt(1 - 0.9**2) / np.sqrt(4))


def test_without_a_change_nothing_is_larger_than_what_does_not_matter():
    """Of 50 series of 100 windows: the largest ratio of about 100 places stays below 4 + 0.3/0.1 deviations."""
    largest = []
    for seed in range(50):
        changes = Changes(Belief.independent([0.0], [0.02]), np.array([1.0]))
        belief = changes.start
        for each in seen(np.random.default_rng(seed).normal(0.0, 0.1, 100), 0.1):
            belief = fused(belief, each, changes.add(belief, each))
        largest.append(changes.likeliest(np.eye(1), np.array([0.05]))[1])
    assert max(largest) < 4.0


def test_windows_that_scatter_more_are_believed_less():
    """Values of twice the deviation that they claim: the mean of 4 χ², no value of which counts as more than 9."""
    changes, belief = Changes(Belief.independent([0.0], [0.01]), np.array([1.0])), Belief.independent([0.0], [0.01])
    for each in seen(np.random.default_rng(3).normal(0.0, 0.2, 2000), 0.1):
        scatter = changes.add(belief, each)
    expected = 4 * scipy.stats.chi2(3).cdf(9 / 4) + 9 * scipy.stats.chi2(1).sf(9 / 4)
    assert scatter == pytest.approx(expected, abs=0.25)
    assert Changes(belief, np.array([1.0])).likeliest(np.eye(1), np.zeros(1)) is None
