"""clearance-mj response: what the Python call finds, as files; folds and jumps in words; bad input is one line."""

import json
from functools import partial

import numpy as np
import pytest

from clearance_mj import Model, Rig, TimeLaw, periodic
from clearance_mj.cli import main

from ..periodic.jeffcott import FREQUENCY, GAP, jeffcott, unbalanced
from ..periodic.test_starts import GAP as OSCILLATOR
from .conftest import LAW, RIG, csv_rows


def test_files_hold_what_the_call_finds(law, tmp_path, answer):
    """Of the Table-1 rig at 6 m/s²: folds at 46.9 Hz upwards and 45.7 Hz downwards (docs/periodic.md)."""
    ends, out = (43.0, 49.0), tmp_path / "out"
    given = ("--from", ends[0], "--to", ends[1], "--harmonics", 9, "--quiet")
    printed = answer("response", RIG, "--law", law, "--level", "6,2", *given, "--sensors", 8, "--out", out)
    stored = json.loads((out / "response.json").read_text(encoding="utf-8"))
    assert printed == stored | {"out": str(out)}
    assert stored["law"] == LAW.to_dict() and Rig.from_dict(stored["rig"]) == Rig.load(RIG)
    branch = periodic.follow_response(Model(Rig.load(RIG), LAW), 6.0, ends, 9)
    first, second = stored["branches"]
    assert (first["level"], second["level"]) == (6.0, 2.0)
    assert [(p["kind"], p["frequency"]) for p in first["special"]] == [(p.kind, p.frequency) for p in branch.special]
    up, down = first["jumps"]
    assert up["upwards"] and up["at"] == pytest.approx(46.9, abs=0.1) and up["after"][0] < 0.5 * up["before"]
    assert not down["upwards"] and down["at"] == pytest.approx(45.7, abs=0.1) and down["after"][0] > 2 * down["before"]
    assert second["special"] == second["jumps"] == []
    rows = [row for row in csv_rows(out / "response.csv") if row["level"] == "6.0"]
    np.testing.assert_array_equal([float(row["frequency_hz"]) for row in rows], branch.frequency)
    assert [row["stable"] == "True" for row in rows] == branch.stable.tolist()
    for column, expected in (
        ("acceleration_8:+Z_amplitude_m_s2", branch.amplitude()[:, 7]),
        ("acceleration_8:+Z_fundamental_m_s2", np.abs(branch.acceleration[:, 7, 1])),
        ("clearance_displacement_6:+Z_amplitude_m", branch.amplitude("clearance_displacement")[:, 0]),
        ("contact_force_7:+Z_amplitude_n", branch.amplitude("contact_force")[:, 1]),
    ):
        np.testing.assert_allclose([float(row[column]) for row in rows], expected, rtol=1e-12)
    assert (out / "response.png").stat().st_size > 20_000


def test_it_says_what_branches_from_both_ends_leave_out(tmp_path, output_of):
    """Superharmonic resonances in between, up to 0.0339 and from 0.2752 Hz on."""

    OSCILLATOR.save(tmp_path / "rig.toml")
    given = ["--level", "1", "--from", "0.03", "--to", "0.4774", "--harmonics", "31", "--quiet"]
    said = output_of("response", tmp_path / "rig.toml", *given, "--out", tmp_path).out.splitlines()
    turned = [line for line in said if line.startswith("  it turns back and leaves the range at")]
    assert "0.0339408 to 0.4774 Hz is not covered" in turned[0] and "to 0.03 Hz is not covered" in turned[1]
    assert "1 N: no vibration was found from 0.03394 to 0.2752 Hz" in said


