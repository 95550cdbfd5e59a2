"""Rigs in TOML: what comes back, and every value that is refused with the name of its field."""

import dataclasses
import math
import pickle

import pytest

from clearance_mj.core.errors import RigError
from clearance_mj.rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker

from .rig_changes import FILE, MISSING, NUMBER, SHAFT, changed, refused

GREASE, CONTACT = Grease(4369.0, 3.0), Contact(7.8e3, 4.0)


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
        bushings=(
            Bushing(0.3, 1e-4, 0.02, grease, Contact(1e4, 1.0), None, 3e-5, "upper"),
            Bushing(0.5, 2e-4, 0.01, GREASE, CONTACT),
        ),
        sensors=(Sensor(11, 0.3, 0.005), Sensor(3, 0.8)),
        masses=(PointMass(0.7, 0.1, "boss"), PointMass(0.8, 0.2)),
        shaker=Shaker("force", 0.4),
        description="two lines\nof text",
    )


RIGS = [Rig.load(FILE), full_rig(), Rig("min", Beam(1.0, 1.0, 1.0, 1.0), (), (Sensor(1, 1.0),))]


@pytest.mark.parametrize("rig", RIGS)
def test_toml_round_trip(tmp_path, rig):
    rig.save(tmp_path / "rig.toml")
    assert Rig.load(tmp_path / "rig.toml") == rig and Rig.from_dict(rig.to_dict()) == rig
    again = tmp_path / "again.toml"
    Rig.load(tmp_path / "rig.toml").save(again)
    assert again.read_bytes() == (tmp_path / "rig.toml").read_bytes()


def test_whole_numbers_are_numbers():
    assert Rig.from_dict(changed("beam.length", 1)).beam.length == 1.0


def test_a_rig_is_a_value():
    """Rigs are keys of caches, and go to other processes."""
    rig = full_rig()
    assert rig == full_rig() != Rig.load(FILE)
    assert hash(rig) == hash(full_rig()) and pickle.loads(pickle.dumps(rig)) == rig
    with pytest.raises(dataclasses.FrozenInstanceError):
        rig.name = "other"


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
    with pytest.raises(RigError, match="sensors must hold 1 or more, got none"):
        rig.replace(sensors=())


# Values at the limits are taken


@pytest.mark.parametrize(("path", "value"), [
    ("bushings[0].grease.stiffness", 0.0),
    ("bushings[0].grease.elastic_ratio", 1.0),
    ("bushings[0].grease", {"stiffness": 1.0, "beta": 2.0, "gamma": -2.0}),
    ("bushings[0].grease", {"stiffness": 1.0, "beta": 2.0, "gamma": 2.0, "elastic_ratio": 0.0}),
    ("bushings[0].grease.exponent", 1.0),
    ("bushings[0].grease.film_limit", 1.0),
    ("bushings[0].contact.damping", 0.0),
    ("bushings", []),
    ("beam.rayleigh", [0, 0]),
    ("sensors[0].position", 1.0),
    ("masses", []),
    ("shaker", {"kind": "force", "position": 1.0}),
    ("description", ""),
    ("bushings[0].length", 0.0),
    ("bushings[0].to", 0.7),
    ("shaker", {"kind": "force", "position": 1.0, "also": [{"position": 0.5, "factor": -1.0}]}),
    ("shaker.direction", [0, 0, -2]),
])  # fmt: skip
def test_limits_are_allowed(path, value):
    Rig.from_dict(changed(path, value))


def test_bushing_may_end_at_the_tip():
    tables = changed("bushings[1].position", 0.75)
    tables["bushings"][1]["length"] = 0.375  # 0.5625 to 0.9375, exact in binary
    Rig.from_dict(tables)
    tables["bushings"][1] |= {"position": 0.875, "length": 0.25}
    assert Rig.from_dict(tables).bushings[1].ends[1] == 1.0


# Refusals, each with the field


LINE = {"length": 1.0, "young_modulus": 1.0, "density": 1.0}


POINT = (
    'must be a number, m along the shaft, or a text: a degree of freedom "12:+Z" or a shaft\'s "inner@0.4" or '
    '"@0.4:RX", got'
)


