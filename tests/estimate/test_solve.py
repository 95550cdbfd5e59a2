"""The solver against closed forms and classical problems: linear, bounded, banana-shaped, robust, with priors."""

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError, RigError
from clearance_mj.estimate import (
    GroupedHuber,
    LinearisedResiduals,
    Parameter,
    Problem,
    SoftL1,
    StoppingCriteria,
    UnknownScale,
    log_evidence,
    one_by_one,
    rival_weights,
    solve,
)  # fmt: skip

EXACT = StoppingCriteria(steps=200, decrease=1e-14, move=1e-12)


def free(name, start=0.0, low=-np.inf, high=np.inf, prior_std=np.inf):
    return Parameter(name, "1", start, low, high, prior_std, "linear")


def line(n=50, seed=0, m=2):
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((n, m))
    return rows, rows @ np.arange(1.0, m + 1) + rng.standard_normal(n)


@pytest.mark.parametrize("lanes", [True, False])
def test_linear_regression_with_a_prior_is_solved_in_one_step(lanes):
    rows, data = line()
    parameters = [free("a", 0.5, prior_std=0.1), free("b")]
    problem = Problem(parameters, lambda x: x @ rows.T - data, lanes=lanes)
    solution = solve(problem, stop=EXACT)
    precision = rows.T @ rows + np.diag([100.0, 0.0])
    expected = np.linalg.solve(precision, rows.T @ data + [50.0, 0.0])
    assert solution.values == pytest.approx(expected, rel=1e-9)
    assert solution.estimates(solution.covariance).covariance == pytest.approx(np.linalg.inv(precision), rel=1e-6)
    left = rows @ expected - data
    assert solution.cost == pytest.approx(left @ left + ((expected[0] - 0.5) / 0.1) ** 2)


@pytest.mark.parametrize("lanes", [True, False])
@pytest.mark.parametrize("high", [np.inf, 0.5])
def test_rosenbrock(lanes, high):
    """Minimum (1, 1); with x <= 1/2 at (1/2, 1/4), where (1 - x)² is 1/4."""
    problem = Problem(
        [free("x", -1.2, high=high), free("y", 1.0)],
        lambda p: np.stack((1 - p[:, 0], 10 * (p[:, 1] - p[:, 0] ** 2)), axis=1),
        step=1e-6, central=True, lanes=lanes,
    )  # fmt: skip
    solution = solve(problem, stop=EXACT)
    assert solution.values == pytest.approx([min(high, 1.0), min(high, 1.0) ** 2], abs=1e-7)
    assert solution.at_bound.tolist() == [high < 1, False]


