"""What a rig file leaves open: default priors, tolerances before them, and the rig with other values."""

import dataclasses
import math

import numpy as np
import pytest

from clearance_mj.estimate import Estimates
from clearance_mj.identify.structure.misfit import RecordMisfit
from clearance_mj.identify.structure.priors import prepared_rig, priors, rig_with, unsaid_words
from clearance_mj.identify.structure.rig_update import RigUpdate
from clearance_mj.identify.structure.spectra import rms
from clearance_mj.linear import linear_model
from clearance_mj.rig import Bushing, Contact, Grease, PointMass, Rig, Sensor, Tolerance
from clearance_mj.structure import Disc, Material, Section, Shaft, Support


def by_name(rig, **options):
    return {p.name: p for p in priors(rig, **options)}


def test_defaults(rig):
    prior_of = by_name(rig)
    stds = {
        "beam.young_modulus": 0.03, "beam.density": 0.01, "masses[0].mass": 0.05, "bushings[1].position": 2e-3,
        "sensors[2].position": 2e-3, "sensors[2].gain": 0.01, "beam.damping_ratios[0]": math.log(2),
        "bushings[0].gap": 0.2, "bushings[0].offset": 0.3 * rig.bushings[0].gap,
    }  # fmt: skip
    assert {name: prior_of[name].prior_std for name in stds} == pytest.approx(stds)


def test_the_clamp_gives_as_a_length_uniform_from_0_to_two_diameters(rig):
    """Mean and standard deviation of a/(EI) and a³/(3EI) over a, by a sum over a fine grid."""
    a = (np.arange(100_000) + 0.5) / 100_000 * 2 * rig.beam.diameter
    for name, compliance in (("rotation", a), ("translation", a**3 / 3)):
        parameter = by_name(rig)[f"1/beam.clamp.{name}"]
        assert parameter.start == pytest.approx(compliance.mean() / rig.beam.bending_stiffness)
        assert parameter.prior_std == pytest.approx(compliance.std() / rig.beam.bending_stiffness)
        assert parameter.low == 0


def test_tolerances_go_before_defaults(rig):
    tolerances = (
        Tolerance("bushings.gap", "5 %"), Tolerance("sensors[0].position", "1 mm"), Tolerance("masses[0].mass", "0 %"),
        Tolerance("beam.clamp.rotation", "3 mm"), Tolerance("beam.clamp.translation", "0 mm"),
        Tolerance("beam.length", "1 mm"), Tolerance("bushings[0].offset", "10 %"),
    )  # fmt: skip
    prior_of = by_name(rig.replace(tolerances=tolerances))
    assert prior_of["bushings[0].gap"].prior_std == prior_of["bushings[1].gap"].prior_std == pytest.approx(0.05)
    assert prior_of["sensors[0].position"].prior_std == pytest.approx(1e-3)
    assert prior_of["sensors[1].position"].prior_std == pytest.approx(2e-3)
    assert "masses[0].mass" not in prior_of and "1/beam.clamp.translation" not in prior_of
    rotation = prior_of["1/beam.clamp.rotation"]
    assert (rotation.start, rotation.prior_std) == (0.0, pytest.approx(3e-3 / rig.beam.bending_stiffness))
    assert (prior_of["beam.length"].prior_std, prior_of["beam.length"].transform) == (pytest.approx(1e-3), "linear")
    assert prior_of["bushings[0].offset"].prior_std == pytest.approx(0.1 * rig.bushings[0].gap)


def test_values_stand_in_the_rig(rig):
    values = {"beam.young_modulus": 2e11, "bushings[1].position": 0.8, "sensors[0].gain": 1.02, "probes[0].gain": 1.1}
    changed = rig_with(rig, values | {"1/beam.clamp.rotation": 2e-5, "1/beam.clamp.translation": 0.0})
    assert changed.beam.young_modulus == 2e11
    assert (changed.beam.clamp.rotation, changed.beam.clamp.translation) == (pytest.approx(5e4), None)
    assert (changed.bushings[1].position, changed.sensors[0].gain) == (0.8, 1.02)
    assert rig_with(changed, {"1/beam.clamp.rotation": 0.0}).beam.clamp is None
    kept = rig_with(changed, {"1/beam.clamp.translation": 1e-9}).beam.clamp
    assert (kept.rotation, kept.translation) == (pytest.approx(5e4), pytest.approx(1e9))