REFUSED = [
    # Beam
    ("beam.length", 0.0, "must be > 0, got 0 (m)"),
    ("beam.young_modulus", 0.0, "must be > 0, got 0 (Pa)"),
    ("beam.density", -7850.0, "must be > 0, got -7850 (kg/m³)"),
    ("beam.diameter", 0.0, "must be > 0, got 0 (m)"),
    ("beam.rayleigh", [0.5, 0.0, 1.0], "must be a list of 2 numbers, got [0.5, 0.0, 1.0]"),
    ("beam.rayleigh", 0.5, "must be a list of 2 numbers, got 0.5"),
    # Bushings
    ("bushings[0].gap", -3e-4, "must be > 0, got -0.0003 (radial clearance d, m)"),
    ("bushings[0].length", -0.1, "must be >= 0, got -0.1 (m along the shaft, 0 for a degree of freedom)"),
    ("bushings[0].length", 2.0, "2 m makes it reach from -0.4516 to 1.5484 m, past the beam (0 < x <= 1 m)"),
    ("bushings[1].position", 1.2, "1.2 m lies outside the beam (0 < x <= 1 m)"),
    ("bushings[0].position", 0.0, "0 m lies outside the beam (0 < x <= 1 m)"),
    ("bushings[0].position", "12:+Z", '"12:+Z" is no position on the beam: give a number, 0 < x <= 1 m'),
    ("bushings[0].to", "inner@0.5", '"inner@0.5" is no position on the beam: give a number, 0 < x <= 1 m'),
    ("bushings[0].to", 0.5484, "is the bushing's own position; give another point"),
    # Grease and contact
    ("bushings[0].grease.stiffness", -1.0, "must be >= 0, got -1 (k, N/m)"),
    ("bushings[0].grease.damping", -1.0, "must be >= 0, got -1 (c, N s/m, of the centred shaft)"),
    ("bushings[0].grease.elastic_ratio", 1.1, "must be <= 1, got 1.1 (λ, share of the stiffness that does not slide)"),
    ("bushings[0].grease.elastic_ratio", -0.1, "must be >= 0, got -0.1 (λ, share"),
    ("bushings[0].grease.amplitude", 0.0, "must be > 0, got 0 (A)"),
    ("bushings[0].grease.beta", -1.0, "must be >= 0, got -1 (β, 1/mⁿ"),
    ("bushings[0].grease.exponent", 0.5, "must be >= 1, got 0.5 (n)"),
    ("bushings[0].grease.film_height", 0.0, "must be > 0, got 0 (h, m"),
    ("bushings[0].grease.film_limit", 0.0, "must be > 0, got 0 (ε, smallest relative film thickness"),
    ("bushings[0].grease.film_limit", 1.5, "must be <= 1, got 1.5 (ε, smallest relative film thickness"),
    ("bushings[0].contact.stiffness", 0.0, "must be > 0, got 0 (k, N/m)"),
    ("bushings[0].contact.damping", -1.0, "must be >= 0, got -1 (c, N s/m)"),
    # Masses, sensors, shaker, names
    ("masses[0].mass", 0.0, "must be > 0, got 0 (kg)"),
    ("masses[0].position", 1.01, "1.01 m lies outside the beam (0 < x <= 1 m)"),
    ("sensors[2].position", -0.1, "-0.1 m lies outside the beam (0 < x <= 1 m)"),
    ("sensors[2].position", 1.5, "1.5 m lies outside the beam (0 < x <= 1 m)"),
    ("sensors[2].mass", -0.01, "must be >= 0, got -0.01 (kg, loads the structure like a point mass)"),
    ("sensors[2].node", 1, "1 is used twice; each sensor needs its own node"),
    ("sensors[2].node", 0, "must be >= 1, got 0 (positive, unique in the rig)"),
    ("sensors[2].node", 10**9, "must be <= 999999999, got 1000000000 (positive, unique in the rig)"),
    ("sensors[2].node", 100, "must not be 100 (base) or 200 (shaker)"),
    ("sensors", [], "must hold 1 or more, got none"),
    ("shaker.kind", "kick", '"kick" is unknown; use base or force'),
    ("name", "", "must not be empty"),
    # Types
    ("sensors[0].node", 1.0, "must be a whole number, got 1.0"),
    ("sensors[0].node", "1", "must be a whole number, got '1'"),
    ("sensors[0].node", True, "must be a whole number, got True"),
    ("name", 3, "must be a string, got 3"),
    ("shaker.kind", 1, "must be a string, got 1"),
    ("beam", 3, "must be a table of keys, got 3"),
    ("bushings[0].contact", 7800.0, "must be a table of keys, got 7800.0"),
    ("bushings", {"position": 0.5}, "must be a list of tables ([[bushings]]), got"),
    ("sensors", [1], "[0] must be a table of keys, got 1"),
    ("masses", "none", "must be a list of tables ([[masses]]), got 'none'"),
    # Unknown keys
    ("nonsense", {"x": 1}, "is not a known key; known: name, beam, bushings, sensors, masses, shaker, description"),
    ("beam.lenght", 1.0, "is not a known key; known: length, young_modulus, density", "; did you mean length?"),
    ("bushings[1].clearance", 1e-4, "is not a known key; known: position, gap, length, grease, contact"),
    ("bushings[0].grease.k", 1.0, "is not a known key; known: stiffness"),
    ("shaker.force", 1.0, "is not a known key; known: kind, position"),
    # Points
    *(("sensors[0].position", value, f"{POINT} {value!r}") for value in ("12:+W", "12:++Z", ":X", "12", "@0.4", "a@b")),
    *(("sensors[0].position", value, f"{POINT} {value!r}") for value in ("inner@", "inner@1.2.3", "-1:X", "in\n@1")),
    ("shaker.direction", [0, 0, 0], "must not be zero"),
    ("shaker.direction", [0, 1], "must be a list of 3 numbers, got [0, 1]"),
    ("shaker.also[0].position", 2.0, "2 m lies outside the beam (0 < x <= 1 m)"),
    # Beam or structure
    ("beam", MISSING, "is missing; give either [beam], a uniform cantilever, or [structure], of one of the kinds"),
    ("structure", SHAFT, "stands beside beam; give either [beam], a uniform cantilever, or [structure], of one of"),
    # Missing keys
    *((key, MISSING, "is missing") for key in ("name", "bushings", "sensors", "masses[0].mass")),
    *((f"beam.{key}", MISSING, "is missing") for key in LINE),
    *((f"bushings[1].{key}", MISSING, "is missing") for key in ("position", "gap", "length", "grease", "contact")),
    *((f"bushings[0].{key}.stiffness", MISSING, "is missing") for key in ("grease", "contact")),
    *((f"sensors[3].{key}", MISSING, "is missing") for key in ("node", "position")),
]


