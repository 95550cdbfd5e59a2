"""Rigs of other kinds, and what their accelerometers read, against the linear state space integrated by scipy.

The state space itself is checked against finite elements in verification/test_beam_fe.py.
"""

import dataclasses
import functools

import numpy as np
import pytest
import scipy.signal

from clearance_mj.beam import state_space
from clearance_mj.clearance import ConstantLaw
from clearance_mj.engines import Links, Modal, get_engine, simulate
from clearance_mj.rig import Beam, Bushing, Contact, Grease, Rig, Sensor, Shaker
from clearance_mj.signals.excitation import Excitation, random
from clearance_mj.structure import Clamp

from ..conftest import TABLE1
from ..verification.test_beam_fe import three_bushings

LAW = ConstantLaw(2e4, 3.0)
FS = 2048.0
ENGINES = ["links", "modal"]

UNDAMPED_SHAFT = dataclasses.replace(TABLE1.beam, rayleigh=(0.0, 0.0))
RIGS = {
    "three bushings": three_bushings(),
    "pushed": TABLE1.replace(shaker=Shaker("force", 0.7)),
    "pushed at a bushing": TABLE1.replace(shaker=Shaker("force", TABLE1.bushings[0].position)),
    "no bushing": TABLE1.replace(bushings=()),
    "no mass": TABLE1.replace(masses=()),
    "no damping of the shaft": TABLE1.replace(beam=UNDAMPED_SHAFT),
    "one bushing": TABLE1.replace(bushings=TABLE1.bushings[1:]),
}
_random = np.random.default_rng(5)
FREQUENCY, PHASE = _random.uniform(5, 120, 30), _random.uniform(0, 2 * np.pi, 30)


def drive(t):
    """Thirty tones of 0.2 rms, faded in over 50 ms."""
    tones = np.cos(2 * np.pi * np.outer(t, FREQUENCY) + PHASE).sum(axis=1)
    return 0.2 * np.sqrt(2 / 30) * tones * np.sin(np.pi / 2 * np.minimum(t / 0.05, 1)) ** 2


def error(computed, expected):
    """RMS of the difference over RMS, all channels together; without the end, where a cut excitation rings."""
    return np.sqrt(np.mean((computed - expected)[..., :-40] ** 2) / np.mean(expected[..., :-40] ** 2))


TOLERANCE = {"links": 3e-2, "modal": 1e-3}
"""RMS over 0.3 s; of links, 0.1 % of the third frequency adds up to that in phase"""


@functools.cache
def expected(rig):
    """Excitation, accelerations and displacements; integrated at sixteen times the rate of the record."""
    fine = 16
    t = np.arange(round(0.3 * FS) * fine) / (FS * fine)
    system = state_space(rig, 24)
    _, output, _ = scipy.signal.lsim((system.A, system.B, system.C, system.D), drive(t), t)
    return Excitation(drive(t[::fine]), FS, rig.shaker.kind), *np.split(output[::fine].T, [len(rig.sensors)])


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())
def test_motion_in_the_gap(rig, engine):
    excitation, acceleration, displacement = expected(rig)
    response = simulate(rig, excitation, LAW, engine)
    assert error(response.acceleration, acceleration) < TOLERANCE[engine]
    assert response.displacement.shape == displacement.shape
    assert not np.any(response.contact_force)
    assert not rig.bushings or error(response.displacement, displacement) < TOLERANCE[engine]


@pytest.mark.parametrize("engine", [Links(6), Modal(1)], ids=ENGINES)
def test_accelerometers_read_the_absolute_acceleration(engine):
    """A stout shaft (1.6 kHz) follows its base: 30 Hz comes through but for (30/1600)² = 4e-4."""
    shaft = Beam(0.1, 210e9, 7850.0, diameter=0.02, rayleigh=(1.0, 1e-6))
    bushing = Bushing(0.05, 1e-3, 0.01, Grease(1e3, 1.0), Contact(1e4, 1.0))
    rig = Rig("stout", shaft, (bushing,), (Sensor(1, 0.03), Sensor(2, 0.1)))
    t = np.arange(400) / FS
    base = 10 * np.sin(2 * np.pi * 30 * t) * np.minimum(t / 0.05, 1) ** 2
    response = simulate(rig, Excitation(base, FS), LAW, engine)
    assert np.max(np.abs(response.acceleration - base)[:, :-40]) < 1e-3 * 10
    assert np.max(np.abs(response.displacement)) < 1e-7  # the base's own is 0.3 mm


def test_acceleration_is_that_of_the_displacement(engine):
    """Step by step: second difference of the displacement, plus the base, at sensors on the bushings."""
    rig = TABLE1.replace(sensors=tuple(Sensor(6 + j, b.position) for j, b in enumerate(TABLE1.bushings)))
    engine = get_engine(engine)
    step = engine.largest_step(rig, LAW)
    base = drive(np.arange(round(0.3 / step)) * step)
    acceleration, displacement, *_ = np.hsplit(engine.start(rig, LAW, "base", step).advance(base), 5)
    relative = acceleration[1:-1] - base[1:-1, None]
    second = np.diff(displacement, 2, axis=0) / step**2
    assert np.max(np.abs(relative - second)) < 1e-3 * np.max(np.abs(second))


def test_bushings_in_any_order(engine):
    """A rig file may list them as it likes; each has its own gap, grease, k and c."""
    inner, outer = TABLE1.bushings
    outer = dataclasses.replace(outer, gap=1e-4, grease=Grease(2e3, 1.0))
    excitation = Excitation(60 * drive(np.arange(400) / FS), FS)
    there = simulate(TABLE1.replace(bushings=(inner, outer)), excitation, ConstantLaw([3e4, 8e3], [3.0, 1.0]), engine)
    back = simulate(TABLE1.replace(bushings=(outer, inner)), excitation, ConstantLaw([8e3, 3e4], [1.0, 3.0]), engine)
    assert np.all(np.any(there.contact_force, axis=1))
    # 0.2 s of contact: rounding grows, but stays small.
    np.testing.assert_allclose(back.displacement[::-1], there.displacement, atol=1e-4 * np.ptp(there.displacement))


def test_sensor_near_the_clamp(engine):
    """Before the first hinge of the chain: it reads the base."""
    rig = TABLE1.replace(sensors=(Sensor(1, 0.005), Sensor(2, 1.0)))
    excitation = Excitation(drive(np.arange(400) / FS), FS)
    assert error(simulate(rig, excitation, LAW, engine).acceleration[0], excitation.value) < 1e-2


@pytest.mark.parametrize("engine", ["links", "modal"])
def test_gain_of_a_sensor_scales_what_it_reads(engine):
    sensors = TABLE1.sensors
    rig = TABLE1.replace(sensors=(dataclasses.replace(sensors[0], gain=1.03), *sensors[1:]))
    excitation = random(0.3, 2048, rms=2.0)
    plain, scaled = (simulate(r, excitation, LAW, engine).acceleration for r in (TABLE1, rig))
    np.testing.assert_allclose(scaled[0], 1.03 * plain[0], rtol=1e-12)
    np.testing.assert_array_equal(scaled[1:], plain[1:])


def test_engines_agree_on_a_clamp_that_gives():
    beam = dataclasses.replace(TABLE1.beam, clamp=Clamp(rotation=800.0, translation=2e6), damping_ratios=(0.01,))
    rig = TABLE1.replace(beam=beam)
    excitation = random(2.0, 2048, rms=0.5, seed=3)
    computed, expected = (simulate(rig, excitation, LAW, e).displacement for e in ("links", "modal"))
    assert np.abs(computed - expected).max() < 0.03 * np.abs(expected).max()
