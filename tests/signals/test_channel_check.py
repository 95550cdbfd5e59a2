"""Clipping against records of which it is known whether they are clipped."""

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.signals import excitation
from clearance_mj.signals.channel_check import check_channel

from ..refusals import assert_refused

FS = 2048.0
TIME = np.arange(round(12 * FS)) / FS


def pressed(rng):
    """A sine that a wall flattens a little, with noise of 0.7 % of its size: what probes read under a stepped sine."""
    sine = np.sin(2 * np.pi * 11.5 * TIME) * np.minimum(TIME, 1.0)
    return sine - 0.3 * np.maximum(np.abs(sine) - 0.6, 0.0) * np.sign(sine) + 0.007 * rng.standard_normal(TIME.size)


def test_noise_on_flat_peaks_is_no_clipping():
    for seed in range(40):
        check_channel("probe", pressed(np.random.default_rng(seed)), FS)


@pytest.mark.parametrize("ratio", [0.6, 0.9, 0.97])
def test_the_same_beyond_a_range_is(ratio):
    for seed in range(10):
        signal = pressed(np.random.default_rng(seed))
        limit = ratio * signal.max()
        assert_refused(RecordError, f"clipped at {limit:g}", check_channel, "probe", np.minimum(signal, limit), FS)


def test_a_limit_need_not_be_one_number():
    """Amplifiers saturate at values that differ by 1e-4, of a quick signal whose differences are as large as noise."""
    for seed in range(10):
        wave = excitation.random(10.0, FS, (5.0, 220.0), rms=1.0, seed=seed).value
        limit = 3.0 * (1 + 1e-4 * np.random.default_rng(seed).standard_normal(wave.size))
        assert_refused(RecordError, "clipped at", check_channel, "accelerometer", np.clip(wave, -limit, limit), FS)
