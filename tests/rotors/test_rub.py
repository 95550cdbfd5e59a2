"""Rub in a round clearance against closed forms of a Jeffcott rotor and against time integration."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from clearance_mj import ClearanceError, RigError
from clearance_mj.rotors import dry_whirls, rolling_whirls, synchronous_rub
from clearance_mj.structure import Material, Support

from ..periodic.jeffcott import FREQUENCY, GAP, MASS, jeffcott
from ..refusals import assert_refused
from ..verification.page import Measured

CIRCLE = "circle under unbalance: quadratic equation of its radius"
WHIRL = "ω* = [c/μ + √((c/μ)² + 4mk)]/2m, r* = δ/(1 - cω*/(μ k_c))"
ROLLING = "ω r = Ω R, m ω² = k + k_c (1 - δ/r)"


def rub(speeds: np.ndarray | list[float], friction: float = 0.0, eccentricity: float = 0.2, damping: float = 0.1):
    given = jeffcott(damping), FREQUENCY * np.array(speeds), 0.5, MASS * eccentricity * GAP
    return synchronous_rub(*given, friction, n_modes=4)


def test_first_contact(measured: Measured) -> None:
    """The free motion reaches the gap at ω = 0.9252, and leaves it at 1.1032."""
    speeds = np.linspace(0.9, 1.15, 25001)
    beyond = speeds[rub(speeds[::10]).free.repeat(10)[: speeds.size] > GAP]
    for value, known_onset in zip((beyond[0], beyond[-1]), (0.9252, 1.1032)):
        measured.equal("first contact of a Jeffcott rotor, closed form, ω", value, known_onset, CIRCLE, rel=1e-4)


@pytest.mark.parametrize("friction, radius", [(0.0, 1.008635), (0.1, 1.008109)])
def test_the_radius_of_a_synchronous_rub(friction: float, radius: float, measured: Measured) -> None:
    synchronous = rub([1.0], friction)
    what = f"synchronous rub, μ = {friction:g}: radius in gaps"
    measured.equal(what, synchronous.radius[0, 1] / GAP, radius, CIRCLE, rel=1e-6)
    assert synchronous.stable[0, 1] == (friction < 0.1 * np.sqrt(21.0) / 20.0)  # the threshold of dry whirl, below


@pytest.mark.parametrize("friction, end", [(0.0, 4.328), (0.05, 3.715), (0.1, 2.999)])
def test_where_the_branch_ends(friction: float, end: float, measured: Measured) -> None:
    synchronous = rub(np.arange(end - 0.05, end + 0.05, 2e-4), friction)
    (ends,) = synchronous.ends / FREQUENCY
    measured.equal(f"synchronous rub, μ = {friction:g}: end of the branch, ω", ends, end, CIRCLE, rel=1e-3)
    last = np.flatnonzero(np.isfinite(synchronous.radius[:, 1]))[-1]
    # Both branches meet there (what is left is the square root of the way to the end).
    assert_allclose(synchronous.radius[last, 0], synchronous.radius[last, 1], rtol=2e-2)


def marched(damping: float, contact: float, friction: float, start: np.ndarray, time: np.ndarray, force=0.0, spin=1.0):
    """Displacements y + i z of the Jeffcott rotor with its bushing, by Runge-Kutta in the closed forms' units."""

    def rate(t: float, state: np.ndarray) -> list[complex]:
        w, v = state
        size = abs(w)
        push = contact * max(size - 1.0, 0.0) * (1 + 1j * friction) * w / size if size else 0.0
        return [v, force * spin**2 * np.exp(1j * spin * t) - damping * v - w - push]

    return solve_ivp(rate, time[[0, -1]], start, t_eval=time, rtol=1e-10, atol=1e-12, method="DOP853").y


def test_a_rub_is_where_a_march_settles() -> None:
    synchronous = rub([1.4], 0.01)
    radius = synchronous.radius[0, 1] / GAP
    time = np.linspace(0.0, 250.0, 2501)
    path = marched(0.1, 20.0, 0.01, np.array([radius + 0.01, 1.4j * radius]), time, 0.2, 1.4)
    settled = np.abs(path[0, -500:])
    assert synchronous.stable[0, 1] and np.ptp(settled) < 1e-5
    assert_allclose(settled, radius, rtol=1e-5)


