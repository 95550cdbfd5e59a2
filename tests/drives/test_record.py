"""Logs of drives as they come: columns, signs, and what is wrong with them."""

import gzip

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.drives import DriveRecord

TIME = np.arange(200) * 0.01
HEADING = "time,motor_angle,motor_torque"


def table(time=TIME, heading=HEADING, angle=None):
    angle = np.sin(3 * time) if angle is None else angle
    return heading + "\n" + "\n".join(f"{t:.4f},{x:.6f},{0.1 * x:.6f}" for t, x in zip(time, angle)) + "\n"


def test_columns_by_a_map_and_a_sign(tmp_path):
    path = tmp_path / "run 7.csv.gz"
    path.write_bytes(gzip.compress(table(heading="t,q,tau").encode()))
    record = DriveRecord.read_csv(path, {"time": "t", "motor_angle": "q", "motor_torque": "-tau"})
    assert (record.name, record.fs, record.both_ends) == ("run 7", pytest.approx(100.0), False)
    np.testing.assert_allclose(record.motor_torque, -0.1 * record.motor_angle, atol=1e-6)
    assert record.reversals == 2  # sin 3t turns back at 0.52 s and 1.57 s


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (table(heading="time,motor_angle,torque"), 'no column "motor_torque"'),
        (table(time=np.delete(TIME, [50, 51])), "0.03 s pass after 0.49 s instead of 0.01 s .1 times.: samples are"),
        (table(time=TIME[::-1]), "times must rise"),
        (table(angle=np.arctan2(np.sin(9 * TIME), np.cos(9 * TIME))), "a whole turn in rad: the encoder wraps"),
        (table(angle=np.degrees(np.arctan2(np.sin(9 * TIME), np.cos(9 * TIME)))), "a whole turn in degrees"),
        (table(time=TIME[:50]), "50 samples are too few"),
        (table().replace("0.5100,0.", "0.5100,x"), "motor_angle is not finite at 0.51 s"),
        ("", "cannot be read as CSV"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, text, said):
    path = tmp_path / "run.csv"
    path.write_text(text)
    with pytest.raises(RecordError, match=said):
        DriveRecord.read_csv(path)


def test_samples_of_different_number():
    with pytest.raises(RecordError, match="load_angle has 100 samples, motor_angle 200"):
        DriveRecord("a", 100.0, TIME, TIME, TIME[:100], TIME)
    with pytest.raises(RecordError, match="sampling rate 0 Hz must be > 0"):
        DriveRecord("a", 0.0, TIME, TIME)
    with pytest.raises(RecordError, match='"pressure" is no column of a drive'):
        DriveRecord.read_csv("run.csv", {"pressure": "p"})
