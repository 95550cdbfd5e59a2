"""The quadratic program against methods that share nothing with OSQP."""

import numpy as np
import osqp
import pytest
import scipy.linalg
import scipy.optimize

from clearance_mj.vehicle.controllers import Observation, Task
from clearance_mj.vehicle.controllers.mpc import LimitedPlan, ModelPredictive, Weights, program
from clearance_mj.vehicle.manoeuvres import clothoid_arc, straight

from .test_controller import LINEAR, MODEL, SPEED, solved

LAW = ModelPredictive(horizon=20)
WEIGHTS = Weights(LAW.course, LAW.yaw, LAW.effort)
PATH = straight(100.0)
SEEN = Observation(40.0, 0.4, 0.03, -0.2, 0.1, SPEED)


def steady_turn(curvature):
    """State, with the command, that holds a curvature: of the equations of motion."""
    A, B, E = MODEL.continuous
    return np.append(0.0, np.linalg.solve(np.column_stack((A[:, 1:], B)), -E)) * curvature


def regulator(law):
    """Model with the command as a state, outputs, their weights, and the cost without limits (Riccati equation)."""
    A6, B6, E6 = MODEL.discrete
    A = np.block([[A6, B6[:, None]], [np.zeros((1, 6)), np.eye(1)]])
    B, E = np.append(B6, 1.0), np.append(E6, 0.0)
    C = np.array([[1, 0, 0, 0, 0, 0, 0], [0, SPEED, 1, 0, 0, 0, 0], [0, 0, 0, 1, 0, 0, 0.0]])
    W = np.diag((1.0, law.course, law.yaw))
    return A, B, E, C, W, scipy.linalg.solve_discrete_are(A, B[:, None], C.T @ W @ C, np.array([[law.effort]]))


def dense(law, seen, curvature, task):
    """First command by condensing the states out of the program and a bounded active-set-free dense solver (SLSQP).

    The model, the cost and the terminal cost (SciPy's Riccati equation) are written anew here.
    """
    A, B, E, C, W, V = regulator(law)
    turn, x0 = steady_turn(curvature[-1]), np.array([seen.e_y, seen.e_psi, seen.lateral_speed, seen.yaw_rate, 0, 0, 0])

    def total(changes):
        x, J = x0, 0.0
        for k, change in enumerate(changes):
            y = C @ x - np.array([0, 0, SPEED * curvature[k]])
            J += y @ W @ y + law.effort * change**2
            x = A @ x + B * change + E * curvature[k]
        return J + (x - turn) @ V @ (x - turn)

    step = task.largest_rate * task.period
    sums = {"type": "ineq", "fun": lambda z: task.largest_angle - np.abs(np.cumsum(z)).max()}
    limits = {"constraints": [sums] if task.largest_angle < step * law.horizon else []}
    limits["bounds"] = [(-step, step)] * law.horizon
    options = {"maxiter": 1000, "ftol": 1e-14}
    return scipy.optimize.minimize(total, np.zeros(law.horizon), method="SLSQP", **limits, options=options).x[0]


@pytest.mark.parametrize("rate", [10.0, 0.2], ids=["free", "rate-limited"])
def test_first_command_is_that_of_a_dense_solver(rate):
    task = Task(LINEAR, clothoid_arc(), SPEED, largest_rate=rate, largest_angle=10.0)
    curvature = task.curvature(SEEN, np.arange(LAW.horizon + 1) * task.period)
    command, expected = LAW.start(task).command(SEEN), dense(LAW, SEEN, curvature, task)
    assert command == pytest.approx(expected, abs=2e-5)
    assert (abs(expected) == pytest.approx(rate * task.period)) == (rate == 0.2)


def test_without_limits_it_is_the_linear_quadratic_regulator():
    """On a straight the terminal cost makes any horizon infinite: Δu = -K x (discrete-time Riccati equation)."""
    A, B, _, _, _, V = regulator(LAW)
    K = B @ V @ A / (LAW.effort + B @ V @ B)
    seen = Observation(10.0, 0.05, -0.003, 0.02, 0.01, SPEED)
    expected = -K @ np.array([*seen[1:5], 0, 0, 0])
    run = LAW.start(Task(LINEAR, straight(200.0), SPEED, largest_rate=10.0))
    assert run.command(seen) == pytest.approx(expected, abs=1e-6)


@pytest.fixture
def solved_by_osqp(monkeypatch):
    """How often OSQP has solved a program."""
    calls, solve = [], osqp.OSQP.solve
    monkeypatch.setattr(osqp.OSQP, "solve", lambda self, **options: calls.append(1) or solve(self, **options))
    return calls


