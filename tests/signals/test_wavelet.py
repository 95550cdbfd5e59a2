"""Wavelet ridges. Of signals whose frequency and amplitude are known formulas."""

import numpy as np
import pytest

from clearance_mj import RecordError, identify
from clearance_mj.signals.wavelet import scalogram

from ..refusals import assert_refused

FS = 2048.0
TIME = np.arange(8192) / FS


def rms(value):
    return np.sqrt(np.mean(np.square(value)))


def decay(rate=0.3, frequency=80.0):
    return np.exp(-rate * TIME) * np.cos(2 * np.pi * frequency * TIME)


def test_amplitude_and_phase_of_a_sine_are_exact(measured):
    ridge = identify.ridge(3.0 * np.cos(2 * np.pi * 80 * TIME + 0.5), FS, (50, 110))
    frequency, amplitude = (ridge.omega / (2 * np.pi * 80))[ridge.valid], (ridge.amplitude / 3)[ridge.valid]
    measured.below("sine: largest error of frequency", np.abs(frequency - 1).max(), 1e-4, "the sine's")
    measured.below("sine: largest error of amplitude", np.abs(amplitude - 1).max(), 1e-4, "the sine's")
    assert np.abs(np.angle(np.exp(1j * (ridge.phase - 2 * np.pi * 80 * TIME - 0.5))))[ridge.valid].max() < 2e-3


@pytest.mark.parametrize("band", [(50, 110), (20, 200)])
def test_linear_chirp_with_decay(band, measured):
    """φ = 2π (60 t + 5 t²), A = e^{-0.3 t}: 60 to 100 Hz"""
    ridge = identify.ridge(np.exp(-0.3 * TIME) * np.cos(2 * np.pi * (60 * TIME + 5 * TIME**2)), FS, band)
    known = 2 * np.pi * (60 + 10 * TIME)
    what, source = f"decaying chirp, 60 to 100 Hz, band {band[0]} to {band[1]} Hz", "the chirp's"
    measured.below(f"{what}: RMS error of frequency", rms((ridge.omega / known - 1)[ridge.valid]), 1e-4, source)
    error = rms((ridge.amplitude * np.exp(0.3 * TIME) - 1)[ridge.valid])
    measured.below(f"{what}: RMS error of amplitude", error, 1e-4, source)


def test_frequency_modulation(measured):
    """ω = 2π (80 + 8 cos πt)"""
    ridge = identify.ridge(np.cos(2 * np.pi * 80 * TIME + 16 * np.sin(np.pi * TIME)), FS, (50, 110))
    error = rms((ridge.omega / (2 * np.pi * (80 + 8 * np.cos(np.pi * TIME))) - 1)[ridge.valid])
    measured.below("frequency that swings, 72 to 88 Hz: RMS error", error, 1e-4, "2π (80 + 8 cos πt)")


def test_wider_wavelets_follow_a_slower_world_alike():
    for omega0 in (5.0, 12.0, 30.0):
        ridge = identify.ridge(decay(), FS, (50, 110), omega0)
        assert rms((ridge.amplitude * np.exp(0.3 * TIME) - 1)[ridge.valid]) < 2e-4


def test_above_a_quarter_of_the_sampling_rate():
    ridge = identify.ridge(2 * np.cos(2 * np.pi * 135 * (np.arange(4096) / 512)), 512.0, (100, 180))
    assert rms((ridge.amplitude / 2 - 1)[ridge.valid]) < 1e-3
    assert rms((ridge.omega / (270 * np.pi) - 1)[ridge.valid]) < 1e-3


def test_ends_are_masked_by_four_spreads():
    ridge = identify.ridge(decay(), FS, (50, 110))
    spread = 5.0 / (2 * np.pi * 80)
    assert np.sum(ridge.valid ^ (TIME >= 4 * spread) & (TIME <= TIME[-1] - 4 * spread)) <= 8
    np.testing.assert_allclose(ridge.spread, spread, rtol=0.05)


