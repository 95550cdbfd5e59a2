"""What a law makes of a motion. Against the engine's forces, closed forms and quadrature."""

import numpy as np
import pytest
import scipy.integrate

from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, HuntCrossley, KelvinVoigt, TimeLaw
from clearance_mj.identify.forces import restoring_force
from clearance_mj.identify.loop import equivalent_contact, law_force
from clearance_mj.rig import Grease
from clearance_mj.signals.excitation import random

from .records import FS, record_of

GAP = 3e-4
BOUC_WEN = Grease(4300.0, 4.0, elastic_ratio=0.75, beta=1.5e7, gamma=5e6, film_height=8e-4)
LAWS = {
    "constant": ConstantLaw([6e3, 8e3], [12.0, 3.0]),
    "time": TimeLaw([0.0, 4.0], [[4e3, 5e3], [9e3, 8e3]], [[3.0, 4.0], [6.0, 2.0]]),
    "amplitude": AmplitudeLaw([3e-4, 1.2e-3], [3000.0, 9000.0], [5.0, 15.0], grease=BOUC_WEN),
    "contact": ContactLaw(HuntCrossley(2.5e5, 0.6), BOUC_WEN),
}


@pytest.mark.parametrize("name", LAWS)
def test_force_along_a_simulated_motion_is_the_engine_s(rig, name):
    record, response = record_of(rig, random(4.0, FS, rms=8.0, seed=4), LAWS[name], noise=0.0)
    measured = restoring_force(record)
    truth = response.contact_force + response.grease_force
    left = (law_force(measured, LAWS[name]) - truth)[:, measured.valid]
    assert np.all(response.contact_force.max(axis=1) > 0.5)  # N: both bushings are reached
    # The motion is known up to 0.4 fs only, which rounds off the beginnings of contact.
    assert np.all(left.std(axis=1) < 0.01 * truth.std(axis=1))


def test_a_contact_that_may_pull_is_its_own_equivalent():
    k, c = equivalent_contact(ContactLaw(KelvinVoigt(7800.0, 4.0, adhesion=True)), [GAP], [0.9 * GAP, 2 * GAP], [60.0])
    np.testing.assert_allclose(k.ravel(), [np.nan, 7800.0], rtol=1e-9)
    np.testing.assert_allclose(c.ravel(), [np.nan, 4.0], rtol=1e-9)


def test_elastic_hertz_contact_by_quadrature(measured):
    """Without damping k = ∫K δ^2.5 dφ / ∫δ² dφ over the part of the cycle in contact."""
    stiffness, amplitudes = 2.5e5, np.array([1.2, 2.0, 4.0]) * GAP
    k, c = equivalent_contact(ContactLaw(HuntCrossley(stiffness, 1.0)), [GAP], amplitudes, [60.0])

    def mean(power, a):
        return scipy.integrate.quad(lambda p: (a * np.cos(p) - GAP) ** power, 0, np.arccos(GAP / a))[0]

    expected = [stiffness * mean(2.5, a) / mean(2, a) for a in amplitudes]
    for amplitude, found, known in zip(amplitudes, k.ravel(), expected):
        what = f"equivalent stiffness of Hertz contact, amplitude {amplitude / GAP:g} gaps (N/m)"
        measured.equal(what, found, known, "∫K δ^2.5 dφ / ∫δ² dφ by quadrature", rel=1e-4)
    np.testing.assert_allclose(c.ravel(), 0, atol=1e-9)
