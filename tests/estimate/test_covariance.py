"""Covariances of correlated residuals against closed forms: means of blocks, and autoregressive errors."""

import numpy as np
import pytest
import scipy.signal

from clearance_mj.estimate import (
    Parameter,
    Problem,
    SoftL1,
    coloured,
    correlated_observations,
    correlation_time,
    jackknife,
    sandwich,
    solve,
)
from clearance_mj.estimate.covariance import student_widening

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


def test_few_blocks_widen_as_students_table_says():
    """Student's 97.5 % quantiles: 12.706 of one degree of freedom, 3.182 of three, 1.960 of a normal variable."""
    assert [1.95996 * student_widening(n) for n in (2, 4, 10**7)] == pytest.approx([12.706, 3.182, 1.960], rel=1e-3)


def test_what_nothing_depends_on_is_infinite():
    rows, left, block = mean_of_blocks()
    wide = np.hstack((rows, 0 * rows))
    assert np.isinf(np.diag(sandwich(wide, left, block))).tolist() == [False, True]
    assert np.isinf(jackknife(rows, rows, np.zeros(len(rows)), np.zeros((1, 1)))).all()


def test_what_was_known_before_counts():
    """A parameter that no residual sees keeps its prior, here 1/2; without one residual the other is fitted."""
    rows, left = np.array([[1.0, 0.0], [1.0, 0.0]]), np.array([0.1, -0.1])
    covariance = jackknife(rows, rows * left[:, None], np.array([0, 1]), np.diag([0.0, 4.0]))
    assert covariance == pytest.approx(np.diag([0.01, 0.25]))


def test_robust_fits_with_errors_that_blocks_share():
    """Scatter of 250 fits of a line whose residuals have half of their variance in common within a block."""
    rng = np.random.default_rng(1)
    block = np.repeat(np.arange(40), 25)
    design = np.stack((np.ones(1000), np.repeat(rng.uniform(-1, 1, 40), 25)), axis=1)
    parameters = [Parameter(name, "1", 0.0, -np.inf, np.inf, transform="linear") for name in ("a", "b")]
    values, robust, independent = [], [], []
    for _ in range(250):
        noise = 0.5 * (rng.standard_normal(40)[block] + rng.standard_normal(1000))
        fit = solve(Problem(parameters, lambda x, e=noise: x @ design.T - e, loss=SoftL1()))
        values.append(fit.values)
        robust.append(jackknife(fit.rows, fit.scores, block, fit.prior))
        independent.append(fit.covariance * fit.cost / 998)
    scatter = np.diag(np.cov(np.transpose(values)))
    # σ of a variance out of 250 fits: 9 %; the jackknife is on the safe side by some per cent.
    np.testing.assert_allclose(np.diag(np.mean(robust, axis=0)) / scatter, 1.08, atol=0.2)
    assert np.all(np.diag(np.mean(independent, axis=0)) < scatter / 5)


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