def test_impact_is_masked():
    """The decay is struck again at 2 s, with a jump of the phase, which is masked as one of the frequency"""
    after = np.where(TIME >= 2, np.exp(-3 * (TIME - 2)) * np.sin(2 * np.pi * 80 * (TIME - 2)), 0)
    ridge = identify.ridge(0.2 * decay(0.3) + after, FS, (50, 110))
    spread = 5.0 / (2 * np.pi * 80)
    assert not ridge.valid[np.abs(TIME - 2) < 4 * spread].any()
    assert ridge.valid[(np.abs(TIME - 2) > 7 * spread) & (np.abs(TIME - 2) < 1.5)].all()
    known = np.where(TIME < 2, 0.2 * np.exp(-0.3 * TIME), np.hypot(0.2 * np.exp(-0.3 * TIME), np.exp(-3 * (TIME - 2))))
    assert np.abs(ridge.amplitude / known - 1)[ridge.valid].max() < 2e-3


def test_jump_of_the_frequency_is_masked_and_nothing_else():
    phase = 2 * np.pi * np.where(TIME < 2, 90 * TIME, 180 + 70 * (TIME - 2))
    gap = TIME[(~identify.ridge(np.cos(phase), FS, (50, 120)).valid) & (TIME > 0.5) & (TIME < 3.5)]
    assert gap.min() == pytest.approx(2 - 4 * 5 / (2 * np.pi * 90), abs=0.008)
    assert gap.max() == pytest.approx(2 + 4 * 5 / (2 * np.pi * 70), abs=0.008)


def test_each_band_gives_its_mode(rng):
    modes = ((20.0, 1.0), (62.0, 0.4), (150.0, 0.7))
    signal = sum(a * np.exp(-0.2 * TIME) * np.sin(2 * np.pi * f * TIME) for f, a in modes)
    signal += 0.02 * rng.standard_normal(TIME.size)
    for ridge, (f, a) in zip(identify.ridges(signal, FS, [(12, 30), (45, 85), (110, 200)]), modes):
        assert np.mean(ridge.omega[ridge.valid]) == pytest.approx(2 * np.pi * f, rel=1e-3)
        assert np.mean((ridge.amplitude * np.exp(0.2 * TIME))[ridge.valid]) == pytest.approx(a, rel=2e-2)


def test_scalogram_of_a_sine_peaks_at_its_frequency_with_its_amplitude():
    plane = scalogram(3.0 * np.cos(2 * np.pi * 80 * TIME), FS, (50, 110), 10.0)
    column = np.abs(plane.value[:, 4096])
    assert plane.frequency[column.argmax()] == pytest.approx(80, rel=0.02)
    # |ψ̂| at a distance: exp(-(aω - ω0)²/2)
    np.testing.assert_allclose(column, 3 * np.exp(-((plane.scale * 2 * np.pi * 80 - 10) ** 2) / 2), atol=0.02)


def test_noise_after_the_decay_is_not_valid(rng):
    ridge = identify.ridge(decay(6.0) + 1e-3 * rng.standard_normal(TIME.size), FS, (50, 110))
    assert ridge.valid[(TIME > 0.1) & (TIME < 1.0)].all()
    assert ridge.valid[TIME > 2.0].mean() < 0.1


def noisy(signal, index, value):
    signal = signal.copy()
    signal[index] = value
    return signal


@pytest.mark.parametrize(("signal", "message"), [
    (noisy(decay(), 17, np.nan), "the signal is not a finite number at "),
    (np.full(8192, 2.5), r"the signal is constant \(2\.5\)"),
    (decay()[:150], r"the record lasts 0.0732\d+ s; .* needs 0.159 s at 50 Hz"),
    (np.clip(decay(), -0.7, 0.7), r"the signal is clipped at 0\.7 from"),
    (np.clip(decay(), -0.7, 9), r"the signal is clipped at -0.7"),
    (np.random.default_rng(1).standard_normal(8192), "no ridge above the noise between 50 and 110 Hz"),
    (np.zeros((3, 100)), r"one row of samples, got shape \(3, 100\)"),
])  # fmt: skip
def test_bad_signals(signal, message):
    assert_refused(RecordError, message, identify.ridge, signal, FS, (50, 110))


@pytest.mark.parametrize(("arguments", "message"), [
    ((FS, (50, 1100)), "up to fs / 2 = 1024 Hz"),
    ((FS, (0, 100)), "above 0"),
    ((FS, (110, 50)), "rising"),
    ((0.0, (50, 110)), "fs must be > 0"),
    ((FS, (50, 110), 2.0), "omega0 must be >= 4"),
])  # fmt: skip
def test_bad_arguments(arguments, message):
    assert_refused(RecordError, message, identify.ridge, decay(), *arguments)


def test_coarse_converter_is_not_clipping():
    identify.ridge(np.round(decay() * 2048) / 2048, FS, (50, 110))
