"""What logs of a motor alone tell of the drive behind it: virtual gears of known numbers, and what is not told."""

import json

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.drives import DriveRecord, fit_motor_side
from clearance_mj.drives.teeth import NUMBERS, predict_teeth
from experiments.drives import virtual

GEAR = virtual.Gear.drawn(3)


def gear_runs(*loads, seconds, noise):
    """Runs of both ends with noise in proportion to the range, integrated at 20 kHz."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(virtual, "SECONDS", seconds)
        patch.setattr(virtual, "NOISE", noise)
        return [GEAR.run(f"load {load:g}", load, i) for i, load in enumerate(loads)]


def motor_runs(*loads, seconds=6.0):
    """Runs of the motor's end alone, with noise of 0.02 % of the range."""
    runs = gear_runs(*loads, seconds=seconds, noise=2e-4)
    return [DriveRecord(run.name, run.fs, run.motor_angle, run.motor_torque) for run in runs]


@pytest.fixture(scope="module")
def fit():
    return fit_motor_side(motor_runs(0.0, 1.5))


def test_play_efficiency_friction_and_loads_are_found(fit):
    """Those of the gear, in units of its motor."""
    n = GEAR.ratio
    assert fit.values["play"] == pytest.approx(GEAR.play / n, rel=0.02)
    assert fit.values["efficiency"] == pytest.approx(GEAR.efficiency, abs=0.002)
    assert fit.values["friction"] == pytest.approx(GEAR.friction[0], rel=0.05)
    assert fit.values["load friction"] == pytest.approx(GEAR.friction[1] * n, rel=0.1)
    assert fit.values["load of load 1.5"] == pytest.approx(1.5 * GEAR.usual * n, rel=0.02)
    assert fit.crossings > 0 and not any(words.startswith("play ") for words in fit.not_told)


def test_stiffness_that_noise_and_sampling_hide_is_not_claimed(fit):
    assert any(words.startswith("stiffness is not told by these runs; a finer encoder") for words in fit.not_told)


def test_plain_data(fit):
    """In the motor's units; what it is made of can be written as JSON."""
    table = fit.table()
    assert table["play to either side, rad"] == fit.values["play"]
    assert table["stiffness of the teeth, N m/rad"] == fit.values["stiffness"]
    data = json.loads(json.dumps(fit.to_dict()))
    assert data["runs"] == ["load 0", "load 1.5"] and data["not_told"] == list(fit.not_told)


def test_play_that_no_reversal_passes_is_not_told():
    """Both loads are far larger than the load's friction and its spring: the teeth never change sides."""
    fit = fit_motor_side(motor_runs(1.5, 2.5, seconds=4.0))
    assert fit.crossings == 0
    assert "play is not told by these runs; a reversal without load would tell it" in fit.not_told
    assert fit.values["efficiency"] == pytest.approx(GEAR.efficiency, abs=0.005)


def test_teeth_without_play_are_a_rigid_drive():
    """A constant torque on stiff teeth: the angle is that of both inertias together, 0.5 t² M/(J + J')."""
    time = np.arange(500) / 500.0
    angle, torque = 0.5 * time**2 * 0.2 / 0.05, np.full(500, 0.2)
    values = dict.fromkeys(NUMBERS, 0.0) | {
        "inertia": 0.02, "load inertia": 0.03, "play": 1e-9, "stiffness": 1e6, "teeth's damping": 1e3,
        "efficiency": 1.0, "turnover": 1.0, "width": 1.0, "load width": 1.0,
    }  # fmt: skip
    predicted, teeth, _ = predict_teeth(angle, torque, 1 / 500.0, np.array([values[name] for name in NUMBERS]), 8)
    begun = (angle[20] - angle[0]) / 0.04  # the speed that the motion is taken to begin with
    assert predicted == pytest.approx(angle + begun * time, abs=2e-3)
    assert teeth[50:] == pytest.approx(0.2 * 0.03 / 0.05, rel=1e-3)


@pytest.mark.parametrize(("change", "said"), [
    ({"motor_torque": np.zeros(1000)}, 'run "run": the motor\'s torque never changes'),
    ({"motor_angle": np.linspace(0, 1, 1000)}, 'run "run": the motor never turns back'),
])  # fmt: skip
def test_runs_that_are_no_use(change, said):
    time = np.arange(1000) / 100
    channels = {"motor_angle": np.sin(time), "motor_torque": np.cos(time)} | change
    with pytest.raises(RecordError, match=said) as error:
        fit_motor_side([DriveRecord("run", 100.0, **channels)])
    assert "\n" not in str(error.value)


def test_no_runs():
    with pytest.raises(RecordError, match="from one run at least"):
        fit_motor_side([])


@pytest.mark.slow
def test_the_load_torque_tells_both_frictions_and_the_ratio():
    """Without the load's angle: numbers of the gear, which was integrated at 20 kHz."""
    loaded = gear_runs(0.0, 1.5, seconds=6.0, noise=2e-3)
    runs = [DriveRecord(r.name, r.fs, r.motor_angle, r.motor_torque, load_torque=r.load_torque) for r in loaded]
    fit = fit_motor_side(runs)
    n = GEAR.ratio
    assert fit.values["ratio"] == pytest.approx(n, rel=1e-3)
    assert fit.values["efficiency"] == pytest.approx(GEAR.efficiency, abs=0.002)
    assert fit.values["friction"] == pytest.approx(GEAR.friction[0], rel=0.01)
    assert fit.values["load friction"] == pytest.approx(GEAR.friction[1] * n, rel=0.02)
    assert not any(words.startswith(("ratio", "efficiency", "friction", "load friction")) for words in fit.not_told)
