"""Rigs in TOML: what comes back, and every value that is refused with the name of its field."""

import copy
import dataclasses
import math
import tomllib
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from clearance_mj.errors import ClearanceError, RigError
from clearance_mj.rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker

FILE = Path(__file__).parents[1] / "models" / "table1_rig.toml"
TABLES = tomllib.loads(FILE.read_text(encoding="utf-8"))
GREASE, CONTACT = Grease(4369.0, 3.0), Contact(7.8e3, 4.0)
MISSING = object()


def changed(*path, value):
    """Return the tables of the rig file with one value changed, or taken out if it is MISSING."""
    tables = copy.deepcopy(TABLES)
    place = tables
    for key in path[:-1]:
        place = place[key]
    if value is MISSING:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return tables


def case(*arguments):
    """Split (*path, value, message) and name the case by its field."""
    *path, value, message = arguments
    shown = "missing" if value is MISSING else str(value)[:24]
    return pytest.param(path, value, message, id=f"{'.'.join(map(str, path))}={shown}")


# What comes back


def test_file_of_the_article_rig():
    """The rig fitted to the test column of the article's Table 1."""
    rig = Rig.load(FILE)
    assert rig.beam == Beam(1.0, 210e9, 7850.0, diameter=0.0086166, rayleigh=(0.5, 1e-5))
    assert [b.position for b in rig.bushings] == [0.5484, 0.7918]
    assert {b.grease.stiffness for b in rig.bushings} == {4369.0}
    assert rig.masses == (PointMass(1.0, 0.434, "lever boss"),)
    assert rig.sensor_labels == [f"{i}:+Z" for i in range(1, 9)]
    assert rig.shaker == Shaker("base")


def full_rig():
    """Every field given, so that none is lost on the way through a file."""
    grease = Grease(4369.0, 3.0, 0.8, 1.5, 2e7, -1e6, 1.5, 7.5e-4, 0.1)
    return Rig(
        name='täst \\ "one"',
        beam=Beam(0.8, 70e9, 2700.0, width=0.02, height=0.01, rayleigh=(0.1, 1e-6)),
        bushings=(Bushing(0.3, 1e-4, 0.02, grease, Contact(1e4, 1.0)), Bushing(0.5, 2e-4, 0.01, GREASE, CONTACT)),
        sensors=(Sensor(11, 0.3, 0.005), Sensor(3, 0.8)),
        masses=(PointMass(0.7, 0.1, "boss"), PointMass(0.8, 0.2)),
        shaker=Shaker("force", 0.4),
        description="two lines\nof text",
    )


@pytest.mark.parametrize(
    "rig", [Rig.load(FILE), full_rig(), Rig("min", Beam(1.0, 1.0, 1.0, 1.0), (), (Sensor(1, 1.0),))]
)
def test_toml_round_trip(tmp_path, rig):
    rig.save(tmp_path / "rig.toml")
    assert Rig.load(tmp_path / "rig.toml") == rig
    assert Rig.from_dict(rig.to_dict()) == rig
    again = tmp_path / "again.toml"
    Rig.load(tmp_path / "rig.toml").save(again)
    assert again.read_bytes() == (tmp_path / "rig.toml").read_bytes()


@settings(max_examples=50, deadline=None)
@given(st.floats(1e-6, 1e-2), st.floats(1e-3, 1e9), st.floats(0, 1e3))
def test_every_digit_survives_the_file(gap, stiffness, damping):
    bushing = Bushing(0.5, gap, 0.01, Grease(stiffness, damping), Contact(stiffness, damping))
    rig = Rig("r", Beam(1.0, 2e11, 7850.0, 0.01), (bushing,), (Sensor(1, 1.0),))
    assert Rig.from_dict(tomllib.loads(tomli_w.dumps(rig.to_dict()))) == rig


def test_none_is_left_out_of_the_file():
    tables = full_rig().to_dict()
    assert "diameter" not in tables["beam"]
    assert "film_height" not in tables["bushings"][1]["grease"]


