"""Records that cannot be identified from, or not fully. Channels are damaged by hand; the answer is what was done."""

import dataclasses
import warnings

import numpy as np
import pytest

from clearance_mj import identify
from clearance_mj.core.errors import RecordError
from clearance_mj.identify.records.checks import IdentifiabilityWarning, check_records, warn_of_no_contact
from clearance_mj.identify.records.lowest_mode import warn_of_no_ridge
from clearance_mj.identify.records.prepared import prepared
from clearance_mj.identify.registry import Identified, register
from clearance_mj.io.dataset import Dataset
from clearance_mj.model import Model
from clearance_mj.signals.channel_check import check_channel

from ..conftest import ROOT, SMALL_LAW, record_of
from ..refusals import assert_refused
from .records import FS, with_channel

TIME = np.arange(int(6 * FS)) / FS


@pytest.fixture(scope="module")
def record(rig):
    """With contact at both bushings."""
    return record_of(rig, "sound", "identify", 8.0, 1)


def clipped(fraction):
    return lambda value: np.clip(value, -fraction * np.abs(value).max(), fraction * np.abs(value).max())


def quantised(value, bits):
    step = 2 * np.abs(value).max() / 2**bits
    return step * np.round(value / step)


def noise(rng):
    return rng.standard_normal(TIME.size)


GOOD = {
    "noise": noise,
    "noise, 8 bits": lambda rng: quantised(noise(rng), 8),
    "slow sine, 12 bits": lambda rng: quantised(np.sin(2 * np.pi * 3.3 * TIME), 12),
    "slow sine, 6 digits": lambda rng: np.round(0.9 * np.sin(2 * np.pi * 2.1 * TIME), 6),
    "hits on a resting channel": lambda rng: np.maximum(0, np.sin(2 * np.pi * 80 * TIME)) * (TIME % 1 < 1 / 160),
    "square root of noise": lambda rng: np.sqrt(np.abs(noise(rng))),
    "free decay across a hammer, 3 steps": lambda rng: np.round(3.4 * np.exp(-TIME) * np.sin(2 * np.pi * 9 * TIME)),
    "free decay, 20 steps": lambda rng: np.round(20 * np.exp(-TIME) * np.sin(2 * np.pi * 9 * TIME)),
    "resonance with offset, 16 bits": lambda rng: quantised(3 + np.sin(2 * np.pi * 9 * TIME) * (1 + 0.1 * TIME), 16),
}


@pytest.mark.parametrize("name", GOOD)
def test_good_channels_pass(rng, name):
    check_channel("channel", GOOD[name](rng), FS)


CLIPPED = {
    "noise at 2 σ": lambda rng: np.clip(np.convolve(noise(rng), np.hanning(20), "same"), -6, 6),
    "above only": lambda rng: np.minimum(np.sin(2 * np.pi * 40 * TIME), 0.8),
    "below only, 12 bits": lambda rng: np.maximum(quantised(np.sin(2 * np.pi * 9.3 * TIME), 12), -0.8),
    "free decay, 10 bits": lambda rng: np.clip(quantised(np.exp(-TIME) * np.sin(2 * np.pi * 9 * TIME), 10), -0.5, 0.5),
    "one hit": lambda rng: np.clip(0.01 * noise(rng) + 5 * np.exp(-(((TIME - 3) / 0.002) ** 2)), -1, 1),
}


@pytest.mark.parametrize("name", CLIPPED)
def test_clipped_channels_are_found(rng, name):
    assert_refused(RecordError, "channel is clipped at", check_channel, "channel", CLIPPED[name](rng), FS)


def test_instant_and_level_of_clipping():
    signal = np.minimum(np.sin(2 * np.pi * 4.0 * TIME), 0.5)  # passes 0.5 first at 1/48 s
    assert_refused(RecordError, r"clipped at 0\.5 from 0\.0209961 s on", check_channel, "channel", signal, FS)


def test_shipped_records_pass():
    dataset = Dataset.load(ROOT / "data" / "table1_rig")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_records(dataset.records)


CHANNELS = {
    "excitation": (100, "acceleration", "excitation .*; nothing can be identified from this record"),
    "accelerometer": (3, "acceleration", r'accelerometer 3:.Z .* with left_out = \["3:.Z"\] .* everything still can'),
    "accelerometer at a bushing": (6, "acceleration", r'accelerometer 6:.Z .* with left_out = \["6:.Z"\] for this rec'),
    "probe": (7, "displacement", "probe 7:.Z .* without the probes, bench, output-error and constant still"),
}
DAMAGE = {"is constant": lambda value: 0 * value + 0.25, "is clipped": clipped(0.5)}


@pytest.mark.parametrize("damage", DAMAGE)
@pytest.mark.parametrize("channel", CHANNELS)
def test_damaged_channels_are_named_with_what_is_left(record, channel, damage):
    node, quantity, words = CHANNELS[channel]
    damaged = with_channel(record, node, quantity, DAMAGE[damage])
    assert damage in assert_refused(RecordError, f'record "{record.name}": {words}', check_records, [damaged])
    with pytest.raises(RecordError, match=r'without it, the rest \("sound"\) can be identified from'):
        check_records([dataclasses.replace(damaged, name="damaged"), record])


