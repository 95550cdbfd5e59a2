"""The virtual rig and the engines, which share no physics code. Given the rig's truth, an engine must reproduce it.

The rig: 64 Hermite elements, Newmark, Hunt-Crossley with constant dissipation. The engine: Ritz modes, exact flow of
the modes between kicks, Hunt-Crossley with the impact speed. The contacts dissipate differently, so levels in contact
agree less than those without.
"""

import dataclasses
import functools

import numpy as np
import pytest

from clearance_mj import Grease, Links, Modal, estimate_frf, simulate
from clearance_mj.clearance import ContactLaw, HuntCrossley
from clearance_mj.signals.excitation import random
from experiments.testrig import Truth, simulate_rig

TRUTH = Truth(drift=0.0)
SLOPES = {"beta": TRUTH.hysteresis.beta, "gamma": TRUTH.hysteresis.gamma}
FILM = {"damping": TRUTH.film_damping, "film_height": TRUTH.film_height, "film_limit": TRUTH.film_limit}
GREASE = Grease(TRUTH.grease_stiffness, elastic_ratio=TRUTH.elastic_ratio, **SLOPES, **FILM)
LAW = ContactLaw(HuntCrossley(TRUTH.contact_stiffness, restitution=0.85, first_order=True), grease=GREASE)


def difference_db(a, b):
    return np.sqrt(np.mean((20 * np.log10(np.abs(a.value) / np.abs(b.value))) ** 2))


OFF_CENTRE = 0.3, -0.2  # offset of the shaft in the two bushings, of the gap


@functools.cache
def shaken(rig, level):
    excitation = random(12.0, 2048.0, band=(5, 220), rms=level, seed=9)
    return excitation, simulate_rig(rig, TRUTH, excitation, seed=1)


@pytest.mark.parametrize(("level", "engine", "bound"), [(0.3, Modal(), 0.15), (2.0, Modal(), 0.2), (2.0, Links(), 0.4)])
def test_engine_with_the_truth_reproduces_the_rig(rig, level, engine, bound, measured):
    compare(rig, level, engine, bound, f"{engine.name} and the virtual rig, {level} m/s²", measured)


def test_off_centre(rig, measured):
    bushings = tuple(dataclasses.replace(b, offset=o * b.gap) for b, o in zip(rig.bushings, OFF_CENTRE))
    what = "modal and the virtual rig, off centre, 2 m/s²"
    compare(rig.replace(bushings=bushings), 2.0, Modal(), 0.2, what, measured)


def compare(rig, level, engine, bound, what, measured):
    excitation, bench = shaken(rig, level)
    model = simulate(rig, excitation, LAW, engine)
    source = "virtual rig, whose parameters the engine is given"
    difference = difference_db(estimate_frf(bench), estimate_frf(model))
    measured.below(f"{what}: RMS difference of FRFs", difference, bound, source, "dB")
    first = slice(0, 1024)
    error = np.sqrt(np.mean((model.displacement - bench.displacement)[:, first] ** 2, axis=1))
    error = np.max(error / np.sqrt(np.mean(bench.displacement[:, first] ** 2, axis=1)))
    measured.below(f"{what}: displacement over the first 0.5 s, RMS error", error, 0.02, source)
