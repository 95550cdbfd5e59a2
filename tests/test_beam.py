"""Ritz model of the shaft against closed forms; verification/test_beam_fe.py has elements."""

from pathlib import Path

import numpy as np
import pytest

from clearance_mj import beam
from clearance_mj.linear import linear_model
from clearance_mj.rig import Rig, Sensor, Shaker

from .structure.test_beam import integrate

RIG = Rig.load(Path(__file__).parents[1] / "models" / "table1_rig.toml")
FORCE_RIG = RIG.replace(shaker=Shaker("force", 0.3))
BARE = RIG.replace(masses=(), bushings=())
RIGIDITY = 210e9 * np.pi * 0.0086166**4 / 64


def flexibility(x):
    """Deflections at x of a clamped beam under unit forces at x (Roark, table 8.1, case 1a)."""
    near, far = np.minimum(x[:, None], x), np.maximum(x[:, None], x)
    return near**2 * (3 * far - near) / (6 * RIGIDITY)


@pytest.mark.parametrize("modes", [1, 8, 20])
def test_static_deflection_of_the_linear_model(modes):
    """Deflection of bushings and tip under forces on each other, whatever modes are left out (Roark, table 8.1, 1a)."""
    model, x = linear_model(RIG, modes), np.array([0.5484, 0.7918, 1.0])
    shapes = model.shapes(x)
    np.testing.assert_allclose(shapes / model.omega**2 @ shapes.T, flexibility(x), rtol=1e-9)


@pytest.mark.parametrize("grease", [False, True])
def test_modes_have_unit_mass_and_lift_the_tip(grease):
    """With the engines' eight modes; the residual modes are small differences of shapes, which costs them digits."""
    model = linear_model(RIG, 8, grease)
    mass = RIG.beam.mass_per_length * integrate(lambda x: model.shapes(x)[:, :, None] * model.shapes(x)[:, None], 1.0)
    tip = model.shapes([1.0])[0]
    np.testing.assert_allclose(mass + 0.434 * np.outer(tip, tip), np.eye(model.size), atol=1e-5)
    np.testing.assert_allclose(np.diag(mass)[:6] + 0.434 * tip[:6] ** 2, 1, rtol=1e-8)
    assert np.all(tip > 0)


def test_participation_of_the_bare_shaft():
    """Effective masses (2σ/λ)² of a cantilever: 61.31, 18.83, 6.47, 3.31 % of its mass (Blevins; NASTRAN manuals)."""
    model = linear_model(BARE, 30)
    mass = BARE.total_mass
    np.testing.assert_allclose(model.participation[:4] ** 2 / mass, [0.6131, 0.1883, 0.0647, 0.0331], atol=6e-5)
    # σ -> 1 and λ -> (i - 1/2)π: the masses left out of n modes are 4/(π² n) of the whole.
    assert 1 - np.sum(model.participation**2) / mass == pytest.approx(4 / (np.pi**2 * 30), rel=1e-3)


def test_participation_sums_to_the_total_mass():
    """With the lever boss: the missing share falls as 1/n, so two sizes extrapolate to the whole."""
    total = [np.sum(linear_model(RIG, n).participation ** 2) for n in (40, 80)]
    assert total[0] < total[1] < RIG.total_mass
    assert 2 * total[1] - total[0] == pytest.approx(RIG.total_mass, rel=1e-4)


def test_reciprocity():
    """Maxwell-Betti: the response at r to a force at s is that at s to a force at r."""

    def frf(push, measure):
        rig = RIG.replace(shaker=Shaker("force", push), sensors=(Sensor(1, measure),))
        return beam.linear_frf(rig, np.arange(5, 220, 0.5), n_modes=24)[0]

    there, back = frf(0.3, 0.65), frf(0.65, 0.3)
    # Not exact: the model has a static shape where the force is, and none at the sensor.
    assert np.max(np.abs(there - back)) < 1e-5 * np.max(np.abs(there))
    there, back = frf(0.5484, 1.0), frf(1.0, 0.5484)
    assert np.max(np.abs(there - back)) < 1e-9 * np.max(np.abs(there))


@pytest.mark.parametrize("rig", [RIG, FORCE_RIG], ids=["base", "force"])
def test_state_space(rig):
    """Its poles are the in-gap frequencies, slightly lowered by damping; its displacements twice integrated give H."""
    system = beam.state_space(rig)
    poles = np.sort(np.abs(system.poles()[system.poles().imag > 0]))[:4] / (2 * np.pi)
    np.testing.assert_allclose(poles, [9.25, 39.75, 92.85, 188.85], rtol=3e-4)
    assert (system.ninputs, system.noutputs) == (1, 10)
    f = np.linspace(5, 220, 300)
    value = np.squeeze(system(2j * np.pi * f))
    base = rig.shaker.kind == "base"
    # Sensors 6 and 7 sit at the bushings.
    np.testing.assert_allclose(value[5:7], -((2 * np.pi * f) ** 2) * value[8:] + base, rtol=1e-7)
    np.testing.assert_allclose(value[:8], beam.linear_frf(rig, f), rtol=1e-7)


def test_rayleigh_damping():
    """2ζω = η1 + η2 ω² (Eq. 6)."""
    model = linear_model(RIG, 4)
    np.testing.assert_allclose(model.damping, 0.5 + 1e-5 * model.omega**2, rtol=1e-14)
