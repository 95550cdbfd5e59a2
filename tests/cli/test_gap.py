"""``--gap``: what a model would do with other bushings."""

import json

import pytest

import clearance_mj as cm
from clearance_mj.cli import Parser, find
from clearance_mj.io.results import load

RIG = "models/table1_rig.toml"
SHORT = "--engine", "modal", "--duration", 2, "--rms", 2


def test_simulate_with_half_the_gap(answer, tmp_path):
    """As the rig file with half the gap does; a smaller gap is used up more of the time."""
    cm.Rig.load(RIG).with_gap(1.5e-4).save(tmp_path / "half.toml")
    as_it_is = answer("simulate", RIG, *SHORT, "--out", tmp_path / "own.nc")
    half = answer("simulate", RIG, *SHORT, "--gap", "x0.5", "--out", tmp_path / "half.nc")
    expected = answer("simulate", tmp_path / "half.toml", *SHORT, "--out", tmp_path / "expected.nc")
    assert all(half[key] == expected[key] for key in ("contact_share", "acceleration_rms"))
    assert all(a > b for a, b in zip(half["contact_share"], as_it_is["contact_share"]))
    named = answer("simulate", RIG, *SHORT, "--gap", "6:+Z=0.15mm", "--gap", "7:+Z=x0.5", "--out", tmp_path / "n.nc")
    assert named["contact_share"] == half["contact_share"]
    assert [b["gap"] for b in load(tmp_path / "n.nc").provenance["rig"]["bushings"]] == [1.5e-4, 1.5e-4]


def test_backbones_and_maps_know_it_too(answer, tmp_path):
    answer("backbone", RIG, "--gap", "0.2mm", "--harmonics", 3, "--out", tmp_path / "b")
    written = json.loads((tmp_path / "b" / "backbone.json").read_text())
    assert [b["gap"] for b in written["rig"]["bushings"]] == [2e-4, 2e-4]


def test_options_take_units():
    parser = Parser()
    commands = parser.add_subparsers()
    for name in ("rattle-map", "simulate", "response"):
        find(name).add(commands)
    given = parser.parse_args(["rattle-map", RIG, "--gaps", "0.1mm,5mil", "--to", "0.3kHz"])
    assert given.gaps == (1e-4, 1.27e-4) and given.stop == 300.0
    assert parser.parse_args(["rattle-map", RIG, "--gaps", "0.1mm:0.3mm:3"]).gaps == pytest.approx((1e-4, 2e-4, 3e-4))
    given = parser.parse_args(["simulate", RIG, "--duration", "1.5min", "--band", "5", "1kHz", "--fs", "4.096kHz"])
    assert (given.duration, given.band, given.fs) == (90.0, (5.0, 1000.0), 4096.0)
    assert parser.parse_args(["response", RIG, "--frequency", "20,0.03kHz"]).frequency == (20.0, 30.0)


@pytest.mark.parametrize("given, words", [
    (["--gap", "half"], '"half" is no number, alone or with a unit: m, mm'),
    (["--gap", "9:+Z=x0.5"], "the rig has 6:+Z, 7:+Z"),
    (["--gap", "x0.5", "--gap", "7:+Z=x0.5"], "give one for all, or BUSHING=VALUE of each"),
])  # fmt: skip
def test_what_is_refused(refused, tmp_path, given, words):
    assert words in refused("simulate", RIG, *SHORT, *given, "--out", tmp_path / "x.nc")


def test_a_law_over_amplitude_belongs_to_its_gap(tmp_path, capsys):
    cm.AmplitudeLaw([3e-4, 6e-4], [1e4, 2e4], [3.0, 3.0]).save(tmp_path / "law.json")
    arguments = ["simulate", RIG, "--law", tmp_path / "law.json", *SHORT, "--gap", "x0.5", "--out", tmp_path / "x.nc"]
    assert cm.cli.main(list(map(str, arguments))) == 0
    assert "was found at the gap before" in capsys.readouterr().err