@pytest.mark.parametrize("method", ["constant", "ridge", "force-balance", "amplitude", "output-error"])
def test_every_method_checks_its_records(record, method):
    damaged = with_channel(record, 100, "acceleration", DAMAGE["is clipped"])
    assert_refused(RecordError, "excitation is clipped at", identify.law, Dataset(record.rig, (damaged,)), method)


def test_a_sample_that_is_no_number_is_named(record):
    def spoil(value):
        value[1024] = np.nan
        return value

    with pytest.raises(RecordError, match=r'channel "acc 3".*sample 1024 is not a finite number'):
        with_channel(record, 3, "acceleration", spoil)
    with pytest.raises(RecordError, match=r"channel is not a finite number at 0\.5 s"):
        check_channel("channel", spoil(record.channels[0].value.copy()), FS)


def cut(record, duration):
    channels = [dataclasses.replace(c, value=c.value[: int(duration * FS)]) for c in record.channels]
    return dataclasses.replace(record, name="short", channels=channels)


SHORT = {
    ("output-error", 3.0): r"lasts 3 s; this method needs 5 s; long enough for ridge \(1\.72 s\), .*amplitude \(1\.2 s",
    ("ridge", 1.5): r"lasts 1\.5 s; this method needs 1\.72 s; long enough for force-balance \(1\.2 s\), amplitude",
    ("amplitude", 1.0): "lasts 1 s; this method needs 1.2 s; too short for any method",
}


@pytest.mark.parametrize(("method", "duration"), SHORT)
def test_short_records_name_the_methods_they_serve(record, method, duration):
    with pytest.raises(RecordError, match=SHORT[method, duration]):
        identify.law(Dataset(record.rig, (cut(record, duration),)), method)


@pytest.mark.slow
def test_no_contact_is_a_warning_and_the_grease_still_is_identified(rig):
    dataset = Dataset(rig, (record_of(rig, "quiet", "identify", 0.3, 3),))
    with pytest.warns(IdentifiabilityWarning, match=r"no contact: bushings\[0\] .* in a gap of 0\.3 mm, bushings\[1\]"):
        law = identify.law(dataset, "constant")
    (grease,), (known,) = law.grease, SMALL_LAW.grease
    assert grease.stiffness == pytest.approx(known.stiffness, rel=0.005)
    assert grease.damping == pytest.approx(known.damping, rel=0.02)
    with pytest.warns(IdentifiabilityWarning, match="no contact"):
        physical = identify.law(dataset, "output-error")
    for grease in physical.grease:
        assert grease.stiffness == pytest.approx(known.stiffness, rel=0.005)
        assert grease.damping == pytest.approx(known.damping, rel=0.02)
    with (
        pytest.warns(IdentifiabilityWarning, match="no contact"),
        pytest.raises(RecordError, match=r"only the grease: bushings\[0\].*4000 N/m"),
    ):
        identify.law(dataset, "amplitude")


def test_contact_at_one_bushing_only(record):
    still = with_channel(record, 6, "displacement", lambda value: 0.1 * value)
    with pytest.warns(IdentifiabilityWarning, match=r"at one bushing: bushings\[0\] moves up to .*; its contact is"):
        warn_of_no_contact(check_records([still]), still.rig)


def test_a_method_that_finds_the_rig_speaks_of_the_gap_that_it_finds(record, monkeypatch):
    """The rig file's gap of 0.3 mm is never crossed, the one that is found is: nothing is said."""
    still = with_channel(record, 6, "displacement", lambda value: 0.1 * value)
    narrow = still.rig.replace(bushings=tuple(dataclasses.replace(b, gap=1e-5) for b in still.rig.bushings))
    monkeypatch.setattr("clearance_mj.identify.registry.METHODS", {})
    dataset = Dataset(still.rig, (still,))

    def said(rig):
        method = register("found", "", lambda rig: 1.0, finds_rig=True)(lambda *_: Identified(model=Model(rig)))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", IdentifiabilityWarning)
            return method(dataset).warnings

    assert said(narrow) == ()
    (words,) = said(still.rig)
    assert words.startswith("no contact at one bushing: bushings[0] moves up to ") and "in a gap of 0.3 mm" in words


def test_no_ridge_above_the_noise(record, rng):
    noisy = with_channel(record, 7, "displacement", lambda value: 1e-4 * rng.standard_normal(value.size))
    decay = np.exp(-0.5 * TIME) * np.cos(2 * np.pi * 9.25 * TIME)
    noisy = with_channel(noisy, 6, "displacement", lambda value: 1e-4 * decay)
    with pytest.warns(IdentifiabilityWarning, match=r"no ridge above the noise .* at bushings\[1\]: .* do not need a"):
        warn_of_no_ridge(prepared(noisy))