def test_it_says_folds_and_jumps_and_how_far(law, tmp_path, output_of):

    given = [str(RIG), "--law", str(law), "--level", "6", "--from", "49", "--to", "43", "--harmonics", "7", "--quiet"]
    said = output_of("response", *given, "--out", tmp_path)
    deep = "is 0.43 mm deep in the wall, beyond a fifth of the gap (0.3 mm): the contact's stiffness decides what is"
    assert [line.count("deep in the wall") for line in said.err.splitlines()] == [1, 1] and deep in said.err
    lines = said.out.splitlines()
    assert lines[0].startswith("6 m/s²: ") and " from 49 to 43 Hz, " in lines[0]
    down, up = (line for line in lines if line.startswith("  fold"))
    assert "fold at 45.6" in down and ": downwards the vibration jumps from 0.3" in down
    assert "fold at 46.9" in up and ": upwards the vibration jumps from 0.6" in up


@pytest.mark.parametrize("arguments, words", [
    (["--level", "2", "--from", "nan"], "frequency_range must be two different frequencies > 0 Hz"),
    (["--level", "2", "--harmonics", "0"], "harmonics must be 1 or more"),
    (["--level", "2", "--harmonics", "21", "--samples", "84"], "samples must be 85 or more"),
    (["--level", "2", "--modes", "0"], "modes must be between 1 and"),
    (["--level", "2", "--kind", "force"], "shaker"),
    (["--level", "2", "--sensors", "6,11"], "the rig has no sensor 11; it has 1, 2, 3, 4, 5, 6, 7, 8"),
    (["--level", "2", "--law", "TYPO"], "typo.json"),
    (["--from", "2"], "give --level to follow over frequency, or --frequency over level"),
    (["--level", "2", "--frequency", "46"], "give --level to follow over frequency, or --frequency over level"),
    (["--level", "2", "--over", "gap"], "--over gap is at one --level and --frequency: give both"),
    (["--frequency", "46", "--from", "2"], "from --from to --to: give both"),
    (["--frequency", "46", "--from", "2", "--to", "3", "--isolas", "2"], "over frequency: give --level"),
])  # fmt: skip
def test_refusals(law, tmp_path, refused, arguments, words):
    (tmp_path / "typo.json").write_text('{"kind": "constnt", "k": 1, "c": 0}')
    arguments = [str(tmp_path / "typo.json") if a == "TYPO" else a for a in arguments]
    out = tmp_path / "out"
    assert words in refused("response", RIG, "--law", law, "--quiet", "--out", out, *arguments)
    assert not out.exists()


@pytest.mark.parametrize("level, words", [
    *((level, "such as 0.5:10:50") for level in ("-2", "0", "1:2", "1:2:1", "1:2:1000000000")),
    ("2,x", '"x" is no number'), ("inf", '"inf" is no number'), ("2kg", 'unit "kg" of acceleration'),
])  # fmt: skip
def test_impossible_levels(capsys, level, words):
    with pytest.raises(SystemExit, match="2"):
        main(["response", str(RIG), f"--level={level}"])
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and words in said


def test_a_law_over_time_is_refused(tmp_path, refused):
    law, out = tmp_path / "law.json", tmp_path / "out"
    TimeLaw([0.0, 1.0], [[1e3], [2e3]], [[1.0], [1.0]]).save(law)
    assert "over time" in refused("response", RIG, "--law", law, "--level", "2", "--out", out)
    assert not out.exists()


def test_over_level(law, tmp_path, output_of):
    """At 46.5 Hz, between the folds at 6 m/s², the rig jumps up and down over level, too."""
    given = ["--frequency", "46.5", "--from", "3", "--to", "8", "--harmonics", "9", "--quiet", "--out", tmp_path]
    lines = output_of("response", RIG, "--law", law, *given).out.splitlines()
    branch = periodic.follow_response_over_level(Model(Rig.load(RIG), LAW), 46.5, (3.0, 8.0), 9)
    stored = json.loads((tmp_path / "response.json").read_text(encoding="utf-8"))["branches"][0]
    assert stored["over"] == "level" and stored["frequency"] == pytest.approx(46.5) and stored["level"] is None
    folds = [point.level for point in branch.special if point.kind == "fold"]
    assert [jump["at"] for jump in stored["jumps"]] == pytest.approx(folds) and len(folds) == 2
    assert lines[0].startswith("46.5 Hz: ") and "from 3 to 8 m/s²" in lines[0]
    assert any(f"fold at {folds[0]:.6g} m/s²: upwards the vibration jumps from" in line for line in lines)
    levels = [float(row["level"]) for row in csv_rows(tmp_path / "response.csv")]
    np.testing.assert_allclose(levels, np.abs(branch.level[:, 0]))
    assert (tmp_path / "response.png").stat().st_size > 20_000


