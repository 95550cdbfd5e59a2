"""Free decays of known oscillators, and their identification at single scales (Figure 4)."""

import functools

import numpy as np
import pytest

from clearance_mj import RecordError
from experiments.article.free_decays import (
    CONDITIONS,
    SCALE_CONDITION,
    SCALE_SEQUENCES,
    Condition,
    free_decay,
    scale_study,
)

decay = functools.cache(free_decay)


def test_free_decay_against_the_exact_solution():
    decay = free_decay(Condition(lambda t: 8000.0, lambda t: 0.02), duration=2.0)
    rate = 0.02 / (2 * 0.025)
    omega = np.sqrt(8000 / 0.025 - rate**2)
    exact = np.exp(-rate * decay.time) * (np.cos(omega * decay.time) + rate / omega * np.sin(omega * decay.time))
    np.testing.assert_allclose(decay.signal, exact, atol=1e-7)


def test_noise_has_the_power_it_says():
    clean = decay(CONDITIONS[2])
    noise = clean.with_noise(20, 3).signal - clean.signal
    assert np.mean(clean.signal**2) / np.mean(noise**2) == pytest.approx(100, rel=0.05)


def test_best_single_scale_is_that_of_the_ridge(measured):
    """Figure 4, confirmed: ω0/ω = 5/√(8000/0.025) = 2^-6.82 is best, from 2^-7 to 2^-6.5 it changes little"""
    clean = decay(SCALE_CONDITION, duration=4.55, fs=1024)
    exponents = (-8.0, -7.0, -6.8, -6.5, -6.25, -6.0, -5.0)
    runs = [scale_study(clean.with_noise(100, seed), 2.0 ** np.array(exponents)) for seed in range(4)]
    error = dict(zip(exponents, np.median([[result.c_error for result in run] for run in runs], axis=0)))
    source = "best near ω0/ω = 2^-6.82"
    measured.below("Figure 4, scale 2^-6.8: error of c, median of 4 noises", error[-6.8], 1e-3, source)
    ratio = error[-6.8] / min(error.values())
    measured.below("Figure 4, scale 2^-6.8: error of c over the least of 7 scales", ratio, 1.2, source)
    assert max(error[-7.0], error[-6.5]) < 2.5 * error[-6.8]
    assert min(error[-8.0], error[-6.25]) > 2 * error[-6.8] and error[-6.0] > 50 * error[-6.8] and error[-5.0] > 1


def test_translations_of_a_scale(measured):
    """50 T/a + 1 for T = 1, whole ones; the article prints 3200, 3800, 4400, 5200, 6400"""
    results = scale_study(decay(SCALE_CONDITION, duration=4.55, fs=1024), SCALE_SEQUENCES[1])
    assert [result.points for result in results] == [3201, 3806, 4526, 5382, 6401]
    for result, scale in zip(results, SCALE_SEQUENCES[1]):
        what = f"translations at scale 2^{np.log2(scale):g}"
        measured.equal(what, result.points, 50 / scale + 1, "50 T/a + 1, T = 1", abs=1)
    # a fixed rate of samples makes the shorter wavelets of smaller scales as much cheaper as there are more of them
    products = [result.products for result in results]
    assert max(products) / min(products) < 1.01
    ratio = 5.0**2 * 0.025 / 8000
    assert [result.k_error for result in results] == pytest.approx([abs(ratio / s**2 - 1) for s in SCALE_SEQUENCES[1]])


def test_decay_too_short_for_the_scales():
    with pytest.raises(RecordError, match=r"the decay lasts 4 s; scale 0.03125 s needs 4.5 s"):
        scale_study(decay(CONDITIONS[2]), SCALE_SEQUENCES[0])
