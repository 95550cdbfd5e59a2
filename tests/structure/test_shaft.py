"""Shafts: what they refuse, their mass, theory and damping, and the uniform cantilever written as one.

Frequencies and static deflections: tests/verification/test_shafts.py.
"""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj import ConstantLaw, Rig, RigError, Sensor, Shaker, beam, linear_model
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

from ..conftest import TABLE1
from ..refusals import assert_refused

STEEL = Material(210e9, 7850.0)
UNIFORM, BASE = (Section(1.0, 0.02),), Shaker()
AS_SHAFT = TABLE1.replace(beam=None, structure=TABLE1.beam.shafts[0])


def rig(shaft, at=0.5, shaker=BASE):
    return Rig("shaft", None, (), (Sensor(1, at),), shaker=shaker, structure=shaft)


def simple(*supports, **more):
    return Shaft(**{"sections": UNIFORM, "supports": supports, "material": STEEL, "theory": "euler"} | more)


@pytest.mark.parametrize(("changes", "message"), [
    ({"material": None}, "sections[0].material is missing, and the shaft has no material for all sections"),
    ({"supports": (Support(1.1, "pinned"),)}, "supports[0].position 1.1 m lies outside the shaft (0 <= x <= 1 m)"),
    ({"discs": (Disc(-0.1, 1.0),)}, "discs[0].position -0.1 m lies outside the shaft (0 <= x <= 1 m)"),
    ({"sections": ()}, "sections must hold 1 or more, got none"),
    ({"theory": "bernoulli"}, 'theory "bernoulli" is unknown; use auto, euler or timoshenko'),
])  # fmt: skip
def test_refused(changes, message):
    words = assert_refused(RigError, None, dataclasses.replace, simple(), **changes)
    assert words.removeprefix("shaft.").removeprefix("shaft: ") == message


@pytest.mark.parametrize(("fields", "message"), [
    ({}, "support: holds nothing; give kind (clamped, pinned or guided), or springs or dampers"),
    ({"kind": "pinned", "translation": 1e5}, 'translation has no effect, as a support of kind "pinned" allows no'),
    ({"kind": "clamped", "rotation_damping": 1.0}, 'rotation_damping has no effect, as a support of kind "clamped"'),
    ({"kind": "guided", "rotation": 1e5}, 'rotation has no effect, as a support of kind "guided" allows no'),
])  # fmt: skip
def test_supports_refused(fields, message):
    assert message in assert_refused(RigError, None, Support, 0.5, **fields)


@pytest.mark.parametrize(("changes", "message"), [
    ({"width": 0.1}, "give either diameter, or width and height"),
    ({"diameter": None, "inner_diameter": 0.01, "width": 0.1, "height": 0.1}, "inner_diameter needs a diameter"),
    ({"inner_diameter": 0.02}, "inner_diameter (0.02, 0.02) m must be less than diameter (0.02, 0.02) m"),
    ({"diameter": (0.02, 0.0)}, "diameter[1] must be > 0"),
])  # fmt: skip
def test_sections_refused(changes, message):
    assert message in assert_refused(RigError, None, dataclasses.replace, UNIFORM[0], **changes)


def test_points_outside_are_refused():
    with pytest.raises(RigError, match=r"sensors\[0\].position 1.01 m lies outside the shaft \(0 <= x <= 1 m\)"):
        rig(simple(), at=1.01)
    assert_refused(RigError, r'sensors\[0\].position "3:\+Z" is no position on the shaft', rig, simple(), at="3:+Z")


def test_lengths_that_do_not_add_up_to_the_last_digit():
    """0.1 + 0.2 is a little more than 0.3; a support at the end counts as there."""
    three = tuple(Section(length, 0.02) for length in (0.1, 0.2, 0.7))
    ends = Support(0.0, "pinned"), Support(1.0, "pinned")
    edge = Support(0.3, translation=1e5), Support(0.1 + 0.2, translation=1e5)
    split, whole = (rig(simple(*ends, support, sections=s)) for support, s in zip(edge, (three, UNIFORM)))
    np.testing.assert_allclose(beam.natural_frequencies(split, 6), beam.natural_frequencies(whole, 6), rtol=1e-12)


