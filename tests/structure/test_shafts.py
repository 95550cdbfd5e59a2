"""Several shafts: what they refuse, and that springs and dampers join them.

Frequencies: tests/verification/test_shafts.py; a clearance between two: tests/verification/test_relative_clearance.py.
"""

import dataclasses

import numpy as np
import pytest

from clearance_mj import Bushing, Contact, Grease, PointMass, Rig, RigError, Sensor, Shaker, beam, linear_model
from clearance_mj.structure import Material, Section, Shaft, Shafts, Spring, Support

from ..refusals import assert_refused

STEEL = Material(210e9, 7850.0)
PINS = Support(0.0, "pinned"), Support(1.0, "pinned")


def part(name, supports=PINS, **more):
    return Shaft((Section(1.0, 0.02),), supports, (), STEEL, theory="euler", name=name, **more)


PAIR = Shafts((part("inner"), part("outer")))


def rig(structure, at="inner@0.5", bushings=(), **more):
    return Rig("shafts", None, bushings, (Sensor(1, at),), structure=structure, **more)


@pytest.mark.parametrize(("changes", "message"), [
    ({"parts": ()}, "parts must hold 1 or more, got none"),
    ({"parts": (part(""),)}, 'parts[0].name "" must be letters, digits, spaces, _ and -'),
    ({"parts": (part("a"), part("a"))}, 'parts[1].name "a" is used twice; each shaft needs its own'),
    ({"parts": (part("a", damping_ratios=(0.01,)),)},
     "parts[0].damping_ratios: only the modes of the whole have them; give them there"),
    ({"springs": (Spring(0.5, 1e3),)},
     'springs[0].position 0.5 m is on none of the shafts: name one, "inner@...", "outer@..."'),
    ({"springs": (Spring("inner@0.5", 1e3, "outer@1.5"),)},
     'springs[0].to 1.5 m lies outside the shaft "outer" (0 <= x <= 1 m)'),
    ({"springs": (Spring("inner@0.5", 1e3, "inner@0.5"),)},
     "springs[0].to is the spring's own position; give another point"),
])  # fmt: skip
def test_refused(changes, message):
    words = assert_refused(RigError, None, dataclasses.replace, PAIR, **changes)
    assert words.removeprefix("shafts.").removeprefix("shafts: ") == message


def test_points_name_their_shaft():
    words = r'sensors\[0\].position "mid@0.5" is on none of the shafts: name one, "inner@'
    assert_refused(RigError, words, rig, PAIR, at="mid@0.5")
    assert [shaft.name for shaft in PAIR.shafts] == ["inner", "outer"]
    assert PAIR.total_mass == pytest.approx(2 * 7850 * np.pi * 0.02**2 / 4)


def test_equal_shafts_joined_by_a_spring():
    """In phase as one alone; in opposite phase as one on a spring of twice the stiffness to the base."""
    spring = 3e5
    joined = beam.natural_frequencies(rig(Shafts(PAIR.parts, (Spring("inner@0.3", spring, "outer@0.3"),))), 8)
    alone = Rig("one", None, (), (Sensor(1, 0.5),), structure=part(""))
    held = alone.replace(structure=part("", (*PINS, Support(0.3, translation=2 * spring))))
    expected = np.sort(np.concatenate([beam.natural_frequencies(r, 8) for r in (alone, held)]))[:8]
    np.testing.assert_allclose(joined, expected, rtol=1e-12)


def test_spring_to_the_base_is_a_support():
    one = linear_model(rig(Shafts((part("inner"),), (Spring("inner@0.3", 3e5, damping=20.0),))), 6)
    support = Support(0.3, translation=3e5, translation_damping=20.0)
    other = linear_model(Rig("one", None, (), (Sensor(1, 0.5),), structure=part("", (*PINS, support))), 6)
    np.testing.assert_allclose(one.omega, other.omega, rtol=1e-12)
    np.testing.assert_allclose(one.damping, other.damping, rtol=1e-9)
    np.testing.assert_allclose(np.abs(one.coupling), np.abs(other.coupling), atol=1e-8)


def test_damping_of_each_shaft():
    """Each mode of unconnected shafts has its own shaft's Rayleigh damping, and that of the whole."""
    parts = part("inner", rayleigh=(2.0, 1e-6)), part("outer", rayleigh=(5.0, 0.0))
    model = linear_model(rig(Shafts(parts, (), (0.25, 0.0), (0.01,))), 4)
    one = np.array([9.0, 36.0]) / 9 * model.omega[0]
    np.testing.assert_allclose(model.omega[:4], np.repeat(one, 2), rtol=1e-12)
    # Equal frequencies: the damping matrix of a pair has the two shafts' as its eigenvalues.
    full = np.diag(model.damping) + (model.coupling if model.coupling.size else 0)
    for i in (0, 2):
        omega = model.omega[i]
        expected = np.sort([2.0 + 1e-6 * omega**2, 5.0]) + 0.25 + 0.02 * omega
        np.testing.assert_allclose(np.linalg.eigvalsh(full[i : i + 2, i : i + 2]), expected, rtol=1e-9)


def test_clearance_moves_relatively():
    """A force on the outer shaft closes the clearance by that shaft's deflection there, with the opposite sign."""
    bushing = Bushing("inner@0.4", 1e-3, 0.02, Grease(0.0), Contact(1e5), to="outer@0.4")
    joined = rig(PAIR, shaker=Shaker("force", "outer@0.4"), masses=(PointMass("inner@0.5", 0.2),))
    model = linear_model(joined.replace(bushings=(bushing,)), 8)
    relative = model.at_bushings / model.omega**2 @ model.input("force")
    rigidity = 210e9 * np.pi * 0.02**4 / 64
    assert relative[0] == pytest.approx(-(0.4**2 * 0.6**2) / (3 * rigidity), rel=1e-10)  # Roark, table 8.1, 1e
    at_ends = model.shapes(["inner@0.39", "inner@0.41"]) - model.shapes(["outer@0.39", "outer@0.41"])
    np.testing.assert_allclose(model.at_ends, at_ends, atol=1e-12 * np.abs(at_ends).max())


def test_clearance_reaches_past_the_other_shaft():
    outer = part("outer", (Support(0.2, "pinned"), Support(1.2, "pinned")), start=0.2)
    bushing = Bushing("inner@0.205", 1e-3, 0.02, Grease(0.0), Contact(1e5), to="outer@0.205")
    message = r'bushings\[0\].length 0.02 m makes it reach from 0.195 to 0.215 m, past the shaft "outer" \(0.2 <= x <='
    assert_refused(RigError, message, rig, Shafts((part("inner"), outer)), bushings=(bushing,))
