"""A virtual gear that was found from logs, in a MuJoCo model, beside a run of its own physics under another load."""

from experiments.drives.in_mujoco import judge


def test_a_gear_of_foreign_physics():
    """Torques over their range and the play over its noise; asked of the whole chain: 6 %, 1 % and the noise."""
    row = judge(1)
    assert row["motor's torque"] < 0.06 and row["load's torque"] < 0.01 and row["play over noise"] < 1.0
