"""Matrices that are not symmetric: seals and cross-coupled bearings (K), gyroscopic damping (C)."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj import Bushing, ConstantLaw, Contact, Grease, Rig, Sensor, Shaker, linear_model
from clearance_mj.engines.equilibrium import static_equilibrium
from clearance_mj.structure import Matrices
from clearance_mj.structure.attached import Oscillator

MASS, STIFFNESS, DAMPING = 2.0, 8e4, 10.0  # kg, N/m, N s/m
OMEGA = np.sqrt(STIFFNESS / MASS)
THRESHOLD = DAMPING * OMEGA  # N/m


def jeffcott(cross, gap=1.0, damping=DAMPING, gyroscopic=0.0, shape="round", **more):
    """A disc on two springs that a seal's cross stiffness drives, in a clearance that it does not reach."""
    structure = Matrices(
        "m-kg-s", None, ((MASS, 0.0), (0.0, MASS)), ((STIFFNESS, cross), (-cross, STIFFNESS)),
        ((damping, gyroscopic), (-gyroscopic, damping)), ("1:Y", "1:Z"),
    )  # fmt: skip
    wall = Bushing("1:Z", gap, 0.0, Grease(0.0), Contact(1e5), shape=shape)
    sensors = (Sensor(1, "1:Y"), Sensor(2, "1:Z"))
    return Rig("jeffcott", None, (wall,), sensors, shaker=Shaker("force", "1:Z"), structure=structure, **more)


def _sorted(poles):
    return poles[np.lexsort((poles.imag, np.round(poles.real, 6)))]


def test_poles_of_a_jeffcott_rotor():
    """m s² + c s + k ± i k_xy = 0; unstable where k_xy > c ω_n (Childs, Turbomachinery Rotordynamics, 1993, 1.5)."""
    for cross in (0.0, 0.9 * THRESHOLD, 1.1 * THRESHOLD):
        exact = np.concatenate([np.roots([MASS, DAMPING, STIFFNESS + 1j * sign * cross]) for sign in (1, -1)])
        poles = linear_model(jeffcott(cross)).poles().value
        np.testing.assert_allclose(_sorted(poles), _sorted(exact), rtol=1e-9)
        assert (poles.real.max() > 0) == (cross > THRESHOLD)


@pytest.mark.parametrize("shape", ["round", "slot"])
@pytest.mark.parametrize("ratio", [0.9, 1.1])
def test_simulated_decay_and_growth(ratio, shape):
    """A kick grows or decays as e^(Re s t) of the least damped pole, in both loops of the modal engine."""
    rig = jeffcott(ratio * THRESHOLD, shape=shape)
    fs, n = 4096.0, 8192
    kick = cm.Excitation(np.where(np.arange(n) < 8, 1.0, 0.0), fs, "force")
    moved = cm.simulate(rig, kick, ConstantLaw(0.0, 0.0), engine="modal").displacement
    size = np.sqrt(np.mean(np.reshape(moved[-1], (8, -1)) ** 2, axis=1))  # of eight pieces
    rate = np.polyfit(np.arange(4, 8) * n / 8 / fs, np.log(size[4:]), 1)[0]
    least = linear_model(rig).poles().value.real.max()
    assert (rate > 0) == (ratio > 1)
    np.testing.assert_allclose(rate, least, rtol=0.02, atol=0.01)


def test_gains_with_nonsymmetric_matrices():
    """(K - ω² M + iω C)⁻¹ of two degrees of freedom, with nonsymmetric K and C, and on an oscillator's reduction."""
    rig = jeffcott(3e4, gyroscopic=40.0)
    omega = np.array([150.0, 200.0, 250.0])
    model = linear_model(rig)
    k, c = np.array(rig.structure.stiffness), np.array(rig.structure.damping)
    exact = np.array([np.linalg.inv(k - w**2 * MASS * np.eye(2) + 1j * w * c)[:, 1] for w in omega])
    gains = model.responses(model.shapes(["1:Y", "1:Z"]), model.push()[:, None], omega)
    np.testing.assert_allclose(gains[..., 0], exact, rtol=1e-9)
    static = model.static_deflection(["1:Y", "1:Z"], model.push()[None])[:, 0]
    np.testing.assert_allclose(static, np.linalg.solve(k, [0.0, 1.0]), rtol=1e-9)


def test_attached_masses_keep_the_cross_stiffness():
    """An oscillator, far stiffer than the rest, is a mass in one direction: det(K - ω² M + iω C) = 0 at the poles."""
    rig = jeffcott(3e4, gyroscopic=40.0, shape="slot", oscillators=(Oscillator("1:Z", 1.0, 1e5, 0.0),))
    mass = np.diag([MASS, MASS + 1.0])
    k, c = np.array(rig.structure.stiffness), np.array(rig.structure.damping)
    state = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(mass, k), -np.linalg.solve(mass, c)]])
    poles = linear_model(rig).poles().value
    poles = poles[np.argsort(np.abs(poles))][:4]
    np.testing.assert_allclose(_sorted(poles), _sorted(np.linalg.eigvals(state)), rtol=1e-5)


def test_rounding_is_symmetrised():
    """Noise of 1e-9 of a file gives the very numbers of the symmetric matrix, and no cross stiffness."""
    exact = jeffcott(0.0)
    noise = 1e-9 * STIFFNESS
    noisy = dataclasses.replace(exact.structure, stiffness=((STIFFNESS, noise), (-noise, STIFFNESS)))
    linear = linear_model(exact.replace(structure=noisy))
    assert not linear.springs.size and not linear.coupling.size
    np.testing.assert_array_equal(linear.omega, linear_model(exact).omega)


def test_energies_of_a_cross_stiffness_balance():
    """What it puts in is counted as the drive's, so that nothing is left."""
    noise = cm.excitation.random(0.2, 4096.0, band=(10, 100), rms=5.0, seed=2, kind="force")
    for shape in ("slot", "round"):
        balance = cm.energy_balance(jeffcott(5 * THRESHOLD, shape=shape), noise, engine="modal")
        assert balance.imbalance < 1e-6 and balance.drive[-1] > 0


def test_rest_and_vibration_in_the_gap():
    """K x = m g at rest, and |(K - ω² M + iω C)⁻¹ F| of a sine, as continuation finds it in the plane and in space."""
    cross = 0.5 * THRESHOLD
    k, c = np.array([[STIFFNESS, cross], [-cross, STIFFNESS]]), DAMPING * np.eye(2)
    rest = static_equilibrium(jeffcott(cross, gravity=(0.0, 0.0, -9.81)))
    np.testing.assert_allclose(rest.displacement, np.linalg.solve(k, [0.0, -9.81 * MASS]), rtol=1e-6)
    for shape in ("slot", "round"):
        branch = cm.periodic.follow_response(cm.Model(jeffcott(cross, shape=shape)), 2.0, (25.0, 28.0), 3)
        omega = 2 * np.pi * branch.frequency
        exact = [np.abs(np.linalg.solve(k - w**2 * MASS * np.eye(2) + 1j * w * c, [0.0, 2.0])) for w in omega]
        np.testing.assert_allclose(np.abs(branch.acceleration[..., 1]), omega[:, None] ** 2 * exact, rtol=1e-6)
