"""clearance-mj hammer: from files of hits to FRFs, hits and modes; who is the hammer, and where everything is."""

import json

import numpy as np
import pytest

import clearance_mj as cm

from ..signals.test_hammer import DAMPING, FREQUENCY, FS, beam


def table(path, record, header):
    time = np.arange(record.excitation.size) / FS
    columns = np.column_stack((time, record.excitation, record.acceleration.T / 9.80665))
    np.savetxt(path, columns, "%.8g", ",", header=header, comments="")
    return path


def test_a_file_of_hits(tmp_path, answer, refused, capsys):
    """Modes of the closed form from a CSV with names of its own; the hammer is the only force, or named."""
    file = table(tmp_path / "a.csv", beam(), "Time [s],Hammer [N],A1 [g],A2 [g]")
    places = ["--column", "A1=acc:1 [g]", "--column", "A2=acc:2 [g]"]
    out = tmp_path / "test"
    said = answer("hammer", file, "--at", "2:+Z", *places, "--band", 5, 250, "--out", out)
    assert said["averaged"] == 4 and [hit["fault"] for hit in said["hits"]] == [""] * 4
    np.testing.assert_allclose(said["frequency"], FREQUENCY, rtol=1e-3)
    np.testing.assert_allclose(said["damping"], DAMPING, rtol=0.03)
    assert json.loads((out / "hammer.json").read_text())["window_rate"] == said["window_rate"] > 0
    assert cm.read(out / "frf.uff").window_rate == pytest.approx(said["window_rate"], rel=1e-8)
    assert {path.name for path in out.iterdir()} >= {"frf.uff", "hammer.json", "hits.png", "frf.png"}
    named = answer("hammer", file, "--at", "2:+Z", "--hammer", "Hammer", *places, "--modes", 0, "--out", tmp_path / "b")
    assert named["hits"] == said["hits"] and named["frequency"] == []
    assert 'does not say where "A1" is' in refused("hammer", file, "--at", "2:+Z", "--out", tmp_path / "c")
    assert 'does not say where "Hammer" pushes' in refused("hammer", file, *places, "--out", tmp_path / "c")
    assert '"A1" is no force' in refused("hammer", file, "--hammer", "A1", *places, "--out", tmp_path / "c")
    assert "one for each of the 1 files" in refused("hammer", file, "--at", "1:+Z", "2:+Z", *places)
    assert not (tmp_path / "c").exists()


def test_files_of_a_roving_hammer(tmp_path, answer):
    header = "Time [s],Hammer [N],A [g]"
    files = [table(tmp_path / f"{i}.csv", beam((0.1,), (60.0,), f"{i}:+Z", ("2:+Z",), 2.5), header) for i in (1, 2)]
    answer("hammer", *files, "--at", "1:+Z", "2:+Z", "--sensor-at", "2:+Z", "--out", tmp_path / "out")
    frf = cm.read(tmp_path / "out" / "frf.uff")
    assert (frf.references, frf.responses) == (("1:+Z", "2:+Z"), ("2:+Z",))


RIG = """
name = "one mass on a base"
bushings = []
[structure]
kind = "matrices"
units = "m-kg-s"
mass = [[1.0]]
stiffness = [[142122.3]]
damping = [[3.77]]
dofs = ["1:Z"]
[shaker]
kind = "base"
position = "1:+Z"
[[sensors]]
node = 1
position = "1:+Z"
"""


def test_hammer_and_shaken_base_in_one_dataset(tmp_path, rng, answer, refused):
    """Each record has its own input: what the rig's shaker does, or a force where no base was recorded."""
    rig = tmp_path / "rig.toml"
    rig.write_text(RIG)
    time = np.arange(2048) / 1024
    for name, header in (("shaken", "base"), ("hit", "force")):
        values = np.column_stack((time, rng.standard_normal((2048, 2))))
        np.savetxt(tmp_path / f"{name}.csv", values, "%.8g", ",", header=f"time,{header},acc:1", comments="")
    answer("convert", tmp_path / "shaken.csv", tmp_path / "hit.csv", tmp_path / "set", "--rig", rig)
    records = cm.Dataset.load(tmp_path / "set").records
    assert [(r.name, r.excitation_kind) for r in records] == [("shaken", "base"), ("hit", "force")]
    assert records[1].response().reference == "200:+Z"
    asked = ("convert", tmp_path / "hit.csv", tmp_path / "set", "--kind", "base")
    assert 'the excitation of a record of kind "base"' in refused(*asked)
    rig.write_text(RIG.replace('position = "1:+Z"\n[[', "[["))
    assert "give [shaker] its position" in refused("convert", tmp_path / "hit.csv", tmp_path / "other", "--rig", rig)


def test_frf_of_hits_by_convert(tmp_path, answer, capsys):
    """No Hann window on hits, unless it is asked for: the damping of one mass, 0.5 %, stays what it is."""
    rig = tmp_path / "rig.toml"
    rig.write_text(RIG.replace('kind = "base"', 'kind = "force"'))
    time, w, ratio = np.arange(round(11 * FS)) / FS, 2 * np.pi * 60, 0.005
    force, motion = np.zeros(time.size), np.zeros(time.size)
    damped = w * np.sqrt(1 - ratio**2)
    for start, peak in ((1000, 100.0), (5500, 140.0), (10000, 90.0), (14500, 120.0), (19000, 110.0)):
        force[start] = peak  # one sample: an impulse of peak / fs, with acceleration peak and -w² times the decay
        t = time[start:] - time[start]
        decay = np.exp(-ratio * w * t) / FS * peak
        slope = (1 - 2 * ratio**2) * w**2 / damped * np.sin(damped * t) + 2 * ratio * w * np.cos(damped * t)
        motion[start:] -= decay * slope
        motion[start] += peak + peak / FS * ratio * w  # the trapezium's half of the first sample of the decay
    table = np.column_stack((time, force, motion))
    np.savetxt(tmp_path / "a.csv", table, "%.9g", ",", header="time,force,acc:1", comments="")
    dampings = []
    for more in ((), ("--window", "hann")):
        answer("convert", tmp_path / "a.csv", tmp_path / "a.uff", "--rig", rig, "--frf", 0.5, "--band", 40, 80, *more)
        dampings.append(cm.extract_modes(cm.read(tmp_path / "a.uff", what="frf"), 1).damping[0])
    assert dampings[0] == pytest.approx(ratio, rel=0.01) and dampings[1] > 1.1 * ratio
