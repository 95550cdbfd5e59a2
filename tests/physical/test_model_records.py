"""Records of models: times that jitter, units and columns of files, sensors that count."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.core.errors import RecordError
from clearance_mj.physical import identification

FS = 500.0  # Hz
TIME = np.arange(1500) / FS


@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_times_that_jitter_are_brought_to_even_ones(hold):
    """Half a millisecond RMS at 500 Hz; an angle is where it was, a held torque has its impulse."""
    rng = np.random.default_rng(2)
    time = TIME + np.clip(rng.normal(0, 5e-4, TIME.size), -9e-4, 9e-4)
    held = rng.normal(size=TIME.size)
    count = 2 * np.pi / 4096
    sensors = {"angle": np.sin(9 * time), "counted": count * np.round(np.sin(9 * time) / count)}
    record = identification.ModelRecord.of_time(time, {"motor": held}, sensors, hold)
    even = time[0] + record.time
    assert record.fs == pytest.approx(FS, rel=1e-3)
    np.testing.assert_allclose(record.sensors["angle"][1:-1], np.sin(9 * even)[1:-1], atol=1.5e-4)
    assert record.quantisation["counted"] == pytest.approx(count)
    if hold == "zero":
        impulse = np.cumsum(held[:-1] * np.diff(time))
        evenly = np.append(0, np.cumsum(record.control["motor"])[:-1] / record.fs)
        resampled_impulse = np.interp(time[1:-1] - even[0], record.time, evenly)
        np.testing.assert_allclose(
            resampled_impulse, impulse[:-1], atol=4e-3
        )  # within a step of 2 ms and a torque of 2
    else:
        np.testing.assert_allclose(record.control["motor"], np.interp(even, time, held))


UNITS = """<mujoco><worldbody><body><joint name="hinge" type="hinge"/><geom size=".1"/><site name="s"/></body>
  <body pos="1 0 0"><joint name="slide" type="slide"/><geom size=".1"/></body></worldbody>
  <actuator><motor name="motor" joint="hinge"/><motor name="push" joint="slide"/></actuator>
  <sensor><jointpos name="enc" joint="hinge"/><jointpos name="scale" joint="slide"/>
  <jointvel name="gyro" joint="hinge"/><actuatorfrc name="torque" actuator="motor"/>
  <actuatorfrc name="load" actuator="push"/>
  <accelerometer name="acc" site="s"/><framequat name="pose" objtype="site" objname="s"/></sensor></mujoco>"""


@pytest.mark.parametrize(("header", "si"), [
    ("enc[deg]", np.pi / 180), ("enc (deg)", np.pi / 180), ("enc [rad]", 1.0), ("enc [rev]", 2 * np.pi),
    ("enc [counts/4096]", 2 * np.pi / 4096), ("sensor:enc [°]", np.pi / 180), ("scale[mm]", 1e-3), ("enc", 1.0),
    ("gyro [rpm]", np.pi / 30), ("gyro [deg/s]", np.pi / 180), ("torque [mNm]", 1e-3), ("torque [Ncm]", 1e-2),
    ("load [kN]", 1e3), ("load [lbf]", 4.4482216152605), ("motor [mNm]", 1e-3), ("actuator:push [mN]", 1e-3),
])  # fmt: skip
def test_units_of_csv(tmp_path, header, si):
    """Numbers are in SI units by what a unit in a header says (BIPM, The SI, 9th edition; NIST SP 811, B.8)."""
    path, values = tmp_path / "run.csv", 1 + np.arange(30.0)
    table = np.stack((np.arange(30) * 2.0, values, values), axis=1)
    np.savetxt(path, table, delimiter=",", header=f"time [ms],{header},acc[0] [g]", comments="")
    read = identification.ModelRecord.read_csv(path, mujoco.MjSpec.from_string(UNITS))
    assert read.fs == pytest.approx(500.0)
    (read_values,) = [v for k, v in (*read.control.items(), *read.sensors.items()) if k != "acc"]
    np.testing.assert_allclose(read_values, si * values, rtol=1e-12)
    np.testing.assert_allclose(read.sensors["acc"], 9.80665 * values, rtol=1e-12)


@pytest.mark.parametrize(("column", "si"), [
    ("pos [ticks/4096]", 2 * np.pi / 4096), ("-pos [deg]", -np.pi / 180), ("pos [turn]", 2 * np.pi), ("-pos", -1.0),
    ("-load", -np.pi / 180),
])  # fmt: skip
def test_a_map_of_columns(tmp_path, column, si):
    """Columns of a logger by what they are, which way round, and in which unit; what is not named is left out."""
    path, values = tmp_path / "run.csv", 1 + np.arange(30.0)
    table = np.stack((np.arange(30) * 2.0, values, values, values, values), axis=1)
    np.savetxt(path, table, delimiter=",", header="t,pos,load [deg],tau,temperature", comments="")
    columns = {"time": "t [ms]", "enc": column, "motor": "-tau [mN m]", "servo.angle": "load"}
    spec = mujoco.MjSpec.from_string(UNITS.replace("</actuator>", '<motor name="servo" joint="hinge"/></actuator>'))
    physical.add_drive(spec, "servo", gap=0.01, k=100, c=0.1, inertia=0.01)
    read = identification.ModelRecord.read_csv(path, spec, columns, hold="zero")
    assert read.fs == pytest.approx(500.0) and read.hold == "zero"
    np.testing.assert_allclose(read.sensors["enc"], si * values, rtol=1e-12)
    np.testing.assert_allclose(read.sensors["servo.angle"], np.pi / 180 * values, rtol=1e-12)
    np.testing.assert_allclose(read.control["motor"], -1e-3 * values, rtol=1e-12)
    with pytest.raises(RecordError, match=r'run.csv: no column "psi" \(enc\); it has t, pos'):
        identification.ModelRecord.read_csv(path, spec, {"time": "t", "enc": "psi"})


def test_columns_of_one_sensor_go_by_their_index(tmp_path):
    path, time = tmp_path / "run.csv", np.arange(30) / 500
    table = np.stack((time, time + 2, time + 1, 1e3 * time), axis=1)
    np.savetxt(path, table, delimiter=",", header="time,acc[2],acc[1],acc[0] [mm/s^2]", comments="")
    read = identification.ModelRecord.read_csv(path, mujoco.MjSpec.from_string(UNITS))
    np.testing.assert_allclose(read.sensors["acc"], np.stack((time, time + 1, time + 2), axis=1), atol=1e-12)


@pytest.mark.parametrize(("header", "says"), [
    ("enc[mm]", 'column "enc.mm.": unit "mm" of angle is unknown; use rad, deg'),
    ("scale [deg]", 'unit "deg" of displacement is unknown'),
    ("torque [N]", 'unit "N" of torque is unknown'),
    ("enc [counts]", "needs the number that makes a turn"),
    ("motor [furlong]", 'unit "furlong" of angle is unknown'),
    ("pose[0] [deg]", "its sensor has no unit"),
    ("acc[1]", r"has columns acc\[1\]; write them all"),
    ("enc,enc", 'column "enc" is there twice'),
    ("enc_deg", 'did you mean "enc"'),
])  # fmt: skip
def test_units_of_csv_that_cannot_be(tmp_path, header, says):
    path = tmp_path / "run.csv"
    columns = [np.arange(30) / 500] * (2 + header.count(","))
    np.savetxt(path, np.stack(columns, axis=1), delimiter=",", header=f"time,{header}", comments="")
    with pytest.raises(RecordError, match=f"run.csv: .*{says}"):
        identification.ModelRecord.read_csv(path, mujoco.MjSpec.from_string(UNITS))


def test_step_of_a_sensor_that_counts_is_seen():
    """Of 4096 counts per turn."""
    step = 2 * np.pi / 4096
    counted = step * np.round(0.2 * np.sin(3 * TIME) / step)
    quantisation = identification.ModelRecord(FS, {}, {"counted": counted, "other": np.sin(TIME)}).quantisation
    assert quantisation["counted"] == pytest.approx(step)
    assert quantisation["other"] == 0
