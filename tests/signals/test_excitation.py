"""Generators against the spectra, levels and phases they promise."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearance_mj.core.errors import ExcitationError
from clearance_mj.signals import Excitation, excitation

from ..refusals import assert_refused

FS = 512.0


def rms(value):
    return np.sqrt(np.mean(np.square(value)))


def outside(value, band, fs=FS):
    """Largest line outside the band over the largest of all."""
    spectrum, frequency = np.abs(np.fft.rfft(value)), np.fft.rfftfreq(value.size, 1 / fs)
    return spectrum[(frequency < band[0] - 1e-9) | (frequency > band[1] + 1e-9)].max() / spectrum.max()


@settings(max_examples=25, deadline=None)
@given(st.floats(1, 9), st.floats(0, 100), st.floats(2, 150), st.floats(1e-6, 1e6), st.integers(0, 2**32))
def test_random_has_its_rms_exactly_and_nothing_outside_its_band(duration, low, width, level, seed):
    shake = excitation.random(duration, FS, (low, low + width), level, seed)
    assert shake.value.size == round(duration * FS)
    assert rms(shake.value) == pytest.approx(level, rel=1e-12)
    assert abs(shake.value.mean()) < 1e-12 * level
    assert outside(shake.value, (low, low + width)) < 1e-12


def test_random_reaches_both_ends_of_the_band_and_its_spectrum_is_flat():
    """The mean square of a line of Gaussian noise is the same at all lines; its spread over 801 lines is 1/√801."""
    spectrum = np.abs(np.fft.rfft(excitation.random(40.0, FS, (20, 60), 2.0, seed=3).value)) ** 2
    lines = np.flatnonzero(spectrum > 1e-12 * spectrum.max())
    assert (lines[0], lines[-1], lines.size) == (800, 2400, 1601)
    lower, upper = spectrum[800:1601].mean(), spectrum[1600:2401].mean()
    assert lower / upper == pytest.approx(1, abs=5 * np.sqrt(2 / 801))


def test_random_is_gaussian():
    """Skewness and excess kurtosis of Gaussian noise are 0; 32000 independent samples give 0.03 and 0.07 (5 sigma)."""
    value = excitation.random(125.0, FS, (0.1, 256), 1.0, seed=1).value
    assert abs(np.mean(value**3)) < 5 * np.sqrt(6 / 32000)
    assert abs(np.mean(value**4) - 3) < 5 * np.sqrt(24 / 32000)


@pytest.mark.parametrize("name", ["random", "burst_random", "level_ramp", "multisine"])
def test_a_seed_gives_the_same_noise_and_another_seed_another(name):
    first, again, other = (getattr(excitation, name)(4.0, FS, (5, 220), seed=seed).value for seed in (7, 7, 8))
    np.testing.assert_array_equal(first, again)
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.2


def test_bursts_are_off_between_and_have_their_level_when_on():
    shake = excitation.burst_random(8.0, FS, (20, 200), 3.0, seed=2, burst=0.6, period=2.0)
    periods = shake.value.reshape(4, 1024)
    on = round(0.6 * 1024) + 1  # samples 0 to 614; 614 / 1024 < 0.6
    assert not periods[:, on:].any() and rms(periods[:, :on]) == pytest.approx(3.0, rel=1e-3)
    assert abs(np.corrcoef(periods)[0, 1:]).max() < 0.3
    spectrum, frequency = np.abs(np.fft.rfft(shake.value)) ** 2, np.fft.rfftfreq(4096, 1 / FS)
    beyond = (frequency < 10) | (frequency > 210)
    assert spectrum[beyond].sum() < 5e-5 * spectrum.sum()  # 8e-4 if the same noise is cut without flanks


def test_the_level_ramp_rises_by_as_many_db_in_every_second():
    """From 0.5 to 8 m/s² in 64 s: 16^(1/64) a second, so the rms of quarter i is about 0.5 · 2^(i + 1/2)."""
    quarters = excitation.level_ramp(64.0, FS, (5, 220), 0.5, 8.0, seed=4).value.reshape(4, -1)
    # mean over a quarter of 2^(2u), u from 0 to 1, is 3 / (2 ln 2)
    expected = 0.5 * 2.0 ** np.arange(4) * np.sqrt(3 / (2 * np.log(2)))
    np.testing.assert_allclose([rms(q) for q in quarters], expected, rtol=0.05)


def test_multisine_has_equal_lines_at_multiples_of_one_over_the_period_only():
    shake = excitation.multisine(6.0, FS, (5, 20), 1.5, seed=1, period=2.0)
    period = shake.value[:1024]
    np.testing.assert_array_equal(shake.value, np.tile(period, 3))
    amplitude = np.abs(np.fft.rfft(period)) / 512
    lines = np.flatnonzero(amplitude > 1e-9)
    np.testing.assert_array_equal(lines, np.arange(10, 41))
    np.testing.assert_allclose(amplitude[lines], 1.5 * np.sqrt(2 / 31), rtol=1e-12)


def test_multisine_leaves_the_highest_line_out():
    value = excitation.multisine(1.0, 64.0, (1, 32), 1.0, period=1.0).value
    assert np.flatnonzero(np.abs(np.fft.rfft(value)) > 1e-9).tolist() == list(range(1, 32))


@pytest.mark.parametrize(("band", "method", "frequency"), [
    ((10, 100), "linear", lambda u: 10 + 90 * u),
    ((10, 100), "logarithmic", lambda u: 10 * 10**u),
    ((100, 10), "linear", lambda u: 100 - 90 * u),
    ((100, 10), "logarithmic", lambda u: 100 * 10**-u),
])  # fmt: skip
def test_a_sweep_has_the_frequency_of_its_method(band, method, frequency):
    """Times of the rising zeros: the number of turns up to time t is the integral of the frequency."""
    shake = excitation.sweep(10.0, 8192.0, band, 2.5, method=method)
    assert shake.band == (10, 100)
    value, time = shake.value, shake.time
    assert np.abs(value).max() == pytest.approx(2.5, rel=1e-3)
    rising = np.flatnonzero((value[:-1] < 0) & (value[1:] >= 0))
    zeros = time[rising] - value[rising] / (value[rising + 1] - value[rising]) / 8192
    np.testing.assert_allclose(1 / np.diff(zeros), frequency((zeros[1:] + zeros[:-1]) / 2 / 10), rtol=2e-3)


def test_hammer_pulses_are_half_sines():
    """The impulse of a half sine is 2/π of peak times width; 20 samples a pulse integrate it to (π/40)²/3 = 0.2 %."""
    shake = excitation.hammer(4.0, 2000.0, (10, -30), 0.01, (0.5, 2.25), kind="force")
    assert not shake.value[:1000].any()
    np.testing.assert_allclose(shake.value[1000:1021], 10 * np.sin(np.pi * np.arange(21) / 20), atol=1e-12)
    assert shake.value[4500:4521].sum() / 2000 == pytest.approx(-30 * 0.01 * 2 / np.pi, rel=3e-3)
    assert np.abs(shake.value[4522:]).max() < 1e-12
    assert (shake.kind, shake.band) == ("force", None)


def test_one_peak_serves_all_hammer_pulses_which_may_start_at_zero_and_end_with_the_record():
    assert excitation.hammer(1.0, 100.0, 5.0, 0.1, (0.0, 0.4, 0.9)).value[[5, 45, 95]] == pytest.approx(5.0)


def test_a_stepped_sine_turns_by_each_frequency_for_as_long():
    """Rising zeros: the phase goes on from step to step, so its turns add up: 8 + 16 + 12 at 1024 Hz."""
    shake = excitation.stepped_sine(6.0, 1024.0, (4.0, 8.0, 6.0), (1.0, 2.0, 0.5))
    for i, (cycles, peak) in enumerate(((8, 1.0), (16, 2.0), (12, 0.5))):
        step = shake.value[2048 * i : 2048 * (i + 1)]
        np.testing.assert_allclose(step, peak * np.sin(2 * np.pi * cycles * np.arange(2048) / 2048), atol=1e-12)


def test_the_phase_of_a_stepped_sine_does_not_jump():
    """From one sample to the next a sine of 1 changes by at most 2 sin(πf/fs)."""
    value = excitation.stepped_sine(4.0, 512.0, np.linspace(7.1, 12.7, 8), 1.0).value
    assert np.abs(np.diff(value)).max() <= 2 * np.sin(np.pi * 12.7 / 512)


GENERATORS = {
    "random": ({}, {"rms": 1.0, "seed": 0, "band": [5.0, 220.0]}),
    "burst_random": ({}, {"rms": 1.0, "seed": 0, "burst": 0.6, "period": 2.0}),
    "level_ramp": ({"end_rms": np.float64(3)}, {"start_rms": 0.5, "end_rms": 3.0, "seed": 0}),
    "multisine": ({"seed": np.int64(5)}, {"rms": 1.0, "seed": 5, "period": 2.0}),
    "sweep": ({"method": "linear"}, {"amplitude": 1.0, "method": "linear"}),
    "stepped_sine": ({"frequency": [5, 6.5], "amplitude": 2}, {"frequency": [5.0, 6.5], "amplitude": [2.0]}),
    "hammer": ({"peak": 2, "width": 0.01, "times": [1]}, {"peak": 2.0, "width": 0.01, "times": [1.0]}),
}


@pytest.mark.parametrize("name", GENERATORS)
def test_the_description_names_the_generator_and_is_plain_data(name):
    arguments, expected_fields = GENERATORS[name]
    shake = getattr(excitation, name)(4.0, FS, **arguments, kind="force")
    description = json.loads(json.dumps(shake.description))
    assert description == shake.description
    expected = {"generator": name, "duration": 4.0, "fs": FS, "kind": "force", **expected_fields}
    assert {key: description[key] for key in expected} == expected
    assert (shake.kind, shake.fs, shake.value.size) == ("force", FS, 2048)
    assert shake.band == (None if name in ("hammer", "stepped_sine") else (5.0, 220.0))


@pytest.mark.parametrize("name", ["random", "burst_random", "level_ramp", "multisine", "sweep"])
@pytest.mark.parametrize(("changes", "message"), [
    ({"duration": -1.0}, "duration -1.0: must be"),
    ({"duration": np.nan}, "duration nan: must be"),
    ({"duration": 1e-3}, "duration 0.001: must be two samples"),
    ({"fs": 0.0}, "fs 0.0: must be > 0 Hz"),
    ({"band": (5, 257)}, r"band \(5, 257\): must end at or below fs / 2 = 256 Hz"),
    ({"band": (20, 20)}, r"band \(20, 20\): must be two rising"),
    ({"band": (-5, 20)}, r"band \(-5, 20\): must be two rising"),
    ({"kind": "voltage"}, 'kind "voltage" is unknown'),
])  # fmt: skip
def test_what_no_generator_can_do_is_refused_by_name(name, changes, message):
    assert_refused(ExcitationError, message, getattr(excitation, name), **{"duration": 4.0, "fs": FS, **changes})


NEEDED = {"stepped_sine": {"frequency": 5.0, "amplitude": 1.0}, "hammer": {"peak": 1.0, "width": 0.01, "times": (1.0,)}}


@pytest.mark.parametrize(("name", "changes", "message"), [
    ("random", {"rms": -1.0}, "rms -1.0: must be >= 0"),
    ("random", {"rms": np.inf}, "rms inf: must be >= 0"),
    ("random", {"band": (10.1, 10.2)}, r"duration 4.0: puts no line of 0.25 Hz into the band \(10.1, 10.2\)"),
    ("burst_random", {"rms": -1.0}, "rms -1.0"),
    ("burst_random", {"burst": 0.0}, "burst 0.0: must be > 0 and <= 1"),
    ("burst_random", {"burst": 1.1}, "burst 1.1: must be > 0 and <= 1"),
    ("burst_random", {"period": 5.0}, "period 5.0: must be more than a sample and at most the duration"),
    ("level_ramp", {"start_rms": 0.0}, "start_rms 0.0: must be > 0"),
    ("level_ramp", {"end_rms": -2.0}, "end_rms -2.0: must be > 0"),
    ("multisine", {"rms": -1.0}, "rms -1.0"),
    ("multisine", {"period": 0.0}, "period 0.0: must be more than a sample"),
    ("multisine", {"period": 1.001}, "period 1.001: must be a whole number of samples"),
    ("multisine", {"band": (10.1, 10.2)}, r"period 2.0: puts no line of 0.5 Hz into the band"),
    ("sweep", {"amplitude": -1.0}, "amplitude -1.0: must be >= 0"),
    ("sweep", {"method": "cubic"}, "method 'cubic': must be"),
    ("random", {"band": (50, 20)}, r"band \(50, 20\): must be two rising"),
    ("sweep", {"band": (0, 100)}, r"band \(0, 100\): must stay above 0 Hz"),
    ("stepped_sine", {"frequency": 0.0}, "frequency 0.0: must be in 0 to 256 Hz"),
    ("stepped_sine", {"frequency": (5.0, 256.0)}, r"frequency \(5.0, 256.0\): must be in 0 to 256 Hz"),
    ("stepped_sine", {"frequency": (5.0, 6.0), "amplitude": (1.0, 2.0, 3.0)}, r"frequency .* each of 3 steps"),
    ("stepped_sine", {"amplitude": -1.0}, "amplitude -1.0: must be >= 0"),
    ("stepped_sine", {"amplitude": (1.0, np.inf)}, "amplitude .*: must be >= 0"),
    ("stepped_sine", {"frequency": (5.0, 6.0, 7.0)}, "duration 4.0: must give each of 3 steps a whole number"),
    ("stepped_sine", {"duration": 0.0}, "duration 0.0"),
    ("hammer", {"width": 0.003}, "width 0.003: must be at least two samples"),
    ("hammer", {"times": (1.0, 1.005)}, r"times \[1.0, 1.005\]: must rise within 0 to 4 s"),
    ("hammer", {"times": (2.0, 1.0)}, "times"),
    ("hammer", {"times": (3.995,)}, "times"),
    ("hammer", {"times": (-0.5,)}, "times"),
    ("hammer", {"times": ()}, "times"),
    ("hammer", {"peak": (1.0, 2.0)}, r"peak \[1.0, 2.0\]: must be one finite number, or one for each of 1 times"),
    ("hammer", {"peak": np.nan}, "peak nan"),
])  # fmt: skip
def test_impossible_parameters_are_refused_by_name(name, changes, message):
    with pytest.raises(ExcitationError, match=message):
        getattr(excitation, name)(**{"duration": 4.0, "fs": FS, **NEEDED.get(name, {}), **changes})


@pytest.mark.parametrize(("fields", "message"), [
    ({"value": np.ones((2, 3))}, r"one row of samples, got shape \(2, 3\)"),
    ({"value": [0.0, np.nan]}, "sample 1 of the excitation is not finite"),
    ({"fs": -1.0}, "fs must be > 0"),
    ({"kind": "noise"}, '"noise" is unknown'),
    ({"band": (20, 10)}, "two increasing frequencies"),
    ({"band": (5, 60)}, "fs 100 Hz is below twice the band's upper end 60 Hz"),
])  # fmt: skip
def test_an_impossible_excitation_is_refused(fields, message):
    assert_refused(ExcitationError, message, Excitation, **{"value": [0.0, 1.0], "fs": 100.0, **fields})
