"""Calibration: known rigs are recovered, deviations are those of repeated tests, and what data leave open is said."""

import dataclasses
import json

import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import brentq

from clearance_mj.beam import linear_frf, natural_frequencies
from clearance_mj.calibrate import FRFTarget, ModalTarget, calibrate, profile, read_frequencies, value_of
from clearance_mj.core.errors import RecordError, RigError
from clearance_mj.rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor
from clearance_mj.signals.frf import FRF
from clearance_mj.structure import Disc, Material, Matrices, Section, Shaft, Shafts, Support
from clearance_mj.structure.beam import cantilever_roots
from experiments.testrig.fem import FiniteElements

from ..conftest import ROOT, dense

RIG = str(ROOT / "models" / "table1_rig.toml")
TABLE1 = ROOT / "data" / "article" / "table1_natural_frequency.csv"
RESOLUTION_STD = 0.05 / np.sqrt(12)  # Hz: Table 1 is in steps of 0.05 Hz
EQUAL = ("bushings[0].position", "bushings[1].position", "bushings.grease.stiffness", "masses[0].mass")
BARE = Rig("bare", Beam(0.8, 2e11, 7800.0, diameter=0.01), (), (Sensor(1, 0.8),))


def modes_of(frequency, std=1e-3, **shape):
    frequency = np.asarray(frequency, dtype=float)
    return ModalTarget(frequency, np.arange(1, frequency.size + 1), std * frequency, **shape)


def bare_frequencies(young_modulus, n):
    """λ²/(2π l²) √(E I / ρ A), Blevins, table 8-1."""
    b = BARE.beam
    return (
        cantilever_roots(n) ** 2
        / (2 * np.pi * b.length**2)
        * np.sqrt(young_modulus * b.second_moment / (b.density * b.area))
    )


def fe_modes(rig, n):
    """Frequencies and shapes at the sensors by Hermite elements, which share no code with the Ritz model."""
    fe = FiniteElements.of_shaft(rig.beam, rig.point_masses, 64)
    mass, stiffness = dense(fe.mass), dense(fe.stiffness)
    at = fe.points([b.position for b in rig.bushings]).dense(fe.count)
    stiffness = stiffness + (at.T * [b.grease.stiffness for b in rig.bushings]) @ at
    value, vector = scipy.linalg.eigh(stiffness, mass, subset_by_index=(0, n - 1))
    return np.sqrt(value) / (2 * np.pi), fe.points([s.position for s in rig.sensors]).dense(fe.count) @ vector


def test_young_modulus_and_its_deviation_in_closed_form():
    """ln f = ln E / 2 + ..., so n frequencies of relative deviation s tell ln E to 2 s / √n."""
    calibration = calibrate(BARE, [modes_of(bare_frequencies(1.9e11, 4))], {"beam.young_modulus": None}, n_starts=3)
    assert calibration.estimates.value[0] == pytest.approx(1.9e11, rel=1e-6)
    assert calibration.estimates.varied_std[0] == pytest.approx(2 * 1e-3 / np.sqrt(4), rel=1e-4)
    assert calibration.rig.beam.young_modulus == calibration.estimates.value[0]
    assert calibration.warnings == ()


def test_only_the_ratio_of_modulus_and_density_is_identified():
    """Frequencies go with E/ρ: the product is not identifiable, with equal exponents; the ratio is."""
    free = {"beam.young_modulus": None, "beam.density": None}
    calibration = calibrate(BARE, [modes_of(bare_frequencies(1.9e11, 4))], free, n_starts=2)
    (combination,) = calibration.unidentified
    assert combination.exponent == pytest.approx(dict.fromkeys(free, 0.5**0.5), abs=1e-6)
    assert "beam.young_modulus^+0.71 × beam.density^+0.71" in calibration.warnings[0]
    assert np.divide(*calibration.estimates.value) == pytest.approx(1.9e11 / 7800, rel=1e-6)
    assert calibration.estimates.correlation[0, 1] == pytest.approx(1.0, abs=1e-6)
    assert any("2 different rigs fit equally well" in w for w in calibration.warnings)


