"""Hammer tests against the closed form of a simply supported beam: f_n = n² f_1, φ_n(x) = √(2/m) sin(nπx/L).

The force is a sum of sin² pulses. Each mode's response is exact for a force that is linear between samples, taken at
eight times the rate.
Windows: Fladung, Windows used for impact testing, IMAC 15, 1997. pyFRF and sdypy-EMA get the same blocks.
"""

import dataclasses

import numpy as np
import pytest
import scipy.signal

import clearance_mj as cm
from clearance_mj.core.notes import RecordNote
from clearance_mj.signals import Response, hammer_frf, join_references
from clearance_mj.signals.hits import is_impulsive

from ..refusals import assert_refused

FS, UP, MASS = 2048.0, 8, 2.0
FREQUENCY, DAMPING = 18.0 * np.arange(1, 4) ** 2, np.array([0.008, 0.006, 0.005])
PLACE = {"1:+Z": 0.15, "2:+Z": 0.3, "3:+Z": 0.45}
TIMES, PEAKS = (0.62, 3.13, 5.57, 8.21), (60.0, 80.0, 55.0, 70.0)


def shape(dof):
    return np.sqrt(2 / MASS) * np.sin(np.arange(1, 4) * np.pi * PLACE[dof])


def exact(frequency, response, reference, rate=0.0):
    s, wn = rate + 2j * np.pi * np.asarray(frequency)[:, None], 2 * np.pi * FREQUENCY
    return (s**2 * shape(response) * shape(reference) / (wn**2 + s**2 + 2 * DAMPING * wn * s)).sum(axis=1)


