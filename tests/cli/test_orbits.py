"""clearance-mj orbits and campbell: what the Python calls find, as files; bad input."""

import json

import matplotlib.image
import numpy as np
import pytest

from clearance_mj import Bushing, Contact, Grease, Rig, Sensor
from clearance_mj.core.output_folder import FIGURES
from clearance_mj.rig import Spin, Unbalance
from clearance_mj.rotors import campbell, turning_shaft, unbalance_response
from clearance_mj.rotors.diagram import whirl_names
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

from ..conftest import ROOT
from .conftest import csv_rows

PLANAR = ROOT / "models" / "table1_rig.toml"
SPIN, MOMENT = 100.0, 2e-5


@pytest.fixture
def rig(tmp_path):
    """A disc of 3 kg on a shaft of 20 mm, softer along y at one end, that stays within the gap of its bushing."""
    supports = Support(0.0, "pinned"), Support(1.0, translation=2e6, translation_y=1e6)
    disc = Disc(0.35, 3.0, 0.01, polar_inertia=0.02)
    steel = Material(2.1e11, 7800.0)
    shaft = Shaft((Section(1.0, (0.02, 0.02)),), supports, (disc,), steel, (20.0, 0.0))
    bushing = Bushing(0.6, 5e-4, 0.02, Grease(0.0, 0.0), Contact(2e6, 50.0), shape="round")
    made = Rig(
        "rotor", None, (bushing,), (Sensor(1, 0.35),), structure=shaft, spin=Spin(SPIN),
        unbalances=(Unbalance(0.35, MOMENT, 0.5),),
    )  # fmt: skip
    made.save(tmp_path / "rotor.toml")
    return made


def test_a_rig_is_simulated_and_its_1x_is_that_of_the_linear_theory(rig, tmp_path, answer):
    result = answer("orbits", tmp_path / "rotor.toml", "--duration", 6, "--fs", 1024, "--out", tmp_path / "out")
    (of,) = result["bushings"]
    shaft = turning_shaft(rig, 8)
    y, z = (shaft.shapes([0.6]) @ shaft.under_unbalances([SPIN]))[0, :, 0]
    forward, backward = (y + 1j * z) / 2, np.conj((y - 1j * z) / 2)
    assert of["forward"] == pytest.approx(abs(forward), rel=2e-3)
    assert of["backward"] == pytest.approx(abs(backward), rel=5e-3)
    assert of["forward_phase"] == pytest.approx(np.angle(forward), abs=5e-3)
    assert of["major"] == pytest.approx(abs(forward) + abs(backward), rel=2e-3)
    assert of["largest_radius_over_gap"] == pytest.approx(of["major"] / 5e-4, rel=0.01)
    assert of["spin"] == pytest.approx(SPIN, rel=1e-6) and of["turns"] == 8
    assert sorted(p.name for p in (tmp_path / "out").glob("[!.]*")) == ["full_spectra.png", "orbits.json", "orbits.png"]
    stored = json.loads((tmp_path / "out" / "orbits.json").read_text(encoding="utf-8"))
    assert stored["bushings"] == result["bushings"] and stored["rig"] == rig.to_dict()
    assert "rotor.toml" in str(stored["provenance"]["inputs"])


def test_a_response_of_a_run_up_is_drawn_over_its_speed(rig, tmp_path, answer, refused):
    rig.replace(spin=Spin(40.0, 30.0, 130.0)).save(tmp_path / "up.toml")
    given = ["--rms", 0, "--engine", "modal", "--duration", 4, "--fs", 1024, "--out", tmp_path / "up.nc"]
    answer("simulate", tmp_path / "up.toml", *given)
    result = answer("orbits", tmp_path / "up.nc", "--turns", 5, "--out", tmp_path / "out")
    names = ["orbits.png", "full_spectra.png", "waterfall.png", "bode.png"]
    assert result["figures"] == [str(tmp_path / "out" / name) for name in names]
    assert all(np.ptp(matplotlib.image.imread(path)) > 0.5 for path in result["figures"])
    assert result["bushings"][0]["spin"] == pytest.approx(130.0, rel=1e-3)
    assert "simulated already; leave it out" in refused("orbits", tmp_path / "up.nc", "--gap", "x0.5")
    assert "--drop 9: must be in 0 to less than" in refused("orbits", tmp_path / "up.nc", "--drop", "9")
    assert "--turns 0: must be at least 1" in refused("orbits", tmp_path / "up.nc", "--turns", "0")


def test_what_has_no_orbits_is_refused_before_anything_is_computed(rig, tmp_path, refused, answer):
    assert 'give its bushings shape = "round"' in refused("orbits", PLANAR)
    assert "there is no such file" in refused("orbits", tmp_path / "none.nc")
    answer("simulate", PLANAR, "--engine", "modal", "--duration", 0.5, "--out", tmp_path / "plane.nc")
    assert 'give its bushings shape = "round"' in refused("orbits", tmp_path / "plane.nc", "--out", tmp_path / "out")


