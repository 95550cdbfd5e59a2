"""Grease: yield, squeeze film, refusals and the table that engines read; loops are in verification/test_bouc_wen.py."""

import numpy as np
import pytest

from clearance_mj.clearance import ConstantLaw
from clearance_mj.clearance.greases import bouc_wen
from clearance_mj.clearance.greases.bouc_wen import film_damping
from clearance_mj.clearance.record import fillings_of
from clearance_mj.core.errors import LawError, RigError
from clearance_mj.rig import Grease

from ..conftest import TABLE1 as RIG


def bouc_wen_step(z, dx, *parameters):
    """Along one coordinate."""
    return bouc_wen.bouc_wen_step((z,), (dx,), *parameters)[0]


@pytest.mark.parametrize("numbers", [(1.0, 0.5, 0.5, 1.0), (2.0, 3e7, -1e7, 2.0), (1.0, 4.0, 1.0, 3.0)])
def test_ultimate_displacement(numbers):
    """z_ult = (A/(β+γ))^(1/n): where a long stroke ends, and where nothing moves any more."""
    a, beta, gamma, n = numbers
    grease = Grease(1.0, elastic_ratio=0.5, amplitude=a, beta=beta, gamma=gamma, exponent=n)
    ultimate = (a / (beta + gamma)) ** (1 / n)
    assert grease.yield_displacement == pytest.approx(ultimate, rel=1e-14)
    z = 0.0
    for _ in range(4000):
        z = bouc_wen_step(z, 0.01 * ultimate, *numbers)
    assert z == pytest.approx(ultimate, rel=1e-6)
    assert bouc_wen_step(ultimate, 1.0, *numbers) == pytest.approx(ultimate, rel=1e-12)
    assert Grease(1.0).yield_displacement == np.inf  # linear
    assert bouc_wen_step(0.3, 0.25, 1.0, 0.0, 0.0, 2.0) == pytest.approx(0.55, rel=1e-15)


def test_step_is_of_second_order():
    """z = tanh x for n = 2, β = γ = 1/2: half the step, a quarter of the error."""
    errors = []
    for steps in (50, 100, 200):
        z = 0.0
        for _ in range(steps):
            z = bouc_wen_step(z, 1.5 / steps, 1.0, 0.5, 0.5, 2.0)
        errors.append(abs(z - np.tanh(1.5)))
    assert (errors[0] / errors[1], errors[1] / errors[2]) == pytest.approx((4, 4), rel=0.05)


@pytest.mark.parametrize(("beta", "gamma", "message"), [
    (0.5, 0.6, "gamma 0.6 makes the Bouc-Wen element create energy"), (0.5, -0.6, "gamma -0.6 makes"),
    (-0.5, 0.0, "beta must be >= 0"), (0.5, -0.5, "must be > 0 when elastic_ratio < 1"),
    (800.0, -1100.0, "gamma -1100 makes"),  # Noël & Schoukens' set: a softening loop beyond this range
])  # fmt: skip
def test_only_dissipative_grease(beta, gamma, message):
    """-β <= γ <= β, and β + γ > 0 where z carries force."""
    with pytest.raises(RigError, match=message):
        Grease(1.0, elastic_ratio=0.5, beta=beta, gamma=gamma)


def test_dissipative_at_the_edges():
    """γ = β and γ just above -β pass; their loops dissipate."""
    for gamma in (0.5, -0.499):
        Grease(1.0, elastic_ratio=0.5, beta=0.5, gamma=gamma)
        z, energy = 0.0, 0.0
        for dx in 1e-3 * np.concatenate((np.ones(1000), -np.ones(2000), np.ones(2000))):
            new = bouc_wen_step(z, dx, 1.0, 0.5, gamma, 2.0)
            energy, z = energy + (z + new) / 2 * dx, new
        assert energy > 0.1


FACTORS = [(0.0, 1.0), (3.75e-4, 4.0), (-3.75e-4, 4.0), (5e-4, 9.0), (6e-4, 25.0), (7e-4, 25.0), (2e-3, 25.0)]


@pytest.mark.parametrize(("x", "factor"), FACTORS)
def test_squeeze_film(x, factor):
    """c / (1 - |x|/h)², h = 0.75 mm, as far as the asperities' 20 % of h (physics.md, section 3)."""
    assert film_damping(x, 4.0, 1 / 7.5e-4, 0.2) == pytest.approx(4 * factor, rel=1e-12)
    assert film_damping(x, 4.0, 0.0, 0.2) == 4.0  # no film


def table(rig, law):
    return [model.parameters() for model in fillings_of(rig, law)]


def test_table():
    """The rig's own grease, or the law's: one for all bushings or one each."""
    row = [4369.0, 1.0, 1.0, 0.0, 0.0, 2.0, 3.0, 0.0, 0.2]
    np.testing.assert_array_equal(table(RIG, ConstantLaw(1e4, 1.0)), [row, row])
    film = Grease(5e3, 2.0, 0.8, 1.1, 1.5e7, 5e6, 1.5, 8e-4, 0.1)
    other = [5e3, 0.8, 1.1, 1.5e7, 5e6, 1.5, 2.0, 1250.0, 0.1]
    np.testing.assert_allclose(table(RIG, ConstantLaw(1e4, 1.0, film)), [other, other], rtol=1e-15)
    both = table(RIG, ConstantLaw(1e4, 1.0, (RIG.bushings[0].grease, film)))
    np.testing.assert_allclose(both, [row, other], rtol=1e-15)
    with pytest.raises(LawError, match="grease for 3 bushings, the rig has 2"):
        table(RIG, ConstantLaw(1e4, 1.0, (Grease(1.0),) * 3))