REFUSED_OF_ANOTHER_FIELD = [
    ("beam.diameter", MISSING, "beam: give either diameter, or width and height"),
    ("beam.width", 0.01, "beam: give either diameter, or width and height"),
    ("beam", LINE | {"width": 0.1}, "beam: give either diameter, or width and height"),
    ("beam", LINE | {"width": 0.1, "height": -0.1}, "beam.height must be > 0, got -0.1 (m, in the direction of"),
    ("beam.rayleigh", [0.5, -1e-5], "beam.rayleigh[1] must be >= 0, got -1e-05"),
    ("beam.rayleigh", [0.5, "1e-5 s"], f"beam.rayleigh[1] {NUMBER} '1e-5 s'"),
    ("beam.rayleigh", [0.5, math.nan], "beam.rayleigh[1] must be finite, got nan"),
    ("bushings[0].position", 0.005,
     "bushings[0].length 0.012 m makes it reach from -0.001 to 0.011 m, past the beam (0 < x <= 1 m)"),
    ("bushings[1].position", 0.999,
     "bushings[1].length 0.012 m makes it reach from 0.993 to 1.005 m, past the beam (0 < x <= 1 m)"),
    ("bushings[1].position", 0.55, "bushings[1] overlaps bushings[0]: it starts at 0.544 m, the other ends at"),
    ("bushings[0].position", 0.79, "bushings[1] overlaps bushings[0]"),
    ("bushings[0].position", 0.80, "bushings[0] overlaps bushings[1]"),
    ("bushings[0].grease", {"stiffness": 1.0, "beta": 1.0, "gamma": 1.1},
     "bushings[0].grease.gamma 1.1 makes the Bouc-Wen element create energy (needs -beta <= gamma <= beta, beta = 1"),
    ("bushings[0].grease.gamma", -1.1, "bushings[0].grease.gamma -1.1 makes the Bouc-Wen element create energy"),
    ("bushings[0].grease.elastic_ratio", 0.5, "bushings[0].grease.beta + gamma must be > 0 when elastic_ratio < 1"),
    ("shaker.kind", "force", 'shaker.position is missing; a shaker of kind "force" pushes at one point'),
    ("shaker", {"kind": "force", "position": 2.0}, "shaker.position 2 m lies outside the beam"),
]  # fmt: skip


NUMBERS = [
    *(f"beam.{key}" for key in ("length", "young_modulus", "density", "diameter")),
    *(f"bushings[0].{key}" for key in ("gap", "length")),
    *(f"bushings[0].grease.{f.name}" for f in dataclasses.fields(Grease)),
    *(f"bushings[0].contact.{f.name}" for f in dataclasses.fields(Contact)),
    *("masses[0].mass", "sensors[0].mass", "shaker.also[0].factor"),
]


POINTS = [f"{place}.position" for place in ("bushings[0]", "masses[0]", "sensors[0]", "shaker", "shaker.also[0]")]


POINTS.append("bushings[0].to")


@pytest.mark.parametrize(("path", "value", "parts"), [(path, value, parts) for path, value, *parts in REFUSED])
def test_refused_by_name(path, value, parts):
    message = refused(path, value)
    assert message.startswith((f"{path} {parts[0]}", f"{path}{parts[0]}")) and all(p in message for p in parts)


@pytest.mark.parametrize(("path", "value", "start"), REFUSED_OF_ANOTHER_FIELD)
def test_refused_by_name_of_what_it_contradicts(path, value, start):
    assert refused(path, value).startswith(start)


@pytest.mark.parametrize("path", NUMBERS)
def test_every_number_must_be_a_finite_number(path):
    for value in (math.nan, math.inf, -math.inf):
        assert refused(path, value).startswith(f"{path} must be finite, got {value}")
    for value in (True, "1.0", "0.3 mm", [], [3e-4], {}):
        assert refused(path, value) == f"{path} {NUMBER} {value!r}"


@pytest.mark.parametrize("path", POINTS)
def test_every_point_must_be_a_number_or_a_name(path):
    for value in (math.nan, math.inf, -math.inf):
        assert refused(path, value) == f"{path} must be finite, got {value}"
    assert refused(path, 10**400) == f"{path} must be finite, got inf"
    for value in (True, "1.0", "0.3 mm", [], [3e-4], {}):
        assert refused(path, value) == f"{path} {POINT} {value!r}"
