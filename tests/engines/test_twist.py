"""Teeth on a shaft that twists: its angle in a clearance is that of one inertia on a spring of twist."""

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.clearance import ConstantLaw
from clearance_mj.core.errors import RigError
from clearance_mj.engines import default_engine
from clearance_mj.rig import Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker
from clearance_mj.structure import Disc, Material, Matrices, Section, Shaft, Support

INERTIA, LENGTH, DIAMETER = 2e-3, 0.5, 0.02
STIFFNESS = 210e9 / 2.6 * np.pi * DIAMETER**4 / 32 / LENGTH  # N m/rad
CONTACT = Contact(4 * STIFFNESS, 0.2)


def rig(structure, at):
    teeth = Bushing(at, 1e-3, 0.0, Grease(20.0, 0.05), CONTACT)
    return Rig("teeth", None, (teeth,), (Sensor(1, at),), shaker=Shaker("force", at), structure=structure)


LIGHT = Shaft(
    (Section(LENGTH, DIAMETER),), (Support(0.0, "clamped"),), (Disc(LENGTH, 0.5, INERTIA / 2),), Material(210e9, 10.0),
    (20.0, 0.0), theory="euler",
)  # fmt: skip
SHAFT = rig(LIGHT, f"@{LENGTH}:RX")
ONE_INERTIA = Matrices("m-kg-s", None, ((INERTIA,),), ((STIFFNESS,),), None, ("1:RX",), rayleigh=(20.0, 0.0))
ONE = rig(ONE_INERTIA, "1:RX")


@pytest.mark.parametrize(("engine", "tolerance"), [("modal", 5e-3), ("links", 1e-2)])
def test_teeth_are_those_of_one_inertia(engine, tolerance):
    torque = cm.excitation.random(0.1, 81920, band=(20, 400), rms=3.0, seed=1, kind="force")
    law = ConstantLaw(CONTACT.stiffness, CONTACT.damping)
    twisted, one = cm.simulate(SHAFT, torque, law, engine=engine), cm.simulate(ONE, torque, law, engine="modal")
    assert SHAFT.probe_labels == ["1:+RX"] and np.abs(one.contact_force).max() > 1.0
    size = np.abs(one.displacement).max()
    assert size > 1e-3
    np.testing.assert_allclose(twisted.displacement, one.displacement, atol=tolerance * size)  # of steps that differ


def test_modes_are_the_default_engine():
    assert default_engine(SHAFT) == "modal"


def test_links_refuse_a_mass_along_one_direction():
    torque = cm.excitation.random(0.1, 2048, rms=1.0, seed=1, kind="force")
    heavy = SHAFT.replace(masses=(PointMass("@0.2:RY", 1e-3),))
    with pytest.raises(RigError, match=r'links has masses that move in every direction, and "@0\.2:RY" names RY'):
        cm.simulate(heavy, torque, engine="links")
