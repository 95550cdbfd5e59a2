"""Recursive estimation against closed forms: batch least squares, the Kalman filter, coverage on normal data."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from clearance_mj.core.errors import RecordError
from clearance_mj.estimate.beliefs import Belief, refine
from clearance_mj.estimate.parameter import Parameter


def regression(rows, data):
    """Residuals of a linear regression, for points (n_points, n)."""
    return lambda points: points @ rows.T - data


def problem(seed, n=3, m=200):
    rng = np.random.default_rng(seed)
    rows, prior = rng.standard_normal((m, n)), Belief.independent([1.0, -2.0, 0.5], [0.5, 1.0, 2.0])
    truth = prior.mean + prior.std * rng.standard_normal(n)
    return rows, prior, truth, rng


def test_window_by_window_is_the_batch():
    rows, prior, truth, rng = problem(0)
    data = rows @ truth + rng.standard_normal(200)
    belief = prior
    for part in np.split(np.arange(200), 10):
        belief = refine(belief, regression(rows[part], data[part])).belief
    precision = np.linalg.inv(prior.covariance) + rows.T @ rows  # Bayes' theorem on normal distributions
    mean = np.linalg.solve(precision, np.linalg.solve(prior.covariance, prior.mean) + rows.T @ data)
    assert belief.mean == pytest.approx(mean, rel=1e-9)
    assert belief.covariance == pytest.approx(np.linalg.inv(precision), rel=1e-8, abs=1e-12)


def test_states_follow_the_kalman_filter():
    rng = np.random.default_rng(1)
    A, C, Q, R = np.array([[1.0, 0.1], [-0.2, 0.95]]), np.array([[1.0, 0.0]]), np.diag([0.01, 0.04]), 0.25
    belief, mean, P = Belief.independent([0.0, 1.0], [1.0, 2.0]), np.array([0.0, 1.0]), np.diag([1.0, 4.0])
    for seen in rng.standard_normal(30):
        belief = refine(belief, lambda x, seen=seen: (x @ C.T - seen) / np.sqrt(R)).belief
        belief = belief.through(lambda x: x @ A.T).drifted(np.sqrt(np.diag(Q)))
        gain = P @ C.T / (C @ P @ C.T + R)  # Kalman, Journal of Basic Engineering 82, 1960
        mean, P = mean + (gain * (seen - C @ mean)).ravel(), P - gain @ C @ P
        mean, P = A @ mean, A @ P @ A.T + Q
        assert belief.mean == pytest.approx(mean, abs=1e-10)
        assert belief.covariance == pytest.approx(P, abs=1e-10)


def test_intervals_cover_and_innovations_are_chi_squared():
    inside, innovation = [], []
    for seed in range(400):
        rows, prior, truth, rng = problem(seed, m=40)
        refined = refine(prior, regression(rows, rows @ truth + rng.standard_normal(40)))
        inside.append(np.abs(refined.belief.mean - truth) < 1.96 * refined.belief.std)
        innovation.append(refined.innovation)
    assert 0.93 < np.mean(inside) < 0.97  # 1200 of 0.95: standard deviation 0.0063
    assert scipy.stats.kstest(innovation, scipy.stats.chi2(40).cdf).pvalue > 0.01


@pytest.mark.parametrize("block, low, high", [(None, 0.3, 0.75), (100, 0.88, 0.99)])
def test_residuals_that_hang_together_widen_the_intervals(block, low, high):
    inside = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        # AR(1) errors, variance 1, correlation 0.9 from one to the next: of 2000 only 105 count.
        errors = scipy.signal.lfilter([np.sqrt(1 - 0.81)], [1.0, -0.9], rng.standard_normal(2200))[200:]
        refined = refine(Belief.independent([0.0], [10.0]), lambda x, e=errors: x + e, block)
        inside.append(abs(refined.belief.mean[0]) < 1.96 * refined.belief.std[0])
    assert low < np.mean(inside) < high


def test_a_kinked_model_is_fitted():
    x = np.linspace(-1.0, 1.0, 400)

    def force(points):
        gap, stiffness = np.exp(points).T[:, :, None]
        return stiffness * (np.maximum(x - gap, 0) + np.minimum(x + gap, 0))

    truth = np.log([0.31, 50.0])
    for start in (np.log([0.15, 80.0]), np.log([0.6, 30.0])):
        refined = refine(Belief.independent(start, [1.0, 1.0]), lambda p: (force(p) - force(truth[None])) / 1e-4)
        assert refined.belief.mean == pytest.approx(truth, abs=1e-6)


def test_what_is_known_exactly_stays():
    refined = refine(Belief.independent([1.0, 2.0], [0.0, 1.0]), lambda x: x - [[5.0, 5.0]])
    assert refined.belief.mean == pytest.approx([1.0, 3.5])
    assert refined.belief.std == pytest.approx([0.0, np.sqrt(0.5)])


def test_beliefs_of_parameters_and_their_estimates():
    gap = Parameter("gap", "m", 2e-4, 1e-6, 1e-2, prior_std=0.5)
    bias = Parameter("bias", "m", 0.0, -1.0, 1.0, prior_std=0.1, transform="linear")
    belief = Belief.of([gap]).joined(Belief.of([bias]))
    estimates = belief.estimates([gap, bias])
    assert estimates.value == pytest.approx([2e-4, 0.0])
    assert estimates.varied_std == pytest.approx([0.5, 0.1])
    assert belief.part([1]).std == pytest.approx([0.1])


def test_what_cannot_be_believed_is_refused():
    with pytest.raises(RecordError, match=r"mean \(n,\)"):
        Belief(np.zeros(2), np.eye(3))
    with pytest.raises(RecordError, match="finite"):
        Belief.independent([0.0], [np.inf])
    with pytest.raises(RecordError, match="not finite"):
        refine(Belief.independent([0.0], [1.0]), lambda x: x * np.nan)
    with pytest.raises(RecordError, match="at least two"):
        refine(Belief.independent([0.0], [1.0]), lambda x: x + np.zeros(4), block=3)
