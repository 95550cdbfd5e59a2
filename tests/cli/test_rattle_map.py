"""clearance-mj rattle-map: what the Python call finds, as files; first contact and jumps in words; bad input."""

import json

import numpy as np
import pytest

from clearance_mj import Model, Rig, periodic
from clearance_mj.calibrate.free import with_values
from clearance_mj.rig import Spin, Tolerance

from ..conftest import ROOT
from ..periodic.jeffcott import FREQUENCY, jeffcott, unbalanced
from .conftest import LAW, RIG, csv_rows

LEVELS, FREQUENCIES, GAPS = (1.0, 3.5, 6.0), np.linspace(40, 49, 19), (3e-4, 6e-4)


def test_files_hold_what_the_call_finds(law, tmp_path, answer, capsys):
    """At 6 m/s² the Table-1 rig jumps at 46.9 Hz upwards and 45.7 Hz downwards (docs/periodic.md)."""
    out = tmp_path / "out"
    given = ["rattle-map", RIG, "--law", law, "--levels", "1:6:3", "--from", 40, "--to", 49, "--steps", 19]
    given += ["--gaps", "3e-4,6e-4", "--harmonics", 7, "--workers", 1, "--quiet", "--out", out]
    printed = answer(*given)
    stored = json.loads((out / "rattle_map.json").read_text(encoding="utf-8"))
    assert printed == stored | {"out": str(out)}
    settings = {"n_harmonics": 7, "workers": 1}
    rattle = periodic.map_rattle(Model(Rig.load(RIG), LAW), LEVELS, FREQUENCIES, GAPS, **settings)
    assert stored["law"] == LAW.to_dict() and stored["level"] == list(LEVELS) and stored["unknown"] == 0
    np.testing.assert_allclose(np.array(stored["first_contact"], dtype=float), rattle.first_contact, rtol=1e-12)
    jumps = {(j["gap"], j["level"], j["sweep"]): j["frequency"] for j in stored["jumps"]}
    assert jumps[0, 6.0, "up"] == pytest.approx(46.9, abs=0.1)
    assert jumps[0, 6.0, "down"] == pytest.approx(45.7, abs=0.1)
    rows = csv_rows(out / "rattle_map.csv")
    assert len(rows) == 2 * 2 * 3 * 19
    of = [r for r in rows if (r["gap_7:+Z_m"], r["level"], r["sweep"]) == ("0.0006", "3.5", "down")]
    np.testing.assert_allclose([float(r["frequency_hz"]) for r in of], FREQUENCIES)
    np.testing.assert_allclose([float(r["displacement_6:+Z_m"]) for r in of], rattle.displacement[1, 1, 1, :, 0], 1e-12)
    np.testing.assert_allclose([float(r["contact_share_7:+Z"]) for r in rows], rattle.contact_share[..., 1].flat, 1e-12)
    assert (out / "rattle_map.png").stat().st_size > 20_000


def test_it_says_where_it_touches_and_jumps(law, tmp_path, output_of):

    given = ["--levels", "2,6", "--from", "36", "--to", "49", "--steps", "27", "--harmonics", "5", "--workers", "1"]
    lines = output_of("rattle-map", RIG, "--law", law, *given, "--quiet", "--out", tmp_path).out.splitlines()
    assert lines[0].startswith("gap 0.3 mm: touches first from 1.5") and "at 39.5 Hz; rattles in " in lines[0]
    assert any("jumps in sweeps up" in line and "to 6 m/s² and 46.9" in line for line in lines), lines


def test_contacts_as_soft_and_as_stiff_as_their_tolerance_says(tmp_path, answer, refused, capsys):
    """A standard deviation of 50 % is a factor of 1.5 either way; what lies in the gap does not feel it.

    Scatter ends at four standard deviations, which moves one of them by 1e-4.
    """
    rig = Rig.load(RIG)
    rig = rig.replace(tolerances=(*rig.tolerances, Tolerance("bushings.contact.stiffness", "50 %")))
    rig.save(tmp_path / "rig.toml")
    given = ["--levels", "2,6", "--from", 40, "--to", 44, "--steps", 3, "--harmonics", 3, "--workers", 1, "--quiet"]
    result = answer("rattle-map", tmp_path / "rig.toml", *given, "--contact-spread", "--out", tmp_path / "out")
    for name, factor in (("softer", 1 / 1.5), ("stiffer", 1.5)):
        other = periodic.map_rattle(
            Model(with_values(rig, {("bushings", i, "contact", "stiffness"): factor * 7.8e3 for i in range(2)})),
            (2.0, 6.0), np.linspace(40, 44, 3), n_harmonics=3, workers=1,
        )  # fmt: skip
        largest = np.nanmax(other.contact_force, axis=(0, 2, 3))
        np.testing.assert_allclose(result[name]["largest_force"], largest, rtol=1e-4)
        np.testing.assert_allclose(result[name]["first_contact"], result["first_contact"], rtol=1e-6)
    soft, as_drawn, stiff = (np.array(each["largest_depth"]) for each in (result["softer"], result, result["stiffer"]))
    assert np.all(soft > as_drawn) and np.all(as_drawn > stiff) and np.all(stiff > 0)
    words = 'no tolerance of "bushings.contact.stiffness" says how far'
    assert words in refused("rattle-map", RIG, *given, "--contact-spread", "--out", tmp_path / "no")


