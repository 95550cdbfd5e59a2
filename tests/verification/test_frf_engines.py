"""FRFs of the engines. Against the linear model in the gap, against each other in contact.

In the gap a periodic random signal is used, and one period after 8 s: no leakage, no start transient, so that what is
left is the engine's own error. `beam.linear_frf` itself is checked against finite elements in test_beam_fe.py.
"""

import functools

import numpy as np
import pytest

from clearance_mj import ConstantLaw, Excitation, Response, Shaker, estimate_frf, simulate
from clearance_mj.beam import linear_frf

from ..conftest import TABLE1 as RIG

PUSHED, LAW = RIG.replace(shaker=Shaker("force", 0.3)), ConstantLaw(2e4, 3.0)
FS, BAND = 2048.0, (5.0, 220.0)


def noise(duration, rms, seed):
    """Random phases at every line of the band."""
    n = round(duration * FS)
    frequency = np.fft.rfftfreq(n, 1 / FS)
    inside = (frequency >= BAND[0]) & (frequency <= BAND[1])
    value = np.fft.irfft(inside * np.exp(2j * np.pi * np.random.default_rng(seed).random(frequency.size)), n)
    return value * rms / np.std(value)


def rms_db(model_frf, expected):
    return np.sqrt(np.mean((20 * np.log10(np.abs(model_frf / expected))) ** 2))


def in_gap_frf(rig, kind, rms, engine):
    """H1 of the fifth period of 2 s; the signal goes on for a moment, as its interpolation rings where it is cut."""
    response = simulate(rig, Excitation(np.resize(noise(2, rms, 3), round(10.1 * FS)), FS, kind, BAND), LAW, engine)
    assert np.max(np.abs(response.displacement)) < 3e-4 and not np.any(response.contact_force)
    fifth = slice(round(8 * FS), round(10 * FS))
    response = Response(FS, response.excitation[fifth], response.acceleration[:, fifth], kind=kind, band=BAND)
    return estimate_frf(response, "H1", resolution=0.5, overlap=0, window="boxcar")


TOLERANCE = {"links": 0.3, "modal": 0.05, "modal-mj": 0.1}  # dB RMS over all sensors, 5-220 Hz


@pytest.mark.parametrize(("rig", "rms"), [(RIG, 0.3), (PUSHED, 0.1)], ids=["base", "force"])
def test_in_the_gap(rig, rms, engine, measured):
    """0.3 m/s² rms of the base; 0.1 N rms at 0.3 m: the same, phase included."""
    kind, limit = rig.shaker.kind, TOLERANCE[engine]
    in_gap = in_gap_frf(rig, kind, rms, engine)
    expected, what = linear_frf(rig, in_gap.frequency), f"{engine}: FRF in the gap, {kind}"
    measured.below(f"{what}: RMS of magnitude", rms_db(in_gap.functions, expected), limit, "linear FRF", "dB")
    if kind == "force":
        assert in_gap.quantity == "acceleration/force"
        phase = np.sqrt(np.mean(np.angle(in_gap.functions / expected) ** 2))
        measured.below(f"{what}: RMS of phase", phase, limit / 8.686, "linear FRF", "rad")


@functools.cache
def in_contact_frf(engine, seed):
    response = simulate(RIG, Excitation(noise(16, 5.0, seed), FS, "base", BAND), LAW, engine)
    assert np.all(np.max(np.abs(response.displacement), axis=1) > 3e-4)
    assert np.all(np.any(response.contact_force != 0, axis=1))
    return estimate_frf(response, "H1", resolution=1.0).functions


@pytest.mark.parametrize("engine", ["links", "modal-mj"])
def test_in_contact(engine, measured):
    """5 m/s² rms: engines differ no more than 1.5 times as much as two seeds of one engine do."""
    floor = rms_db(in_contact_frf("modal", 5), in_contact_frf("modal", 4))
    rms_error = rms_db(in_contact_frf(engine, 4), in_contact_frf("modal", 4))
    what, source = f"{engine} and modal: FRFs in contact, difference over that of two seeds", "two seeds of modal"
    measured.below(what, rms_error / floor, 1.5, source)


def test_contact_changes_the_frf():
    """The comparison above is not one of linear systems."""
    assert rms_db(in_contact_frf("modal", 4), linear_frf(RIG, np.arange(5.0, 221.0))) > 3