def test_every_start_is_the_rig_file(rig):
    parameters = priors(rig, probes=True)
    assert rig_with(rig, {p.name: p.start for p in parameters if not p.name.startswith("1/")}) == prepared_rig(rig)


def test_damping_ratios_are_those_of_rayleigh(rig):
    """ζ = η1/(2ω) + η2 ω/2: the same damping of the lowest modes."""
    before, after = linear_model(rig, 16), linear_model(prepared_rig(rig), 16)
    np.testing.assert_allclose(after.damping[:8], before.damping[:8], rtol=1e-12)


def test_no_mode_is_damped_more_than_critically(rig):
    """Six standard deviations up, 0.3 would be 19: the bound is 1, and an update that gets there says why."""
    damped = rig.replace(beam=dataclasses.replace(rig.beam, rayleigh=(0.0, 0.0), damping_ratios=(0.3, 0.001)))
    bounds = {p.name: p.high for p in priors(damped) if "damping_ratios" in p.name}
    assert bounds["beam.damping_ratios[0]"] == 1.0 and bounds["beam.damping_ratios[1]"] == pytest.approx(0.064)
    assert rig_with(damped, bounds).beam.damping_ratios[0] == 1.0
    parameters = tuple(p for p in priors(damped) if p.name == "beam.damping_ratios[0]")
    lines = np.ones((1, 3), dtype=complex)
    missed = RecordMisfit("run", damped, "base", 1.0, np.arange(3.0), rms(lines.T), lines, lines, lines)
    for value, said in ((1.0, True), (0.5, False)):
        estimates = Estimates.of(parameters, np.array([value]), np.array([[0.01]]))
        words = " ".join(RigUpdate(damped, damped, (), estimates, (missed,), ("1:+Z",), True, ()).warnings)
        assert ("damped critically (beam.damping_ratios[0] = 1)" in words and "g for m/s²" in words) == said


def test_a_shaft_of_sections():
    steel = Material(210e9, 7850.0)
    brass = dataclasses.replace(steel, young_modulus=1e11, density=8500.0)
    shaft = Shaft(
        (Section(0.5, diameter=0.01), Section(0.5, diameter=0.008, material=brass)),
        (Support(0.0, "elastic", 1e6, 1e3), Support(0.9, "pinned")), (Disc(0.7, 0.3),), steel,
    )  # fmt: skip
    rig = Rig(
        "stepped", None, (Bushing(0.6, 3e-4, 0.01, Grease(4e3, 3.0), Contact(1e4)),), (Sensor(1, 0.3), Sensor(2, 1.0)),
        (PointMass(1.0, 0.2),), structure=shaft, tolerances=(Tolerance("structure.supports[0].rotation", "20 %"),),
    )  # fmt: skip
    prior_of = by_name(rig)
    expected = {
        "structure.material.young_modulus": 0.03, "structure.sections[1].material.density": 0.01,
        "structure.discs[0].mass": 0.05, "structure.supports[0].rotation": 0.2, "masses[0].mass": 0.05,
    }  # fmt: skip
    assert {name: prior_of[name].prior_std for name in expected} == pytest.approx(expected)
    assert prior_of["sensors[1].position"].high == 1.0
    changed = rig_with(rig, {"structure.supports[0].rotation": 900.0, "structure.discs[0].mass": 0.31})
    assert changed.structure.supports[0].rotation == 900.0
    assert changed.structure.discs[0].mass == 0.31


def test_few_of_many_parameters_are_named():
    """A sentence names six of those that records say nothing about; the table of parameters has all."""
    names = [f"sensors[{i}].gain" for i in range(30)]
    said = unsaid_words(names)
    assert "sensors[5].gain" in said and "sensors[6].gain" not in said and " and 24 more: values are those" in said
    assert unsaid_words(names[:1]).endswith("sensors[0].gain: its value is that of the rig file, within its tolerance")
