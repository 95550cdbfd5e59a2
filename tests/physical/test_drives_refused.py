"""Drives that cannot be: numbers out of range, actuators of other kinds, integrators; one line each."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.core.errors import LawError, ModelError
from clearance_mj.physical import drive_state

from .test_drives import GAP, C, K, driven, link


@pytest.mark.parametrize("options, says", [
    (dict(gap=-1.0), "gap -1.0 must be finite and >= 0"), (dict(inertia=0.0), "inertia 0.0 must be finite and > 0"),
    (dict(hysteresis=[(100.0, -1.0)]), r"hysteresis\[0\] -1.0 must be finite and > 0"),
    (dict(encoder="gear"), 'encoder "gear"; known: motor, load'),
])  # fmt: skip
def test_numbers_out_of_range(options, says):
    with pytest.raises(ModelError, match=f'actuator "motor": {says}'):
        driven(**options)


@pytest.mark.parametrize("actuator, says", [
    ('<general name="motor" joint="elbow" dyntype="muscle" lengthrange="0 1"/>',
     "is muscle; a drive needs none or integrator or filter or filterexact"),
    ('<position name="motor" joint="elbow" kp="6" delay="0.01" nsample="2"/>', "has delay"),
    ('<motor name="other" joint="elbow"/>', 'no actuator "motor"; did you mean "other"|no actuator "motor"'),
    ('<motor name="motor" joint="elbow" gear="0"/>', "has gear 0"),
])  # fmt: skip
def test_actuators_that_cannot_have_a_drive(actuator, says):
    with pytest.raises(ModelError, match=says):
        driven(actuator)


def test_more_that_is_refused():
    spec = link()
    with pytest.raises(LawError, match="k = 0"):
        physical.add_drive(spec, "motor", GAP, 0.0, 1.0)
    spec.joint("elbow").armature = 0
    with pytest.raises(ModelError, match="its joint has no armature; give inertia"):
        physical.add_drive(spec, "motor", GAP, K, C)
    physical.add_drive(spec, "motor", GAP, K, C, 0.01)
    with pytest.raises(ModelError, match="has a drive already"):
        physical.add_drive(spec, "motor", GAP, K, C, 0.01)
    model = physical.compile(spec)
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_RK4)
    with pytest.raises(ModelError, match="integrator RK4 asks for forces between the steps"):
        physical.Softener(model)
    with pytest.raises(ModelError, match='actuator "other" has no drive'):
        drive_state(model, np.zeros(model.na), "other")
    with pytest.raises(ModelError, match="needs 7 numbers"):
        drive_state(model, np.zeros(3), "motor")
