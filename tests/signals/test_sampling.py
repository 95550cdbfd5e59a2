"""Interpolation and decimation against tones, whose samples are known at any rate, and scipy's polyphase filter."""

import itertools

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from clearance_mj.signals.sampling import Decimator, decimate, interpolate, lowpass

FS = 2048.0


def tone(frequency, fs, n, phase=0.7):
    return np.cos(2 * np.pi * frequency / fs * np.arange(n) + phase)


def measured(signal, frequency, fs, phase=0.7):
    """Complex gain of a tone by least squares over the middle half of the signal."""
    t = np.arange(signal.size) / fs
    middle = slice(signal.size // 4, 3 * signal.size // 4)
    basis = np.exp(1j * (2 * np.pi * frequency * t[middle] + phase))
    (a, b), *_ = np.linalg.lstsq(np.stack((basis.real, basis.imag), axis=1), signal[middle], rcond=None)
    return a - 1j * b


def decibel(gain):
    return 20 * np.log10(np.abs(gain))


@pytest.mark.parametrize("factor", [2, 7, 24])
def test_interpolation_of_the_highest_tone(factor):
    """220 Hz at 2048 Hz, the band's end: 0.001 dB and no delay."""
    fast = interpolate(tone(220, FS, 2048), factor)
    gain = measured(fast, 220, FS * factor)
    assert abs(decibel(gain)) < 1e-3 and abs(np.angle(gain)) < 1e-9
    # In the middle every sample is the tone's, images included.
    middle = slice(fast.size // 4, 3 * fast.size // 4)
    np.testing.assert_allclose(fast[middle], tone(220, FS * factor, fast.size)[middle], atol=2e-4)


def test_linear_interpolation_is_not_good_enough():
    """It loses sinc²(f/fs): 0.33 dB at 220 Hz (design.md). The measure above sees that."""
    gain = measured(np.interp(np.arange(2048 * 24) / 24, np.arange(2048), tone(220, FS, 2048)), 220, FS * 24)
    assert decibel(gain) == pytest.approx(decibel(np.sinc(220 / FS) ** 2), abs=1e-3)
    assert decibel(gain) == pytest.approx(-0.33, abs=5e-3)


def test_interpolation_keeps_the_samples():
    """Sample i of the input is sample i * factor of the output, to the filter's 80 dB."""
    signal = tone(30, FS, 400) + tone(700, FS, 400)
    np.testing.assert_allclose(interpolate(signal, 8)[::8][100:300], signal[100:300], atol=4e-4)


@pytest.mark.parametrize("factor", [2, 5, 24])
@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.25, 0.35, 0.4])
def test_decimation_is_flat(factor, ratio):
    """Up to 0.4 fs: 0.01 dB and zero delay."""
    frequency = ratio * FS
    slow = decimate(tone(frequency, FS * factor, 4096 * factor, 0.0)[:, None], factor)[:, 0]
    gain = np.mean(slow[1000:3000]) if ratio == 0 else measured(slow, frequency, FS, 0.0)
    assert abs(decibel(gain)) < 0.01 and abs(np.angle(gain)) < 1e-9


@pytest.mark.parametrize("factor", [2, 5, 24])
def test_decimation_rejects_aliases(factor):
    """From 0.6 fs to the fast Nyquist frequency, where everything that is left folds into the band: 80 dB."""
    for frequency in np.linspace(0.6, factor / 2, 40) * FS:
        slow = decimate(tone(frequency, FS * factor, 1024 * factor)[:, None], factor)[256:768, 0]
        assert np.max(np.abs(slow)) < 1e-4, frequency


def test_zero_delay():
    """An impulse comes back symmetric about its own instant."""
    impulse = np.zeros((600, 1))
    impulse[300] = 1.0
    slow, raised = decimate(impulse, 6)[:, 0], interpolate(impulse[:, 0], 6)
    assert (np.argmax(slow), np.argmax(raised)) == (50, 1800)
    np.testing.assert_allclose(slow[51:100], slow[49:0:-1], atol=1e-15)
    np.testing.assert_allclose(raised[1801:3500], raised[1799:100:-1], atol=1e-15)


@pytest.mark.parametrize("factor", [2, 3, 10, 41])
def test_taps_are_symmetric_of_odd_number_and_of_unit_sum(factor):
    taps = lowpass(factor)
    assert taps.size % (2 * factor) == 1
    np.testing.assert_array_equal(taps, taps[::-1])
    assert taps.sum() == pytest.approx(1, abs=1e-14)


def test_nothing_to_do():
    signal = np.random.default_rng(0).standard_normal((50, 2))
    np.testing.assert_array_equal(interpolate(signal[:, 0], 1), signal[:, 0])
    np.testing.assert_array_equal(decimate(signal, 1), signal)


@pytest.mark.parametrize("n", [1, 47, 48, 49, 500])
def test_decimation_is_a_polyphase_filter(n):
    """scipy.signal.upfirdn, its delay cut off: ceil(n / factor) samples, zeros before and after the record."""
    factor = 12
    taps = lowpass(factor)
    signal = np.random.default_rng(n).standard_normal((n, 3))
    expected = scipy.signal.upfirdn(taps, signal, down=1, axis=0)[taps.size // 2 :][:n:factor]
    np.testing.assert_allclose(decimate(signal, factor), expected, atol=1e-14)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 30), st.lists(st.integers(0, 300), min_size=1, max_size=12), st.integers(0, 1000))
def test_ragged_blocks(factor, sizes, seed):
    """A stream in blocks of any size gives what the whole record gives."""
    signal = np.random.default_rng(seed).standard_normal((sum(sizes) + 1, 2))
    edges = np.cumsum([0, *sizes, 1])
    decimator = Decimator(2, factor)
    parts = [decimator.push(signal[start:end]) for start, end in itertools.pairwise(edges)]
    slow = np.concatenate((*parts, decimator.flush()))
    np.testing.assert_allclose(slow[: -(-signal.shape[0] // factor)], decimate(signal, factor), rtol=0, atol=1e-14)