@pytest.mark.parametrize("arguments, words", [
    (["--levels", "2,1"], "amplitudes must be > 0, at most 1e+12 and increasing"),
    (["--gaps", "1e-4,1e3", "--modes", "0"], "modes must be between 1 and"),
    (["--from", "60", "--to", "40"], "frequencies must be > 0, at most 1e+12 and increasing"),
    (["--steps", "1"], "--steps must be between 2 and"),
    (["--steps", "1000000000"], "--steps must be between 2 and"),
    (["--workers", "0"], "workers must be 1 to 1024"),
])  # fmt: skip
def test_refusals(law, tmp_path, refused, arguments, words):
    out = tmp_path / "out"
    assert words in refused("rattle-map", RIG, "--law", law, "--out", out, *arguments)
    assert not out.exists()


def test_a_map_over_speed_and_unbalance(tmp_path, answer, capsys):
    """A Jeffcott rotor whose file lets it run up: jumps where tests/periodic/test_space_map.py has them."""
    unbalanced(jeffcott()).replace(spin=Spin(FREQUENCY, rate=5.0)).save(tmp_path / "rotor.toml")
    out, hz = tmp_path / "out", FREQUENCY / (2 * np.pi)
    given = ["--kind", "unbalance", "--levels", "0.25,1", "--from", 0.9 * hz, "--to", 4.6 * hz, "--steps", 30]
    result = answer("rattle-map", tmp_path / "rotor.toml", *given, "--harmonics", 1, "--workers", 1, "--out", out)
    assert result["kind"] == "unbalance" and result["unknown"] == 0
    jumps = {jump["sweep"]: jump["frequency"] / hz for jump in result["jumps"]}
    assert jumps == pytest.approx({"up": 4.328, "down": 1.1032}, rel=1e-3)
    rows = csv_rows(out / "rattle_map.csv")
    assert {row["level_unit"] for row in rows} == {"× unbalance"} and "displacement_1:+Z_m" in rows[0]
    assert (out / "rattle_map.png").stat().st_size > 20_000


@pytest.mark.parametrize(
    ("rig", "words"),
    [(None, "rig 'table1' does not turn; give"), (jeffcott(), "rig 'jeffcott' has no unbalances; give")],
)
def test_what_has_no_unbalance_is_refused(tmp_path, refused, rig, words):
    path = RIG if rig is None else tmp_path / "rotor.toml"
    if rig is not None:
        rig.save(path)
    for command in (("rattle-map", "--levels", 1), ("response", "--level", 1)):
        assert words in refused(*command, path, "--kind", "unbalance", "--quiet", "--out", tmp_path / "out")


@pytest.mark.slow
def test_gears_over_mean_torque_and_ripple(tmp_path, capsys, answer):
    """The teeth part from 1.662 N m on, of the rig's orders of 3.5 N m, in proportion to the mean torques."""
    out = tmp_path / "out"
    given = ["rattle-map", ROOT / "models" / "gear_pair.toml", "--loads", "0.5,1", "--levels", "0.1:0.4:4"]
    given += ["--from", 13.333, "--steps", 1, "--harmonics", 31, "--workers", 1, "--quiet", "--out", out]
    np.testing.assert_allclose(answer(*given)["onset"], 1.662 / 3.5 * np.array([[0.5], [1.0]]), rtol=5e-3)
    rows = csv_rows(out / "rattle_map.csv")
    assert len(rows) == 2 * 2 * 4
    assert {row["impacts"] for row in rows if row["load"] == "1.0"} == {"in contact"}
