"""What a rig and its law miss, where it is known: gains of sensors, noise, decays."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.engines import simulate
from clearance_mj.identify.laws.law_misfit import law_misfit
from clearance_mj.identify.records.prepared import prepared
from clearance_mj.io.dataset import BASE_NODE
from clearance_mj.io.uff import Channel
from clearance_mj.model import Model
from clearance_mj.signals.excitation import Excitation, random, stepped_sine, sweep

from ..conftest import SMALL_LAW, TABLE1, record_of
from ..study.turning_rig import RIG
from .records import FS
from .records import record_of as simulated

GAIN = 2.0  # dB


def changed(record, factors=(), noise=0.0):
    """The record with accelerometers by node times a factor, all with noise, as a share of their RMS."""
    rng, channels = np.random.default_rng(1), []
    for c in record.channels:
        value = c.value * dict(factors).get(c.node, 1.0)
        if c.node != BASE_NODE:
            value = value + noise * value.std() * rng.standard_normal(value.size)
        channels.append(Channel(c.name, c.node, c.direction, c.quantity, value, c.fs))
    return dataclasses.replace(record, channels=channels)


@pytest.fixture(scope="module")
def ramp():
    return record_of(TABLE1, "ramp", "identify", 2.0, 1, 10.0, start=0.3)


def test_a_gain_is_missed_at_its_sensor_and_said(ramp):
    node = TABLE1.sensors[2].node
    misfit = law_misfit([prepared(changed(ramp, {node: 10 ** (GAIN / 20)}, 0.01))], Model(TABLE1, SMALL_LAW))
    assert [s.duration for s in misfit.stretches] == [5.0, 5.0]
    missed = np.array([s.missed for s in misfit.stretches])
    # The typical size of a constant difference counts 1.48 times, as the standard deviation of a normal one.
    assert missed[:, 2] == pytest.approx(1.4826 * GAIN, rel=0.05)
    others = np.delete(np.array([s.ratio for s in misfit.stretches]), 2, axis=1)
    assert np.sqrt(np.mean(others**2)) == pytest.approx(1.0, abs=0.3)  # noise alone: as much as it explains
    (words,) = misfit.warnings
    label = TABLE1.sensor_labels[2]
    begin = "the law misses FRFs between 5 and 220 Hz by more than 3 times their random error at sensors"
    assert words.startswith(f"{begin} {label}, at ")
    assert f"most at sensor {label}, by 3" in words and misfit.widening > 3


def test_bands_of_few_lines_are_beyond_their_random_error_as_seldom_as_any_other():
    """Three standard deviations are passed by 0.27 % of normal variables, so by about three of these 1152."""
    ratios = []
    for seed in (3, 5, 8):
        record = changed(record_of(TABLE1, "ramp", "identify", 9.0, seed, 32.0, start=0.3), noise=0.01)
        ratios += [s.ratio for s in law_misfit([prepared(record)], Model(TABLE1, SMALL_LAW)).stretches]
    assert np.sum(np.array(ratios) > 3) <= 5
    assert np.sqrt(np.mean(np.square(ratios))) == pytest.approx(1.0, abs=0.15)


def test_noise_is_no_misfit_and_its_error_falls_with_the_duration(ramp):
    misfit = law_misfit([prepared(changed(ramp, noise=0.05))], Model(TABLE1, SMALL_LAW))
    assert misfit.warnings == () and misfit.widening < 1.3
    line, level = np.array([100.0]), misfit.stretches[0].level
    short, long = (misfit.spread(line, level, duration, 1.0) for duration in (5.0, 80.0))
    s = misfit.stretches[0]
    band = np.searchsorted(misfit.edges, 100.0) - 1
    beyond = np.maximum(0, s.missed**2 - s.random**2)[:, band]
    assert (8.6859 * short[:, 0]) ** 2 == pytest.approx(beyond + s.random[:, band] ** 2, rel=1e-3)
    assert (8.6859 * long[:, 0]) ** 2 == pytest.approx(beyond + s.random[:, band] ** 2 / 16, rel=1e-3)


@pytest.mark.parametrize(("cross", "said"), [(0.0, ()), (0.1, ("at sensors 1:+Y, ", "most at sensor 1:+Y, by "))])
def test_channels_across_the_excitation_hold_noise_unless_they_are_coherent_with_it(cross, said):
    """A shaft that does not turn moves along z alone; its sensors along y show noise, one also a part of z."""
    still = RIG.replace(spin=None, unbalances=())
    record, _ = simulated(still, random(5.0, 512.0, band=(5, 200), rms=1.0, seed=1), None)
    rng, moved = np.random.default_rng(3), {c.direction: c.value for c in record.channels if c.node == 1}
    channels = [
        dataclasses.replace(c, value=1e-2 * rng.standard_normal(c.size) + (c.node == 1) * cross * moved["+Z"])
        if c.direction == "+Y" and c.quantity == "acceleration" else c for c in record.channels
    ]  # fmt: skip
    misfit = law_misfit([prepared(dataclasses.replace(record, channels=channels))], Model(still))
    assert len(misfit.warnings) == bool(said)
    assert all(words in misfit.warnings[0] for words in said)
    assert np.isfinite(misfit.widening) and (misfit.widening > 3) == bool(said)


def test_decays_are_compared_from_hit_to_hit():
    value = np.zeros(int(4 * 2048.0))
    value[[1024, 5120]] = 60.0, 120.0
    hits = record_of(TABLE1, "hits", "identify", 1.0, 1, 4.0)
    response = simulate(TABLE1, Excitation(value, 2048.0, "base"), SMALL_LAW, "modal")
    signals = {BASE_NODE: value} | {s.node: 2.0 * a for s, a in zip(TABLE1.sensors, response.acceleration)}
    channels = [dataclasses.replace(c, value=signals[c.node]) for c in hits.channels if c.quantity == "acceleration"]
    record = dataclasses.replace(hits, channels=channels, band=None, level=None)
    misfit = law_misfit([prepared(record)], Model(TABLE1, SMALL_LAW))
    assert misfit.stretches == () and misfit.widening == 1.0 and misfit.warnings == ()
    assert [(d.start, d.peak) for d in misfit.decays] == [(0.5, 60.0), (2.5, 120.0)]
    for decay in misfit.decays:
        assert decay.missed == pytest.approx(-6.0206, abs=1e-3)  # the record is twice the model


@pytest.mark.parametrize("shake", [
    sweep(10.0, FS, (5.0, 220.0), 1.0), sweep(10.0, FS, (220.0, 5.0), 1.0, method="linear"),
    stepped_sine(10.0, FS, np.linspace(5.0, 220.0, 20), 1.0),
])  # fmt: skip
def test_lines_that_a_sine_passes_once_are_no_average(shake):
    """A gain of 2 dB, with noise: of one segment the coherence is 1, whatever noise there is."""
    record, _ = simulated(TABLE1, shake, SMALL_LAW)
    record = changed(record, {3: 1.26}, 0.1)
    misfit = law_misfit([prepared(record)], Model(TABLE1, SMALL_LAW))
    assert not any(np.isfinite(s.ratio).any() for s in misfit.stretches)
    assert (misfit.widening, misfit.warnings) == (1.0, ())


def test_lines_of_a_long_step_alone_are_compared():
    record, _ = simulated(TABLE1, stepped_sine(10.0, FS, [40.0, 90.0], 1.0), SMALL_LAW)
    misfit = law_misfit([prepared(changed(record, {3: 1.26}, 0.01))], Model(TABLE1, SMALL_LAW))
    for stretch, step in zip(misfit.stretches, (40.0, 90.0)):
        (band,) = np.flatnonzero(np.isfinite(stretch.missed[2]))
        assert misfit.edges[band] <= step <= misfit.edges[band + 1]
        assert stretch.missed[2, band] == pytest.approx(1.4826 * 20 * np.log10(1.26), rel=0.1)
