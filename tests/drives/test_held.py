"""Servos that hold while others pull them: a synthetic protocol with known loss, and what is refused."""

import json

import numpy as np
import pytest

from clearance_mj.cli import main
from clearance_mj.core.errors import RecordError
from clearance_mj.core.notes import RecordNote
from clearance_mj.drives import ServoLog, fit_held

HEADER = ",".join(f"target pos ({i}),pos ({i}),load ({i})" for i in (7, 3, 4))


def log(path, stretched=(8.0, -8.0), let_go=(3.4, -3.4), gain=6.0, pulls=5):
    """Write a log of servo 7, which loses so many ticks to each side; its first row is before the first telemetry."""
    rng = np.random.default_rng(1)
    rows = ["2025-11-12T10:03:29.555Z,2047,,,1700,,,2300,,"]
    target, error = {7: 2047, 3: 1700, 4: 2300}, 0.0

    def add(count):
        for _ in range(count):
            cells = []
            for servo, wanted in target.items():
                off = error + rng.uniform(-0.5, 0.5) if servo == 7 else 0.0
                load = round(gain * off)
                cells += [wanted, round(wanted + off), load if load >= 0 else 1024 - load]
            stamp = f"2025-11-12T10:{len(rows) // 600:02d}:{len(rows) % 600 / 10:06.3f}Z"
            rows.append(",".join(map(str, [stamp, *cells])))

    add(5)
    for turn in range(pulls):
        for side, (puller, away, home) in enumerate(((3, 2100, 1700), (4, 1900, 2300))):
            target[puller] = away
            add(2)
            error = stretched[side]
            add(3)
            target[puller], error = home, let_go[side]
            add(10)
        target[7] = 2147 if turn % 2 else 2047
        add(4)
        target[7] = 2047
        add(4)
    path.write_text("\n".join([f"timestamp,{HEADER}", *rows]) + "\n")
    return path


def test_lost_motion_between_pulls(tmp_path):
    """Sixteen ticks stretched, 6.8 let go; of the load, 0.6 % per tick. Both intervals hold, and are a tick wide."""
    (servo,) = fit_held(ServoLog.read(log(tmp_path / "log.csv")))
    assert servo.servo == 7
    for lost, true in ((servo.stretched, 16.0), (servo.let_go, 6.8)):
        assert lost.low < true < lost.high
        assert lost.ticks == pytest.approx(true, abs=0.6)
        assert 1.5 < lost.high - lost.low < 3.0
        assert lost.pulls == (5, 5)
    assert servo.gain == pytest.approx(6.0, rel=0.1)
    assert servo.follows > 0.95
    assert "gear and loop are not told apart" in servo.not_told[0]


def test_what_hides_within_a_tick(tmp_path):
    """Positions that are rounded alike in all pulls have no scatter, and yet hide a tick."""
    (servo,) = fit_held(ServoLog.read(log(tmp_path / "log.csv", (0.2, -0.2), (0.0, 0.0))))
    assert servo.let_go.low == 0.0 and servo.let_go.high > 0.77
    assert "servo 7, let go: not told from none" in servo.not_told[1]


def test_command(tmp_path, capsys):
    path, out = log(tmp_path / "log.csv"), tmp_path / "out"
    assert main(["drive", str(path), "--out", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    (servo,) = result["servos"]
    assert servo["stretched"]["rad"] == pytest.approx(servo["stretched"]["ticks"] * 2 * np.pi / 4096)
    assert "not told apart" in result["not_told"][0]
    assert "Between the pulls to both sides" in (out / "index.html").read_text()
    assert main(["drive", str(tmp_path / "none.csv"), "--out", str(tmp_path / "other")]) == 2
    assert "none.csv: cannot be read" in capsys.readouterr().err


def test_targets_that_do_not_show_who_pulls(tmp_path):
    """All go to and fro equally often."""
    read = ServoLog.read(log(tmp_path / "log.csv", pulls=6))
    read.target[7][:] = np.where(read.target[3] == 2100, 2147, 2047)
    with pytest.raises(RecordError, match="do not show which two servos pull; name them"):
        fit_held(read)


@pytest.mark.parametrize(("change", "given", "says"), [
    (("target pos (4)", "goal (4)"), {}, "needs target pos"),
    (("", ""), {"held": [9]}, "has no servo 9; it has 3, 4, 7"),
    (("1900,", "2300,"), {"pullers": (3, 4)}, "must each pull twice"),
    (("2147,", "2100,"), {"pullers": (3, 8)}, "has no servo 8"),
])  # fmt: skip
def test_logs_that_cannot_be(tmp_path, change, given, says):
    path = log(tmp_path / "log.csv")
    path.write_text(path.read_text().replace(*change) if change[0] else path.read_text())
    with pytest.raises(RecordError, match=says):
        fit_held(ServoLog.read(path), **given)


def test_a_servo_without_loads_is_left_out_and_said(tmp_path):
    path = log(tmp_path / "log.csv")
    rows = path.read_text().splitlines()
    path.write_text("\n".join([rows[0] + ",target pos (9),pos (9)", *(f"{row},2000,2000" for row in rows[1:])]))
    with pytest.warns(RecordNote, match=r"servo 9 is left out: no load \(9\)$"):
        read = ServoLog.read(path)
    assert sorted(read.target) == [3, 4, 7]


@pytest.mark.parametrize("given", [["--predict", "other.csv"], ["--column", "motor_torque=tau"]])
def test_options_that_logs_of_servos_do_not_take(tmp_path, capsys, given):
    """They would be left out in silence."""
    assert main(["drive", str(log(tmp_path / "log.csv")), *given, "--out", str(tmp_path / "out")]) == 2
    words = "logs of servos that hold have their own columns: leave --column, --map, --predict away"
    assert words in capsys.readouterr().err
