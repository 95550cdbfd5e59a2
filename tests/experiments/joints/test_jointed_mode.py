"""A mode with a joint that slips. Of a known one: its marched decay, its harmonic response, its parameters again."""

import dataclasses

import numpy as np
import pytest

from clearance_mj import RecordError, identify
from clearance_mj.clearance.harmonic import harmonic_stiffness
from clearance_mj.signals.free_decay import Decay, decay
from experiments.joints.jointed_mode import ForcedCurve, ForcedTest, JointedMode, fit_jointed_mode

from ...refusals import assert_refused

MODE = JointedMode(80.0, 0.0012, 6e-4, 8e-3, 4e-3, 1.2e-4)
TEST = ForcedTest(mass=1.9, residual=-0.8, shift=-0.1, phase=0.01)
LINES = np.arange(79.0, 81.0, 0.05)


def seen(mode, amplitude, rng=None, noise=0.0):
    frequency, damping = mode.backbone(amplitude)
    scatter = np.zeros((2, amplitude.size)) if rng is None else noise * rng.standard_normal((2, amplitude.size))
    return Decay(np.arange(amplitude.size) * 0.1, amplitude, frequency * (1 + scatter[0]), damping + scatter[1])


def curve(force, noise=1.0):
    """The stepped sine at a force, N."""
    forces = np.full(LINES.size, force)
    return ForcedCurve(LINES, forces, TEST.response(MODE, LINES, forces) * noise)


@pytest.mark.parametrize(("field", "power"), [("even", 2), ("linear", 3), ("quadratic", 4)])
def test_energy_of_a_cycle(field, power):
    """Iwan's elements spread over x^(p-1) dx lose 4 ∫ k x (X - x) dx, which grows as X to the power of p + 2."""
    none = {"damping": 0.0, "even": 0.0, "linear": 0.0, "quadratic": 0.0}
    mode = dataclasses.replace(MODE, **(none | {field: 1e-3}))
    small, large = 0.2 * MODE.reach, 0.8 * MODE.reach
    loss = [x**2 * mode.stiffness(np.array([x]), 0.0).imag[0] for x in (small, large)]
    assert np.log(loss[1] / loss[0]) / np.log(4) == pytest.approx(power, abs=0.02)
    exact = 4 * 1e-3 * MODE.reach**2 * 0.8**power / (power * (power - 1)) * (2 * np.pi * 80) ** 2 / np.pi
    assert loss[1] == pytest.approx(exact, rel=0.02)


def test_element_is_the_same_law(measured):
    """The law for the engines, marched over two periods, against the mode's own closed form."""
    x, omega, mass = np.array([1e-5, 1e-4]), 2 * np.pi * 79.0, 2.5
    element = harmonic_stiffness(MODE.element(mass), x, omega, 512)
    error = np.abs(element / (mass * MODE.stiffness(x, omega)) - 1).max()
    measured.below("joint as a Maxwell-slip law: complex stiffness", error, 1e-4, "closed form of the mode")
    assert element.imag == pytest.approx(mass * MODE.stiffness(x, omega).imag, rel=0.01)


def test_backbone_against_a_marched_decay(measured):
    """Two seconds by the central difference, seen by a wavelet ridge in windows; nothing of it is harmonic balance."""
    slider, slip = MODE.elements()
    fs, small = 8192.0, 2 * np.pi * MODE.frequency
    loss, stay, limit = 2 * MODE.damping * small, 1 - slider.sum(), slip
    x = before = 1.3e-4
    stretch, path = np.minimum(x, limit), np.empty(round(2 * fs))
    for i in range(path.size):
        pull = small**2 * (stay * x + slider @ stretch)
        after = (2 * x - before - pull / fs**2 + loss / fs / 2 * before) / (1 + loss / fs / 2)
        stretch = np.clip(stretch + after - x, -limit, limit)
        before, x = x, after
        path[i] = x
    free_decay = decay(identify.ridge(path, fs, (70, 90), 10.0), 0.2, fs)
    frequency, damping = MODE.backbone(free_decay.amplitude)
    frequency = frequency * (1 + (small / fs) ** 2 / 24)  # the central difference vibrates too fast by that
    error = np.abs(free_decay.frequency - frequency).max()
    measured.below("joint's free decay: frequency (Hz)", error, 0.01, "wavelet ridge of the marched decay")
    error = np.abs(free_decay.damping - damping).max()
    measured.below("joint's free decay: damping ratio", error, 5e-5, "wavelet ridge of the marched decay")


