"""Dropouts, spikes, offsets and drifts put into channels that were sound; decays, hits and rests are none."""

import re
import warnings

import numpy as np
import pytest

from clearance_mj.identify.records.checks import check_records
from clearance_mj.identify.records.dropouts import describe_dropouts, zero_error
from clearance_mj.io.dataset import Dataset

from .records import with_channel

FS, GAP = 512.0, 3e-4
TIME = np.arange(8192) / FS


@pytest.fixture
def sound(rng):
    """Noise below a tenth of the rate."""
    return np.convolve(rng.standard_normal(TIME.size), np.hanning(20), "same")


def held(signal):
    return np.where((TIME >= 4.0) & (TIME < 4.05), signal[2048], signal)


def lost(signal):
    return np.where((TIME >= 4.0) & (TIME < 5.5), 0.0, signal)


def struck(signal):
    return np.where(TIME == 4.0, 40 * signal.std(), signal)


@pytest.mark.parametrize(("damage", "words"), [
    (held, "drops out at 4 s for 0.0508 s"),
    (lost, "drops out at 4 s for 1.5 s"),
    (struck, "has a spike of one sample at 4 s"),
])  # fmt: skip
def test_a_loose_cable(sound, damage, words):
    assert describe_dropouts([damage(sound), sound[::-1]], FS) == [words, ""]


def test_hits_and_rests_are_none(sound):
    """A hit strikes all channels; a decay calms down to the steps of a converter, and rests."""
    decay = np.round(sound * np.exp(-3 * TIME) / 1e-3) * 1e-3
    assert describe_dropouts([decay, np.where(TIME < 2, 0.0, sound)], FS) == ["", ""]
    assert describe_dropouts([struck(sound), struck(sound[::-1])], FS) == ["", ""]
    felt = np.where(TIME == 2056 / FS, 6 * sound.std(), sound[::-1])  # less than other impacts
    assert describe_dropouts([struck(sound), np.where(TIME == 2.0, 20 * sound.std(), felt)], FS)[0] == ""


def test_zero_of_a_probe(sound):
    motion = GAP * np.minimum(TIME / 8, 1) * sound / np.abs(sound).max()
    assert zero_error(motion, GAP) == ""
    assert zero_error(motion + 1.5e-4, GAP) == "has an offset of 0.15 mm"
    assert zero_error(motion + 2e-5, GAP) == "has an offset of 0.0199 mm"  # spoilt FRFs by 1.5 dB, in silence
    assert zero_error(motion / 4 + 5e-6, GAP).startswith("has an offset of 0.00")  # and by 0.3 dB
    # Loud, and then quiet where grease holds the shaft 12 µm away: the tail of a sweep.
    assert zero_error(np.where(TIME < TIME[-1] / 2, sound * GAP, 0.02 * motion - 1.2e-5), GAP) == ""
    assert zero_error(1e3 * motion, GAP) == ""  # in mm
    assert zero_error(motion + 2e-4 * TIME / TIME[-1], GAP).startswith("drifts by 0.1")


@pytest.mark.parametrize(
    ("shift", "words"),
    [(1.5e-4, r"probe at bushings\[0\] has an offset of 0\.15 mm, beside a gap of 0\.3 mm; .* subtract it"), (0.0, "")],
)
def test_a_probe_with_an_offset_is_said(small_dataset, shift, words):
    """0.15 mm made the amplitude law predict FRFs 2.5 dB off in place of 0.05, in silence."""
    (record,) = Dataset.load(small_dataset).to_identify()
    moved = with_channel(record, 6, "displacement", lambda value: value + shift)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        check_records([moved])
    assert (len(said) == 1) == bool(words)
    assert not words or re.search(words, str(said[0].message))
