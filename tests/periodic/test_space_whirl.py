"""Unbalance, rub and whirl by harmonic balance against closed-form circles, thresholds in oil, and time integration."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj import periodic
from clearance_mj.rig import Spin
from clearance_mj.rotors import synchronous_rub

from ..verification.page import Measured
from .jeffcott import CLEARANCE, FREQUENCY, GAP, GRAVITY, MASS, jeffcott, rigid_in_oil, unbalanced, viscosity_at

CHILDS = {0.1: (2.741, 0.503), 0.3: (2.607, 0.519), 0.5: (2.539, 0.515), 0.6: (2.707, 0.473), 0.7: (3.61, 0.346)}
"""Of a rigid rotor in short bearings, by eccentricity ratio: Ω √(C/g) at the threshold, whirl over spin (Childs,
Turbomachinery Rotordynamics, 1993, chapter 3)"""


@pytest.mark.parametrize(("begin", "end", "expected"), [(0.85, 1.0, 0.9252), (1.2, 1.0, 1.1032)])
def test_first_contact_under_unbalance(begin: float, end: float, expected: float, measured: Measured) -> None:
    """The free circle e ω²/|1 - ω² + i c ω| reaches the gap at ω = 0.9252, and from above at 1.1032."""
    branch = periodic.follow_unbalance(cm.Model(unbalanced(jeffcott())), (begin * FREQUENCY, end * FREQUENCY), 3)
    (contact, *_) = [p for p in branch.special if p.kind == "first contact"]
    value = branch.spin[contact.index] / FREQUENCY
    measured.equal(f"first contact from ω = {begin:g} on", value, expected, "circle e ω²/(1 - ω² + i c ω)", rel=1e-4)


@pytest.mark.parametrize("friction", [0.0, 0.02])
def test_a_synchronous_rub_is_a_circle(friction: float, measured: Measured) -> None:
    """Radius of the branch in contact, up to its end, beside the quadratic equation of the circle."""
    rig = unbalanced(jeffcott(friction=friction))
    branch = periodic.follow_unbalance(cm.Model(rig), (0.95 * FREQUENCY, 1.6 * FREQUENCY), 3, stability=False)
    rubs = synchronous_rub(rig, branch.spin, 0.5, 0.2 * MASS * GAP, friction, n_modes=8)
    radius = np.hypot(*np.abs(branch.clearance_displacement[:, :2, 1]).T) / np.sqrt(2)
    touching = radius > 1.0005 * GAP
    assert touching.sum() > 10
    apart = np.abs(radius[touching] / rubs.radius[touching, 1] - 1).max()
    what = f"synchronous rub, μ = {friction:g}, ω = 0.95 to 1.6: radius, largest error"
    measured.below(what, apart, 1e-4, "quadratic equation of the circle")


@pytest.mark.parametrize(("friction", "ends"), [(0.0, 4.328), (0.05, 3.715), (0.1, 2.999)])
def test_where_the_branch_of_a_rub_ends(friction: float, ends: float, measured: Measured) -> None:
    """It folds back where both radii of the circle meet."""
    model = cm.Model(unbalanced(jeffcott(friction=friction)))
    rub = periodic.follow_unbalance(model, (1.0 * FREQUENCY, (ends + 0.2) * FREQUENCY), 3, stability=False)
    end = max(rub.spin[p.index] / FREQUENCY for p in rub.special if p.kind == "fold")
    measured.equal(f"synchronous rub, μ = {friction:g}: end of the branch, ω", end, ends, "both radii meet", rel=1e-3)
    assert rub.spin[-1] >= (ends + 0.199) * FREQUENCY


def test_dry_whirl(measured: Measured) -> None:
    """ω* = [c/μ + √((c/μ)² + 4mk)]/2m = 1.10499 and r* = δ/(1 - c ω*/(μ k_c)) = 1.01117, backward, at any fast spin."""
    rig = jeffcott(0.02, friction=0.1).replace(spin=Spin(3 * FREQUENCY))
    branch = periodic.follow_whirl(cm.Model(rig), (3 * FREQUENCY, 3.2 * FREQUENCY), "dry", 3)
    y, z = branch.clearance_displacement[0, :2, 1]
    closed = "ω* = [c/μ + √((c/μ)² + 4mk)]/2m, r* = δ/(1 - cω*/(μ k_c))"
    measured.equal("dry whirl: ω", 2 * np.pi * branch.frequency[-1] / FREQUENCY, 1.10499, closed, rel=1e-4)
    measured.equal("dry whirl: radius in gaps", abs(y) / GAP, 1.01117, closed, rel=1e-4)
    assert_allclose(2 * np.pi * branch.frequency / FREQUENCY, 1.10499, rtol=1e-4)
    assert_allclose(z / y, 1j, atol=1e-4)  # backward: z = r cos(ωt + π/2) = -r sin(ωt) where y = r cos(ωt)


@pytest.mark.parametrize("ratio", CHILDS)
def test_the_threshold_in_oil(ratio: float, measured: Measured) -> None:
    """Known answers of stability: within 1 % of Childs' threshold and of his whirl ratio."""
    threshold, whirl = CHILDS[ratio]
    speed = threshold * np.sqrt(GRAVITY / CLEARANCE)
    model = cm.Model(rigid_in_oil(viscosity_at(ratio, speed), speed))
    onset = periodic.find_whirl_onset(model, (0.8 * speed, 1.2 * speed), 2)
    # At another speed the journal rests elsewhere, so both are compared where it rests at the ratio.
    what, value = f"rigid rotor in oil, ε = {ratio:g}", onset.speed / np.sqrt(GRAVITY / CLEARANCE)
    measured.equal(f"{what}: Ω √(C/g) at the threshold", value, threshold, "Childs 1993, chapter 3", rel=1e-2)
    value = 2 * np.pi * onset.frequency / onset.speed
    measured.equal(f"{what}: whirl ratio", value, whirl, "Childs 1993, chapter 3", rel=1e-2)


def test_oil_whirl_grows_out_of_rest() -> None:
    """Followed from its onset, and at a point of it where the modal engine's march stays."""
    speed = 2.55 * np.sqrt(GRAVITY / CLEARANCE)
    model = cm.Model(rigid_in_oil(viscosity_at(0.3, speed), speed))
    onset = periodic.find_whirl_onset(model, (0.8 * speed, 1.3 * speed), 2)
    branch = periodic.follow_whirl(model, (0.8 * speed, 1.3 * speed), n_modes=2, n_harmonics=7)
    amplitude = np.abs(branch.clearance_displacement[:, 0, 1])
    assert_allclose(branch.spin[0], onset.speed, rtol=1e-2)
    assert_allclose(branch.frequency[0], onset.frequency, rtol=1e-2)
    assert amplitude[0] < 0.1 * CLEARANCE < amplitude.max()
