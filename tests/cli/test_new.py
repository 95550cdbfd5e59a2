"""clearance-mj new: rig files to go on from, and the JSON Schema that editors check them with."""

import copy
import json
import re
import shlex
import tomllib

import jsonschema
import numpy as np
import pytest

from clearance_mj import Beam, Bushing, ConstantLaw, Contact, Grease, PointMass, Rig, RigError, Sensor, Shaker, simulate
from clearance_mj.cli import demo, main
from clearance_mj.rig import rig_schema
from clearance_mj.signals.excitation import random
from clearance_mj.structure import ModalStructure

from ..conftest import ROOT

VALIDATOR = jsonschema.Draft202012Validator(rig_schema())
MISSING = object()

FULL = Rig(
    "full",
    Beam(0.8, 70e9, 2700.0, width=0.02, height=0.01, rayleigh=(0.1, 1e-6)),
    (Bushing(0.3, 1e-4, 0.02, Grease(4369.0, 3.0, 1.0, 1.5, 2e7, 0.0, 1.5, 7.5e-4, 0.1), Contact(1e4, 1.0)),),
    (Sensor(11, 0.3, 0.005),),
    (PointMass(0.7, 0.1, "boss"),),
    Shaker("force", 0.4),
    "every key given",
).to_dict()


def new(folder, *arguments):
    assert main(["new", *map(str, arguments), "--out", str(folder / "rig.toml"), "--json"]) == 0
    return Rig.load(folder / "rig.toml")


def test_a_rig_in_space(tmp_path):
    options = "--kind shaft --length 500mm --gravity 0 0 -9.81 --spin 1500rpm --unbalance 0.3 1e-4 --friction 0.1"
    rig = new(tmp_path, "pump", *options.split(), "--oil", 0.02)
    assert rig.moves_across and rig.gravity == (0.0, 0.0, -9.81) and rig.spin.speed == pytest.approx(50 * np.pi)
    assert [(u.position, u.moment) for u in rig.unbalances] == [(0.3, 1e-4)]
    assert {(b.friction.coefficient, b.film.viscosity, b.grease.stiffness) for b in rig.bushings} == {(0.1, 0.02, 0.0)}
    assert {b.film.width for b in rig.bushings} == {"finite"}  # 12 mm in a shaft of 10 mm
    short = new(tmp_path / "short", "pump", *options.split(), "--oil", 0.02, "--bushing-length", "2.4mm")
    assert {b.film.width for b in short.bushings} == {"short"}


def test_what_is_told_is_in_the_file(tmp_path):
    args = ["--length", 0.8, "--section", 0.02, 0.01, "--young-modulus", 70e9, "--density", 2700, "--rayleigh", 0.1, 0]
    args += ["--bushings", 0.3, 0.6, "--gap", 1.25e-4, "--bushing-length", 0.02, "--contact", 2e4, 1.5]
    args += ["--grease", 4369, 2, "--mass", 0.8, 0.4, "--mass", 0.5, 0.1, "--sensors", 0.3, 0.6, 0.8, "--force-at", 0.1]
    rig = new(tmp_path, "mine", *args)
    bushings = tuple(Bushing(x, 1.25e-4, 0.02, Grease(4369.0, 2.0), Contact(2e4, 1.5)) for x in (0.3, 0.6))
    beam = Beam(0.8, 70e9, 2700.0, width=0.02, height=0.01, rayleigh=(0.1, 0.0))
    sensors = (Sensor(1, 0.3), Sensor(2, 0.6), Sensor(3, 0.8))
    masses = (PointMass(0.8, 0.4), PointMass(0.5, 0.1))
    assert rig == Rig("mine", beam, bushings, sensors, masses, Shaker("force", 0.1)) and not rig.examples


def test_an_example_follows_the_length(tmp_path):
    rig = new(tmp_path, "mine", "--length", 0.5)
    assert [b.position for b in rig.bushings] == [0.55 * 0.5, 0.8 * 0.5]
    assert [s.position for s in rig.sensors] == [0.125, 0.55 * 0.5, 0.8 * 0.5, 0.5]