def test_supports_at_one_place():
    once, again = Support(0.3, "pinned"), Support(0.3 + 1e-9, "clamped")
    twice = rig(simple(once, once, again))
    np.testing.assert_allclose(beam.natural_frequencies(twice, 6), beam.natural_frequencies(rig(simple(again)), 6))


@pytest.mark.parametrize("length", [1e-2, 1e-4, 1e-5])
def test_short_sections(length):
    """A groove of the shaft's own diameter changes nothing, however short; free, so that no support helps."""
    sections = tuple(Section(x, 0.02) for x in (0.4, length, 0.6 - length))
    hz = beam.natural_frequencies(rig(simple(sections=sections)), 8)
    assert not hz[:2].any()
    np.testing.assert_allclose(hz[2:], beam.natural_frequencies(rig(simple()), 8)[2:], rtol=1e-11)


def test_mass():
    """Round, a tube, a truncated cone (Δ = π l (D² + D d + d²)/12), a rectangle, each of its material; discs."""
    sections = (
        Section(0.2, 0.03), Section(0.3, 0.05, 0.04, material=Material(70e9, 2700.0)), Section(0.1, (0.04, 0.02)),
        Section(0.4, width=0.02, height=(0.03, 0.01)),
    )  # fmt: skip
    steel = np.pi * (0.2 * 0.03**2 / 4 + 0.1 * (0.04**2 + 0.04 * 0.02 + 0.02**2) / 12) + 0.4 * 0.02 * 0.02
    tube = 2700 * 0.3 * np.pi * (0.05**2 - 0.04**2) / 4
    shaft = simple(sections=sections, discs=(Disc(0.5, 2.5, 0.01),))
    assert shaft.total_mass == pytest.approx(7850 * steel + tube + 2.5, rel=1e-13)
    # Whatever is free moves with the base: the rigid motions carry the whole mass, bending none.
    participation = linear_model(rig(shaft), 8).participation
    assert np.sum(participation[:2] ** 2) == pytest.approx(shaft.total_mass, rel=1e-12)
    np.testing.assert_allclose(participation[2:], 0, atol=1e-8)


THEORIES = [(0.01, (), "euler"), (0.04, (), "timoshenko"), (0.02, (), "euler"), (0.02, (0.0, 0.2, 0.6), "timoshenko")]


@pytest.mark.parametrize(("diameter", "supports", "theory"), THEORIES)
def test_automatic_theory(diameter, supports, theory):
    """Timoshenko's, where it lowers the third frequency of a pinned span by over 1 %: steel, slenderness below 132."""
    pins = tuple(Support(x, "pinned") for x in supports)
    shaft = simple(*pins, sections=(Section(1.0, diameter),), theory="auto")
    span = 0.4 if supports else 1.0
    assert shaft.slenderness == pytest.approx(4 * span / diameter)
    assert shaft.bending_theory == theory == ("timoshenko" if 4 * span / diameter < 132 else "euler")
    assert dataclasses.replace(shaft, theory="euler").bending_theory == "euler"


def test_timoshenko_tends_to_euler():
    """For a slenderness of 2000, by (1 + E/κG)(nπ/s)²/2."""
    pins = Support(0.0, "pinned"), Support(1.0, "pinned")
    thin = (rig(simple(*pins, sections=(Section(1.0, 0.002),), theory=theory)) for theory in ("euler", "timoshenko"))
    by_theory = [beam.natural_frequencies(each, 6) for each in thin]
    ratio = 2 * (1 + 0.3) * (7 + 6 * 0.3) / (6 * (1 + 0.3))  # E/κG
    lowered = (1 + ratio) * (np.arange(1, 7) * np.pi / 2000) ** 2 / 2
    np.testing.assert_allclose(1 - by_theory[1] / by_theory[0], lowered, rtol=1e-3)