def test_damping_is_not_identified_by_frequencies(rig):
    free = {"beam.rayleigh[0]": None, "masses[0].mass": None}
    calibration = calibrate(rig, [modes_of(natural_frequencies(rig, 4))], free, n_starts=1)
    assert [list(c.exponent) for c in calibration.unidentified] == [["beam.rayleigh[0]"]]


def test_deviations_are_those_of_repeated_tests():
    """χ² of 40 noisy tests with the covariance of each: 80 degrees of freedom, 99.9 % within 44 to 125."""
    truth = BARE.replace(masses=(PointMass(0.8, 0.2),))
    clean, noise = natural_frequencies(truth, 4), np.random.default_rng(0)
    free = {"beam.young_modulus": None, "masses[0].mass": None}
    chi2 = 0.0
    for _ in range(40):
        target = ModalTarget(clean * (1 + 2e-3 * noise.standard_normal(4)), np.arange(1, 5), 2e-3 * clean)
        calibration = calibrate(truth, [target], free, n_starts=1)
        # without the allowance for errors of the model
        covariance = calibration.estimates.covariance / max(1.0, calibration.chi2 / 2)
        away = np.log(calibration.estimates.value / [2e11, 0.2])
        chi2 += away @ np.linalg.solve(covariance, away)
    assert 44 < chi2 < 125


def test_recovers_the_rig_of_table_1():
    """The published rig: bushings at 0.5484 and 0.7918 m, grease 4369 N/m each, tip mass 0.434 kg, d = 8.617 mm."""
    measured = read_frequencies(TABLE1)
    target = ModalTarget(measured.frequency, measured.mode, np.full(4, RESOLUTION_STD))
    rig = Rig.load(RIG)
    far = json.loads(json.dumps(rig.to_dict()).replace("4369.0", "3000.0").replace("0.434", "0.3"))
    far["bushings"][0]["position"], far["bushings"][1]["position"] = 0.5, 0.85
    far = Rig.from_dict(far)
    calibration = calibrate(far, [target], dict.fromkeys(EQUAL), n_starts=2, seed=3)
    np.testing.assert_allclose(natural_frequencies(calibration.rig, 4), [9.25, 39.75, 92.85, 188.85], rtol=1e-6)
    assert np.all(np.abs(calibration.estimates.value - [0.5484, 0.7918, 4369.0, 0.434]) < calibration.estimates.std)
    assert np.all(calibration.estimates.varied_std < 0.02)
    assert len({b.grease.stiffness for b in calibration.rig.bushings}) == 1
    again = calibrate(far, [target], dict.fromkeys(EQUAL), n_starts=2, seed=3)
    assert again.to_dict() == calibration.to_dict()


def test_other_rigs_fit_table_1_as_well():
    """With the diameter free too, the first bushing may stand anywhere over a span of centimetres."""
    measured = read_frequencies(TABLE1)
    target = ModalTarget(measured.frequency, measured.mode, np.full(4, RESOLUTION_STD))
    free = dict.fromkeys(("beam.diameter", *EQUAL[1:]))
    family = profile(Rig.load(RIG), [target], free, EQUAL[0], (0.56, 0.60), n_starts=1)
    for member, place in zip(family, (0.56, 0.60)):
        assert member.rig.bushings[0].position == place
        np.testing.assert_allclose(natural_frequencies(member.rig, 4), [9.25, 39.75, 92.85, 188.85], rtol=1e-6)
    assert value_of(family[1].rig, "masses[0].mass") > 1.3 * value_of(family[0].rig, "masses[0].mass")


