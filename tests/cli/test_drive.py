"""clearance-mj drive: a drive from logs of both ends, and what is no use for it."""

import json

import numpy as np
import pytest

from clearance_mj.cli import main

from ..drives.test_fit import DRIVE, run_of


@pytest.fixture
def logs(tmp_path):
    paths = []
    for i, (load, frequency) in enumerate([(0.5, 0.2), (2.0, 0.4), (1.0, 0.3)]):
        run = run_of(DRIVE, f"log_{i}", load, frequency, i)
        time = np.arange(run.motor_angle.size) / run.fs
        columns = (time, run.motor_angle, -run.motor_torque, run.load_angle, run.load_torque)
        paths.append(tmp_path / f"log_{i}.csv")
        np.savetxt(
            paths[-1], np.column_stack(columns), "%.7f", ",", header="t,motor_angle,tau,load_angle,load_torque",
            comments="",
        )  # fmt: skip
    return paths


def test_a_drive_and_a_run_that_is_predicted(logs, tmp_path, answer):
    out = tmp_path / "out"
    given = ["--column", "time=t", "--column", "motor_torque=-tau", "--predict", str(logs[2]), "--out", str(out)]
    result = answer("drive", logs[0], logs[1], *given)
    assert result["table"]["ratio"] == pytest.approx(-0.5, rel=1e-2)
    (row,) = result["predicted"]
    assert row["run"] == "log_2" and row["angle_rms_deg"] == pytest.approx(np.degrees(1e-3), rel=0.2)
    page = (out / "index.html").read_text()
    assert all(words in page for words in ("lost motion at 3 % of the torque", "log_2", "Posterior over prior", "95 %"))
    assert {f.name for f in (out / "figures").iterdir()} == {"hysteresis.png", "runs.png"}
    assert json.loads((out / "drive.json").read_text())["drive"]["ratio"] == result["table"]["ratio"]


def test_a_run_to_predict_that_has_the_load_angle_alone(logs, tmp_path, capsys):
    """Its error is said; there is none of a torque that nobody measured."""
    rows = np.loadtxt(logs[2], delimiter=",", skiprows=1)[:, :4]
    np.savetxt(logs[2], rows, "%.7f", ",", header="t,motor_angle,tau,load_angle", comments="")
    given = ["--column", "motor_torque=-tau", "--predict", str(logs[2]), "--out", str(tmp_path / "out")]
    assert main(["drive", str(logs[0]), str(logs[1]), *given]) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("log_2: "))
    assert line.startswith("log_2: angle 0.0") and line.endswith(" degrees RMS off")
    (row,) = json.loads((tmp_path / "out" / "drive.json").read_text())["predicted"]
    assert row["angle_rms_deg"] == pytest.approx(np.degrees(1e-3), rel=0.2) and row["torque_rms_Nm"] is None


def test_a_map_and_what_is_skipped(logs, tmp_path, capsys, output_of):
    """Degrees and mN m in headers, a map, and the load's torque left out: the motor's side alone is looked at."""
    for path in logs:
        rows = np.loadtxt(path, delimiter=",", skiprows=1) * [1e3, 180 / np.pi, 1e3, 180 / np.pi, 1e3]
        np.savetxt(path, rows, "%.7f", ",", header="t [ms],motor [deg],tau [mNm],joint [deg],load [mNm]", comments="")
    (tmp_path / "map.toml").write_text(
        '[channels]\n"motor" = "motor_angle"\n"tau" = "-motor_torque"\n"joint [deg]" = "load_angle"\n"t" = "skip"\n'
    )
    given = ["drive", *map(str, logs[:2]), "--map", str(tmp_path / "map.toml"), "--out", str(tmp_path / "out")]
    said = output_of(*given, "--column", "load=load_torque", "--json")
    assert json.loads(said.out)["table"]["ratio"] == pytest.approx(-0.5, rel=1e-2) and "note" not in said.err
    assert main([*given, "--column", "load_angle=skip", "--predict", str(logs[2])]) == 2
    assert "--predict needs logs of both ends" in capsys.readouterr().err


@pytest.mark.slow
def test_logs_of_the_motor_alone(logs, tmp_path, capsys, answer):
    """What a motor tells, and a file to predict, which needs both ends."""
    out, columns = tmp_path / "out", ["--column", "time=t", "--column", "motor_torque=-tau"]
    for path in logs:
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        np.savetxt(path, table[:, :3], "%.7f", ",", header="t,motor_angle,tau", comments="")
    result = answer("drive", *logs[:2], *columns, "--out", out)
    assert result["table"]["play to either side, rad"] > 0 and not result["predicted"]
    assert "The ratio to the load" in (out / "index.html").read_text()
    given = ["--predict", str(logs[2]), "--out", str(tmp_path / "other")]
    assert main(["drive", *map(str, logs[:2]), *columns, *given]) == 2
    assert "--predict needs logs of both ends" in capsys.readouterr().err


@pytest.mark.parametrize("given, said", [
    (["--column", "tau"], '--column "tau": needs WHAT=COLUMN, such as "motor_torque=tau"'),
    (["--column", "speed=v"], '"speed" is no column of a drive; known: time, motor_angle'),
    (["--column", "time=t"], 'no column "motor_torque" (motor_torque); it has t, motor_angle, tau'),
    (["--column", "time=t [s]", "--column", "motor_torque=tau [Nm]"], "a torque or an angle counts the other way"),
])  # fmt: skip
def test_bad_input_is_one_line(logs, tmp_path, refused, given, said):
    (line,) = refused("drive", logs[0], *given, "--out", tmp_path / "out").strip().splitlines()
    assert said in line and not (tmp_path / "out").exists()
