"""Channels that are late in simulations: against the same simulation without delays, shifted by its spectrum."""

import dataclasses

import numpy as np

import clearance_mj as cm
from clearance_mj.engines.late import DelayedChannels
from clearance_mj.engines.together import simulate_and_keep
from clearance_mj.signals import excitation

from ..conftest import TABLE1

PUSH = excitation.random(1.0, 2048.0, (5.0, 200.0), rms=2.0, seed=1)


def late_rig(rig):
    """One accelerometer by 1.7 ms, a probe by 0.3 samples too early, the excitation by 0.4 ms."""
    sensors = (dataclasses.replace(rig.sensors[0], delay=1.7e-3), *rig.sensors[1:])
    bushings = (dataclasses.replace(rig.bushings[0], probe_delay=-0.3 / 2048.0), *rig.bushings[1:])
    return rig.replace(sensors=sensors, bushings=bushings, shaker=dataclasses.replace(rig.shaker, delay=4e-4))


def shifted(signal, seconds):
    size = 2 * signal.size
    spectrum = np.fft.rfft(signal, size) * np.exp(-2j * np.pi * np.fft.rfftfreq(size, 1 / 2048.0) * seconds)
    return np.fft.irfft(spectrum, size)[: signal.size]


def test_a_delay_shifts_its_channel_alone():
    plain, late = (cm.simulate(rig, PUSH, engine="modal") for rig in (TABLE1, late_rig(TABLE1)))
    middle = slice(200, -200)  # of a shift by the spectrum, ends are not those of a record
    for channel, delay in ((0, 1.7e-3 - 4e-4), (1, -4e-4)):
        expected = shifted(plain.acceleration[channel], delay)[middle]
        assert np.std(late.acceleration[channel][middle] - expected) < 3e-3 * np.std(expected)
    expected = shifted(plain.displacement[0], -0.3 / 2048.0 - 4e-4)[middle]
    assert np.std(late.displacement[0][middle] - expected) < 1e-4 * np.std(expected)


def test_blocks_and_laws_side_by_side_are_late_in_the_same_way():
    rig = late_rig(TABLE1)
    whole = cm.simulate(rig, PUSH, engine="modal")
    blocks = np.concatenate([b.acceleration for b in cm.simulate_blocks(rig, PUSH, engine="modal")], axis=1)
    np.testing.assert_array_equal(blocks, whole.acceleration)
    law = cm.ContactLaw([cm.clearance.KelvinVoigt(b.contact.stiffness, b.contact.damping) for b in rig.bushings])
    (kept,) = simulate_and_keep([(rig, law)], PUSH, lambda response: response.acceleration.copy())
    np.testing.assert_array_equal(kept, cm.simulate(rig, PUSH, law, engine="modal").acceleration)


def test_a_cubic_is_delayed_exactly_however_it_is_cut():
    time = np.arange(60.0)
    stream = np.column_stack((time**3, time**3, time))
    late = DelayedChannels(np.array([2.3, -1.6, 0.0]), 4)
    out = np.concatenate([late.push(part) for part in np.split(stream, [7, 8, 30])])
    assert late.ahead == 4
    assert len(out) == 60 - 4
    np.testing.assert_allclose(out[10:, 0], (time[10:56] - 2.3) ** 3, rtol=1e-12)
    np.testing.assert_allclose(out[10:, 1], (time[10:56] + 1.6) ** 3, rtol=1e-12)
    np.testing.assert_array_equal(out[:, 2], time[:56])
