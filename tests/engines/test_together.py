"""Cases side by side in the lanes of a register are what each is alone."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, HuntCrossley, KelvinVoigt, MaxwellSlip
from clearance_mj.core.errors import SimulationError
from clearance_mj.engines import simulate, simulate_and_keep, simulate_together
from clearance_mj.linear import linear_model
from clearance_mj.rig import Grease
from clearance_mj.signals.excitation import random
from clearance_mj.structure.shaft import Material, Section, Shaft, Support

from ..conftest import TABLE1
from .alike import assert_alike, with_bushings

GREASE = Grease(4365.0, 4.0, 0.8, 1.0, 1.1e7, 1.0e7, 2.02, 7.5e-4)
LAWS = [
    ContactLaw(HuntCrossley(8e5, 0.9, 1.6), GREASE),
    ConstantLaw(2e4, 3.0),
    AmplitudeLaw([1e-4, 6e-4], [1e4, 3e4], [3.0, 9.0], grease=GREASE),
    ContactLaw(KelvinVoigt(2e4, 30.0, adhesion=True), MaxwellSlip((2e3, 1e3), (0.2, 0.4), 1e3, 4.0)),
]


def other_rig():
    """Another shaft, other gaps, off centre."""
    beam = dataclasses.replace(TABLE1.beam, young_modulus=2.0e11)
    return with_bushings(TABLE1.replace(beam=beam), gap=2e-4, offset=5e-5)


@pytest.mark.parametrize("count", [1, 3, 11])
def test_what_each_is_alone(count):
    cases = [(other_rig() if i % 3 == 1 else TABLE1, LAWS[i % 4]) for i in range(count)]
    drive = random(0.5, 2048.0, rms=8.0, seed=3)
    responses = simulate_together(cases, drive)
    assert len(responses) == count
    for (rig, law), response in zip(cases, responses):
        alone = simulate(rig, drive, law, "modal")
        assert np.any(alone.contact_force) and response.provenance == alone.provenance
        assert_alike(response, alone, 1e-9)


def test_what_is_kept_of_each():
    """In the order of the cases; without forces the rest is the same."""
    cases, drive = [(TABLE1, LAWS[i % 2]) for i in range(10)], random(0.5, 2048.0, rms=8.0, seed=3)
    whole = simulate_together(cases, drive)
    kept = simulate_and_keep(cases, drive, lambda r: (r.acceleration, r.displacement, r.grease_force), forces=False)
    for (acceleration, displacement, force), response in zip(kept, whole):
        np.testing.assert_array_equal(acceleration, response.acceleration)
        np.testing.assert_array_equal(displacement, response.displacement)
        assert force is None


def test_damping_that_couples_modes():
    """A damper at the tip of the shaft, beside rigs without."""
    supports = Support(0.0, "clamped"), Support(1.0, translation_damping=20.0)
    shaft = Shaft((Section(1.0, 0.0086),), supports, material=Material(2.1e11, 7850.0), rayleigh=(0.5, 1e-5))
    rig = TABLE1.replace(beam=None, structure=shaft)
    assert linear_model(rig).coupling.any()
    drive = random(0.3, 2048.0, rms=8.0, seed=3)
    for response in simulate_together([(TABLE1, LAWS[1]), (rig, LAWS[1]), (rig, LAWS[1])], drive)[1:]:
        assert_alike(response, simulate(rig, drive, LAWS[1], "modal"), 1e-9, ("acceleration",))


def test_a_divergence_names_its_rig():
    wild = TABLE1.replace(name="wild", beam=dataclasses.replace(TABLE1.beam, young_modulus=1e3))
    law = ContactLaw(HuntCrossley(8e5, 0.9))
    with pytest.raises(SimulationError, match="'wild'"):
        simulate_together([(TABLE1, law), (wild, law)], random(0.5, 2048.0, rms=1e5, seed=3))