def test_dampers():
    """A free shaft on two equal springs and dampers at its ends: c/m in heave, 6 c/m in pitch (as it is rigid)."""
    ends = tuple(Support(x, translation=0.04, translation_damping=3.0) for x in (0.0, 1.0))
    shaft = simple(*ends, rayleigh=(0.5, 0.0))
    model = linear_model(rig(shaft), 2)
    np.testing.assert_allclose(model.damping[:2], 0.5 + np.array([6.0, 18.0]) / shaft.total_mass, rtol=1e-5)


def test_dampers_couple_modes():
    """A damper at the tip: its forces on the modes are -c φ φᵀ q̇."""
    shaft = simple(Support(0.0, "clamped"), Support(1.0, translation_damping=7.0), damping_ratios=(0.01, 0.02))
    model = linear_model(rig(shaft), 6)
    tip = model.shapes([1.0])[0]
    expected = 7.0 * np.outer(tip, tip)
    np.testing.assert_allclose(model.coupling, expected - np.diag(expected.diagonal()), atol=1e-9)
    ratio = np.array([0.01, *[0.02] * (model.size - 1)])
    np.testing.assert_allclose(model.damping, 2 * ratio * model.omega + expected.diagonal(), rtol=1e-12)


def test_rotation_damper_and_disc():
    """A rigid disc's inertia on a stiff hub: a pendulum of the rotation spring and damper alone."""
    stiff = Material(1e16, 1e-3)
    hinge = Support(0.0, "pinned", rotation=50.0, rotation_damping=0.3)
    model = linear_model(rig(simple(hinge, discs=(Disc(1.0, 2.0, 0.5),), material=stiff)), 1)
    inertia = 2.0 * 1.0**2 + 0.5
    assert model.omega[0] == pytest.approx(np.sqrt(50.0 / inertia), rel=1e-6)
    assert model.damping[0] == pytest.approx(0.3 / inertia, rel=1e-6)


def test_no_static_deflection_of_what_is_free():
    model = linear_model(rig(simple(Support(0.0, "pinned")), shaker=Shaker("force", 0.3)), 4)
    assert model.omega[0] == 0 and model.omega[1] > 0
    with pytest.raises(RigError, match="can move without bending, so it has no static deflection; add a support"):
        model.static_deflection([0.5], model.input("force")[None])


@pytest.mark.parametrize("modes", [4, 8])
def test_cantilever_as_a_shaft(modes):
    """The frequencies of [beam]; its Ritz functions are closed forms, and elements add what they lack."""
    hz, expected = (beam.natural_frequencies(r, modes) for r in (AS_SHAFT, TABLE1))
    np.testing.assert_allclose(hz[:6], expected[:6], rtol=1e-9)
    x = np.linspace(0.05, 1.0, 20)
    shapes, closed = (beam.mode_shapes(r, x, 4) for r in (AS_SHAFT, TABLE1))
    np.testing.assert_allclose(shapes, closed, atol=1e-6 * np.abs(closed).max())


@pytest.mark.parametrize("level", [1.0, 5.0])
def test_cantilever_as_a_shaft_in_contact(level):
    """FRFs of the same excitation within 0.05 dB; impacts scatter what differs in the last digits."""
    excitation = cm.excitation.random(4.0, 2048.0, band=(5, 220), rms=level, seed=3)
    law = ConstantLaw(7.8e3, 4.0)
    responses = [cm.simulate(r, excitation, law, engine="modal") for r in (AS_SHAFT, TABLE1)]
    assert responses[1].contact_force.any()
    assert cm.rmse_db(*(cm.estimate_frf(f, resolution=1.0).value for f in responses)).max() < 0.05
