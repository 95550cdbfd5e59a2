import numpy as np
import pytest

from clearance_mj.testrig.acquisition import digitise


def test_noise_is_one_percent_of_the_signal():
    signal = 3 * np.sin(np.arange(200_000) * 0.1)
    value, _ = digitise(signal, 0.01, np.random.default_rng(3))
    assert np.std(value - signal) / np.std(signal) == pytest.approx(0.01, rel=0.01)


def test_single_precision_holds_every_code():
    signal = np.random.default_rng(1).standard_normal(100_000)
    value, full_scale = digitise(signal, 0.01, np.random.default_rng(2))
    assert np.array_equal(value.astype(np.float32).astype(float), value)
    codes = value / full_scale * 2**23
    assert np.array_equal(codes, np.rint(codes))
    assert np.abs(value).max() < full_scale <= 2 * np.abs(value).max()
    assert np.log2(full_scale) % 1 == 0


def test_quantisation_is_half_a_step():
    signal = np.linspace(-1.9, 1.9, 10_001)
    value, full_scale = digitise(signal, 0.0, np.random.default_rng(0))
    assert full_scale == 2.0
    assert np.abs(value - signal).max() <= full_scale / 2**24