def test_shapes_tell_what_frequencies_leave_open(rig):
    """Five free parameters against four frequencies and shapes of finite elements."""
    frequency, shape = fe_modes(rig, 4)
    nodes = tuple(s.node for s in rig.sensors)
    target = modes_of(frequency, shape=-3 * shape, nodes=nodes)
    free = dict.fromkeys(("beam.diameter", *EQUAL))
    start = rig.replace(masses=(PointMass(1.0, 0.5),))
    calibration = calibrate(start, [target], free, n_starts=1)
    np.testing.assert_allclose(calibration.estimates.value, [0.0086166, 0.5484, 0.7918, 4369.0, 0.434], rtol=2e-3)
    assert calibration.unidentified == ()
    assert target.size == 4 + 7 * 4


def test_frf_tells_damping(rig):
    """FRF magnitudes with 2 % noise of a rig whose grease and shaft damp otherwise."""
    lines = np.arange(5.0, 150.0, 1.0)
    truth = Rig.from_dict(json.loads(json.dumps(rig.to_dict()).replace('"damping": 3.0', '"damping": 6.5')))
    noise = 1 + 0.02 * np.random.default_rng(1).standard_normal((8, lines.size))
    target = FRFTarget(FRF(lines, linear_frf(truth, lines) * noise), std=20 * np.log10(1.02))
    free = {"bushings.grease.damping": None, "bushings.grease.stiffness": None}
    calibration = calibrate(rig, [target], free, n_starts=1)
    assert np.all(np.abs(calibration.estimates.value - [6.5, 4369.0]) < 3 * calibration.estimates.std)
    assert calibration.estimates.std[0] < 0.05
    assert calibration.chi2 == pytest.approx(target.size, rel=0.1)


def test_bushings_keep_their_order(rig):
    calibration = calibrate(rig, [modes_of(natural_frequencies(rig, 4))], dict.fromkeys(EQUAL), n_starts=3, seed=2)
    assert all(s.value[0] < s.value[1] for s in calibration.solutions)


# Rigs of other structures.

STEEL = Material(2e11, 7800.0)
ROD = Section(0.8, diameter=0.01)
BENDING, PER_LENGTH = 2e11 * np.pi * 0.01**4 / 64, 7800 * np.pi * 0.01**2 / 4


def shaft_rig(supports, discs=(), sections=(ROD,)):
    shaft = Shaft(sections, supports, discs, STEEL, theory="euler")
    return Rig("shaft", None, (), (Sensor(1, 0.5),), structure=shaft)


def characteristic_frequencies(characteristic, n):
    """λ² √(EI/ρA) / (2π l²) of the first n roots of an equation of λ, looked for in steps of 0.01."""
    trial = np.arange(0.1, 14.0, 0.01)
    sign = np.flatnonzero(np.diff(np.sign([characteristic(x) for x in trial])))[:n]
    roots = np.array([brentq(characteristic, trial[i], trial[i + 1], xtol=1e-13) for i in sign])
    return roots**2 * np.sqrt(BENDING / PER_LENGTH) / (2 * np.pi * 0.8**2)


def elastic_clamp(rotation):
    """Hinged at a spring of N m/rad, free at the other end (Blevins, Formulas for Natural Frequency, table 8-2)."""
    k = rotation * 0.8 / BENDING
    return lambda x: k * (1 + np.cos(x) * np.cosh(x)) - x * (np.sin(x) * np.cosh(x) - np.cos(x) * np.sinh(x))


def disc_at_the_tip(mass):
    """Clamped, with a point mass at the free end (Blevins, table 8-8)."""
    m = mass / (PER_LENGTH * 0.8)
    return lambda x: 1 + np.cos(x) * np.cosh(x) + m * x * (np.cos(x) * np.sinh(x) - np.sin(x) * np.cosh(x))


