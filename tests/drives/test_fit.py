"""Drives found from runs of both ends whose numbers are known, and logs that are no use."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.drives import Drive, DriveRecord, PreslidingFriction, Strand, fit_drive

FS = 200.0
TIME = np.arange(4000) / FS
DRIVE = Drive(
    ratio=-0.5, zero=0.3, compliance=0.02, strands=(Strand(1.0, 0.2),), capstan=0.15, efficiency=0.9, torque_zero=0.05,
    stiffness=0.1, friction=PreslidingFriction(0.05, 0.1, 0.02),
)  # fmt: skip


def run_of(drive, name, load, frequency, seed):
    """A run of 20 s: the motor's angle is a sine, its torque follows the load and friction, noise is 1e-3 of all."""
    rng = np.random.default_rng(seed)
    angle = 1.2 * np.sin(2 * np.pi * frequency * TIME) + 0.2 * np.sin(2 * np.pi * 0.37 * frequency * TIME + 1)
    torque = load + 0.7 * np.tanh(2 * np.gradient(angle) * FS) + 0.8 * angle + 0.3 * np.sin(2 * np.pi * 0.7 * TIME)
    clean = DriveRecord(name, FS, angle, torque)
    told_angle, told_torque = drive.follow(clean)
    noise = rng.normal(0, 1e-3, (2, TIME.size))
    return dataclasses.replace(clean, load_angle=told_angle + noise[0], load_torque=told_torque + noise[1])


def runs_of(drive, seed=0):
    loads = [(0.5, 0.2), (1.5, 0.3), (2.5, 0.5), (-1.0, 0.3)]  # and frequencies
    return [run_of(drive, f"run {i}", *given, seed + i) for i, given in enumerate(loads)]


@pytest.fixture(scope="module")
def fit():
    return fit_drive(runs_of(DRIVE))


def test_numbers_of_a_drive_are_found(fit):
    """Those it was made of, within three standard deviations and 2 %."""
    known = {
        "ratio": -0.5, "zero": 0.3, "compliance": 0.02, "coulomb": 0.2, "capstan": 0.15, "efficiency": 0.9,
        "torque zero": 0.05, "stiffness": 0.1, "width": 0.05, "friction": 0.1, "lost motion": 0.02,
    }  # fmt: skip
    assert fit.parts == ()  # nothing is added that is not there
    assert dict(zip(fit.estimates.names, fit.estimates.value)) == pytest.approx(known, rel=0.02)


def test_parts_that_are_there_are_found():
    fit = fit_drive(runs_of(dataclasses.replace(DRIVE, backlash=0.05, backlash_torque=0.1, damping=0.05)))
    assert set(fit.parts) == {"backlash", "damping"}
    assert fit.drive.damping == pytest.approx(0.05, rel=0.05)
    assert fit.drive.backlash == pytest.approx(0.05, rel=0.1)


def test_a_run_that_it_was_not_found_from(fit):
    """Its error is the noise."""
    angle, torque = fit.drive.errors(run_of(DRIVE, "other", 2.0, 0.4, 50))
    assert angle == pytest.approx(1e-3, rel=0.1) and torque == pytest.approx(1e-3, rel=0.1)


def test_table_of_a_drive(fit):
    """With the motor held: k = η/(n² c); lost in reversals 2 n p; friction C η/n; all as a gear maker measures them."""
    table = fit.table()
    assert table["stiffness from half to full torque, N m/rad"] == pytest.approx(0.9 / (0.25 * 0.02), rel=0.03)
    assert table["lost in reversals, rad"] == pytest.approx(2 * 0.5 * 0.02, rel=0.02)
    assert table["friction without load, N m"] == pytest.approx(0.2 * 0.9 / 0.5, rel=0.02)
    assert table["efficiency of driving"] == pytest.approx(0.9 * np.exp(-0.15), rel=0.01)
    data = fit.to_dict()
    assert data["runs"] == ["run 0", "run 1", "run 2", "run 3"] and data["parts"] == {}


def test_what_runs_do_not_tell_is_said():
    """One load that never changes does not tell friction that grows with the load from the efficiency."""
    record, *_ = runs_of(DRIVE)
    torque = np.where(np.gradient(record.motor_angle) > 0, 1.0, 0.98)
    angle, load = DRIVE.follow(dataclasses.replace(record, motor_torque=torque))
    noise = np.random.default_rng(1).normal(0, 1e-3, TIME.size)
    quiet = DriveRecord("quiet", FS, record.motor_angle, torque, angle + noise, load + noise)
    words = fit_drive([quiet], parts=()).not_told
    assert any(word.startswith("capstan") and "loads of different size" in word for word in words)


@pytest.mark.parametrize(("change", "said"), [
    ({"load_torque": None}, 'run "run 1" has the motor\'s end only'),
    ({"motor_torque": np.zeros(4000)}, 'run "run 1": the motor\'s torque never changes'),
    ({"motor_angle": np.linspace(0, 1, 4000), "load_torque": np.zeros(4000)}, "the motor never turns back"),
])  # fmt: skip
def test_runs_that_are_no_use(change, said):
    runs = runs_of(DRIVE)[:2]
    with pytest.raises(RecordError, match=said):
        fit_drive([runs[0], dataclasses.replace(runs[1], **change)])


def test_torques_that_count_the_other_way_round():
    record = runs_of(DRIVE)[0]
    other = dataclasses.replace(record, motor_torque=-record.motor_torque, load_torque=-record.load_torque)
    with pytest.raises(RecordError, match="J more than it gets; a torque or an angle counts the other way round"):
        fit_drive([other])
    with pytest.raises(RecordError, match="from one run at least"):
        fit_drive([])
    with pytest.raises(RecordError, match='part "gear" is unknown; known: second strand'):
        fit_drive([record], parts=["gear"])