def beam(times=TIMES, peaks=PEAKS, at="2:+Z", responses=("1:+Z", "2:+Z"), duration=10.7, noise=0.02, damping=DAMPING):
    """Record of hits of 2 ms at a point."""
    time = np.arange(round(duration * FS) * UP) / (FS * UP)
    force = np.zeros(time.size)
    for start, peak in zip(times, peaks):
        inside = (time > start) & (time < start + 0.002)
        force[inside] += peak * np.sin(np.pi * (time[inside] - start) / 0.002) ** 2
    motion = 0.0
    of_responses = np.transpose([shape(r) for r in responses])
    for wn, ratio, of_hammer, of_sensors in zip(2 * np.pi * FREQUENCY, damping, shape(at), of_responses):
        system = [[0, 1], [-(wn**2), -2 * ratio * wn]], [[0], [of_hammer]], [[-(wn**2), -2 * ratio * wn]], [[of_hammer]]
        system = tuple(map(np.array, system))
        up, down = scipy.signal.ss2tf(*scipy.signal.cont2discrete(system, 1 / (FS * UP), "foh")[:4])
        motion += np.outer(of_sensors, scipy.signal.lfilter(up[0], down, force)[::UP])
    rng = np.random.default_rng(3)
    force = force[::UP] + noise * rng.standard_normal(force.size // UP)
    motion = motion + noise * rng.standard_normal(motion.shape)
    return Response(FS, force, motion, kind="force", responses=responses, reference=at)


@pytest.fixture(scope="module")
def beam_test():
    return beam()


def faults(test):
    return [hit.fault for hit in test.hits]


def modes_are_right(frf, damping=DAMPING):
    modes = cm.extract_modes(frf, 3, band=(5, 250))
    np.testing.assert_allclose(modes.frequency, FREQUENCY, rtol=1e-3)
    np.testing.assert_allclose(modes.damping, damping, rtol=0.03)


def test_frfs_coherence_and_modes_of_a_clean_test(beam_test):
    test = hammer_frf(beam_test, exponential=0.05)
    assert faults(test) == [""] * 4
    np.testing.assert_allclose([hit.time for hit in test.hits], np.add(TIMES, 0.001), atol=0.5 / FS + 1e-9)
    for row, label in enumerate(test.frf.responses):
        error = test.frf.value[row, 0] - exact(test.frf.frequency, label, "2:+Z", test.frf.window_rate)
        near = (test.frf.frequency > 10) & (test.frf.frequency < 250)
        assert np.linalg.norm(error[near]) < 0.01 * np.linalg.norm(test.frf.value[row, 0, near])
    peaks = np.abs(test.frf.frequency[:, None] - FREQUENCY).argmin(axis=0)
    assert test.frf.coherence[:, 0, peaks].min() > 0.99  # what is left of the hit before, 10 % at 18 Hz
    modes_are_right(test.frf)
    assert len(test.plot().axes) == 4


def test_pyfrf_and_sdypy_ema_find_the_same(tmp_path, beam_test):
    """pyFRF's own H1 of the same blocks, without its windows; sdypy-EMA's LSCF of these FRFs."""
    pyfrf, ema = pytest.importorskip("pyFRF"), pytest.importorskip("sdypy.EMA")
    test = hammer_frf(beam_test, band=(0.5, 250.0), exponential=1.0)
    size = test.blocks[0].excitation.size
    settings = {"exc_type": "f", "resp_type": "a", "window": "none", "nperseg": size, "fft_len": size, "noverlap": 0}
    other = pyfrf.FRF(int(FS), frf_estimator="H1", **settings)
    histories = ([getattr(block, name) for block in test.blocks] for name in ("excitation", "acceleration"))
    excitation, motion = (np.concatenate(parts, axis=-1) for parts in histories)
    other.add_data(excitation[None, None], motion[None])
    theirs = np.squeeze(other.get_FRF(frf_form="accelerance"))
    first = round(test.frf.frequency[0] * size / FS)
    np.testing.assert_allclose(test.frf.functions, theirs[:, first : first + test.frf.frequency.size], rtol=1e-9)
    cm.write(tmp_path / "h.uff", test.frf)
    model = ema.Model(lower=5, upper=249, pol_order_high=30)
    model.read_uff(str(tmp_path / "h.uff"))
    model.get_poles(show_progress=False)
    model.select_closest_poles(list(FREQUENCY), f_window=5, fn_temp=0.01, xi_temp=0.1)
    ours = cm.extract_modes(test.frf, 3, band=(5, 250))
    np.testing.assert_allclose(ours.frequency, model.nat_freq, rtol=1e-3)
    np.testing.assert_allclose(ours.damping, model.nat_xi, rtol=0.03)


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_estimators(beam_test, estimator):
    modes_are_right(hammer_frf(beam_test, estimator).frf)


def test_damping_of_the_exponential_window_is_taken_out():
    """A tenth of the damping: a fifth of the response is left at the end of a block; its window adds 1.5 % at 18 Hz."""
    record = beam(damping=DAMPING / 10)
    test = hammer_frf(record)
    assert test.frf.window_rate == pytest.approx(-np.log(0.01 / 0.3) / 2.44, rel=0.3)
    assert "exponential window" in test.notes[-1]
    modes_are_right(test.frf, DAMPING / 10)
    rate = hammer_frf(record, exponential=0.001).frf.window_rate
    assert rate == pytest.approx(np.log(1000) * FS / test.blocks[0].excitation.size)
    without = cm.extract_modes(dataclasses.replace(test.frf, window_rate=0.0), 3, band=(5, 250))
    added = test.frf.window_rate / (2 * np.pi * FREQUENCY)
    np.testing.assert_allclose(without.damping, DAMPING / 10 + added, rtol=0.03)


def test_the_rate_of_the_window_stays_with_the_frfs(tmp_path, beam_test):
    frf = hammer_frf(beam_test, exponential=0.1).frf
    for name in ("a.uff", "a.nc"):
        cm.write(tmp_path / name, frf)
        assert cm.read(tmp_path / name).window_rate == pytest.approx(frf.window_rate, rel=1e-8)
    with pytest.warns(RecordNote, match="no place for the exponential window"):
        cm.write(tmp_path / "a.csv", frf)
    modal = cm.structure.modes_from_frf(frf, 3, band=(5, 250))
    np.testing.assert_allclose(modal.structure.frequencies[-3:], FREQUENCY, rtol=1e-3)
    np.testing.assert_allclose(modal.structure.ratios[-3:], DAMPING, rtol=0.03)
    np.testing.assert_allclose(np.abs(np.transpose(modal.structure.shapes)[-3:, 1]), np.abs(shape("2:+Z")), rtol=0.03)


def test_double_hits_and_clipped_hits_are_left_out():
    """A second pulse of 40 % after 41 ms; a hit of 160 N whose responses the converter cuts."""
    record = beam((*TIMES[:2], 5.57, 5.611, 8.21, 10.8), (60, 80, 55, 22, 70, 160), duration=13.3)
    limit = 1.02 * np.abs(record.acceleration[:, : round(10.5 * FS)]).max()
    record = dataclasses.replace(record, channels=np.clip(record.acceleration, -limit, limit))
    test = hammer_frf(record)
    assert [fault.partition(",")[0] for fault in faults(test)] == ["", "", "double hit", "", "overload"]
    assert faults(test)[2] in ("double hit, 40% again 41 ms later", "double hit, 41% again 41 ms later")
    assert len(test.blocks) == 3
    modes_are_right(test.frf)


def test_a_clipped_force_is_an_overload(beam_test):
    force = np.minimum(beam_test.excitation, 40.0)
    with pytest.raises(cm.RecordError, match=r"no hit at 2:.Z is left: .* overload, the force clipped"):
        hammer_frf(dataclasses.replace(beam_test, excitation=force))


def test_a_hammer_that_rings_on_and_offset_and_drift_of_its_channel():
    """Ringing of 8 % at 650 Hz is no double hit, and no force on the beam; offset and drift are no force either."""
    record, time = beam(), np.arange(round(10.7 * FS)) / FS
    force = record.excitation + 3.0 + 0.5 * np.sin(0.4 * time)
    for start, peak in zip(TIMES, PEAKS):
        after = time > start + 0.002
        t = time[after] - start - 0.002
        force[after] += 0.08 * peak * np.exp(-60 * t) * np.sin(2 * np.pi * 650 * t)
    test = hammer_frf(dataclasses.replace(record, excitation=force))
    assert faults(test) == [""] * 4
    modes_are_right(test.frf)


def test_the_ends_of_the_record():
    """A hit at 10 ms has its block; one that has begun before the record, and one 0.3 s before its end, do not."""
    record = beam((0.01, 2.5, 5.1, 7.7, 10.4), (60, 80, 55, 70, 65))
    test = hammer_frf(record)
    assert [bool(fault) for fault in faults(test)] == [False, False, False, False, True]
    assert "does not hold its block" in faults(test)[-1]
    modes_are_right(test.frf)
    cut = round(0.011 * FS)
    late = dataclasses.replace(record, excitation=record.excitation[cut:], channels=record.acceleration[:, cut:])
    assert "does not hold its block" in faults(hammer_frf(late))[0]


def test_a_force_of_the_other_sign(beam_test):
    test = hammer_frf(dataclasses.replace(beam_test, excitation=-beam_test.excitation))
    assert faults(test) == [""] * 4
    assert any("4 hits is negative" in words for words in test.notes)
    assert any("driving point 2:+Z says a negative mass" in words for words in test.notes)
    np.testing.assert_allclose(test.frf.value, -hammer_frf(beam_test).frf.value)


def test_roving_hammer_and_roving_accelerometer():
    """One hit in each file; both ways of roving give the same FRFs (Maxwell's reciprocity)."""
    hits = [beam((0.1,), (60.0,), at, ("2:+Z",), 2.5) for at in PLACE for _ in range(2)]
    sensors = [beam((0.1,), (60.0,), "2:+Z", (of,), 2.5) for of in PLACE for _ in range(2)]
    by_hammer, by_sensor = hammer_frf(hits).frf, hammer_frf(sensors).frf
    assert (by_hammer.references, by_sensor.responses) == (tuple(PLACE), tuple(PLACE))
    assert by_hammer.coherence.shape == by_hammer.value.shape == (1, 3, by_hammer.frequency.size)
    np.testing.assert_allclose(by_hammer.value[0], by_sensor.value[:, 0], rtol=0.2, atol=0.2)
    modes_are_right(by_hammer)
    modes_are_right(by_sensor)


def test_estimate_frf_takes_no_hann_window_on_hits(beam_test):
    """A Hann window on segments of 2 s makes the first peak 2 dB lower and its damping 3/2 of what it is."""
    assert is_impulsive(beam_test.excitation, FS)
    said = "is hits: a block of 2 s from each of 4, without a window; 1[67]% of the response is left"
    with pytest.warns(RecordNote, match=said):  # exp(-ζ ω 2 s) = 16 % at 18 Hz
        frf = cm.estimate_frf(beam_test)
    modes_are_right(frf)
    at = np.abs(frf.frequency - FREQUENCY[0]).argmin()
    assert abs(frf.value[1, 0, at]) == pytest.approx(abs(exact([18.0], "2:+Z", "2:+Z")[0]) * (1 - 0.164), rel=0.03)
    assert abs(cm.estimate_frf(beam_test, window="hann").value[1, 0, at]) < 0.9 * abs(frf.value[1, 0, at])
    with pytest.warns(RecordNote, match="Hann window damps .* no block of 4 s holds one hit alone"):
        wrong = cm.estimate_frf(beam_test, resolution=0.25)
    assert wrong == cm.estimate_frf(beam_test, resolution=0.25, window="hann")


def test_what_is_no_hits(rng):
    noise = rng.standard_normal(20000)
    for other in (noise, np.sin(np.arange(20000) / 20), noise * np.linspace(0, 1, 20000), np.zeros(100)):
        assert not is_impulsive(other, FS)
    with pytest.raises(cm.RecordError, match="the force has no pulse that stands alone"):
        hammer_frf(Response(FS, noise**3, noise[None], kind="force", responses=("1:+Z",), reference="2:+Z"))
    with pytest.raises(cm.RecordError, match="no hit stands out of the noise"):
        hammer_frf(Response(FS, np.zeros(2000), np.zeros((1, 2000)), kind="force"))


@pytest.mark.parametrize(("given", "message"), [
    ({"block": 0.0}, "block must be > 0, got 0.0"),
    ({"exponential": 1.5}, "exponential must be > 0 and at most 1, got 1.5"),
    ({"trigger": 0.0}, "trigger must be > 0"),
    ({"force_window": -1.0}, "0 s or more"),
    ({"block": 30.0}, "does not hold its block of 30 s"),
])  # fmt: skip
def test_impossible_settings(beam_test, given, message):
    assert_refused(cm.RecordError, message, hammer_frf, beam_test, **given)


def test_a_pair_that_comes_twice_is_refused(beam_test):
    frf = hammer_frf(beam_test).frf
    assert_refused(cm.RecordError, r"the FRF of 1:.Z to 2:.Z comes twice", join_references, [frf, frf])
