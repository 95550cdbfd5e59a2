"""Friction of transmissions against closed forms: capstan, screw, a play of the torque and its inverse."""

import math

import numpy as np
import pytest

from clearance_mj.drives import Efficiency, carried, entering, presliding

TURNS = np.sin(np.linspace(0, 6 * np.pi, 3001))


def test_capstan():
    """Euler: T e^{-μφ} passes where the motor pulls, and T e^{μφ} where the load does, less friction without load."""
    torque = 2.0 + np.concatenate([np.linspace(1, -1, 400), np.linspace(-1, 1, 400)])  # never slack
    out = carried(torque, 0.1, *Efficiency.capstan(0.3))
    falling, rising = (torque[:400] + 0.1) * math.exp(0.3), (torque[400:] - 0.1) * math.exp(-0.3)
    np.testing.assert_allclose(out[:400], np.minimum(2.9 * math.exp(-0.3), falling), rtol=1e-12)
    np.testing.assert_allclose(out[400:], np.maximum(1.1 * math.exp(0.3), rising), rtol=1e-12)


def test_play_of_a_negative_torque_is_mirrored():
    np.testing.assert_allclose(carried(-TURNS, 0.1, 0.8, 0.7), -carried(TURNS, 0.1, 0.8, 0.7), atol=1e-15)


def test_without_friction_all_passes():
    np.testing.assert_array_equal(carried(TURNS, 0.0, 1.0, 1.0), TURNS)


def test_screw():
    """tan λ/tan(λ + ρ) is what an incline of λ with friction μ says; a screw locks itself from μ = tan λ on."""
    lead = math.radians(5)
    eta, sin, cos = Efficiency.screw(lead, 0.05), math.sin(lead), math.cos(lead)
    # A square thread on an incline: W (sin λ + μ cos λ) along it lifts, W sin λ would do without friction.
    assert eta.forward == pytest.approx(math.tan(lead) * (cos - 0.05 * sin) / (sin + 0.05 * cos), rel=1e-12)
    assert 0 < eta.backward < eta.forward < 1
    assert Efficiency.screw(lead, math.tan(lead)).backward == pytest.approx(0, abs=1e-12)


def test_a_drive_that_locks_itself_keeps_its_load():
    """Its motor gives way to nothing: what is carried never falls while the motor pushes the same way."""
    out = carried(np.concatenate([np.linspace(0, 1, 50), np.linspace(1, 0, 50)]), 0.0, 0.5, 0.0)
    np.testing.assert_allclose(out[50:], 0.5)


def test_what_a_load_makes_the_motor_feel():
    """A load of torque z > 0 is felt as η' z - C while it grows, and as z/η + C while it falls, from either end."""
    load = np.concatenate([np.linspace(3, 1, 400), np.linspace(1, 3, 400)])
    felt = entering(load, 0.1, 0.8, 0.7)
    np.testing.assert_allclose(felt[:400], np.minimum(0.7 * 3 - 0.1, load[:400] / 0.8 + 0.1), rtol=1e-12)
    np.testing.assert_allclose(felt[400:], np.maximum(1 / 0.8 + 0.1, 0.7 * load[400:] - 0.1), rtol=1e-12)
    np.testing.assert_allclose(entering(-load, 0.1, 0.8, 0.7), -felt, rtol=1e-12)


def test_presliding():
    """A sliding element of width w: x/w from rest, 1 - (x₀ - x)/w after a reversal at x₀, until it slides."""
    x = np.concatenate([np.linspace(0, 1, 101), np.linspace(1, 0, 101), np.linspace(0, 1, 101)])
    presliding_ratio = presliding(x, 0.2)
    expected = np.interp(np.arange(150, 303), [150, 202, 202 + 40, 302], [-1, -1, 1, 1])
    np.testing.assert_allclose(presliding_ratio[150:], expected, atol=0.03)
    np.testing.assert_allclose(presliding_ratio[101:142], 1 - (1 - x[101:142]) / 0.2, atol=1e-12)
