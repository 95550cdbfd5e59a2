"""Estimates of parameters against closed forms of the normal and lognormal distributions."""

import numpy as np
import pytest

from clearance_mj.estimate.estimates import Estimates, principal_deviations, unidentified_combinations
from clearance_mj.estimate.parameter import Parameter

K = Parameter("k", "N/m", 100.0, 1.0, 1e4)
X = Parameter("x", "m", 0.5, 0.0, 1.0, prior_std=0.1, transform="linear")
COVARIANCE = np.array([[0.04, 0.003], [0.003, 0.0009]])


def test_deviations_and_intervals_by_transform():
    estimates = Estimates.of((K, X), [200.0, 0.4], COVARIANCE)
    assert estimates.std == pytest.approx([200 * 0.2, 0.03])  # to first order
    assert estimates.correlation[0, 1] == pytest.approx(0.5)
    low, high = estimates.interval(0.95)
    assert low == pytest.approx([200 * np.exp(-1.959964 * 0.2), 0.4 - 1.959964 * 0.03], rel=1e-6)
    assert high == pytest.approx([200 * np.exp(1.959964 * 0.2), 0.4 + 1.959964 * 0.03], rel=1e-6)


def test_draws_have_the_covariance_and_stay_within_the_bounds():
    drawn = Estimates.of((K, X), [200.0, 0.4], COVARIANCE).draw(20000, seed=1)
    varied = np.column_stack((np.log(drawn[:, 0]), drawn[:, 1]))
    np.testing.assert_allclose(np.cov(varied.T), COVARIANCE, rtol=0.05)
    narrow = Estimates.of((K, X), [200.0, 0.99], 100 * COVARIANCE).draw(200)
    assert narrow[:, 0].min() == pytest.approx(1.0) and narrow[:, 0].max() == pytest.approx(1e4)
    assert narrow[:, 1].min() > 0 and narrow[:, 1].max() == 1.0


@pytest.mark.parametrize(("std", "identifiable"), [((0.1, 0.04), (True, True)), ((2.0, 0.06), (False, False)),
                                                   ((0.0, np.inf), (False, False))])  # fmt: skip
def test_identifiable_is_what_the_data_halve(std, identifiable):
    """Known before: ln k uniform over ln 1e4, a standard deviation of 9.21/√12 = 2.66; x by its prior, 0.1."""
    estimates = Estimates((K, X), np.array([200.0, 0.4]), np.array(std), np.eye(2))
    assert estimates.identifiable.tolist() == list(identifiable)
    assert np.isinf(estimates.std).tolist() == [s in (0.0, np.inf) for s in std]


def test_rows_and_back():
    prior = Parameter("c", "N s/m", 3.0, 0.1, 50.0, prior_std=0.5)
    estimates = Estimates.of((prior, X), [4.0, 0.4], COVARIANCE)
    again = Estimates.from_rows(estimates.rows())
    assert again.rows() == estimates.rows()
    np.testing.assert_array_equal(again.draw(3), estimates.draw(3))


def test_a_product_that_the_data_do_not_identify():
    """Residuals see ln a - ln b only: its deviation is 1/(10 √2); of ln a + ln b nothing is known."""
    direction, std = principal_deviations(np.array([[10.0, -10.0], [0.0, 0.0]]))
    assert std[0] == pytest.approx(1 / (10 * np.sqrt(2)))
    (open_,) = unidentified_combinations(("a", "b"), direction, std)
    assert open_.exponent == pytest.approx({"a": 0.5**0.5, "b": 0.5**0.5})


def test_wider_data_never_tell_less_than_the_prior():
    """Data of standard deviation 0.1 beside a prior of 0.1: C = 0.005; data twice as wide: 1/(100 + 25) = 0.008."""
    wider = Estimates.of((X,), [0.4], np.array([[0.005]])).widened(2.0)
    assert wider.covariance[0, 0] == pytest.approx(0.008)
    assert Estimates.of((X,), [0.4], np.array([[0.005]])).widened(1e6).posterior_over_prior == pytest.approx(1.0)
    assert Estimates.of((K,), [200.0], np.array([[0.04]])).widened(3.0).covariance[0, 0] == pytest.approx(0.36)


def test_beside_priors():
    """K has no prior: uniform over ln 1e4, 2.66; its 95 % interval is 200 exp(±1.96 · 0.2)."""
    k, x = Estimates.of((K, X), [200.0, 0.4], COVARIANCE).beside_priors()
    assert k["posterior_over_prior"] == pytest.approx(0.2 / (np.log(1e4) / np.sqrt(12)))
    assert (k["low"], k["high"]) == pytest.approx((200 * np.exp(-0.391993), 200 * np.exp(0.391993)), rel=1e-5)
    assert (x["before"], x["prior_std"], x["posterior_std"], x["posterior_over_prior"]) == pytest.approx(
        (0.5, 0.1, 0.03, 0.3)
    )
    assert Estimates.of((X,), [0.4], np.array([[0.0095]])).only_prior == ("x",)
