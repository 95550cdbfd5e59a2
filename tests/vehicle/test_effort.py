"""Steering effort of angles with known rates."""

import numpy as np
import pytest

from clearance_mj.vehicle.run import REVERSAL, effort, rate_spectrum

T = np.arange(3000) * 0.01


def sine(amplitude, frequency):
    return amplitude * np.sin(2 * np.pi * frequency * T)


def test_slow_and_fast_part_of_the_rate():
    """20 mrad at 0.5 Hz and 1 mrad at 8 Hz: RMS rates 2π f A/√2, of differences sin(π f T)/(π f T) of it."""
    rates = effort(sine(0.02, 0.5) + sine(0.001, 8.0), 0.01)
    slow, fast = (2 * np.pi * f * a / np.sqrt(2) * np.sinc(f * 0.01) for f, a in ((0.5, 0.02), (8.0, 0.001)))
    assert (rates["fast_rate"], rates["rms_rate"]) == pytest.approx((fast, np.hypot(slow, fast)), rel=0.01)


def test_reversals():
    """A sine turns twice in each of its 15 periods; an oscillation within the slack does not count."""
    assert effort(sine(0.02, 0.5) + sine(0.4 * REVERSAL, 9.0), 0.01)["reversals"] == 2 * 15
    assert effort(sine(0.4 * REVERSAL, 9.0), 0.01)["reversals"] == 0


def test_area_below_the_spectrum_is_the_mean_square():
    """Of white noise (Parseval), to the accuracy of 22 averages."""
    rate = np.random.default_rng(0).normal(scale=0.3, size=3000)
    spectrum = rate_spectrum(np.concatenate(([0.0], rate.cumsum() * 0.01)), 0.01)
    assert spectrum.rms_above(-1.0) == pytest.approx(0.3, rel=0.05)
    np.testing.assert_allclose(spectrum.density[5:-5].mean(), 0.3**2 / 50, rtol=0.05)


def test_short_history_is_one_segment():
    assert rate_spectrum(sine(0.02, 0.5)[:50], 0.01).frequency.size == 25