@pytest.mark.parametrize(("rate", "angle", "calls"), [(10.0, 10.0, 0), (0.2, 10.0, 1), (10.0, 0.01, 1)])
def test_osqp_is_called_where_a_limit_is_active(solved_by_osqp, rate, angle, calls):
    LAW.start(Task(LINEAR, clothoid_arc(), SPEED, largest_rate=rate, largest_angle=angle)).command(SEEN)
    assert len(solved_by_osqp) == calls


def test_solution_without_limits_is_that_of_osqp(solved_by_osqp):
    """The same program through the solver, with a rate limit that is just met."""
    quadratic, rng = program(MODEL, WEIGHTS, 20), np.random.default_rng(0)
    for _ in range(10):
        free = quadratic.free(rng.normal(scale=0.1, size=6), 0.02, rng.normal(scale=0.005, size=21))
        rate = np.abs(free).max() / 0.01
        limits = ({"largest_angle": 10.0, "largest_rate": factor * rate} for factor in (1.0001, 0.9999))
        wide, narrow = (LimitedPlan(Task(LINEAR, PATH, SPEED, **each), quadratic.hessian) for each in limits)
        assert wide.best(free, 0.02) is free
        np.testing.assert_allclose(narrow.best(free, 0.02), free, atol=1e-5 + 1e-3 * np.abs(free).max())
    assert len(solved_by_osqp) == 10


def test_plan_with_limits_is_that_of_a_dense_solver():
    """Every change of a plan that meets both limits; the cost from H and the plan without limits, by SLSQP."""
    quadratic, largest, step = program(MODEL, WEIGHTS, 20), 0.02, 0.002
    free = quadratic.free(np.array([*SEEN[1:5], 0, 0]), 0.0, np.zeros(21))
    task = Task(LINEAR, PATH, SPEED, largest_angle=largest, largest_rate=step / 0.01)
    plan = LimitedPlan(task, quadratic.hessian).best(free, 0.0)
    scale = np.linalg.norm(quadratic.hessian, 2)
    expected = scipy.optimize.minimize(
        lambda z: (z - free) @ quadratic.hessian @ (z - free) / scale, np.zeros(20), method="SLSQP",
        jac=lambda z: 2 * quadratic.hessian @ (z - free) / scale, options={"maxiter": 1000, "ftol": 1e-16},
        bounds=[(-step, step)] * 20, constraints=scipy.optimize.LinearConstraint(np.tri(20), -largest, largest),
    ).x  # fmt: skip
    np.testing.assert_allclose(plan, expected, atol=2e-5)
    assert np.abs(plan.cumsum()).max() == pytest.approx(largest, abs=1e-5)


def test_constant_lost_motion_is_another_zero_of_the_servo():
    """d in all periods is the same as servo and command that stand d ahead, without."""
    quadratic, x, d = program(MODEL, WEIGHTS, 20), np.array([0.1, 0.02, -0.3, 0.1, 0.01, 0.05]), 0.004
    shifted = quadratic.free(x + d * np.eye(6)[4], 0.02 + d, np.full(21, 0.003))
    with_lost = quadratic.free(x, 0.02, np.full(21, 0.003)) + quadratic.lost @ np.full(20, d)
    np.testing.assert_allclose(with_lost, shifted, atol=1e-10)


def test_lost_motion_that_changes():
    """The plan's cost, written anew with the single track integrated in time, is least at the plan that is found."""
    A, B, _, C, W, V = regulator(LAW)
    D = np.append(solved([0, 0, 0, 0, 1.0, 0], 1.0, 0.0, 0.01)[:4], np.zeros(3))  # servo and command stand still
    lost = np.where(np.arange(20) < 7, -0.004, 0.004)

    def total(changes):
        x, J = np.zeros(7), 0.0
        for change, d in zip(changes, lost):
            J += (C @ x) @ W @ (C @ x) + LAW.effort * change**2
            x = A @ x + B * change + D * d
        x[[4, 6]] += lost[-1]
        return J + x @ V @ x

    quadratic = program(MODEL, WEIGHTS, 20)
    plan, rng = quadratic.lost @ lost, np.random.default_rng(0)
    for _ in range(20):
        other = rng.normal(scale=1e-3, size=20)
        # Of a square: J(z* + w) - J(z*) = wᵀ H w.
        assert total(plan + other) - total(plan) == pytest.approx(other @ quadratic.hessian @ other, rel=1e-6)


def test_linearised_anew_when_the_speed_changes():
    """After a change of speed the commands are those of a program made at that speed."""
    runs = (LAW.start(Task(LINEAR, straight(300.0), speed)) for speed in (SPEED, 20.0))
    changed, made = (run.command(SEEN._replace(speed=20.0)) for run in runs)
    assert changed == pytest.approx(made, abs=1e-6)