def test_campbell_writes_what_the_call_finds(rig, tmp_path, answer, refused):
    given = ["--speeds", "0", "9000rpm", "--points", 11, "--n", 4, "--out", tmp_path / "out"]
    result = answer("campbell", tmp_path / "rotor.toml", *given)
    expected = campbell(rig, np.linspace(0.0, 300 * np.pi, 11), 4)
    criticals = expected.criticals
    assert [row["whirl"] for row in result["critical_speeds"]] == list(criticals.whirl) and len(criticals) >= 2
    speeds = [row["spin_rad_s"] for row in result["critical_speeds"]]
    np.testing.assert_allclose(speeds, criticals.spin_rad_s, rtol=1e-12)
    assert [float(row["spin_rad_s"]) for row in csv_rows(tmp_path / "out" / "critical_speeds.csv")] == speeds
    assert result["threshold"] is None and result["operating"] == [SPIN, SPIN]  # of the rig's spin
    rows = csv_rows(tmp_path / "out" / "campbell.csv")
    np.testing.assert_allclose([float(r["frequency_hz"]) for r in rows], expected.frequency.ravel(), rtol=1e-12)
    assert [int(r["mode"]) for r in rows] == list(np.repeat([1, 2, 3, 4], 11))
    assert [r["whirl"] for r in rows] == whirl_names(expected.sense).ravel().tolist()
    assert float(rows[10]["spin_rad_s"]) == pytest.approx(300 * np.pi)
    assert np.ptp(matplotlib.image.imread(tmp_path / "out" / "campbell.png")) > 0.5
    for kind, head in (("svg", b"<?xml"), ("pdf", b"%PDF")):
        assert not (tmp_path / "out" / f"campbell.{kind}").exists()
        answer("campbell", tmp_path / "rotor.toml", *given, "--figures", kind)
        assert (tmp_path / "out" / f"campbell.{kind}").read_bytes().startswith(head)
    here = tmp_path / "rotor.toml"
    assert "must rise, from 0 on" in refused("campbell", here, "--speeds", "3", "1", "--figures", "svg")
    assert FIGURES.get() == ()  # a command that fails leaves nothing to the next one
    assert "--speeds 3 1 rad/s: must rise, from 0 on" in refused("campbell", here, "--speeds", "3", "1")
    assert "--points 1: must be at least 2" in refused("campbell", here, "--speeds", "0", "1", "--points", "1")
    assert "does not say how fast it turns; give --speeds FROM TO" in refused("campbell", PLANAR)
    assert "must be above 0 and not fall" in refused("campbell", here, "--operating", "90", "80")
    beyond = answer("campbell", here, "--operating", 90, 400, "--points", 11, "--out", tmp_path / "beyond")
    assert beyond["speed"] == [0.0, pytest.approx(1.5 * 400)]  # the operating speed, which is the faster one


def test_unbalance_writes_what_the_call_finds(rig, tmp_path, answer, refused, output_of):
    given = "--speeds", 0, 300, "--points", 50, "--out", tmp_path / "out"
    result = answer("unbalance", tmp_path / "rotor.toml", *given)
    expected = unbalance_response(rig, np.linspace(0.0, 300.0, 50), (SPIN, SPIN))  # margins count from the rig's spin
    assert result["critical_speeds"] == expected.criticals.to_dict("records")
    rows = csv_rows(tmp_path / "out" / "unbalance.csv")
    assert [r["probe"] for r in rows[:: expected.speed.size]] == ["1:+Z", "301:+Y", "301:+Z"]
    for name, want in (("amplitude_um_pp", 1e6 * expected.amplitude), ("phase_lag_deg", expected.phase_lag)):
        np.testing.assert_allclose([float(r[name]) for r in rows], want.ravel(), rtol=1e-12)
    assert {r["probe"] for r in csv_rows(tmp_path / "out" / "critical_speeds.csv")} == set(expected.criticals.probe)
    assert np.ptp(matplotlib.image.imread(tmp_path / "out" / "unbalance.png")) > 0.5
    arguments = "unbalance", tmp_path / "rotor.toml", "--gap", "0.01mm", "--out", tmp_path / "narrow"
    said = output_of(*arguments)
    assert "301:+Y, 301:+Z: wider than the clearance" in said.err
    assert "critical speeds up to 1432.4 rev/min:" in said.out and "required_margin_percent" in said.out
    rig.replace(unbalances=()).save(tmp_path / "balanced.toml")
    assert "has no unbalances" in refused("unbalance", tmp_path / "balanced.toml")
