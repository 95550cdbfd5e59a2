"""Logs of drives as they come: columns, signs, and what is wrong with them."""

import gzip
import sys

import numpy as np
import pandas as pd
import pytest
import scipy.io

from clearance_mj.core.errors import RecordError
from clearance_mj.core.notes import RecordNote
from clearance_mj.drives import DriveRecord

TIME = np.arange(200) * 0.01
HEADING = "time,motor_angle,motor_torque"


def table(time=TIME, heading=HEADING, angle=None):
    angle = np.sin(3 * time) if angle is None else angle
    return heading + "\n" + "\n".join(f"{t:.4f},{x:.6f},{0.1 * x:.6f}" for t, x in zip(time, angle)) + "\n"


def test_columns_by_a_map_and_a_sign(tmp_path):
    path = tmp_path / "run 7.csv.gz"
    path.write_bytes(gzip.compress(table(heading="t,q,tau").encode()))
    record = DriveRecord.read(path, {"time": "t", "motor_angle": "q", "motor_torque": "-tau"})
    assert (record.name, record.fs, record.both_ends) == ("run 7", pytest.approx(100.0), False)
    np.testing.assert_allclose(record.motor_torque, -0.1 * record.motor_angle, atol=1e-6)
    assert record.reversals == 2  # sin 3t turns back at 0.52 s and 1.57 s


@pytest.mark.parametrize(("text", "said"), [
    (table(heading="time,motor_angle,torque"), 'no column "motor_torque"'),
    (table(time=np.delete(TIME, [50, 51])), "0.03 s pass after 0.49 s instead of 0.01 s .1 times.: samples are"),
    (table(time=TIME[::-1]), "times must rise"),
    (table(angle=np.arctan2(np.sin(9 * TIME), np.cos(9 * TIME))), "a whole turn in rad: the encoder wraps"),
    (table(angle=np.degrees(np.arctan2(np.sin(9 * TIME), np.cos(9 * TIME)))), "a whole turn in degrees"),
    (table(time=TIME[:50]), "50 samples are too few"),
    (table().replace("0.5100,0.", "0.5100,x"), "motor_angle is not finite at 0.51 s"),
    ("", "holds no records; needs a line with the names of the columns"),
])  # fmt: skip
def test_what_is_wrong_is_said(tmp_path, text, said):
    path = tmp_path / "run.csv"
    path.write_text(text)
    with pytest.raises(RecordError, match=said):
        DriveRecord.read(path)


DEG, OZ_IN = np.pi / 180, 0.028349523125 * 9.80665 * 0.0254  # NIST SP 811: 1 oz = 28.349 523 125 g, 1 in = 25.4 mm
UNITS = [
    ("deg", DEG, "mNm", 1e-3), ("°", DEG, "mN m", 1e-3), ("degrees", DEG, "N.mm", 1e-3),
    ("turns", 2 * np.pi, "N cm", 0.01), ("rev", 2 * np.pi, "kgf·cm", 0.0980665),
    ("mrad", 1e-3, "kg-cm", 0.0980665), ("arcmin", DEG / 60, "oz-in", OZ_IN),
    ("ticks/4096", 2 * np.pi / 4096, "ozf·in", OZ_IN), ("4096 counts/rev", 2 * np.pi / 4096, "lb-in", 16 * OZ_IN),
    ("0.088 deg", 0.088 * DEG, "0.05 Nm", 0.05), ("rad", 1.0, "N·m", 1.0),
    ("4000 cpr", 2 * np.pi / 4000, "lbf ft", 192 * OZ_IN),
]  # fmt: skip


