"""Other programs beside `fit_model`: errors of their numbers, and models that they are given."""

import numpy as np
import pandas as pd
import pytest

from clearance_mj import physical
from experiments.drives import others
from experiments.drives.servos import WANTED, Servo
from experiments.script import run


def test_errors_of_a_program_that_is_off_by_a_hundredth(tmp_path, monkeypatch, capsys):
    """Of a program without teeth, whose prediction is 2 mrad too large everywhere."""

    def program(servo, start, log, other):
        values = {name: 1.01 * getattr(servo, name) for name in WANTED if name not in ("gap", "k", "c")}
        return values, np.asarray(other.sensors["load"]) + 2e-3

    monkeypatch.setattr(others, "methods", lambda: {"BAM, M2": program})
    assert run(others.main, None, ["--seeds", "1", "--out", str(tmp_path / "others.csv")]) == 0
    (row,) = pd.read_csv(tmp_path / "others.csv").to_dict("records")
    assert row["gain"] == pytest.approx(0.01) and np.isnan(row["gap"]) and row["prediction"] == pytest.approx(2.0)
    assert "| BAM, M2 | play, teeth | - | - | - |" in capsys.readouterr().out


def test_the_two_joints_have_the_servo_s_numbers():
    """Rotor and load with play between: both inertias, the gap, and friction at the rotor."""
    servo = Servo.drawn(3)
    model = physical.compile(others._joints(servo, play=True))
    assert model.nv == 2 and model.tendon_range[0, 1] == pytest.approx(servo.gap)
    rotor = model.joint("joint drive").dofadr[0]
    assert model.dof_frictionloss[rotor] == pytest.approx(servo.coulomb)
    assert model.dof_damping[rotor] == pytest.approx(servo.viscous)
    rigid = physical.compile(others._joints(servo, play=False))
    assert rigid.nv == 1 and rigid.dof_armature[0] == pytest.approx(servo.inertia)