def test_failed_save_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "rig.toml"
    full_rig().save(path)
    before = path.read_bytes()

    def fail(*_, **__):
        raise OSError("disk full")

    monkeypatch.setattr(tomli_w, "dumps", fail)
    with pytest.raises(ClearanceError, match=r"rig\.toml: cannot be written \(disk full\)"):
        Rig.load(FILE).save(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["rig.toml"]


def test_whole_numbers_are_numbers():
    assert Rig.from_dict(changed("beam", "length", value=1)).beam.length == 1.0


# Derived values


def test_sections():
    """Area and second moment of area: πd²/4, πd⁴/64 and bh, bh³/12 (any text on beams)."""
    rod, bar = Beam(1.0, 2e11, 7850.0, diameter=0.02), Beam(1.0, 2e11, 7850.0, width=0.02, height=0.01)
    assert rod.area == pytest.approx(3.141592653589793e-4, rel=1e-15)
    assert rod.second_moment == pytest.approx(7.853981633974483e-9, rel=1e-15)
    assert (bar.area, bar.second_moment) == (pytest.approx(2e-4), pytest.approx(1.6666666666666667e-9))
    assert rod.bending_stiffness == pytest.approx(2e11 * 7.853981633974483e-9)
    assert rod.mass_per_length == pytest.approx(2.4661502330679876)


def test_masses_of_sensors_load_the_shaft():
    rig = full_rig()
    assert rig.point_masses == (*rig.masses, PointMass(0.3, 0.005, "sensor 11"))
    assert rig.total_mass == pytest.approx(2700 * 2e-4 * 0.8 + 0.1 + 0.2 + 0.005)


def test_ends_of_a_bushing():
    assert Bushing(0.5, 1e-4, 0.02, GREASE, CONTACT).ends == pytest.approx((0.49, 0.51))


def test_yield_displacement():
    """z_ult = (A/(β+γ))^(1/n), the steady state of Eq. 9."""
    assert Grease(1.0, beta=3.0, gamma=1.0, amplitude=2.0).yield_displacement == pytest.approx(math.sqrt(0.5))
    assert Grease(1.0).yield_displacement == math.inf


def test_replace_checks_again():
    rig = Rig.load(FILE)
    assert rig.replace(name="b").name == "b"
    with pytest.raises(RigError, match="sensors: a rig needs at least one"):
        rig.replace(sensors=())


# Values at the limits are taken


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("bushings", 0, "grease", "stiffness"), 0.0),
        (("bushings", 0, "grease", "elastic_ratio"), 1.0),
        (("bushings", 0, "grease"), {"stiffness": 1.0, "beta": 2.0, "gamma": -2.0}),
        (("bushings", 0, "grease"), {"stiffness": 1.0, "beta": 2.0, "gamma": 2.0, "elastic_ratio": 0.0}),
        (("bushings", 0, "grease", "exponent"), 1.0),
        (("bushings", 0, "grease", "film_limit"), 1.0),
        (("bushings", 0, "contact", "damping"), 0.0),
        (("bushings",), []),
        (("beam", "rayleigh"), [0, 0]),
        (("sensors", 0, "position"), 1.0),
        (("masses",), []),
        (("shaker",), {"kind": "force", "position": 1.0}),
        (("description",), ""),
    ],
)
def test_limits_are_allowed(path, value):
    Rig.from_dict(changed(*path, value=value))


def test_bushing_may_end_at_the_tip():
    tables = changed("bushings", 1, "position", value=0.75)
    tables["bushings"][1]["length"] = 0.375  # 0.5625 to 0.9375, exact in binary
    Rig.from_dict(tables)
    tables["bushings"][1] |= {"position": 0.875, "length": 0.25}
    assert Rig.from_dict(tables).bushings[1].ends[1] == 1.0


# Refusals, each with the field


