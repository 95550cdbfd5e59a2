"""Sliding modes on the linear single track they are designed on."""

import numpy as np
import pytest
import scipy.integrate

from clearance_mj.vehicle.controllers import Observation, Task
from clearance_mj.vehicle.controllers.smc import SlidingMode
from clearance_mj.vehicle.controllers.super_twisting import SuperTwisting
from clearance_mj.vehicle.manoeuvres import straight
from clearance_mj.vehicle.path import lane_changes
from clearance_mj.vehicle.plant import MultiBody
from clearance_mj.vehicle.run import follow_path, nominal_task
from clearance_mj.vehicle.steering import Steering

from .test_controller import LINEAR, MODEL, SPEED


def slide(controller, disturbance=0.0, seconds=3.0, error=0.5):
    """Drive the linear model from a lateral error with an unknown acceleration (m/s²): histories of s and e_y."""
    task = Task(LINEAR, straight(300.0), SPEED)
    run = controller.start(task)
    A, B, _ = MODEL.discrete
    push = np.zeros(6)
    push[2] = disturbance * task.period
    x, values, errors = np.array([error, 0, 0, 0, 0, 0.0]), [], []
    for k in range(round(seconds / task.period)):
        x = A @ x + B * run.command(Observation(SPEED * k * task.period, *x[:4], SPEED)) + push
        values.append(run.sliding)
        errors.append(x[0])
    return np.array(values), np.array(errors)


def test_reaches_the_boundary_layer_and_stays():
    """From 0.5 m off, with k₂ = 1 m/s² against a disturbance of less."""
    law = SlidingMode(look_ahead=3.0, convergence=3.0, reaching=4.0, switching=1.0, layer=0.2)
    values, errors = slide(law, disturbance=0.3)
    assert values[0] > law.layer
    reached = np.argmax(np.abs(values) < law.layer)
    assert 0 < reached < 100 and np.all(np.abs(values[reached:]) < law.layer) and abs(errors[-1]) < 0.05


@pytest.mark.parametrize("disturbance", [0.0, 0.8, -0.8])
def test_time_to_the_layer_on_a_double_integrator(disturbance):
    """x'' = u + D with u = -λ x' - k₁ s - k₂ sat(s/Φ) reaches |s| = Φ at ln((k₁ s₀ + k₂ - D)/(k₁ Φ + k₂ - D))/k₁."""
    law = SlidingMode(look_ahead=3.0, convergence=2.0, reaching=1.5, switching=1.0, layer=0.05)
    run = law.start(Task(LINEAR, straight(300.0), SPEED))

    def sliding(state):
        return state[1] + law.convergence * state[0]

    def rates(_, state):
        return [state[1], -law.convergence * state[1] - run.reaching(sliding(state)) + disturbance]

    def reached(_, state):
        return sliding(state) - law.layer

    reached.terminal = True
    solution = scipy.integrate.solve_ivp(rates, (0, 5), [0.5, 0.2], events=reached, rtol=1e-10, atol=1e-12)
    gain = law.switching - disturbance
    expected = np.log((law.reaching * 1.2 + gain) / (law.reaching * law.layer + gain)) / law.reaching
    assert solution.t[-1] == pytest.approx(expected, rel=1e-6)


def test_depth_is_that_in_layers():
    run = SlidingMode(layer=0.2).start(Task(LINEAR, straight(300.0), SPEED))
    run.command(Observation(10.0, 0.3, 0.01, 0.1, 0.0, SPEED))
    assert run.depth == pytest.approx(abs(run.sliding) / 0.2) and run.depth > 1


def test_tight_turns_do_not_saturate_the_loop():
    """An ISO 3888-2-like path, 40 km/h: the wheels would turn at 0.86 rad/s, the servo has 0.4; nothing is noisy.

    Without averaging of the path SMC is 0.98 m off.
    """
    task = nominal_task(lane_changes("tight", [(0.0, 19.0, 3.3), (25.0, 43.5, 0.0)], -30.0, 80.0), 40 / 3.6)
    assert task.path.needed_acceleration(task.speed) > 6.5
    law = SlidingMode(look_ahead=1.852, convergence=4.272, reaching=2.322, switching=1.407, layer=0.573)
    assert follow_path(MultiBody(), Steering(), law, task).metrics()["peak_e_y"] < 0.08


def test_error_decays_at_the_surface_rate():
    """On the surface e falls as exp(-λt): without disturbance, λ = 3 1/s over the second second, to 15 %."""
    values, errors = slide(SlidingMode(look_ahead=3.0, convergence=3.0, reaching=8.0, switching=1.0, layer=0.2))
    assert np.log(errors[100] / errors[200]) == pytest.approx(3.0, rel=0.15) and abs(values[-1]) < 1e-3


def test_super_twisting_leaves_no_offset():
    """Its integral takes up a constant disturbance that leaves the boundary-layer law with an offset."""
    twisting, _ = slide(SuperTwisting(look_ahead=3.0, convergence=3.0, root=2.0, integral=1.0, layer=0.05), 0.3, 10.0)
    layer, _ = slide(SlidingMode(look_ahead=3.0, convergence=3.0), 0.3, 10.0)
    assert abs(layer[-1]) > 0.01 and abs(twisting[-1]) < 1e-3
