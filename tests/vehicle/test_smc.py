"""Sliding modes on the linear single track they are designed on."""

import numpy as np
import pytest

from clearance_mj.vehicle.controllers import Observation, Task
from clearance_mj.vehicle.controllers.smc import SlidingMode
from clearance_mj.vehicle.controllers.super_twisting import SuperTwisting
from clearance_mj.vehicle.manoeuvres import straight

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
        command = run.command(Observation(SPEED * k * task.period, *x[:4], SPEED))
        x = A @ x + B * command + push
        values.append(run.sliding)
        errors.append(x[0])
    return np.array(values), np.array(errors)


def test_reaches_the_boundary_layer_and_stays():
    """From 0.5 m off, with k₂ = 1 m/s² against a disturbance of less."""
    law = SlidingMode(look_ahead=3.0, convergence=3.0, reaching=4.0, switching=1.0, layer=0.2)
    values, errors = slide(law, disturbance=0.3)
    assert values[0] > law.layer
    reached = np.argmax(np.abs(values) < law.layer)
    assert 0 < reached < 100
    assert np.all(np.abs(values[reached:]) < law.layer)
    assert abs(errors[-1]) < 0.05


def test_error_decays_at_the_surface_rate():
    """On the surface e falls as exp(-λt): without disturbance, λ = 3 1/s over the second second, to 15 %."""
    values, errors = slide(SlidingMode(look_ahead=3.0, convergence=3.0, reaching=8.0, switching=1.0, layer=0.2))
    assert np.log(errors[100] / errors[200]) == pytest.approx(3.0, rel=0.15)
    assert abs(values[-1]) < 1e-3


def test_super_twisting_leaves_no_offset():
    """Its integral takes up a constant disturbance that leaves the boundary-layer law with an offset."""
    twisting, _ = slide(SuperTwisting(look_ahead=3.0, convergence=3.0, root=2.0, integral=1.0, layer=0.05), 0.3, 10.0)
    layer, _ = slide(SlidingMode(look_ahead=3.0, convergence=3.0), 0.3, 10.0)
    assert abs(layer[-1]) > 0.01
    assert abs(twisting[-1]) < 1e-3