def test_force_and_response_invert_each_other():
    force = np.full(LINES.size, 0.2)
    np.testing.assert_allclose(TEST.force(MODE, LINES, np.abs(TEST.response(MODE, LINES, force))), force, rtol=2e-3)


def test_measured_points_show_the_backbone():
    """The inverse harmonic balance of a response gives the frequency and damping that made it.

    The viscous part is seen at the force's frequency, up to 1.3 % off the mode's.
    """
    points = TEST.seen(curve(0.5))
    frequency, damping = MODE.backbone(points.amplitude)
    np.testing.assert_allclose(points.frequency, frequency, atol=0.01)
    np.testing.assert_allclose(points.damping, damping, rtol=0.013)


def test_linear_mode_in_closed_form():
    """Nothing slips: 1/(m ((f0/f)² - 1 + 2jζ f0/f)) + R."""
    mode, ratio = JointedMode(80.0, 0.002, 0.0, 0.0, 0.0, 1e-4), 79.9 / LINES
    known = 0.3 * (1 / (1.9 * (ratio**2 - 1 + 2j * 0.002 * ratio)) - 0.8) * np.exp(0.01j)
    np.testing.assert_allclose(TEST.response(mode, LINES, np.full(LINES.size, 0.3)), known, rtol=1e-4)


def test_recovered_and_predicts_another_force(measured):
    """Two decays and a curve at 0.2 N, 1 % noise; then 0.6 N, whose motion no datum reached: twice as large."""
    rng, amplitude = np.random.default_rng(5), np.geomspace(1.3e-4, 4e-6, 40)
    decays = [seen(MODE, amplitude, rng, 1e-5), seen(MODE, 0.9 * amplitude, rng, 1e-5)]
    force = np.full(LINES.size, 0.2)
    noise = 1 + 0.01 * (rng.standard_normal((2, LINES.size)) * np.array([[1], [1j]])).sum(axis=0)
    fit = fit_jointed_mode(decays, curve(0.2, noise), 1.2e-4)
    known = np.array([*dataclasses.astuple(MODE)[:5], *dataclasses.astuple(TEST)])
    off = np.abs(fit.estimates.value - known) / fit.estimates.std
    measured.below("joint from decays and one curve: parameters' error in standard deviations", off.max(), 3, "its own")
    peaks = [np.nanmax(np.abs(test.response(mode, LINES, 3 * force))) for mode, test in fit.draw(40)]
    truth = np.abs(TEST.response(MODE, LINES, 3 * force)).max()
    peak = np.abs(fit.test.response(fit.mode, LINES, 3 * force)).max()
    measured.below("peak at three times the force: relative error", abs(peak / truth - 1), 0.03, "the known mode's")
    assert np.percentile(peaks, 1) < truth < np.percentile(peaks, 99)


def test_draws_repeat():
    fit = fit_jointed_mode([seen(MODE, np.geomspace(1e-4, 1e-5, 20))], curve(0.2), 1.2e-4)
    assert fit.draw(3, 1) == fit.draw(3, 1) != fit.draw(3, 2)


def test_refused():
    line = np.ones(4)
    assert_refused(RecordError, "three rows of equal length", ForcedCurve, line, line, line[:3])
    assert_refused(RecordError, "forces > 0", ForcedCurve, line, 0 * line, line)
    assert_refused(RecordError, "got 0 decays", lambda: fit_jointed_mode([], ForcedCurve(line, line, line), 1e-4))
