"""clearance-mj vehicle: what it writes, and one clear line with status 2 for bad input."""

import csv
import json
import re

import pytest

from clearance_mj.core import tasks


def test_report_of_runs(tmp_path, answer, monkeypatch):
    monkeypatch.setattr(tasks, "_on_processes", tasks._on_threads)
    out = tmp_path / "out"
    case = ("--speed", "72", "--controller", "smc,smc-cm", "--gap", "0.2deg")
    printed = answer("vehicle", *case, "--quiet", "--out", out)
    smc, model = printed["runs"]
    assert model["peak_e_y"] < smc["peak_e_y"] and printed["timing"]["smc"]["median"] > 0
    assert json.loads((out / "summary.json").read_text())["runs"] == printed["runs"]
    with (out / "histories_smc-cm.csv").open(encoding="utf-8") as file:
        errors = [abs(float(row["e_y_m"])) for row in csv.DictReader(file)]
    assert max(errors) == pytest.approx(model["peak_e_y"], rel=1e-6)
    page = (out / "report.html").read_text(encoding="utf-8")
    without_comment = page.replace("/*! https://github.com/leeoniya/uPlot (v1.6.32) */", "")  # of the charts' code
    names = ("http://www.w3.org", "http://purl.org", "http://creativecommons.org")  # of formats
    assert "http" not in re.sub("|".join(map(re.escape, names)), "", without_comment) and "SMC-CM" in page
    assert all((out / "figures" / f"{name}.png").read_bytes()[:4] == b"\x89PNG" for name in ("paths", "histories"))


def test_manoeuvre_at_its_own_speed(tmp_path, answer):
    """The crowned road at 100 km/h: gravity's share is held off by the wheels, and the page names the manoeuvre."""
    out = tmp_path / "out"
    run = answer("vehicle", "--manoeuvre", "on-centre", "--controller", "smc", "--out", out)["runs"][0]
    assert (run["manoeuvre"], run["speed"]) == ("on-centre", 100.0)
    assert run["peak_lateral_acceleration"] > 0.025 * 9.81
    assert "Straight, crowned road, 100 km/h" in (out / "report.html").read_text(encoding="utf-8")


BAD = {
    "speed": (["--speed", "400"], "speed must be in 18..180 km/h, got 400"),
    "path": (["--speed", "178"], "needs a lateral acceleration of 11.0 m/s²"),
    "short path": (["--speed", "170", "--length-factor", "2"], "needs a lateral acceleration of 15.7 m/s²"),
    "large gap": (["--gap", "6deg"], "steering.half_gap must be in 0..0.0872665, got 0.10472"),
    "plugin": (["--plugin", "none.py"], "--plugin none.py: no such file"),
    "controller": (["--controller", "smc,pid"], 'controller "pid" is unknown; use smc, smc-cm'),
    "gap without unit": (["--gap", "0.2"], 'gap "0.2" has no unit; give an angle at the road wheel (0.2deg'),
    "assumed gap": (["--assumed-gap", "much"], 'gap "much" is not a gap'),
    "regime": (["--regime", "wet"], 'regime "wet" is unknown; use torque, friction'),
    "manoeuvre": (["--manoeuvre", "moose"], 'manoeuvre "moose" is unknown; use lane-change, slalom, obstacle-40'),
    "manoeuvre's length": (["--manoeuvre", "slalom", "--length-factor", "2"], 'manoeuvre "slalom" has none'),
    "plant": (["--plant", "tank"], 'plant "tank" is unknown; use multi-body, single-track'),
    "length": (["--length-factor", "0"], "length_factor must be > 0"),
    "seed": (["--seed", "-1"], "seed must be >= 0"),
}


@pytest.mark.parametrize("bad", BAD)
def test_bad_input(bad, tmp_path, refused):
    arguments, words = BAD[bad]
    assert words in refused("vehicle", *arguments, "--out", tmp_path / "out") and not (tmp_path / "out").exists()
