"""Steps of a stepped sine, read from the record. Truth: the steps that were made."""

import numpy as np
import pytest

from clearance_mj.signals import Response, sine_steps
from clearance_mj.signals.excitation import random, stepped_sine
from clearance_mj.signals.stepped_sines import is_stepped_sine

FREQUENCIES = [7.0, 8.5, 10.1, 10.4, 40.0, 55.5, 40.0, 10.0]
LEVELS = [1.0] * 4 + [2.0] * 4


def record(noise, seed=0):
    sine = stepped_sine(12.0, 2048.0, FREQUENCIES, LEVELS).value
    rng = np.random.default_rng(seed)

    def noisy(signal):
        return signal + noise * rng.standard_normal(signal.size)

    return Response(2048.0, noisy(sine), np.array([noisy(3 * sine), noisy(sine**2)]))


def test_frequencies_levels_and_amplitudes_come_back():
    """A squared sine of amplitude a lies between 0 and a²."""
    steps = sine_steps(record(0.01))
    np.testing.assert_allclose(steps.frequency, FREQUENCIES, rtol=1e-3)
    np.testing.assert_allclose(steps.level, LEVELS, rtol=2e-3)
    np.testing.assert_allclose(steps.acceleration[:, 0], 3 * np.array(LEVELS), rtol=5e-3)
    np.testing.assert_allclose(steps.acceleration[:, 1], np.square(LEVELS) / 2, rtol=2e-2)
    assert steps.upwards.tolist() == [True] * 6 + [False] * 2 and steps.displacement is None


def test_without_noise_they_are_exact():
    steps = sine_steps(record(0.0))
    np.testing.assert_allclose(steps.frequency, FREQUENCIES, rtol=1e-8)
    np.testing.assert_allclose(steps.level, LEVELS, rtol=1e-7)


@pytest.mark.parametrize("signal", [random(4.0, 2048.0, (5, 220), 1.0, 1).value, np.zeros(4096), np.ones(100)])
def test_what_is_no_stepped_sine_has_no_steps(signal):
    steps = sine_steps(Response(2048.0, signal, np.array([signal, signal])))
    assert steps.frequency.size == 0 and steps.acceleration.shape == (0, 2)


@pytest.mark.parametrize(
    ("signal", "is_one"),
    [
        (record(0.01).excitation, True), (5 + record(0.01).excitation, True),
        (np.repeat([1.0, 2.0], 4500) * np.sin(0.1 * np.arange(9000)), True), (np.sin(0.1 * np.arange(9000)), False),
        (random(8.0, 2048.0, (5, 220), 1.0, 1).value, False), (np.arange(9000.0), False), (np.ones(9000), False),
        (np.exp(-0.002 * np.arange(9000)) * np.sin(0.1 * np.arange(9000)), False), (np.zeros(3), False),
    ],
    ids=["steps", "on an offset", "levels", "hum", "noise", "clock", "constant", "decay", "short"],
)  # fmt: skip
def test_what_is_a_stepped_sine(signal, is_one):
    assert is_stepped_sine(signal, 2048.0) == is_one and not is_stepped_sine(signal, 0.4)
