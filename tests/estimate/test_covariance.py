"""Covariances of correlated residuals against closed forms: means of blocks, and autoregressive errors."""

import numpy as np
import pytest
import scipy.signal

from clearance_mj.estimate import coloured, correlated_observations, correlation_time, jackknife, sandwich

BLOCKS, EACH = 40, 5


def mean_of_blocks(seed=0):
    """Residuals of a mean, equal within each block, with their blocks."""
    errors = np.random.default_rng(seed).standard_normal(BLOCKS).repeat(EACH)
    return np.ones((errors.size, 1)), errors - errors.mean(), np.repeat(np.arange(BLOCKS), EACH)


def test_of_a_mean_both_are_the_variance_of_the_blocks():
    rows, left, block = mean_of_blocks()
    expected = np.var(left[::EACH], ddof=1) / BLOCKS
    assert sandwich(rows, left, block)[0, 0] == pytest.approx(expected)
    assert jackknife(rows, rows * left[:, None], block, np.zeros((1, 1)))[0, 0] == pytest.approx(expected)


def test_what_nothing_depends_on_is_infinite():
    rows, left, block = mean_of_blocks()
    wide = np.hstack((rows, 0 * rows))
    assert np.isinf(np.diag(sandwich(wide, left, block))).tolist() == [False, True]
    assert np.isinf(jackknife(rows, rows, np.zeros(len(rows)), np.zeros((1, 1)))).all()


def test_a_prior_counts_as_an_observation():
    """Without data the covariance is that of the prior."""
    rows, _, block = mean_of_blocks()
    assert jackknife(0 * rows, 0 * rows, block, np.eye(1))[0, 0] == pytest.approx(1.0)


def test_autoregressive_errors():
    """AR(1) of 0.9: (1 + 0.9)/(1 - 0.9) = 19 samples count as one."""
    rng = np.random.default_rng(0)
    errors = scipy.signal.lfilter([np.sqrt(1 - 0.81)], [1.0, -0.9], rng.standard_normal(200_000))
    assert correlation_time(errors) == pytest.approx(19, rel=0.15)
    rows = np.ones((errors.size, 1))
    assert coloured(rows, errors)[0, 0] == pytest.approx(19 / errors.size, rel=0.15)
    scores = np.add.reduceat(errors[:, None], np.arange(0, errors.size, 500), axis=0)
    assert correlated_observations(scores, rows.T @ rows) == pytest.approx(19, rel=0.2)
    assert correlated_observations(scores, rows.T @ rows, least=1e9) == 1.0
    assert correlation_time(np.zeros(10)) == 1.0