def test_friction_makes_a_rub_unstable() -> None:
    """Where it is told unstable, a march that begins on the circle leaves it; where stable, it stays."""
    stable = {}
    for friction in (0.01, 0.1):
        synchronous = rub([2.0], friction, eccentricity=0.6)
        radius = synchronous.radius[0, 1] / GAP
        gain = 1 + 20 * (1 - 1 / radius) * (1 + 1j * friction) - 4 + 0.2j
        phase = 0.6 * 4 / (gain * radius)
        start = radius * phase * np.array([1.0, 2.0j]) * (1 + 1e-4)
        path = marched(0.1, 20.0, friction, start, np.linspace(0, 150, 1501), 0.6, 2.0)
        stays = np.abs(np.abs(path[0, -300:]) / radius - 1).max() < 1e-4
        stable[friction] = bool(synchronous.stable[0, 1])
        assert stays == stable[friction]
    assert set(stable.values()) == {True, False}


def test_dry_whirl(measured: Measured) -> None:
    """ω* = [c/μ + √((c/μ)² + 4 m k)]/2m, r* = δ/(1 - c ω*/(μ k_c)): 1.10499 and 1.01117; begun faster it grows."""
    (whirl,) = dry_whirls(jeffcott(0.02), 0.1, n_modes=4)
    measured.equal("dry whirl: ω", whirl.whirl / FREQUENCY, 1.10499, WHIRL, rel=1e-5)
    measured.equal("dry whirl: radius in gaps", whirl.radius / GAP, 1.01117, WHIRL, rel=1e-5)
    assert_allclose(whirl.whirl / FREQUENCY, (0.2 + np.sqrt(0.04 + 4)) / 2, rtol=1e-6)
    # With another sense of rotation of force and friction, the same equations in time.
    for faster, grows in ((1.03, True), (0.97, False)):
        w, r = whirl.whirl / FREQUENCY * faster, whirl.radius / GAP
        path = marched(0.02, 20.0, 0.1, np.array([r, -1j * w * r]), np.linspace(0, 200, 2001))
        assert (np.abs(path[0, -200:]).max() > 1.005 * r) == grows


@pytest.mark.parametrize("damping", [0.2, 0.5])
def test_the_threshold_of_dry_whirl(damping: float) -> None:
    """It needs μ > c √((k + k_c)/m)/k_c."""
    threshold = damping * np.sqrt(21.0) / 20.0
    assert dry_whirls(jeffcott(damping), 1.005 * threshold, n_modes=4)
    assert not dry_whirls(jeffcott(damping), 0.995 * threshold, n_modes=4)


def test_a_shaft_rolls_in_its_bushing(measured: Measured) -> None:
    """With ω r = Ω R and m ω² = k + k_c (1 - δ/r), Ω R = 50: ω = 4.387, r = 11.40; damping needs friction."""
    rig = jeffcott(0.0)
    radius = rig.structure.sections[0].diameter[0] / 2
    spin = 50 * FREQUENCY * GAP / radius
    (whirl,) = rolling_whirls(rig, 0.1, spin, n_modes=4)
    measured.equal("rolling whirl: ω", whirl.whirl / FREQUENCY, 4.387, ROLLING, rel=1e-4)
    measured.equal("rolling whirl: radius in gaps", whirl.radius / GAP, 11.40, ROLLING, rel=1e-3)
    assert_allclose(whirl.friction, 0.0, atol=1e-9)
    omega = whirl.whirl / FREQUENCY
    assert_allclose(omega**2, 1 + 20 * (1 - omega / 50), rtol=1e-4)
    (damped,) = rolling_whirls(jeffcott(0.2), 0.1, spin, n_modes=4)
    assert_allclose(damped.friction, 0.2 * omega / (20 * (1 - omega / 50)), rtol=1e-3)
    assert not rolling_whirls(jeffcott(0.2), 0.04, spin, n_modes=4)


def test_the_rub_is_drawn() -> None:
    (axes,) = rub(np.linspace(0.2, 4.5, 60), 0.05).plot().axes
    assert {"in the gap", "rubbing", "rubbing, unstable", "gap"} <= set(axes.get_legend_handles_labels()[1])


def test_what_has_no_circle_is_refused() -> None:
    rig = jeffcott(0.1)
    supports = tuple(Support(x, "elastic", translation=1e6, translation_y=2e6) for x in (0.0, 1.0))
    shaft = dataclasses.replace(rig.structure, supports=supports, material=Material(2.1e11, 10.0))
    words = "its supports differ in y and z, so that no motion is a circle"
    assert_refused(RigError, words, dry_whirls, rig.replace(structure=shaft), 0.1)
    assert_refused(ClearanceError, "friction -0.1 must be a coefficient >= 0", rub, [1.0], -0.1)
    assert_refused(ClearanceError, "bushing 3 is not there: rig 'jeffcott' has 1", dry_whirls, rig, 0.1, bushing=3)
    aside = rig.replace(bushings=(dataclasses.replace(rig.bushings[0], offset=1e-5),))
    words = r"bushings\[0\].offset is 1e-05 m; a circle needs its middle"
    assert_refused(RigError, words, dry_whirls, aside, 0.1, n_modes=4)
