"""Virtual gear drives of foreign physics: their own known answers, and what identification makes of one."""

import dataclasses

import numpy as np
import pytest

from experiments.drives.virtual import Gear, judge

GEAR = Gear.drawn(3)


def test_a_gear_without_friction_gives_all_its_torque():
    """What is left beside the load's torque times the ratio is J θ'', some per cent of a torque that changes slowly."""
    free = dataclasses.replace(GEAR, efficiency=1.0, friction=(0.0, 0.0), drag=(0.0, 0.0))
    run = free.run("free", 1.0, 1)
    steady = slice(500, None)  # s 1 on: at first the teeth are not in touch
    error = run.motor_torque[steady] - free.ratio * run.load_torque[steady]
    assert np.sqrt(np.mean(error**2)) < 0.05 * np.ptp(run.motor_torque[steady])
    # The load hangs on one flank: behind by the play and the torque over the stiffness.
    lag = free.ratio * run.motor_angle - run.load_angle
    expected = np.sign(run.load_torque) * free.play + run.load_torque / free.stiffness
    pressed = np.abs(run.load_torque) > 0.3 * free.usual
    pressed[:500] = False
    np.testing.assert_allclose(np.median((lag - expected)[pressed]), 0.0, atol=0.03 * free.play)


def test_work_is_lost():
    assert GEAR.run("loaded", 0.6, 1).lost_work > 0


@pytest.mark.parametrize("seed", [100, pytest.param(101, marks=pytest.mark.slow)])
def test_identification_of_a_foreign_gear(seed):
    """Play within 3 %, stiffness within 10 %, efficiency within 2 points."""
    rows = {row["what"]: row for row in judge(seed)}
    assert rows["play"]["value"] == pytest.approx(rows["play"]["truth"], rel=0.03)
    assert rows["stiffness"]["value"] == pytest.approx(rows["stiffness"]["truth"], rel=0.1)
    assert rows["efficiency"]["value"] == pytest.approx(rows["efficiency"]["truth"], abs=0.02)
    assert rows["angle"]["value"] < 1.5 * rows["angle"]["truth"]
