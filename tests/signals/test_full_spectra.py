"""Full spectra of motions whose circles are known: a circle, an ellipse, a line, a chirp."""

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.signals import full_spectrum, speed_cascade

from ..refusals import assert_refused

FS = 2048.0
TIME = np.arange(4 * 2048) / FS


def at(spectrum, hz):
    """Amplitude of the line nearest to a frequency."""
    return spectrum.amplitude[np.argmin(np.abs(spectrum.frequency - hz))]


@pytest.mark.parametrize("hz", [25.0, 25.37, -40.5])
def test_a_circle_shows_its_radius_on_one_side_alone(hz):
    """Whether or not its frequency is that of a line: a flat-top window's gain varies by less than 0.2 %."""
    w = 3e-5 * np.exp(2j * np.pi * hz * TIME + 0.4j)
    spectrum = full_spectrum(w.real + 2e-4, w.imag - 1e-4, FS)
    assert at(spectrum, hz) == pytest.approx(3e-5, rel=2e-3)
    assert spectrum.frequency[np.argmax(spectrum.amplitude)] == pytest.approx(hz, abs=0.5)
    assert at(spectrum, -hz) < 1e-4 * 3e-5 and (spectrum.resolution, spectrum.averages) == (1.0, 13)
    np.testing.assert_array_equal(spectrum.frequency, -spectrum.frequency[::-1])


def test_an_ellipse_is_half_the_sum_and_half_the_difference_of_its_axes():
    """Goldman & Muszynska 1999: forward (a + b)/2, backward (a - b)/2, wherever the ellipse leans."""
    a, b, lean = 5e-5, 2e-5, np.exp(0.7j)
    turn = 2 * np.pi * 30 * TIME
    w = lean * (a * np.cos(turn) + 1j * b * np.sin(turn))
    spectrum = full_spectrum(w.real, w.imag, FS, window="hann")
    assert (at(spectrum, 30), at(spectrum, -30)) == pytest.approx(((a + b) / 2, (a - b) / 2), rel=1e-9)


def test_a_line_is_both_in_equal_parts():
    y = 4e-5 * np.cos(2 * np.pi * 30 * TIME)
    spectrum = full_spectrum(y, -0.5 * y, FS, window="boxcar")
    np.testing.assert_allclose([at(spectrum, 30), at(spectrum, -30)], np.hypot(1, 0.5) * 4e-5 / 2, rtol=1e-9)


def test_a_circle_that_speeds_up_lies_on_the_line_of_the_spin():
    """A run-up from 10 to 50 Hz in 40 s: 1 Hz/s, within windows of 0.5 s a quarter of the distance of the lines."""
    time = np.arange(40 * 1024) / 1024.0
    spin = 2 * np.pi * (10 + time)
    w = 1e-5 * np.exp(2j * np.pi * (10 * time + time**2 / 2))
    cascade = speed_cascade(w.real, w.imag, 1024.0, spin, resolution=2.0, window="flattop", n_windows=21)
    np.testing.assert_allclose(cascade.speed, 2 * np.pi * (10 + cascade.time), rtol=1e-9)
    peak = cascade.frequency[np.argmax(cascade.amplitude, axis=1)]
    np.testing.assert_allclose(peak, cascade.speed / (2 * np.pi), atol=1.01)
    np.testing.assert_allclose(cascade.order(1), 1e-5, rtol=0.01)
    assert cascade.order(-1).max() < 1e-7
    assert np.isnan(cascade.order(20)[-1])  # 1000 Hz are above half the samples per second


Y, HOLED = np.zeros(1000), np.where(np.arange(1000) == 3, np.nan, 0.0)


@pytest.mark.parametrize(("call", "arguments", "words"), [
    (full_spectrum, (Y, Y, FS), r"resolution 1 Hz needs windows of 1 s, and there are 0\.488281 s; give at"),
    (full_spectrum, (Y, Y, FS, 10.0, "hanning"), 'window "hanning" is unknown; use flattop, hann, boxcar'),
    (full_spectrum, (Y, Y[:-1], FS), "one value for each sample"),
    (full_spectrum, (Y, HOLED, FS, 10.0), "sample 3 is not a finite number"),
    (speed_cascade, (Y, Y, FS, np.zeros(3), 10.0), "speed must have a value for each of the 1000 samples"),
])  # fmt: skip
def test_what_cannot_be_had_is_refused_in_one_line(call, arguments, words):
    assert_refused(RecordError, words, call, *arguments)


def test_the_figures_say_what_is_on_their_axes():
    w = 1e-5 * np.exp(2j * np.pi * -20 * TIME)
    spin = np.full(TIME.size, -2 * np.pi * 20)
    (ax,) = full_spectrum(w.real, w.imag, FS).plot(spin[0]).axes
    (line,) = ax.get_lines()[:1]
    peak = np.argmax(line.get_ydata())
    assert (line.get_xdata()[peak], line.get_ydata()[peak]) == pytest.approx((20.0, 10.0), rel=2e-3)  # with the spin
    assert ax.get_xlabel() == "Frequency (Hz): backward on the left, forward on the right"
    assert ax.get_ylabel() == "Amplitude (µm)"
    ax, bar = speed_cascade(w.real, w.imag, FS, spin, n_windows=4).plot().axes
    assert (ax.get_ylabel(), bar.get_ylabel()) == ("Spin (rev/min)", "Amplitude (µm)")
    assert "z to y on the left" in full_spectrum(w.real, w.imag, FS).plot().axes[0].get_xlabel()
