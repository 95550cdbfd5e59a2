"""Best linear approximations and harmonics against closed forms."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.clearance.walls.slot import gap
from clearance_mj.core.errors import RecordError
from clearance_mj.signals import Response, best_linear, excitation, stepped_harmonics

from ..refusals import assert_refused

FS, PERIOD, BAND = 1024.0, 4.0, (5.0, 100.0)
SAMPLES = round(FS * PERIOD)
LINES = np.arange(20, 401)
FILTER = np.array([0.5, 0.3, -0.2, 0.1])


def realisations(system, count, periods=3, noise=0.0, drop=0, rms=1.0):
    """Records of a periodic system, which gets one period and gives one, with white noise on the response."""
    for seed in range(count):
        shake = excitation.multisine((periods + drop) * PERIOD, FS, BAND, rms, seed, period=PERIOD)
        steady = np.tile(system(shake.value[:SAMPLES]), periods + drop)
        response = steady + noise * np.random.default_rng((seed, 7)).standard_normal(steady.size)
        yield Response(FS, shake.value, response[None], band=BAND, responses=("1:+Z",))


def filtered(x):
    return np.fft.irfft(np.fft.rfft(x) * transfer(np.arange(SAMPLES // 2 + 1)), SAMPLES)


def transfer(line):
    return np.exp(-2j * np.pi * np.outer(line / SAMPLES, np.arange(FILTER.size))) @ FILTER


def distortion_of_cube(rms):
    """Variance of the cube's stochastic part over |U|² at the lines: 6 R³ is its autocorrelation (Isserlis)."""
    power = np.zeros(SAMPLES)
    power[LINES] = power[-LINES] = rms**2 / (2 * LINES.size)
    return np.fft.ifft(6 * np.fft.fft(power).real ** 3).real[LINES] / power[LINES]


def test_cube_before_a_filter():
    """x + a x³, then a filter H: the best linear approximation is H (1 + 3 a σ²) (Bussgang), the stochastic
    distortion |H|² a² of the cube's; a multisine of F lines has 1 - 1/(2F) of the 3 σ² of a Gaussian signal."""
    a, rms, count = 0.4, 1.3, 40
    bla = best_linear(list(realisations(lambda x: filtered(x + a * x**3), count, rms=rms)), PERIOD)
    gain = 1 + 3 * a * rms**2 * (1 - 0.5 / LINES.size)
    np.testing.assert_allclose(bla.frf.frequency, LINES / PERIOD)
    expected = np.abs(transfer(LINES)) ** 2 * a**2 * distortion_of_cube(rms)
    normal = np.abs(bla.frf.functions[0] - gain * transfer(LINES)) ** 2 / (expected / count)
    assert np.mean(normal) == pytest.approx(1, abs=4 / np.sqrt(LINES.size))  # exponential with mean 1
    ratio = bla.distortion_variance[0, 0] / expected
    assert np.mean(ratio) == pytest.approx(1, abs=4 / np.sqrt(LINES.size * (count - 1)))
    assert np.all(bla.noise_variance < 1e-20)


def test_linear_system_with_noise_has_no_distortion():
    """White noise σ has the spectral variance N σ² at each line; over P periods and M realisations / (P M)."""
    periods, count, sigma = 4, 10, 0.05
    bla = best_linear(list(realisations(filtered, count, periods, sigma, drop=2)), PERIOD, drop=2)
    expected = SAMPLES * sigma**2 / (SAMPLES**2 / (2 * LINES.size)) / (periods * count)
    for variance, freedom in ((bla.noise_variance, count * (periods - 1)), (bla.total_variance, count - 1)):
        assert np.mean(variance) / expected == pytest.approx(1, abs=4 / np.sqrt(LINES.size * freedom))
    excess = np.mean(bla.total_variance - bla.noise_variance) / expected
    assert abs(excess) < 4 / np.sqrt(LINES.size * (count - 1))
    normal = np.abs(bla.frf.functions[0] - transfer(LINES)) ** 2 / expected
    assert np.mean(normal) == pytest.approx(1, abs=4 / np.sqrt(LINES.size))


def test_noise_and_distortion_are_told_apart():
    a, sigma, count = 0.1, 0.2, 24
    both = best_linear(list(realisations(lambda x: x + a * x**3, count, 3, sigma)), PERIOD, drop=1)
    noise = SAMPLES * sigma**2 / (SAMPLES**2 / (2 * LINES.size)) / (2 * count)
    assert np.mean(both.noise_variance) / noise == pytest.approx(1, abs=4 / np.sqrt(LINES.size * count))
    excess = count * np.mean(both.total_variance - both.noise_variance) / np.mean(a**2 * distortion_of_cube(1.0))
    assert excess == pytest.approx(1, abs=8 / np.sqrt(LINES.size * (count - 1)))


