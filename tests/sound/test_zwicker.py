"""Loudness of the test signals of ISO 532-1:2017, Annex B, as far as their definitions make them.

The expected values are those of the workbooks "Results and tests for synthetic signals" of the standard's electronic
attachment (https://standards.iso.org/iso/532/-1/ed-1/en/), as MoSQITo (validations/sq_metrics/loudness_zwst), SQAT
(validation/Loudness_ISO532_1) and phonometry (tests/data/iso532_1) quote them, alike. The tolerance is the standard's:
5 % or 0.1 sone, the wider of the two.
"""

import importlib.util

import numpy as np
import pytest

from clearance_mj.core.errors import ClearanceError, RecordError
from clearance_mj.sound import Sound, loudness, loudness_level

pytest.importorskip("mosqito")
FS = 48000
PULSE_FLANK = 2e-3
"""s, of raised cosine: the standard states only how long a pulse is and how loud; between half heights here"""


def within(calculated, expected):
    return abs(calculated - expected) <= max(0.05 * expected, 0.1)


def tone(frequency, level, time):
    return np.sqrt(2) * 20e-6 * 10 ** (np.asarray(level) / 20) * np.sin(2 * np.pi * frequency * time)


def steady(frequency, level, seconds=1.0):
    return Sound(tone(frequency, level, np.arange(int(seconds * FS)) / FS), FS)


STATIONARY = [(250, 80, 14.6545), (1000, 60, 4.0192), (4000, 40, 1.5494)]


@pytest.mark.parametrize(("frequency", "level", "expected"), STATIONARY, ids=["signal 2", "signal 3", "signal 4"])
def test_tones(frequency, level, expected):
    """Annex B.3, by the method for stationary sounds."""
    assert within(loudness(steady(frequency, level), "stationary").n5, expected)


@pytest.mark.parametrize(
    ("frequency", "level", "expected"),
    [STATIONARY[0], *(pytest.param(*values, marks=pytest.mark.slow) for values in STATIONARY[1:])],
    ids=["signal 2", "signal 3", "signal 4"],
)
def test_tones_by_the_method_for_all_sounds(frequency, level, expected):
    """The standard's method 2 includes stationary sounds."""
    assert within(loudness(steady(frequency, level, 0.2)).maximum, expected)


def test_pink_noise():
    """Annex B.3, signal 5: 60 dB overall; the standard's is one realisation, this another one."""
    rng = np.random.default_rng(0)
    spectrum = np.fft.rfft(rng.standard_normal(5 * FS))
    spectrum[1:] /= np.sqrt(np.arange(1, spectrum.size))
    spectrum[0] = 0
    pressure = np.fft.irfft(spectrum)
    pressure *= 20e-6 * 10 ** (60 / 20) / np.sqrt(np.mean(pressure**2))
    assert within(loudness(Sound(pressure, FS), "stationary").n5, 10.4978)


def test_one_sone_is_one_kilohertz_at_40_db():
    """The definition of the sone (ISO 532-1:2017, 3.17)."""
    perceived = loudness(steady(1000, 40, 0.4))
    assert perceived.maximum == pytest.approx(1.0, abs=0.005)
    assert perceived.specific.shape[0] == perceived.bark.size == 240
    assert perceived.bark[perceived.specific[:, -1].argmax()] == pytest.approx(8.5, abs=0.6)  # 1 kHz is at 8.5 Bark
    assert loudness_level(perceived.maximum) == pytest.approx(40, abs=0.1)


@pytest.mark.parametrize(
    ("seconds", "maximum", "n5"),
    [(0.010, 4.2998, 0.74487), pytest.param(0.050, 5.9746, 4.16026, marks=pytest.mark.slow),
     pytest.param(0.500, 8.0772, 8.074, marks=pytest.mark.slow)],
    ids=["signal 10", "signal 11", "signal 12"],
)  # fmt: skip
def test_tone_pulses(seconds, maximum, n5):
    """Annex B.4: 1 kHz at 70 dB in a record of 0.998 s. N5 of signal 12 is that of its N(t): the workbook's 7.670 is
    the percentile of another column, the tolerance's lower bound, as SQAT's validation found."""
    pressure, flank = np.zeros(round(0.998 * FS)), round(PULSE_FLANK * FS)
    n = round(seconds * FS) + flank
    window = np.ones(n)
    window[:flank] = 0.5 - 0.5 * np.cos(np.pi * np.arange(flank) / flank)
    window[-flank:] = window[:flank][::-1]
    pressure[9600 : 9600 + n] = window * tone(1000, 70, np.arange(n) / FS)
    perceived = loudness(Sound(pressure, FS))
    assert within(perceived.maximum, maximum)
    assert within(perceived.n5, n5)


@pytest.mark.release
@pytest.mark.parametrize(
    ("frequency", "maximum", "n5"),
    [(250, 14.3592, 11.85756), (1000, 15.9534, 13.37887), (4000, 23.9501, 20.26187)],
    ids=["signal 6", "signal 7", "signal 8"],
)
def test_tones_whose_level_rises(frequency, maximum, n5):
    """Annex B.4: 30 to 80 dB in 10 s, after 0.1 s of silence and before 0.5 s of it; N5 without the silence.

    The end has 5 ms of raised cosine, without which the cut would be heard."""
    time, flank = np.arange(10 * FS) / FS, FS // 200
    rising = tone(frequency, 30 + 5 * time, time)
    rising[-flank:] *= 0.5 + 0.5 * np.cos(np.pi * np.arange(flank) / flank)
    perceived = loudness(Sound(np.concatenate((np.zeros(FS // 10), rising, np.zeros(FS // 2))), FS))
    heard = (perceived.time > 0.0999) & (perceived.time < 10.0981)
    assert within(perceived.maximum, maximum)
    assert within(float(np.percentile(perceived.sone[heard], 95)), n5)


def test_any_sampling_rate():
    slow = 8192
    pressure = tone(1000, 60, np.arange(slow) / slow)
    assert loudness(Sound(pressure, slow), "stationary").n5 == pytest.approx(4.0192, rel=0.05)


@pytest.mark.parametrize(("sone", "phon"), [(1, 40), (2, 50), (4, 60), (0.5, 31.39), (0, 3)])
def test_phon(sone, phon):
    """ISO 532-1:2017: 40 + 33.22 lg N from 1 sone on, and 40 (N + 0.0005)^0.35, at least 3, below."""
    assert loudness_level(sone) == pytest.approx(phon, abs=0.01)


def test_what_has_no_loudness_is_refused(monkeypatch):
    with pytest.raises(RecordError, match=r"too short for its loudness; needs 0\.1 s"):
        loudness(steady(1000, 60, 0.05))
    with pytest.raises(RecordError, match='method "loud" is unknown'):
        loudness(steady(1000, 60), "loud")
    with pytest.raises(RecordError, match='field "near" is unknown'):
        loudness(steady(1000, 60), field="near")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ClearanceError, match=r'needs the package mosqito: pip install "clearance-mj\[sound\]"'):
        loudness(steady(1000, 60))