def test_diameter_of_a_pinned_shaft_and_its_deviation_in_closed_form():
    """f_n = n² π/2 √(E I / ρ A l⁴) ~ d, so n frequencies of relative deviation s tell ln d to s / √n."""
    supports = Support(0.0, "pinned"), Support(0.8, "pinned")
    target = modes_of(1.05 * np.arange(1, 5) ** 2 * np.pi / 2 * np.sqrt(BENDING / PER_LENGTH) / 0.8**2)
    halves = (Section(0.3, diameter=0.01), Section(0.5, diameter=0.01))
    for path, sections in (("structure.sections[0].diameter", (ROD,)), ("structure.sections.diameter", halves)):
        calibration = calibrate(shaft_rig(supports, (), sections), [target], {path: None}, n_starts=1)
        assert calibration.estimates.value[0] == pytest.approx(0.0105, rel=1e-6)
        assert calibration.estimates.varied_std[0] == pytest.approx(1e-3 / np.sqrt(4), rel=1e-4)
        assert {s.diameter for s in calibration.rig.structure.sections} == {(calibration.estimates.value[0],) * 2}
        assert calibration.estimates.parameters[0].unit == "m"


@pytest.mark.parametrize(
    ("rig", "free", "characteristic", "value", "unit"),
    [
        (
            shaft_rig((Support(0.0, "pinned", rotation=100.0),)),
            {"structure.supports[0].rotation": (10.0, 1e4)}, elastic_clamp, 420.0, "N m/rad",
        ),
        (
            shaft_rig((Support(0.0, "clamped"),), (Disc(0.8, 0.1),)),
            {"structure.discs[0].mass": None}, disc_at_the_tip, 0.25, "kg",
        ),
    ],
    ids=["rotation", "disc"],
)  # fmt: skip
def test_supports_and_discs_are_found_from_the_roots_of_their_equations(rig, free, characteristic, value, unit):
    frequency = characteristic_frequencies(characteristic(value), 4)
    calibration = calibrate(rig, [modes_of(frequency)], free, n_starts=2)
    assert calibration.estimates.value[0] == pytest.approx(value, rel=1e-5)
    assert calibration.estimates.parameters[0].unit == unit
    assert calibration.warnings == ()


def test_positions_on_any_shaft():
    """The number behind the @ of a place varies, within the shaft that it is on."""
    inner = Shaft((ROD,), (Support(0.0, "clamped"),), (), STEEL, start=0.0, name="inner")
    outer = Shaft((Section(0.5, diameter=0.03, inner_diameter=0.02),), (Support(0.2, "clamped"),), (), STEEL,
                  start=0.2, name="outer")  # fmt: skip
    bushings = (Bushing("inner@0.4", 1e-4, 0.0, Grease(4e3), Contact(1e4), to="outer@0.45"),)
    rig = Rig("two", None, bushings, (Sensor(1, "inner@0.8"),), structure=Shafts((inner, outer)))
    assert value_of(rig, "bushings[0].position") == 0.4
    target = modes_of(natural_frequencies(rig, 4))
    away = rig.replace(bushings=(dataclasses.replace(bushings[0], position="inner@0.35"),))
    calibration = calibrate(away, [target], {"bushings[0].position": None}, n_starts=1)
    assert calibration.rig.bushings[0].position.startswith("inner@0.")
    assert calibration.estimates.value[0] == pytest.approx(0.4, rel=1e-5)
    (parameter,) = calibration.estimates.parameters
    assert (parameter.low, parameter.high, parameter.unit) == (pytest.approx(0.016), 0.8, "m")
    end = calibrate(rig, [target], {"bushings[0].to": None}, n_starts=1).estimates.parameters[0]
    assert (end.low, end.high) == (pytest.approx(0.21), 0.7)


