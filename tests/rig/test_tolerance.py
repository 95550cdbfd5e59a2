"""Tolerances of a rig file: what they mean in SI units, and what is refused."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearance_mj.core.errors import RigError
from clearance_mj.rig import Rig, Tolerance

from ..refusals import assert_refused

FILE = Path(__file__).parents[2] / "models" / "table1_rig.toml"


@pytest.mark.parametrize("of, std, size, relative", [
    ("beam.young_modulus", "3 %", 0.03, True),
    ("beam.young_modulus", "5 GPa", 5e9, False),
    ("bushings[0].position", "2 mm", 2e-3, False),
    ("sensors.position", "150 µm", 150e-6, False),
    ("masses[0].mass", "12 g", 0.012, False),
    ("bushings.grease.stiffness", "0.4 N/mm", 400.0, False),
    ("beam.clamp.rotation", "6 mm", 6e-3, False),
    ("sensors[0].gain", "0 %", 0.0, True),
    ("bushings[0].friction.coefficient", "0.02", 0.02, False),
])  # fmt: skip
def test_sizes(of, std, size, relative):
    tolerance = Tolerance(of, std)
    assert (tolerance.size, tolerance.relative) == (pytest.approx(size), relative)


@given(st.text(max_size=20), st.text(max_size=20))
def test_any_text_is_taken_or_refused_in_one_line(of, std):
    try:
        Tolerance(of, std)
    except RigError as error:
        assert "tolerance" in str(error)


@pytest.mark.parametrize("of, std, words", [
    ("beam.young_modulus", "-3 %", 'std "-3 %" is negative; 0 stands for an exact value'),
    ("beam.young_modulus", "3", 'std "3" has no unit: a number and one of the units %, Pa, MPa, GPa'),
    ("beam.young_modulus", "3 mm", "has a unit that beam.young_modulus has not: a number and one of the units %, Pa"),
    ("beam.young_modulus", "few %", "is no standard deviation"),
    ("beam.young_modulos", "3 %", 'of "beam.young_modulos" names no number with a tolerance; known: position'),
    ("bushings[7].gap", "3 %", "bushings[7].gap leads nowhere: bushings has 2 entries"),
    ("beam.clamp.rotation", "3 %", "has a unit that beam.clamp.rotation has not: a number and one of the units m, mm"),
    ("structure.discs[0].mass", "3 %", "structure.discs[0].mass leads nowhere"),
])  # fmt: skip
def test_refused_with_the_place_in_the_file(of, std, words):
    data = tomllib.loads(FILE.read_text(encoding="utf-8")) | {"tolerances": [{"of": of, "std": std}]}
    assert words in assert_refused(RigError, r"^tolerances", Rig.from_dict, data)


def test_a_rig_with_tolerances_is_saved_and_compared(tmp_path):
    rig = Rig.load(FILE).replace(tolerances=(Tolerance("bushings.gap", "10 %"), Tolerance("sensors[0].gain", "0.2 %")))
    rig.save(tmp_path / "rig.toml")
    assert Rig.load(tmp_path / "rig.toml") == rig
    assert hash(rig) == hash(Rig.load(tmp_path / "rig.toml")) != hash(Rig.load(FILE))