def test_over_gaps(law, tmp_path, output_of):
    """Of gaps as of the level, which they scale with: docs/periodic.md."""
    given = ["--level", "6", "--frequency", "44", "--over", "gap", "--from", "1", "--to", "2", "--harmonics", "9"]
    lines = output_of("response", RIG, "--law", law, *given, "--quiet", "--out", tmp_path).out.splitlines()
    branch = periodic.follow_response_over(Model(Rig.load(RIG), LAW), "gap", (1.0, 2.0), 44.0, 6.0, 9)
    stored = json.loads((tmp_path / "response.json").read_text(encoding="utf-8"))["branches"][0]
    assert (stored["over"], stored["level"], stored["frequency"]) == ("gap", 6.0, pytest.approx(44.0))
    assert [p["at"] for p in stored["special"]] == pytest.approx([branch.share[p.index] for p in branch.special])
    assert lines[0].startswith("6 m/s² at 44 Hz: ") and "points from 1 to 2 × gaps" in lines[0]
    shares = [float(row["share_of_gaps"]) for row in csv_rows(tmp_path / "response.csv")]
    np.testing.assert_allclose(shares, branch.share)
    assert (tmp_path / "response.png").stat().st_size > 20_000


def test_random_starts_and_period_doublings(law, tmp_path, output_of, monkeypatch):
    """At 48 Hz and 6 m/s² the Table-1 rig has one vibration, which every start comes to; its period doubles nowhere."""
    monkeypatch.setattr("clearance_mj.cli.response.find_isolas", partial(periodic.find_isolas, frequencies=[48.0]))
    given = ["--level", "6", "--from", "47.5", "--to", "49", "--harmonics", "5", "--isolas", "2", "--period-doublings"]
    said = output_of("response", RIG, "--law", law, *given, "--quiet", "--out", tmp_path).out
    assert "0 more branches from random starts, of which 0 % came to none that repeats" in said
    stored = json.loads((tmp_path / "response.json").read_text(encoding="utf-8"))
    assert len(stored["branches"]) == 1
    assert stored["isolas"] == [{"level": 6.0, "new": 0, "frequency": [48.0], "shares": [[1.0, 0.0]]}]


def test_unbalance_over_the_speed(tmp_path, answer):
    """A Jeffcott rotor: its free circle, and first contact where tests/periodic/test_space_whirl.py has it."""
    unbalanced(jeffcott()).save(tmp_path / "rotor.toml")
    out, hz = tmp_path / "out", FREQUENCY / (2 * np.pi)
    given = ["--kind", "unbalance", "--level", "0.5,1", "--from", 0.8 * hz, "--to", hz, "--harmonics", 1, "--quiet"]
    half, one = answer("response", tmp_path / "rotor.toml", *given, "--out", out)["branches"]
    assert (half["kind"], half["level"], one["level"]) == ("unbalance", 0.5, 1.0)
    (contact,) = [point["frequency"] for point in one["special"] if point["kind"] == "first contact"]
    assert contact / hz == pytest.approx(0.9252, rel=1e-4)
    first = csv_rows(out / "response.csv")[0]
    assert first["level_unit"] == "× unbalance"
    assert float(first["spin_rad_s"]) == pytest.approx(0.8 * FREQUENCY)
    radius = 0.5 * 0.2 * 0.8**2 / np.hypot(1 - 0.8**2, 0.1 * 0.8) * GAP
    assert float(first["clearance_displacement_1:+Y_fundamental_m"]) == pytest.approx(radius, rel=1e-4)
    assert (out / "response.png").stat().st_size > 20_000
