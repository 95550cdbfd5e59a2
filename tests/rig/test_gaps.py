"""Another gap at a rig's bushings, by value, with a unit, by factor and by name."""

import re
from dataclasses import replace

import numpy as np
import pytest

from clearance_mj import AmplitudeLaw, ContactLaw, Model, Rig
from clearance_mj.clearance import KelvinVoigt
from clearance_mj.core.errors import LawError, RigError
from clearance_mj.core.units import si_value

from ..refusals import assert_refused

TABLE1 = Rig.load("models/table1_rig.toml")  # gaps of 0.3 mm at 6:+Z and 7:+Z


def gaps(rig):
    return [bushing.gap for bushing in rig.bushings]


@pytest.mark.parametrize("gap, expected", [
    (9e-5, [9e-5, 9e-5]),
    ("0.09mm", [9e-5, 9e-5]),
    (" 90 µm ", [9e-5, 9e-5]),
    ("x0.5", [1.5e-4, 1.5e-4]),
    ("×2", [6e-4, 6e-4]),
    ({"7:+Z": "x0.5"}, [3e-4, 1.5e-4]),
    ({"bushings[0]": "0.2 mm", "7:+Z": 1e-4}, [2e-4, 1e-4]),
])  # fmt: skip
def test_gaps_that_can_be_given(gap, expected):
    rig = TABLE1.with_gap(gap)
    np.testing.assert_allclose(gaps(rig), expected, rtol=1e-12)
    assert rig.replace(bushings=TABLE1.bushings) == TABLE1  # all else is the same
    assert [replace(b, gap=3e-4) for b in rig.bushings] == list(TABLE1.bushings)


@pytest.mark.parametrize("gap, words", [
    ("half", '"half" is no number'),
    ("0.1 furlong", 'unit "furlong" of displacement is unknown; use m, mm'),
    ("x", "is no factor, such as x0.5"),
    (0.0, "must be above 0"),
    ("x-1", "must be above 0"),
    ({"9:+Z": 1e-4}, '"9:+Z": no one bushing has this name; the rig has 6:+Z, 7:+Z'),
])  # fmt: skip
def test_gaps_that_cannot(gap, words):
    assert_refused(RigError, re.escape(words), TABLE1.with_gap, gap)


def test_a_shaft_that_would_not_stand_in_its_bushing():
    rig = TABLE1.replace(bushings=(replace(TABLE1.bushings[0], offset=2e-4),))
    assert_refused(RigError, r"bushings\[0\].*lies beyond the gap 0.00015 m", rig.with_gap, "x0.5")


@pytest.mark.parametrize("text, quantity, expected", [
    ("620 mm", "displacement", 0.62), ("0.62", "displacement", 0.62), ("6.2e-1m", "displacement", 0.62),
    ("450 g", "mass", 0.45), ("210GPa", "pressure", 2.1e11),
])  # fmt: skip
def test_numbers_with_units(text, quantity, expected):
    assert si_value(text, quantity) == pytest.approx(expected, rel=1e-12)


def test_a_model_keeps_its_law_and_its_draws():
    law = ContactLaw(KelvinVoigt(2e4, 3.0))
    drawn = [Model(TABLE1.with_gap(3.1e-4), law), Model(TABLE1.with_gap(2.9e-4), law)]
    half = Model(TABLE1, law, lambda n, seed: drawn[:n]).with_gap("x0.5")
    assert half == Model(TABLE1.with_gap(1.5e-4), law)
    np.testing.assert_allclose([gaps(model.rig)[0] for model in half.draw(2)], [1.55e-4, 1.45e-4])
    assert_refused(LawError, "no posterior", Model(TABLE1, AmplitudeLaw([1e-4], [2e4], [3.0])).with_gap(1e-4).draw, 1)
