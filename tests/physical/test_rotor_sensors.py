"""Sensors of rotors' angles."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.core.errors import ModelError

from .stepping import step_by_hand

pytestmark = pytest.mark.filterwarnings("ignore::clearance_mj.physical.ModelWarning")


def test_a_sensor_shows_the_rotors_angle():
    """As `drive_state` does of the activations that a step begins with, in a context and in a loop of one's own."""
    spec = mujoco.MjSpec.from_string("""
    <mujoco><option timestep="1e-3"/><worldbody><body><joint name="j" axis="0 1 0" armature="0.02" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".02" mass=".5"/></body></worldbody>
      <actuator><position name="servo" joint="j" kp="50" kv="1" gear="3"/></actuator>
      <sensor><jointpos joint="j"/><user dim="1" needstage="pos"/></sensor></mujoco>""")
    with pytest.raises(ModelError, match="servo"):
        physical.add_rotor_sensor(spec, "servo")
    physical.add_drive(spec, "servo", gap=0.01, k=300, c=0.5)
    assert physical.add_rotor_sensor(spec, "servo").name == "servo rotor"
    assert physical.add_rotor_sensor(spec, "servo", "encoder").name == "encoder"
    model = physical.compile(spec)
    data, softener = mujoco.MjData(model), physical.Softener(model)
    data.qpos[0], data.ctrl[0] = 0.3, 1.0
    with softener:
        mujoco.mj_forward(model, data)
        assert data.sensor("encoder").data[0] == pytest.approx(0.3, abs=1e-15), "it begins at the load"
        shown, expected = [], []
        for _ in range(200):
            expected.append(physical.drive_state(model, data.act, "servo").angle)
            mujoco.mj_step(model, data)
            shown.append(data.sensor("encoder").data[0])
    assert shown[1:] == expected[1:]
    assert np.ptp(shown) > 0.03
    assert data.sensor("servo rotor").data[0] == shown[-1]
    held_data = mujoco.MjData(model)
    held_data.qpos[0], held_data.ctrl[0] = 0.3, 1.0
    for _ in range(200):
        step_by_hand(model, held_data, softener)
    assert held_data.sensor("encoder").data[0] == shown[-1]
    assert mujoco.get_mjcb_sensor() is None
    mujoco.set_mjcb_sensor(lambda model, data, stage: None)
    try:
        with pytest.raises(ModelError, match="callback for users' sensors already"), softener:
            pass
    finally:
        mujoco.set_mjcb_sensor(None)
    assert mujoco.get_mjcb_control() is None
