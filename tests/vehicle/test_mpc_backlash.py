"""MPC with the clearance as a mode: MPC without a gap, the least of all plans' costs with one."""

import dataclasses
import itertools

import numpy as np
import pytest

from clearance_mj.core.errors import ManoeuvreError
from clearance_mj.vehicle.controllers import Observation, Task
from clearance_mj.vehicle.controllers.mpc import ModelPredictive
from clearance_mj.vehicle.controllers.mpc_backlash import Backlash, BacklashPredictive, lost_motion, modes
from clearance_mj.vehicle.experiment import GAP, Case, get_controller
from clearance_mj.vehicle.lost_motion import LostMotion, lost_motion_step
from clearance_mj.vehicle.manoeuvres import clothoid_arc, straight

from .test_controller import SPEED, VEHICLE, solved
from .test_mpc import regulator, steady_turn

PATH = clothoid_arc()
LAW = BacklashPredictive(half_gap=GAP, friction=30.0)


@pytest.mark.parametrize("limits", [{}, {"largest_angle": 0.01, "largest_rate": 0.1}])
def test_without_a_gap_it_is_mpc(limits):
    task, rng = Task(VEHICLE, PATH, SPEED, **limits), np.random.default_rng(0)
    runs = [law.start(task) for law in (ModelPredictive(), BacklashPredictive())]
    for k in range(100):
        seen = Observation(0.3 * k, *rng.normal(scale=(0.1, 0.01, 0.05, 0.02)), SPEED)
        assert runs[0].command(seen) == runs[1].command(seen)


def test_modes_are_all_with_at_most_one_crossing():
    """From the next period on; the lost motion of the present one is known."""
    crossings = {tuple(row[1:]) for row in modes(7)}
    expected = {one for one in itertools.product((-1.0, 1.0), repeat=6) if np.count_nonzero(np.diff(one)) <= 1}
    assert crossings == expected and len(modes(7)) == len(expected)


def simulated(clearance, servo, moment):
    """Lost motion that the reduced clearance has at the end of each period, in steps of 0.1 ms."""
    d, lost_motion = 0.0, []
    for turn, pressed in zip(np.diff(servo, prepend=0.0), moment):
        for _ in range(100):
            d, _ = lost_motion_step(d, turn / 100, pressed, 1e-4, clearance)
        lost_motion.append(d)
    return np.array(lost_motion)


def stepped(backlash, servo):
    """The same by the law between periods; the state's lateral speed stands for the moment."""
    d, deflection = 0.0, []
    for turn, angle in zip(np.diff(servo, prepend=0.0), servo):
        d = lost_motion(d, turn, np.array([0, 0, 0, 0, angle, 0, 0.0]), backlash)
        deflection.append(d)
    return np.array(deflection)


def test_lost_motion_where_friction_holds_the_wheel():
    """A slalom of the servo against 10 N m, with 30 N m of friction and a contact of 50 MN m/rad."""
    servo = 0.01 * np.sin(np.linspace(0, 4 * np.pi, 400))
    expected = simulated(LostMotion(GAP, 5e7, friction=30.0), servo, np.full(400, 10.0))
    np.testing.assert_allclose(stepped(Backlash(GAP, 30.0, (0.0, 0.0, 0.0)), servo), expected, atol=2e-6)


def test_lost_motion_where_the_moment_presses_the_wheel():
    """2000 N m per radian of the wheel, no friction: on the moment's side wherever it exceeds 10 N m."""
    servo = 0.03 * np.sin(np.linspace(0, 4 * np.pi, 400))
    lost_motion = stepped(Backlash(GAP, 0.0, (2000.0, 0.0, 0.0)), servo)
    expected = simulated(LostMotion(GAP, 5e7), servo, 2000 * servo)
    pressed = np.abs(2000 * servo) > 10 + 2000 * GAP
    np.testing.assert_allclose(lost_motion[pressed], expected[pressed], atol=2e-6)
    assert np.count_nonzero(pressed) > 200


def rolled_out(plan, x, lost, curvature, task):
    """Cost of a plan, written anew: the play of a friction-driven clearance on the test's own model."""
    A, B, E, C, W, V = regulator(LAW)
    D = np.append(solved([0, 0, 0, 0, 1.0, 0], 1.0, 0.0, 0.01)[:4], np.zeros(3))
    J, d = 0.0, lost
    for change, kappa in zip(plan, curvature):
        y = C @ x - np.array([0, 0, SPEED * kappa])
        J += y @ W @ y + LAW.effort * change**2
        after = A @ x + B * change + E * kappa + D * d
        d, x = np.clip(d - (after[4] - x[4]), -GAP, GAP), after
    x = x - steady_turn(curvature[-1]) + d * np.array([0, 0, 0, 0, 1, 0, 1.0])
    return J + x @ V @ x


@pytest.mark.parametrize("s", [20.0, 60.0, 90.0])
def test_the_plan_taken_costs_least(s):
    """Of all modes' plans, and of MPC's own; friction far above the moment, wheel in the middle of its play."""
    law = dataclasses.replace(LAW, friction=1e6)
    task = Task(VEHICLE, PATH, SPEED, largest_rate=10.0)
    run, seen = law.start(task), Observation(s, 0.05, -0.004, 0.05, 0.02, SPEED)
    curvature = task.curvature(seen, np.arange(21) * task.period)
    x = np.array([*seen[1:5], 0, 0, 0])
    cost = rolled_out(run.changes(seen), x, 0.0, curvature, task)
    alone, sides = run.free(seen, curvature), -GAP * modes(20)
    sides[:, 0] = 0.0
    costs = [rolled_out(alone + run.program.lost @ one, x, 0.0, curvature, task) for one in sides]
    assert cost == pytest.approx(min(costs), rel=1e-6) and cost < rolled_out(alone, x, 0.0, curvature, task)
    assert max(costs) > 1.01 * cost  # the choice matters


def test_softer_contact_is_a_softer_axle():
    """A compliance beyond the nominal steering's: the model's front axle has it."""
    run = dataclasses.replace(LAW, compliance=1 / 4e4).start(Task(VEHICLE, straight(100.0), SPEED))
    assert run.task.vehicle == VEHICLE.with_steering(4e4)


def test_takes_what_the_clearance_model_takes():
    known = Case("mpc-backlash", 72.0, regime="friction", assumed_gap=0.5 * GAP).tuned_controller
    assert (known.half_gap, known.friction, known.compliance) == (0.5 * GAP, 30.0, 0.0)
    assert known.effort == get_controller("mpc-cm").tuned_controller().effort


@pytest.mark.parametrize("settings", [{"half_gap": -0.1}, {"friction": np.inf}])
def test_impossible_settings(settings):
    with pytest.raises(ManoeuvreError, match=r"half_gap \(rad\) and friction \(N m\) must be finite and >= 0"):
        BacklashPredictive(**settings)