G, C = ("bushings", 0, "grease"), ("bushings", 0, "contact")
NUMBER = "must be a plain number in SI units, got"
REFUSED = [
    # Beam
    case("beam", "length", 0.0, "beam.length must be > 0, got 0"),
    case("beam", "length", -1.0, "beam.length must be > 0, got -1"),
    case("beam", "young_modulus", 0.0, "beam.young_modulus must be > 0"),
    case("beam", "density", -7850.0, "beam.density must be > 0"),
    case("beam", "diameter", 0.0, "beam.diameter must be > 0 m, got 0"),
    case("beam", "diameter", MISSING, "beam: give either diameter, or width and height"),
    case("beam", "width", 0.01, "beam: give either diameter, or width and height"),
    case("beam", {"length": 1.0, "young_modulus": 1.0, "density": 1.0, "width": 0.1}, "beam: give either diameter"),
    case("beam", {"length": 1.0, "young_modulus": 1.0, "density": 1.0, "width": 0.1, "height": -0.1}, "beam.height"),
    case("beam", "rayleigh", [0.5, -1e-5], "beam.rayleigh must be two numbers >= 0 (1/s, s)"),
    case("beam", "rayleigh", [0.5], "beam.rayleigh must be a list of 2 numbers, got [0.5]"),
    case("beam", "rayleigh", 0.5, "beam.rayleigh must be a list of 2 numbers, got 0.5"),
    case("beam", "rayleigh", [0.5, "1e-5 s"], f"beam.rayleigh[1] {NUMBER} '1e-5 s'"),
    case("beam", "rayleigh", [0.5, math.nan], "beam.rayleigh[1] must be finite"),
    # Bushings
    case("bushings", 0, "gap", -3e-4, "bushings[0].gap must be > 0 m (radial clearance), got -0.0003"),
    case("bushings", 1, "gap", 0.0, "bushings[1].gap must be > 0 m"),
    case("bushings", 0, "length", 0.0, "bushings[0].length must be > 0 m"),
    case("bushings", 0, "length", 2.0, "bushings[0].length 2 m makes it reach from -0.4516 to 1.5484 m, past the beam"),
    case("bushings", 0, "position", 0.005, "bushings[0].length 0.012 m makes it reach from -0.001"),
    case("bushings", 1, "position", 0.999, "bushings[1].length 0.012 m makes it reach"),
    case("bushings", 1, "position", 1.2, "bushings[1].position 1.2 m lies outside the beam (0 < x <= 1 m)"),
    case("bushings", 0, "position", 0.0, "bushings[0].position 0 m lies outside the beam"),
    case("bushings", 1, "position", 0.55, "bushings[1] overlaps bushings[0]: it starts at 0.544 m, the other ends at"),
    case("bushings", 0, "position", 0.79, "bushings[1] overlaps bushings[0]"),
    case("bushings", 0, "position", 0.80, "bushings[0] overlaps bushings[1]"),
    # Grease and contact
    case(*G, "stiffness", -1.0, "bushings[0].grease.stiffness must be >= 0 N/m, got -1"),
    case(*G, "damping", -1.0, "bushings[0].grease.damping must be >= 0 N s/m"),
    case(*G, "elastic_ratio", 1.1, "bushings[0].grease.elastic_ratio must be in 0..1, got 1.1"),
    case(*G, "elastic_ratio", -0.1, "bushings[0].grease.elastic_ratio must be in 0..1"),
    case(*G, "amplitude", 0.0, "bushings[0].grease.amplitude must be > 0"),
    case(*G, "exponent", 0.5, "bushings[0].grease.exponent must be >= 1"),
    case(*G, {"stiffness": 1.0, "beta": 1.0, "gamma": 1.1}, "bushings[0].grease.gamma 1.1 makes the Bouc-Wen element"),
    case(*G, {"stiffness": 1.0, "beta": 1.0, "gamma": -1.1}, "needs -beta <= gamma <= beta, beta = 1"),
    case(*G, {"stiffness": 1.0, "beta": -1.0}, "bushings[0].grease.gamma 0 makes the Bouc-Wen element create energy"),
    case(
        *G, {"stiffness": 1.0, "elastic_ratio": 0.5}, "bushings[0].grease.beta + gamma must be > 0 when elastic_ratio"
    ),
    case(*G, "film_height", 0.0, "bushings[0].grease.film_height must be > 0 m"),
    case(*G, "film_limit", 0.0, "bushings[0].grease.film_limit must be in 0..1, above 0"),
    case(*G, "film_limit", 1.5, "bushings[0].grease.film_limit must be in 0..1"),
    case(*C, "stiffness", 0.0, "bushings[0].contact.stiffness must be > 0 N/m"),
    case(*C, "damping", -1.0, "bushings[0].contact.damping must be >= 0 N s/m"),
    # Masses, sensors, shaker, names
    case("masses", 0, "mass", 0.0, "masses[0].mass must be > 0 kg"),
    case("masses", 0, "position", 1.01, "masses[0].position 1.01 m lies outside the beam (0 < x <= 1 m)"),
    case("sensors", 2, "position", -0.1, "sensors[2].position -0.1 m lies outside the beam"),
    case("sensors", 2, "position", 1.5, "sensors[2].position 1.5 m lies outside the beam"),
    case("sensors", 2, "mass", -0.01, "sensors[2].mass must be >= 0 kg"),
    case("sensors", 2, "node", 1, "sensors[2].node 1 is used twice; each sensor needs its own node"),
    case("sensors", 2, "node", 0, "sensors[2].node 0 must be a positive whole number of at most 9 digits"),
    case("sensors", 2, "node", -4, "sensors[2].node -4 must be a positive whole number of at most 9 digits"),
    case(
        "sensors",
        2,
        "node",
        100,
        "sensors[2].node 100 must be a positive whole number of at most 9 digits, and not 100",
    ),
    case("sensors", [], "sensors: a rig needs at least one"),
    case("shaker", "kind", "kick", 'shaker.kind "kick" is unknown; use "base" or "force"'),
    case("shaker", "kind", "force", 'shaker.position is missing; a shaker of kind "force" pushes at one point'),
    case("shaker", {"kind": "force", "position": 2.0}, "shaker.position 2 m lies outside the beam"),
    case("name", "", "name must not be empty"),
    # Types
    case("bushings", 0, "gap", "0.3 mm", f"bushings[0].gap {NUMBER} '0.3 mm'"),
    case("bushings", 0, "gap", True, f"bushings[0].gap {NUMBER} True"),
    case("bushings", 0, "gap", [3e-4], f"bushings[0].gap {NUMBER} [0.0003]"),
    case("beam", "length", "1 m", f"beam.length {NUMBER} '1 m'"),
    case("beam", "diameter", False, f"beam.diameter {NUMBER} False"),
    case(*G, "stiffness", "4369", f"bushings[0].grease.stiffness {NUMBER} '4369'"),
    case(*G, "film_height", "none", f"bushings[0].grease.film_height {NUMBER} 'none'"),
    case("sensors", 0, "node", 1.0, "sensors[0].node must be a whole number, got 1.0"),
    case("sensors", 0, "node", "1", "sensors[0].node must be a whole number, got '1'"),
    case("sensors", 0, "node", True, "sensors[0].node must be a whole number, got True"),
    case("name", 3, "name must be a string, got 3"),
    case("shaker", "kind", 1, "shaker.kind must be a string, got 1"),
    case("beam", 3, "beam must be a table of keys, got 3"),
    case(*C, 7800.0, "bushings[0].contact must be a table of keys, got 7800.0"),
    case("bushings", {"position": 0.5}, "bushings must be a list of tables ([[bushings]])"),
    case("sensors", [1], "sensors[0] must be a table of keys, got 1"),
    case("masses", "none", "masses must be a list of tables ([[masses]])"),
    # Unknown keys
    case("nonsense", {"x": 1}, "nonsense is not a known key; known: name, beam, bushings, sensors, masses, shaker"),
    case("beam", "lenght", 1.0, "beam.lenght is not a known key; known: length"),
    case("bushings", 1, "clearance", 1e-4, "bushings[1].clearance is not a known key; known: position, gap"),
    case(*G, "k", 1.0, "bushings[0].grease.k is not a known key; known: stiffness"),
    case("shaker", "force", 1.0, "shaker.force is not a known key; known: kind, position"),
    # Missing keys
    *(case(key, MISSING, f"{key} is missing") for key in ("name", "beam", "bushings", "sensors")),
    *(case("beam", key, MISSING, f"beam.{key} is missing") for key in ("length", "young_modulus", "density")),
    *(
        case("bushings", 1, key, MISSING, f"bushings[1].{key} is missing")
        for key in ("position", "gap", "length", "grease", "contact")
    ),
    case(*G, "stiffness", MISSING, "bushings[0].grease.stiffness is missing"),
    case(*C, "stiffness", MISSING, "bushings[0].contact.stiffness is missing"),
    case("sensors", 3, "node", MISSING, "sensors[3].node is missing"),
    case("sensors", 3, "position", MISSING, "sensors[3].position is missing"),
    case("masses", 0, "mass", MISSING, "masses[0].mass is missing"),
]
NUMBERS = [
    *(("beam", key) for key in ("length", "young_modulus", "density", "diameter")),
    *(("bushings", 0, key) for key in ("position", "gap", "length")),
    *((*G, f.name) for f in dataclasses.fields(Grease)),
    *((*C, f.name) for f in dataclasses.fields(Contact)),
    ("masses", 0, "position"),
    ("masses", 0, "mass"),
    ("sensors", 0, "position"),
    ("sensors", 0, "mass"),
    ("shaker", "position"),
]


