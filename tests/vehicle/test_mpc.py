"""The quadratic program against methods that share nothing with OSQP."""

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

from clearance_mj.vehicle.controllers import DesignModel, Observation, Task
from clearance_mj.vehicle.controllers.mpc import N_STATES, ModelPredictive, program
from clearance_mj.vehicle.manoeuvres import clothoid_arc, straight
from clearance_mj.vehicle.nominal import Servo

from .test_controller import MODEL, SPEED, VEHICLE

LAW = ModelPredictive(horizon=20)
SEEN = Observation(40.0, 0.4, 0.03, -0.2, 0.1, SPEED)


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
    Ac, Bc, Ec = MODEL.continuous
    turn = np.append(0.0, np.linalg.solve(np.column_stack((Ac[:, 1:], Bc)), -Ec)) * curvature[-1]
    x0 = np.array([seen.e_y, seen.e_psi, seen.lateral_speed, seen.yaw_rate, 0, 0, 0])

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
    path = clothoid_arc()
    task = Task(VEHICLE, path, SPEED, largest_rate=rate, largest_angle=10.0)
    curvature = task.curvature(SEEN, np.arange(LAW.horizon + 1) * task.period)
    command = LAW.start(task).command(SEEN)
    expected = dense(LAW, SEEN, curvature, task)
    assert command == pytest.approx(expected, abs=2e-5)
    assert (abs(expected) == pytest.approx(rate * task.period)) == (rate == 0.2)


def test_without_limits_it_is_the_linear_quadratic_regulator():
    """On a straight the terminal cost makes any horizon infinite: Δu = -K x (discrete-time Riccati equation)."""
    A, B, _, _, _, V = regulator(LAW)
    K = B @ V @ A / (LAW.effort + B @ V @ B)
    seen = Observation(10.0, 0.05, -0.003, 0.02, 0.01, SPEED)
    expected = -K @ np.array([*seen[1:5], 0, 0, 0])
    run = LAW.start(Task(VEHICLE, straight(200.0), SPEED, largest_rate=10.0))
    assert run.command(seen) == pytest.approx(expected, abs=1e-6)


def test_size_and_pattern_of_the_program():
    """20 periods: 21 states and 20 inputs; model, commands and their changes as rows; one pattern for all speeds."""
    size = 21 * N_STATES + 20
    assert [m.shape for m in program(LAW, MODEL)[:2]] == [(size, size), (size + 20, size)]
    at = [program(LAW, DesignModel(VEHICLE, Servo(), speed, 0.01)) for speed in (10.0, 40.0)]
    for name in ("P", "A"):
        one, other = (getattr(p, name) for p in at)
        np.testing.assert_array_equal(one.indices, other.indices)
        np.testing.assert_array_equal(one.indptr, other.indptr)
        assert not np.allclose(one.data, other.data)


def test_linearised_anew_when_the_speed_changes():
    """After a change of speed the commands are those of a program made at that speed."""
    slow = SEEN._replace(speed=20.0)
    changed = LAW.start(Task(VEHICLE, straight(300.0), SPEED))
    made = LAW.start(Task(VEHICLE, straight(300.0), 20.0))
    assert changed.command(slow) == pytest.approx(made.command(slow), abs=1e-6)