def test_comments_hold_the_defaults(tmp_path):
    """Every key that has a default is in the file; without the # before it the rig stays the same."""
    rig = new(tmp_path, "mine", "--mass", 1, 0.4)
    text = (tmp_path / "rig.toml").read_text(encoding="utf-8")
    table = tomllib.loads(re.sub(r"(?m)^# (\w+ = [^ ])", r"\1", text))
    assert Rig.from_dict(table) == rig
    unset = re.findall(r"(?m)^# (\w+) = +#", text)
    given = {*table, *table["beam"], *table["bushings"][0], *table["bushings"][0]["grease"], *table["shaker"]}
    assert set(unset) == {
        "width", "height", "damping_ratios", "clamp", "film_height", "to", "position", "direction", "also",
        "bearable_depth", "housing", "planes", "stiffness", "damping", "friction", "film", "radius", "gravity", "spin",
        "moment", "phase", "plate", "shape", "wall", "wear", "relative_to", "fibre", "node",
        "kind", "delay", "name", "force", "torque", "order",
    }  # fmt: skip
    assert {"description", "elastic_ratio", "film_limit", "kind"} <= given
    assert all(line.split("# ")[-1].strip() for line in text.splitlines() if "=" in line)


@pytest.mark.parametrize("kind", ["shaft", "shafts"])
def test_kinds_of_shafts(tmp_path, kind):
    """The example loads, follows the editor's schema, and its comments hold the defaults."""
    rig = new(tmp_path, "mine", "--kind", kind, "--length", 0.5)
    assert rig.structure.kind == kind and {round(shaft.end, 12) for shaft in rig.linear.shafts} == {0.5}
    text = (tmp_path / "rig.toml").read_text(encoding="utf-8")
    VALIDATOR.validate(tomllib.loads(text))
    assert Rig.from_dict(tomllib.loads(re.sub(r"(?m)^# (\w+ = [^ ])", r"\1", text))) == rig
    for word in ("poisson_ratio", "inner_diameter", "theory", "damping_ratios", "translation", "inertia", "offset"):
        assert re.search(rf"(?m)^(# )?{word} =.*# .", text), word


def test_the_next_step_quotes_names_with_blanks(tmp_path, monkeypatch, output_of):
    monkeypatch.chdir(tmp_path)
    assert "next: clearance-mj map FILE... --rig 'my bench.toml': which" in output_of("new", "my bench").out
    monkeypatch.setattr(demo, "RECORDS", {})
    assert main(["demo", "my folder", "--quiet"]) == 0
    text = (tmp_path / "my folder" / "README.txt").read_text(encoding="utf-8")
    commands = [shlex.split(line) for line in text.splitlines() if line.startswith("clearance-mj ")]
    assert [words[-1] for words in commands if words[-2] == "--out"][:2] == ["my folder/rig.toml", "my folder/map.toml"]


def test_numbers_are_as_they_were_meant(tmp_path):
    """Products of floats: 1.6 × 0.0086 is 0.013760000000000001."""
    rig = new(tmp_path, "mine", "--kind", "shafts", "--diameter", 0.0086)
    assert rig.structure.parts[1].sections[0].inner_diameter == (0.01376,) * 2


def test_shafts_rattle_in_each_other(tmp_path):
    rig = new(tmp_path, "mine", "--kind", "shafts")
    assert [b.joined for b in rig.bushings] == [("rod@0.55", "tube@0.55"), ("rod@0.8", "tube@0.8")]


def test_matrices_out_of_files(tmp_path):
    """Files are named from the rig file's folder; the first degree of freedom along Z is the example's."""
    np.save(tmp_path / "m.npy", np.eye(2))
    np.save(tmp_path / "k.npy", [[2e4, -1e4], [-1e4, 1e4]])
    (tmp_path / "dofs.csv").write_text("node,direction\n7,X\n8,Z\n")
    files = [tmp_path / name for name in ("m.npy", "k.npy", "dofs.csv")]
    (tmp_path / "rigs").mkdir()
    rig = new(tmp_path / "rigs", "mine", "--kind", "matrices", "--units", "m-kg-s", "--file", *files)
    assert rig.sensor_labels == ["8:+Z"] and rig.bushings[0].position == "8:Z"
    tables = tomllib.loads((tmp_path / "rigs" / "rig.toml").read_text())
    assert tables["structure"] == {
        "kind": "matrices", "units": "m-kg-s", "mass": "../m.npy", "stiffness": "../k.npy", "dofs": "../dofs.csv",
    }  # fmt: skip
    VALIDATOR.validate(tables)


def test_places_of_a_mujoco_model(tmp_path):
    """A site that moves along Z is the example; places with names have sensors 1, 2, ..."""
    arm = '<body><joint axis="0 1 0" stiffness="9"/><geom size=".1" pos="1 0 0"/><site name="tip" pos="1 0 0"/></body>'
    (tmp_path / "model.xml").write_text(f'<mujoco><option gravity="0 0 0"/><worldbody>{arm}</worldbody></mujoco>')
    rig = new(tmp_path, "mine", "--kind", "mjcf", "--file", tmp_path / "model.xml")
    assert rig.bushings[0].position == "tip:Z" and rig.sensor_labels == ["1:+Z"]
    assert simulate(rig, random(0.1, 512, (5, 100), 1.0, 0), ConstantLaw(1e4, 4.0), "modal").acceleration.any()