def field(path):
    """Name a field as messages do: bushings[0].grease.stiffness."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return text.lstrip(".")


@pytest.mark.parametrize(("path", "value", "message"), REFUSED)
def test_refused_by_name(path, value, message):
    with pytest.raises(RigError) as caught:
        Rig.from_dict(changed(*path, value=value))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("path", NUMBERS, ids=field)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_every_number_must_be_finite(path, value):
    with pytest.raises(RigError) as caught:
        Rig.from_dict(changed(*path, value=value))
    assert str(caught.value).startswith(f"{field(path)} must be finite, got ")


@pytest.mark.parametrize("path", NUMBERS, ids=field)
@pytest.mark.parametrize("value", [True, "1.0", "0.3 mm", [], {}])
def test_every_number_must_be_a_number(path, value):
    with pytest.raises(RigError) as caught:
        Rig.from_dict(changed(*path, value=value))
    assert str(caught.value) == f"{field(path)} {NUMBER} {value!r}"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Beam(0.0, 1.0, 1.0, 1.0), "beam.length must be > 0"),
        (lambda: Beam(math.nan, 1.0, 1.0, 1.0), "beam.length must be > 0, got nan"),
        (lambda: Grease(-1.0), "grease.stiffness must be >= 0"),
        (lambda: Grease(1.0, beta=1.0, gamma=math.nan), "grease.gamma nan makes the Bouc-Wen element create energy"),
        (lambda: Contact(0.0), "contact.stiffness must be > 0"),
    ],
)
def test_elements_check_themselves(make, message):
    with pytest.raises(RigError, match=message):
        make()


# Files


def refused_file(path, part):
    with pytest.raises(RigError) as caught:
        Rig.load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and part in message and "\n" not in message, message


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (b"beam = {", "not valid TOML"),
        (b"", "name is missing"),
        (b"\x00\xff" * 40, "not valid TOML"),
        (b"name = 'a'\nname = 'b'\n", "not valid TOML"),
        ("name = 'ä'".encode("latin-1"), "not valid TOML"),
        ("name = 'a'".encode("utf-16"), "not valid TOML"),
        (FILE.read_bytes() + b"\n[nonsense]\nx = 1\n", "nonsense is not a known key"),
        (FILE.read_bytes().replace(b"3.0e-4", b'"0.3 mm"'), f"bushings[0].gap {NUMBER} '0.3 mm'"),
        (FILE.read_bytes().replace(b"3.0e-4", b"nan"), "bushings[0].gap must be finite, got nan"),
    ],
)
def test_files_are_refused_with_their_name(tmp_path, content, part):
    path = tmp_path / "rig.toml"
    path.write_bytes(content)
    refused_file(path, part)


def test_file_that_cannot_be_read(tmp_path):
    refused_file(tmp_path / "absent.toml", "cannot be read (No such file or directory)")
    refused_file(tmp_path, "cannot be read (Is a directory)")


@pytest.mark.parametrize("content", [b"x = " + b"9" * 5000, b"x = " + b"[" * 5000], ids=["long number", "deep list"])
def test_toml_that_the_parser_gives_up_on(tmp_path, content):
    path = tmp_path / "rig.toml"
    path.write_bytes(content)
    refused_file(path, "not valid TOML")


@pytest.mark.parametrize("path", [("beam", "length"), ("bushings", 0, "gap")], ids=field)
def test_whole_number_beyond_floating_point(path):
    with pytest.raises(RigError, match="must be"):
        Rig.from_dict(changed(*path, value=10**400))


@settings(max_examples=100, deadline=1000)
@given(st.data())
def test_any_value_in_any_place_is_taken_or_refused(data):
    """Nothing but RigError leaves, whatever plain data stands in a field."""
    paths = [
        ("name",),
        ("beam",),
        ("bushings",),
        ("sensors",),
        ("masses",),
        ("shaker",),
        ("sensors", 0, "node"),
        *NUMBERS,
    ]
    simple = st.one_of(st.floats(), st.integers(-(10**6), 10**6), st.booleans(), st.text(max_size=5))
    anything = st.recursive(
        simple, lambda s: st.lists(s, max_size=3) | st.dictionaries(st.text(max_size=8), s, max_size=3)
    )
    tables = changed(*data.draw(st.sampled_from(paths)), value=data.draw(anything))
    try:
        rig = Rig.from_dict(tables)
    except RigError as error:
        assert str(error)
    else:
        assert Rig.from_dict(rig.to_dict()) == rig