@pytest.mark.parametrize(("angle", "radians", "torque", "newton_metres"), UNITS)
def test_units_of_headers_and_of_what_is_given(tmp_path, angle, radians, torque, newton_metres):
    """In the header, behind the name that is given, in round brackets, in a row of units, with decimal commas."""
    x = np.sin(3 * TIME) / radians
    columns = {"motor_angle": "q", "motor_torque": "tau"}
    rows = [f"{1e3 * t:.1f};{a:.9g};{b:.9g}" for t, a, b in zip(TIME, x, TIME / newton_metres)]
    for head, given in (
        (f"t [ms];q [{angle}];tau [{torque}]", columns),
        (f"t (ms);q ({angle});tau ({torque})", columns),
        ("t_ms;q;tau", {"motor_angle": f"q [{angle}]", "motor_torque": f"tau [{torque}]"}),
        (f"Logger;2\n\ntime [ms];q;tau\nms;{angle};{torque}".replace("time [ms]", "time"), columns),
    ):
        path = tmp_path / "run.csv"
        path.write_text("\n".join([head, *(row.replace(".", ",") for row in rows)]) + "\n")
        record = DriveRecord.read(path, given)
        assert record.fs == pytest.approx(100.0)
        np.testing.assert_allclose(record.motor_angle, np.sin(3 * TIME), atol=1e-6)
        np.testing.assert_allclose(record.motor_torque, TIME, rtol=1e-6)


