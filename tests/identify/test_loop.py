"""What a law makes of a measured motion, against the engine's forces."""

import numpy as np
import pytest

from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, HuntCrossley, TimeLaw
from clearance_mj.identify.forces.restoring import restoring_force
from clearance_mj.rig import Grease
from clearance_mj.signals.excitation import random

from .records import FS, record_of

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
    left = (measured.force_of(LAWS[name]) - truth)[:, measured.valid]
    assert np.all(response.contact_force.max(axis=1) > 0.5)  # N: both bushings are reached
    # The motion is known up to 0.4 fs only, which rounds off the beginnings of contact.
    assert np.all(left.std(axis=1) < 0.01 * truth.std(axis=1))