def test_soft_l1_is_that_of_scipy():
    scipy_optimize = pytest.importorskip("scipy.optimize")
    rows, data = line()
    data[::7] += 30.0
    expected = scipy_optimize.least_squares(
        lambda x: rows @ x - data, np.zeros(2), loss="soft_l1", f_scale=0.5, xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    solution = solve(Problem([free("a"), free("b")], lambda x: x @ rows.T - data, loss=SoftL1(0.5)), stop=EXACT)
    assert solution.values == pytest.approx(expected.x, rel=1e-6)
    assert solution.cost == pytest.approx(2 * expected.cost, rel=1e-10)
    assert solution.rows.T @ solution.rows == pytest.approx(expected.jac.T @ expected.jac, rel=1e-4)


def test_grouped_huber_of_complex_residuals_is_a_weighted_mean():
    """One mean of complex pairs; of the outlying pair the distance counts, not its square."""
    data = np.array([1.0 + 1j, 1.2 + 1j, 0.9 + 1.1j, 1.0 + 0.9j, 9.0 + 1j, 9.0 + 1j])
    loss = GroupedHuber(np.full(3, 1.0))
    solution = solve(Problem([free("m")], lambda x: x + 1j - data, loss=loss), stop=EXACT)
    size = np.linalg.norm((solution.values[0] + 1j - data).reshape(3, 2), axis=1)
    weight = np.repeat(np.minimum(1 / size, 1), 2)
    assert solution.values[0] == pytest.approx(np.sum(weight * data.real) / weight.sum(), rel=1e-6)
    assert solution.cost == pytest.approx(np.sum(size[:2] ** 2) + 2 * size[2] - 1)


def test_errors_of_unknown_size_with_equal_neighbours():
    """Each error five times: five residuals count as one, and the size of the errors is found."""
    rng = np.random.default_rng(3)
    rows = rng.standard_normal((400, 1)).repeat(5, axis=0)
    data = rows[:, 0] + 1e-2 * rng.standard_normal(400).repeat(5)
    loss = UnknownScale(np.arange(0, 2000, 5))
    solution = solve(Problem([free("a", 0.8, prior_std=1.0)], lambda x: (x @ rows.T - data) / 3e-2, loss=loss))
    assert solution.loss.correlated == pytest.approx(5, rel=0.2)
    std = float(solution.covariance[0, 0] ** 0.5)
    assert std == pytest.approx(1e-2 / np.sqrt(400), rel=0.25)  # soft L1 of normal errors is a little less efficient
    assert abs(solution.values[0] - 1) < 4 * std


def test_points_without_a_model_are_avoided():
    """√(x - 1) has its minimum of (√(x - 1) - 0.1)² at 1.01, next to where there is none."""

    def residual(x):
        if x[0] < 1:
            raise RigError("impossible")
        return np.sqrt(x - 1) - 0.1

    problem = Problem([free("x", 3.0)], one_by_one(residual), lanes=False, central=True, invalid=RigError)
    assert solve(problem, stop=EXACT).values == pytest.approx([1.01], abs=1e-7)
    with pytest.raises(RecordError, match="no model where the search for x begins"):
        solve(problem, [np.array([-3.0])])


def test_starts_are_compared_and_the_best_searched_from():
    """(x² - 1)² + 0.1 (x - 1)² has its least minimum at 1 and another one at about -1."""
    problem = Problem([free("x")], lambda x: np.hstack((x**2 - 1, np.sqrt(0.1) * (x - 1))))
    starts = [[-1.3], [0.4], [-0.9]]
    assert solve(problem, starts, n_best=1).values[0] < 0  # begins where the cost is least
    solution = solve(problem, starts, n_best=3)
    assert solution.values == pytest.approx([1.0], abs=1e-3)
    assert [s.values[0] < 0 for s in solution.others] == [True, True]


def test_logarithms_and_names():
    k = Parameter("k", "N/m", 100.0, 1.0, 1e4)
    problem = Problem([k, free("x", 2.0, prior_std=0.5)], lambda v: v)
    assert problem.at({"k": 200.0}) == pytest.approx([np.log(2), 0.0])
    assert problem.at([1e9, 3.0]) == pytest.approx([np.log(100), 2.0])
    assert problem.values(problem.at([7.0, 3.0])) == pytest.approx([7.0, 3.0])


def test_own_derivatives():
    rows, data = line()
    problem = Problem(
        [free("a"), free("b")],
        lambda x: x @ rows.T - data,
        linearise=lambda at: LinearisedResiduals(rows @ at - data, rows),
    )
    assert solve(problem, stop=EXACT).values == pytest.approx(np.linalg.lstsq(rows, data, rcond=None)[0], rel=1e-9)


def test_a_direction_without_information_stays_where_it_begins():
    problem = Problem([free("a", 1.0), free("b", 3.0)], lambda x: x.sum(axis=1, keepdims=True) - 10)
    assert solve(problem, stop=EXACT).values == pytest.approx([4.0, 6.0], rel=1e-6)


def test_evidence_of_a_linear_model_is_exact():
    """Two models of one normal observation y of variance 1: y = 0, and y = x with x of variance 9."""
    y = 2.0
    with_x = solve(Problem([free("x", prior_std=3.0)], lambda x: x - y), stop=EXACT)
    at, information = with_x.at, with_x.information
    evidence = [log_evidence(y**2, np.zeros(0), np.zeros((0, 0))),
                log_evidence(with_x.cost - float(at @ at), at, information)]  # fmt: skip
    exact = np.array([np.exp(-(y**2) / 2), np.exp(-(y**2) / 20) / np.sqrt(10)])
    assert rival_weights(evidence) == pytest.approx(exact / exact.sum(), rel=1e-6)