def test_what_is_taken_for_a_unit_is_said(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(table(heading="t,q_deg,tau"))
    said = '"t" is taken for s, without .*"q_deg" is taken for deg, as .*"tau" is taken for N m'
    with pytest.warns(RecordNote, match=said):
        record = DriveRecord.read(path, {"motor_angle": "q_deg", "motor_torque": "tau"})
    np.testing.assert_allclose(record.motor_angle, np.radians(np.sin(3 * TIME)), atol=1e-7)


def test_columns_that_are_not_used_are_said(tmp_path):
    """Not those that were to be left out."""
    path, rows = tmp_path / "run.csv", table(heading="time,motor_angle,motor_torque").splitlines()
    path.write_text("\n".join([rows[0] + ",load_angle,load torque [Nm]", *(f"{row},1,2" for row in rows[1:])]))
    with pytest.warns(RecordNote, match=r"run.csv: not used: load torque \[Nm\]$"):
        record = DriveRecord.read(path, {"load_angle": "skip"})
    assert not record.any_end


@pytest.mark.parametrize(("heading", "given", "said"), [
    ("time,q [ticks],tau [Nm]", {}, r'"q \[ticks\]" .motor_angle.: unit "ticks" of angle needs the number that'),
    ("time,q [deg],tau [A]", {}, r'unit "A" of torque is unknown; use N m, .* or a number of these, such'),
    ("time,q [mm],tau [Nm]", {}, 'unit "mm" of angle is unknown; use rad, deg, turn'),
    ("time,q [rad],q [deg]", {"motor_torque": "q"}, r'several columns are "q" .*give its unit too'),
])  # fmt: skip
def test_a_unit_that_is_none(tmp_path, heading, given, said):
    path = tmp_path / "run.csv"
    path.write_text(table(heading=heading))
    with pytest.raises(RecordError, match=said):
        DriveRecord.read(path, {"motor_angle": "q", "motor_torque": "tau"} | given)


def test_times_that_jitter(tmp_path):
    """A sine of 2 rad/s sampled 1 ms early and late in turn: a line between samples 12 ms apart is off by (0.024)²/8.

    The first sample is early and the last one late, by which the mean step grows by 1/199: 2 ms from first to last.
    """
    time = TIME + 1e-3 * (-1.0) ** np.arange(TIME.size)
    path = tmp_path / "run.csv"
    path.write_text(table(time=time, angle=np.sin(2 * time)))
    with pytest.warns(RecordNote, match=r"times are up to 1.99 ms off even ones"):
        record = DriveRecord.read(path)
    even = time[0] + np.arange(TIME.size) / record.fs
    np.testing.assert_allclose(record.motor_angle[1:-1], np.sin(2 * even)[1:-1], atol=7.3e-5)


def test_a_log_in_a_format_of_records(tmp_path):
    """MATLAB and universal files: what a record's reader returns."""
    scipy.io.savemat(tmp_path / "run.mat", {"time": TIME, "q": np.degrees(np.sin(3 * TIME)), "tau": TIME})
    record = DriveRecord.read(tmp_path / "run.mat", {"motor_angle": "q [deg]", "motor_torque": "-tau [mNm]"})
    np.testing.assert_allclose(record.motor_angle, np.sin(3 * TIME), rtol=1e-12)
    np.testing.assert_allclose(record.motor_torque, -1e-3 * TIME, rtol=1e-12)


def test_samples_of_different_number():
    with pytest.raises(RecordError, match="load_angle has 100 samples, motor_angle 200"):
        DriveRecord("a", 100.0, TIME, TIME, TIME[:100], TIME)
    with pytest.raises(RecordError, match="sampling rate 0 Hz must be > 0"):
        DriveRecord("a", 0.0, TIME, TIME)
    with pytest.raises(RecordError, match='"pressure" is no column of a drive'):
        DriveRecord.read("run.csv", {"pressure": "p"})


STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def write_states(path, topics, kind="sensor_msgs/msg/JointState"):
    """Joint states as a bag of ROS 2 has them: topic, stamps in s, names, positions, efforts (n, n_joints)."""
    writer_module = pytest.importorskip("mcap_ros2.writer")
    with path.open("wb") as file:
        writer = writer_module.Writer(file)
        schema = writer.register_msgdef(kind, STATE)
        for topic, stamps, names, position, effort in topics:
            for stamp, x, torque in zip(stamps, position, effort):
                nanoseconds = round(stamp * 1e9)
                header = {"stamp": {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}, "frame_id": ""}
                message = {"header": header, "name": names, "position": list(x), "velocity": [], "effort": list(torque)}
                writer.write_message(topic=topic, schema=schema, message=message, log_time=nanoseconds)
        writer.finish()


def test_joint_states_of_ros(tmp_path):
    """Two topics of different rates with a joint of one name: the load's is brought to the motor's times."""
    path, slow = tmp_path / "bag.mcap", TIME[::2] + 0.003
    write_states(path, [
        ("/motor/joint_states", 100 + TIME, ["wrist", "elbow"], np.column_stack([TIME, np.sin(3 * TIME)]),
         np.column_stack([0 * TIME, 0.1 * np.sin(3 * TIME)])),
        ("/load/joint_states", 100 + slow, ["elbow"], slow[:, None], -slow[:, None]),
    ])  # fmt: skip
    record = DriveRecord.read(path, {
        "motor_angle": "/motor/joint_states elbow.position", "motor_torque": "/motor/joint_states elbow.effort",
        "load_angle": "/load/joint_states elbow.position", "load_torque": "-/load/joint_states elbow.effort",
    })  # fmt: skip
    assert record.fs == pytest.approx(100.0) and record.both_ends
    np.testing.assert_allclose(record.motor_angle, np.sin(3 * TIME), atol=1e-12)
    np.testing.assert_allclose(record.load_torque[1:-1], TIME[1:-1], atol=1e-8)
    with pytest.raises(RecordError, match=r'no column "motor_angle" .motor_angle.; it has time, wrist.position, wrist'):
        DriveRecord.read(path)


def test_a_bag_without_joint_states(tmp_path):
    path = tmp_path / "bag.mcap"
    write_states(path, [("/other", TIME, ["a"], TIME[:, None], TIME[:, None])], "my_msgs/msg/Other")
    with pytest.raises(RecordError, match=r"no topic has joint states .sensor_msgs/msg/JointState."):
        DriveRecord.read(path)
    path.write_bytes(b"no bag")
    with pytest.raises(RecordError, match="cannot be read as mcap"):
        DriveRecord.read(path)


def test_parquet(tmp_path):
    pytest.importorskip("pyarrow")
    path = tmp_path / "run.parquet"
    pd.DataFrame({"time": TIME, "motor_angle": np.sin(3 * TIME), "motor_torque": TIME}).to_parquet(path)
    np.testing.assert_array_equal(DriveRecord.read(path).motor_torque, TIME)


@pytest.mark.parametrize("suffix", [".parquet", ".mcap"])
def test_what_is_not_installed_is_said(tmp_path, monkeypatch, suffix):
    path = tmp_path / f"run{suffix}"
    path.write_bytes(b"")
    for name in ("pyarrow", "fastparquet", "mcap.reader"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(RecordError, match=r'needs further packages: pip install "clearance-mj\[logs\]"'):
        DriveRecord.read(path)