def test_modes_of_a_hammer_test_are_driven_by_a_force(tmp_path):
    """They do not tell how a shaken base drives them."""
    tested = ModalStructure((9.0,), (0.01,), ("3:+Z", "4:+Z"), ((0.5,), (1.0,)))
    tested.write_csv(tmp_path / "modes.csv")
    rig = new(tmp_path, "mine", "--kind", "modes", "--file", tmp_path / "modes.csv")
    assert rig.shaker == Shaker("force", "3:+Z")


def test_modes_out_of_a_file_that_is_still_to_come(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "mine", "--kind", "modes", "--file", "test.csv"]) == 0
    assert "test.csv is not there yet; the rig can be loaded once it is" in capsys.readouterr().out
    tables = tomllib.loads((tmp_path / "mine.toml").read_text())
    assert tables["structure"] == {"kind": "modes", "file": "test.csv"}
    VALIDATOR.validate(tables)


def test_kind_is_asked_for_at_a_terminal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    answers = iter(["mine", "modes", ""])
    monkeypatch.setattr("builtins.input", lambda question: next(answers))
    assert main(["new"]) == 0
    assert tomllib.loads((tmp_path / "mine.toml").read_text())["structure"] == {"kind": "modes", "file": "modes.uff"}


def test_schema_is_named_in_the_file(tmp_path):
    schema = tmp_path / "editor" / "rig.schema.json"
    new(tmp_path, "mine", "--schema", schema)
    assert (tmp_path / "rig.toml").read_text().startswith("#:schema ./editor/rig.schema.json\n")
    assert json.loads(schema.read_text()) == rig_schema()


def test_schema_alone(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "--schema", "rig.schema.json"]) == 0
    assert [p.name for p in tmp_path.iterdir()] == ["rig.schema.json"]
    assert capsys.readouterr().out == "written: rig.schema.json\n"


def test_schema_of_datasets(tmp_path):
    """It takes the list of the shipped dataset, and refuses what the reader refuses."""
    assert main(["new", "--schema-of", "dataset", "--schema", str(tmp_path / "s.json"), "--json"]) == 0
    validator = jsonschema.Draft202012Validator(json.loads((tmp_path / "s.json").read_text()))
    data = tomllib.loads((ROOT / "data" / "table1_rig" / "dataset.toml").read_text(encoding="utf-8"))
    validator.validate(data)
    for key, value in (("role", "train"), ("fs", 0), ("level", "1"), ("band", [5.0]), ("name", "a/b"), ("colour", 1)):
        assert not validator.is_valid({"records": [data["records"][0] | {key: value}]}), key


@pytest.mark.parametrize("arguments, words", [
    ("", "needs a name"), ("--schema s.json --out rig.toml", "needs a name"),
    ("some/where", "must not hold a folder"), ("mine --length -1", "beam.length must be > 0"),
    ("mine --bushings trace", '"trace" is no place on the shaft'),
    ("mine --bushings 0.5 0.505", "bushings[1] overlaps"), ("mine --kind matrices", "--units is missing"),
    ("mine --kind matrices --units m-kg-s --file m.mtx k.mtx", "--file: give one file that holds all"),
    ("mine --kind modes --file a b", "--file: kind modes is read from one file"),
    ("mine --kind shaft --sensors 3:Z", 'sensors[0].position "3:Z" is no position on the shaft'),
    ("mine --kind beam --step 1 2", "--step is of a shaft: give --kind shaft, not beam"),
    ("mine --bushing-material pom", "belong together"),
    ("mine --bushing-material pom --bushing-thickness 2mm --contact 1 2", "leave it out, or --contact"),
    ("mine --bushing-material pom --bushing-thickness 2mm --section 0.01 0.02", "leave it out, or --contact"),
    ("mine --step 0.3", "--step: section: give either diameter"), ("mine --disc 0.2 2 xx 0.01", '"xx" is no number'),
    ("mine --disc 0.2 2 -0.1 0.01", "diameter must be > 0 m"), ("mine --support 0 pined", '"pined" is no number'),
    ("rotor --unbalance 0.3 1e-4", "give [spin]"), ("rotor --friction -1", "must be >= 0, got -1"),
    ("rotor --spin 9 --unbalance 0.3 1mm", 'unit "mm" of kg m is unknown'),
    ("rotor --section 5mm 8mm --spin 30rpm", "as stiff in every direction"),
    ("rotor --shape slot --friction 0.1", 'bushings[0].friction.along "@0.55:Y": nothing slides along the wall'),
    ("mine --length 620 --diameter 10", "lengths are in metres, and 620 mm is 0.62"),
    ("mine --gap 0.18", "wider than the shaft's radius, 0.005 m"),
    ("mine --mass 0.5 1st", 'unit "st" of mass is unknown; use kg, g, t'),
    ("a --kind beam --teeth 28", "--teeth is of gears: give --kind gears, not beam"),
    ("a --teeth 2 --oil 1", "--oil is of shafts, and kind gears has one mesh: leave it out"),
    ("a --kind gears --gap 1mm", "--gap is of shafts, and kind gears has one mesh: give --backlash"),
])  # fmt: skip
def test_refusals(tmp_path, monkeypatch, refused, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert words in refused("new", *arguments.split())
    assert not list(tmp_path.iterdir())


def test_nothing_is_overwritten(tmp_path, monkeypatch, refused):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text("my work")
    assert "mine.toml is there already" in refused("new", "mine", "--schema", "s.json")
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("mine.toml", "my work")]