def test_noise_on_the_excitation_counts():
    """G of a known system from U + noise: var G = |G|² σ_U²/|U|² for small noise."""
    sigma, count, periods = 0.02, 12, 3
    records = []
    for seed, record in enumerate(realisations(filtered, count, periods, drop=1)):
        noise = sigma * np.random.default_rng((seed, 8)).standard_normal(record.excitation.size)
        records.append(Response(FS, record.excitation + noise, record.acceleration, band=BAND))
    bla = best_linear(records, PERIOD)
    expected = np.abs(transfer(LINES)) ** 2 * sigma**2 * 2 * LINES.size / SAMPLES / (periods * count)
    tolerance = 4 / np.sqrt(LINES.size * count * (periods - 1))
    assert np.mean(bla.noise_variance[0, 0] / expected) == pytest.approx(1, abs=tolerance)


def test_the_transient_is_dropped():
    """A decay in the first period alone: with it the scatter shows, without it nothing is left."""
    decay = np.pad(np.exp(-np.arange(SAMPLES) / 200), (0, 2 * SAMPLES))
    records = [changed(record, channels=record.channels + decay) for record in realisations(filtered, 3)]
    assert best_linear(records, PERIOD, drop=1).noise_variance.max() < 1e-20
    assert best_linear(records, PERIOD, drop=0).noise_variance.max() > 1e-6


def changed(record, **fields):
    return dataclasses.replace(record, **fields)


@pytest.mark.parametrize(("change", "options", "message"), [
    (lambda r: r[:1], {}, "at least two realisations, got 1"),
    (lambda r: r, {"period": 1.3}, "does not hold whole periods of 1.3 s"),
    (lambda r: r, {"drop": 2}, "3 periods less 2 dropped leave fewer than two"),
    (lambda r: [r[0], changed(r[1], band=(5.0, 90.0))], {}, "differ in sampling rate"),
    (lambda r: [r[0], changed(r[1], channels=np.full_like(r[1].acceleration, np.nan))], {}, "not finite"),
    (lambda r: [changed(x, band=(5.0, 120.0)) for x in r], {}, "leaves out lines of its band"),
])  # fmt: skip
def test_records_that_cannot_be_used(change, options, message):
    records = list(realisations(filtered, 2))
    assert_refused(RecordError, message, best_linear, change(records), **{"period": PERIOD, **options})


@pytest.mark.parametrize(("ratio", "gain"), [(2.0, 0.391002), (3.0, 0.583583)])
def test_first_harmonic_of_a_gap_is_its_describing_function(ratio, gain):
    """1 - (2/π)[asin(d/X) + (d/X)√(1 - d²/X²)] (Gelb and Vander Velde 1968)."""
    force = np.array([gap(x, 1.0) for x in ratio * np.cos(2 * np.pi * 9.3 * (np.arange(8192) / 2048))])
    first, second, third = np.abs(stepped_harmonics(force, 2048, [9.3], 3)[0]) / ratio
    assert first == pytest.approx(gain, abs=2e-4) and second < 2e-4
    angle = np.linspace(0, 2 * np.pi, 200_001)
    cos = np.cos(angle)
    fourier = np.sign(cos) * np.maximum(np.abs(cos) - 1 / ratio, 0) * np.cos(3 * angle) / np.pi
    assert third == pytest.approx(abs(np.trapezoid(fourier, angle)), abs=2e-4)


def test_harmonics_of_every_step_have_amplitude_and_phase():
    """cos³ = 3/4 cos + 1/4 cos 3φ; the phase counts from the start of the record."""
    frequency, time = (5.3, 11.0), np.arange(4096) / 1024
    wave = np.where(time < 2, np.cos(2 * np.pi * 5.3 * time + 0.4), 2 * np.cos(2 * np.pi * 11.0 * time - 1.0))
    harmonics = stepped_harmonics(wave**3 + 0.7, 1024, frequency, n_harmonics=4, settle=0.3)
    first, third = np.array([1.0, 8.0]) * 3 / 4, np.array([1.0, 8.0]) / 4
    phase = np.exp(1j * np.array([0.4, -1.0]))
    np.testing.assert_allclose(harmonics, np.array([first * phase, [0, 0], third * phase**3, [0, 0]]).T, atol=1e-9)


@pytest.mark.parametrize(("arguments", "message"), [
    ((np.ones(100), 100.0, [5.0, 6.0, 7.0]), "3 steps of one length do not fit"),
    ((np.ones(100), 100.0, [5.0], 10), "not above twice harmonic 10"),
    ((np.ones(100), 1000.0, [5.0]), "less than a period of 5 Hz"),
    ((np.ones(100), 100.0, [5.0], 0), "n_harmonics must be >= 1"),
    ((np.ones(100), 100.0, [5.0], 5, 1.0), "0 <= settle < 1"),
])  # fmt: skip
def test_steps_that_cannot_be_used(arguments, message):
    assert_refused(RecordError, message, stepped_harmonics, *arguments)
