"""clearance-mj new: numbers that were given, examples where none were, contacts out of material and geometry."""

import json
import re

import pytest

from clearance_mj import Rig
from clearance_mj.clearance.bushing_layer import layer_contact
from clearance_mj.cli import main
from clearance_mj.structure import Section, Support

from .test_new import new


def test_steps_supports_and_discs(tmp_path):
    """What a drawing says is in the file: a cylinder has m (3 r² + w²)/12 about a diameter, m r²/2 about its axis."""
    options = "--step 0.3 20mm --step 0.2 16mm 8mm --support 0.02 pinned --support 0.5 2e6:300 --disc 0.25 2 120mm 20mm"
    shaft = new(tmp_path, "mine", *options.split(), "--young-modulus", 2e11).structure
    assert shaft.sections == (Section(0.3, 0.02), Section(0.2, 0.016, 0.008))
    bearing = Support(0.5, translation=2e6, translation_damping=300.0)
    assert shaft.supports == (Support(0.02, "pinned"), bearing)
    (disc,) = shaft.discs
    assert disc.inertia == pytest.approx(2 * (3 * 0.06**2 + 0.02**2) / 12, rel=5e-6)  # six digits
    assert disc.about_axis == pytest.approx(2 * 0.06**2 / 2, rel=1e-6)


def test_a_tube(tmp_path):
    rig = new(tmp_path, "mine", "--inner-diameter", "6mm", "--diameter", "10mm")
    assert rig.structure.sections[0].inner_diameter == (0.006, 0.006)


def test_a_shaft_that_turns_has_bearings(tmp_path):
    rig = new(tmp_path, "rotor", "--spin", "3000rpm", "--length", 0.5, "--diameter", "18mm")
    assert [(s.position, s.kind, s.translation) for s in rig.structure.supports] == [
        (0.0, "elastic", 1e7), (0.5, "elastic", 1e7),
    ]  # fmt: skip
    assert [section.diameter for section in rig.structure.sections] == [(0.018, 0.018)]


GIVEN = ["--length", 0.62, "--diameter", 0.01, "--young-modulus", 2e11, "--density", 7800, "--rayleigh", 0.1, 1e-6]
GIVEN += ["--bushings", 0.4, "--gap", 1e-4, "--bushing-length", 0.01, "--grease", 4e3, 3, "--sensors", 0.2, 0.4]


def test_examples_are_what_nobody_gave(tmp_path, capsys):
    """Named in the file, marked there, uncertain, printed and in the JSON; a file of which all was given has none."""
    path = tmp_path / "rig.toml"
    assert main(["new", "mine", *map(str, GIVEN), "--out", str(path), "--json"]) == 0
    examples = ["bushings.contact.stiffness", "bushings.contact.damping"]
    assert json.loads(capsys.readouterr().out)["examples"] == examples
    marked = re.findall(r"(?m)^(\w+) = .*# EXAMPLE", path.read_text(encoding="utf-8"))
    assert marked == ["stiffness", "damping"]
    rig = Rig.load(path)
    assert list(rig.examples) == examples == [tolerance.of for tolerance in rig.tolerances]
    assert main(["new", "mine", *map(str, GIVEN), "--contact", "2e6", "9", "--out", str(tmp_path / "own.toml")]) == 0
    assert "nobody gave" not in capsys.readouterr().out
    bare = Rig.load(tmp_path / "own.toml")
    assert bare.examples == () == bare.tolerances


def test_a_mass_says_that_it_has_no_inertia(tmp_path, capsys):
    assert main(["new", "mine", "--mass", "0.4", "450g", "--out", str(tmp_path / "rig.toml")]) == 0
    assert "masses are points without inertia; --disc" in capsys.readouterr().out


def test_a_contact_of_material_and_thickness(tmp_path):
    """Stiffness, depth that is borne and tolerance are those of `layer_contact`, of the section in the bushing."""
    steps = "--step 0.3 20mm --step 0.2 16mm --bushings 0.4 --gap 0.1mm --bushing-length 12mm".split()
    rig = new(tmp_path, "mine", *steps, "--bushing-material", "pom", "--bushing-thickness", "2mm")
    layer = layer_contact("pom", 2e-3, 0.012, 8e-3, 1e-4)
    contact = rig.bushings[0].contact
    assert contact.stiffness == pytest.approx(layer.stiffness, rel=5e-3)
    assert contact.bearable_depth == pytest.approx(layer.bearable_depth, rel=5e-3)
    std = {tolerance.of: tolerance.size for tolerance in rig.tolerances}["bushings.contact.stiffness"]
    assert std == pytest.approx(layer.spread, abs=5e-3)
    assert "bushings.contact.stiffness" not in rig.examples