@pytest.mark.parametrize("path", sorted((ROOT / "models").glob("*.toml")), ids=lambda path: path.name)
def test_schema_takes_the_shipped_rigs(path):
    VALIDATOR.check_schema(rig_schema())
    VALIDATOR.validate(tomllib.loads(path.read_text(encoding="utf-8")))


def leaves(data, path=()):
    """Path of every value in nested plain data."""
    if not isinstance(data, dict | list):
        yield path
        return
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        yield from leaves(value, (*path, key))


def changed(path, value):
    data = copy.deepcopy(FULL)
    place = data
    for key in path[:-1]:
        place = place[key]
    if value is MISSING:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return data


def possible(data):
    try:
        Rig.from_dict(data)
    except RigError:
        return False
    return True


@pytest.mark.parametrize("path", list(leaves(FULL)), ids=lambda path: ".".join(map(str, path)))
def test_schema_agrees_with_the_rig(path):
    """One value changed: the schema takes it if and only if a rig can be made of it."""
    assert possible(FULL)
    for value in (-1, 0, "text", "", True, [], MISSING):
        if (path[-1], value) == ("offset", -1):  # a rule between two values, that it is less than the gap
            continue
        data = changed(path, value)
        assert VALIDATOR.is_valid(data) == possible(data), value


@pytest.mark.parametrize("path, value", [
    (("bushings", 0, "grease", "elastic_ratio"), 1.1), (("bushings", 0, "grease", "film_limit"), 1.1),
    (("bushings", 0, "grease", "exponent"), 0.9), (("sensors", 0, "node"), 100), (("sensors", 0, "node"), 200),
    (("sensors", 0, "node"), 10**9), (("sensors",), []), (("beam", "diameter"), 0.01), (("beam", "rayleigh"), [0.1]),
    (("beam", "rayleigh"), [0.1, 1e-6, 0.0]), (("nonsense",), 1), (("bushings", 0, "grease", "nonsense"), 1),
], ids=str)  # fmt: skip
def test_schema_refuses(path, value):
    data = changed(path, value)
    assert not VALIDATOR.is_valid(data) and not possible(data)


def test_numbers_with_units(tmp_path):
    """The same rig in mm, g and GPa as in SI."""
    args = "--length", "620mm", "--diameter", "10 mm", "--young-modulus", "210GPa", "--mass", "310mm", "450 g"
    args += "--bushings", "0.31m", "--gap", "0.18mm", "--bushing-length", "1cm", "--sensors", "155mm", "0.62"
    rig = new(tmp_path, "mine", *args)
    si = ["--length", 0.62, "--diameter", 0.01, "--young-modulus", 210e9, "--mass", 0.31, 0.45]
    si += ["--bushings", 0.31, "--gap", 1.8e-4, "--bushing-length", 0.01, "--sensors", 0.155, 0.62]
    (tmp_path / "si").mkdir()
    expected = new(tmp_path / "si", "mine", *si)
    assert rig.beam == expected.beam and rig.point_masses == expected.point_masses
    np.testing.assert_allclose(rig.bushings[0].gap, expected.bushings[0].gap, rtol=1e-12)


def test_sensors_of_another_quantity(tmp_path):
    rig = new(tmp_path, "gauges", "--reads", "strain")
    assert {s.quantity for s in rig.sensors} == {"strain"}