def test_shapes_of_sensors_in_any_direction(tmp_path):
    """Two masses of 1 kg on springs along X (closed form); columns name degrees of freedom, in either sign."""
    matrices = Matrices(
        units="m-kg-s", mass=[[1.0, 0], [0, 1]], stiffness=[[2e4, -1e4], [-1e4, 1e4]], dofs=["1:X", "2:X"]
    )
    masses = (PointMass("2:X", 0.3),)
    rig = Rig("masses", None, (), (Sensor(1, "1:X"), Sensor(2, "2:-X")), masses, structure=matrices)
    square, shape = scipy.linalg.eigh([[2e4, -1e4], [-1e4, 1e4]], np.diag([1.0, 1.5]))
    heading = "frequency_hz,shape_1:+X,shape_2:+X"
    rows = [f"{f},{a},{b}" for f, (a, b) in zip(np.sqrt(square) / (2 * np.pi), shape.T)]
    (tmp_path / "modes.csv").write_text("\n".join((heading, *rows)))
    target = read_frequencies(tmp_path / "modes.csv")
    calibration = calibrate(rig, [target], {"masses[0].mass": None}, n_starts=1)
    assert calibration.estimates.value[0] == pytest.approx(0.5, rel=1e-6)
    assert np.abs(calibration.residual).max() < 1e-6
    with pytest.raises(RecordError, match=r"degree of freedom 2:\+Z is no sensor of rig 'masses': 1:\+X, 2:-X"):
        calibrate(rig, [modes_of([9.0], shape=np.ones((1, 1)), nodes=("2:+Z",))], {"masses[0].mass": None})


@pytest.mark.parametrize(
    ("free", "message"),
    [
        (
            {"structure.sections[0].diametr": None},
            r"known: .*structure.sections\[N\].length, structure.sections\[N\].diameter, ",
        ),
        ({"structure.supports[0].position": None}, "starts at 0 and has no bounds; give them"),
        ({"structure.supports[0].rotation": None}, "starts at 0 and has no bounds; give them"),
        ({"structure.rayleigh": None}, "is no free parameter"),
        ({"structure.kind": None}, "is no free parameter"),
    ],
)
def test_impossible_parameters_of_a_shaft(free, message):
    with pytest.raises(RigError, match=message):
        calibrate(shaft_rig((Support(0.0, "clamped"),)), [modes_of([9.0, 40.0])], free)


@pytest.mark.parametrize(
    ("free", "message"),
    [
        ({}, "at least one free parameter"),
        ({"bushing.position": None}, "known: beam.length, .*bushings\\[N\\].grease.stiffness"),
        ({"bushings[2].position": None}, r"2 bushings"),
        ({"bushings[0].gap": None}, "is no free parameter"),
        ({"bushings[0].contact.stiffness": None}, "is no free parameter"),
        ({"beam.rayleigh": None}, "is no free parameter"),
        ({"masses.mass": None, "masses[0].mass": None}, "named twice"),
        ({"masses[0].mass": (0.5, 0.2)}, "0 < low < high"),
        ({"masses[0].mass": (1.0, 2.0)}, "starts at 0.434, outside"),
        ({"sensors[0].mass": None}, "starts at 0 and has no bounds"),
        ({"bushings.position": None}, "bushings overlap"),
    ],
)
def test_impossible_parameters(rig, free, message):
    with pytest.raises(RigError, match=message):
        calibrate(rig, [modes_of([9.0, 40.0])], free)


OTHER_QUANTITY = FRFTarget(FRF(np.arange(5.0, 9.0), np.ones((8, 4)), quantity="acceleration/force"))
OTHER_SENSOR = modes_of([9.0, 40.0], shape=np.ones((2, 2)), nodes=(1, 55))


@pytest.mark.parametrize(
    ("target", "free", "message"),
    [
        (modes_of([9.0, 40.0, 90.0]), EQUAL, "4 free parameters need as many data; the targets hold 3"),
        (OTHER_QUANTITY, ["masses[0].mass"], "but the shaker of rig 'table1' is 'base'"),
        (OTHER_SENSOR, ["masses[0].mass"], "node 55 is no sensor"),
    ],
)
def test_targets_that_do_not_fit_the_rig(rig, target, free, message):
    with pytest.raises(RecordError, match=message):
        calibrate(rig, [target], dict.fromkeys(free))
