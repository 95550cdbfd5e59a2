"""Rig files whose numbers were meant in mm, and large or slender rigs that are none."""

import dataclasses
import math
import re
import warnings

import pytest

from clearance_mj import Rig
from clearance_mj.rig import Sensor
from clearance_mj.rig.plausible import ImplausibleRig
from clearance_mj.structure import Material, Section, Shaft, Support

TABLE1 = Rig.load("models/table1_rig.toml")
STEEL = Material(210e9, 7850.0)


def saved(tmp_path, length, diameter, gap=1e-4):
    """File of a steel cantilever with one bushing at half its length."""
    beam = dataclasses.replace(TABLE1.beam, length=length, diameter=diameter)
    bushing = dataclasses.replace(TABLE1.bushings[0], position=length / 2, gap=gap, length=0.0)
    rig = TABLE1.replace(beam=beam, bushings=(bushing,), masses=(), sensors=(Sensor(1, length),))
    rig.save(tmp_path / "rig.toml")
    return tmp_path / "rig.toml"


@pytest.mark.parametrize("length, diameter, gap, words", [
    (620.0, 10.0, 1e-4, "620 m long and 10 m thick weighs 382,253 t: lengths are in metres, and 620 mm is 0.62"),
    (0.62, 10.0, 1e-4, "0.62 m long and 10 m thick weighs 382 t: lengths are in metres, and 10 mm is 0.01"),
    (620.0, 0.01, 1e-4, "620 m long and 0.01 m thick weighs 382 kg: lengths are in metres, and 620 mm is 0.62"),
    (0.62, 0.01, 0.18, "gap 0.18 m is wider than the shaft's radius, 0.005 m, at x = 0.31 m: gaps are radial, in "
     "metres, and 0.18 mm is 0.00018"),
])  # fmt: skip
def test_millimetres(tmp_path, refused, length, diameter, gap, words):
    """A warning in Python, a refusal on the command line. Mass: 7850 kg/m³ π d²/4 L."""
    path = saved(tmp_path, length, diameter, gap)
    with pytest.warns(ImplausibleRig, match=re.escape(words)):
        Rig.load(path)
    assert words in refused("simulate", path, "--out", tmp_path / "out.nc")


@pytest.mark.parametrize("length, diameter, what", [
    (12.0, 1.8, "rotor of a power station, 240 t"),
    (40.0, 0.9, "shaft of a ship, 200 t"),
    (3000.0, 0.127, "drill string"),
    (2.0, 1e-4, "wire"),
    (0.3, 0.5, "disc on a stub"),
    (150.0, 3.0, "girder of 8000 t"),
])  # fmt: skip
def test_what_is_built(tmp_path, length, diameter, what):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rig = Rig.load(saved(tmp_path, length, diameter, gap=diameter / 3))
    assert rig.total_mass == pytest.approx(7850 * math.pi / 4 * diameter**2 * length), what


def test_each_section_has_its_own_radius(tmp_path):
    shaft = Shaft((Section(0.3, 0.04), Section(0.3, 0.004)), (Support(0.0, "clamped"),), material=STEEL, name="rod")
    bushings = tuple(dataclasses.replace(TABLE1.bushings[0], position=x, gap=3e-3, length=0.0) for x in (0.1, 0.5))
    rig = TABLE1.replace(beam=None, structure=shaft, masses=(), bushings=bushings[:1], sensors=(Sensor(1, 0.6),))
    rig.save(tmp_path / "thick.toml")
    assert Rig.load(tmp_path / "thick.toml") == rig
    rig.replace(bushings=bushings[1:]).save(tmp_path / "thin.toml")
    with pytest.warns(ImplausibleRig, match=r"gap 0.003 m is wider than the shaft's radius, 0.002 m, at x = 0.5 m"):
        Rig.load(tmp_path / "thin.toml")
