"""Numbers that a fit varies, of actuators, bodies and drives: where they stand in a model and its specification."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.core.errors import ModelError
from clearance_mj.physical import drives
from clearance_mj.physical.identification import quantities
from clearance_mj.physical.rows import softness_of

SERVO = """<mujoco><option timestep="1e-4"/><worldbody>
  <body name="arm"><joint name="j" armature=".01"/><geom size=".05" pos=".1 0 0"/>
  <body name="hand"><joint name="h"/><inertial pos="0 0 .1" mass="2" diaginertia=".03 .02 .02"/></body></body>
  </worldbody><actuator><position name="servo" joint="j" kp="10" kv="1"/><velocity name="speed" joint="h" kv="3"/>
  <motor name="motor" joint="h"/></actuator><sensor><jointpos name="q" joint="j"/></sensor></mujoco>"""


@pytest.mark.parametrize(("name", "start", "read"), [
    ("servo.kp", 10.0, lambda m: [m.actuator_gainprm[0, 0], -m.actuator_biasprm[0, 1]]),
    ("servo.kv", 1.0, lambda m: [-m.actuator_biasprm[0, 2]]),
    ("speed.kv", 3.0, lambda m: [m.actuator_gainprm[1, 0], -m.actuator_biasprm[1, 2]]),
    ("motor.gain", 1.0, lambda m: [m.actuator_gainprm[2, 0]]),
    ("hand.mass", 2.0, lambda m: [m.body_mass[2], 2 * m.body_inertia[2, 0] / 0.03]),
    ("hand.inertia", 0.03, lambda m: [m.body_inertia[2, 0], 1.5 * m.body_inertia[2, 1]]),
    ("arm.mass", 4 / 3 * np.pi * 0.05**3 * 1000, lambda m: [m.body_mass[1]]),
    ("servo.gap", 0.01, lambda m: [m.numeric("physical:drive:servo").data[1]]),
    ("servo.inertia", 0.01, lambda m: [m.numeric("physical:drive:servo").data[0]]),
    ("servo.stribeck", 0.2, lambda m: [float(next(drives.drives(m)).numbers(m)["friction_stribeck"])]),
    ("servo.friction_k", 100.0, lambda m: [float(next(drives.drives(m)).numbers(m)["friction_k"])]),
    ("servo.stribeck_exponent", 1.5, lambda m: [m.numeric("physical:drive:servo").data[17]]),
    ("servo.loss_forward", 0.25, lambda m: [m.numeric("physical:drive:servo").data[20]]),
    ("servo.loss_backward", 0.1, lambda m: [m.numeric("physical:drive:servo").data[21]]),
    ("h.friction", 0.5, lambda m: [m.numeric("physical:friction:joint:h").data[0]]),
    ("h.friction_k", 50.0, lambda m: [m.numeric("physical:friction:joint:h").data[1]]),
    ("h.friction_c", 2.0, lambda m: [m.numeric("physical:friction:joint:h").data[2]]),
    ("servo.coulomb", 0.1, lambda m: [float(next(drives.drives(m)).numbers(m)["friction_coulomb"])]),
])  # fmt: skip
def test_numbers_of_actuators_bodies_and_drives(name, start, read):
    """A model and a specification get the same numbers, those that were to be changed."""
    spec = mujoco.MjSpec.from_string(SERVO)
    stribeck = {"stribeck": 0.2, "stribeck_speed": 0.1, "stribeck_exponent": 1.5}
    friction = physical.DriveFriction(100.0, coulomb=0.1, efficiency=(0.8, 0.9), **stribeck)
    physical.add_drive(spec, "servo", gap=0.01, k=100, c=0.1, friction=friction)
    physical.joint_friction(spec, "h", 0.5, 50.0, 2.0)
    (parameter,) = quantities.open_parameters(spec, [name])
    assert parameter.start == pytest.approx(start)
    with pytest.warns(physical.ModelWarning, match="Softener"):
        model = physical.compile(spec)
        written = physical.compile(quantities.written_into(spec, {name: 1.7 * start}))
    changed = quantities.put(model, {name: 1.7 * start})
    assert read(model) == pytest.approx([start] * len(read(model)))
    assert read(changed) == pytest.approx([1.7 * start] * len(read(changed)))
    actuators, bodies = ("actuator_gainprm", "actuator_biasprm"), ("body_mass", "body_inertia")
    for field in (*actuators, *bodies, "numeric_data", "dof_invweight0"):
        np.testing.assert_allclose(getattr(changed, field), getattr(written, field), rtol=1e-9, atol=1e-15)


def test_losses_begin_where_the_specification_has_them_and_may_vanish():
    """A gear without losses is a start, and the bound of a loss; a Stribeck exponent has narrow ones."""
    spec = mujoco.MjSpec.from_string(SERVO)
    physical.add_drive(spec, "servo", gap=0.01, k=100, c=0.1, friction=physical.DriveFriction(100.0))
    loss, exponent = quantities.open_parameters(spec, ["servo.loss_forward", "servo.stribeck_exponent"])
    assert (loss.start, loss.low, loss.high, loss.transform) == (0.0, 0.0, np.inf, "linear")
    assert (exponent.start, exponent.high, exponent.transform) == (2.0, 6.0, "log")


@pytest.mark.parametrize(("name", "says"), [
    ("motor.kp", 'actuator "motor" is no servo with kp'),
    ("motr.gain", 'no actuator "motr"; did you mean "motor"'),
    ("hnad.mass", 'no body "hnad"; did you mean "hand"'),
    ("w.bias", 'no sensor "w"'),
    ("servo.gap", 'no clearance "servo"'),
])  # fmt: skip
def test_numbers_of_actuators_and_bodies_that_cannot_be(name, says):
    with pytest.raises(ModelError, match=says):
        quantities.open_parameters(mujoco.MjSpec.from_string(SERVO), [name])


def test_a_stiffness_beside_a_damping_ratio_keeps_the_damping():
    """Whatever k is written, c stays what it was, in a model as in a specification."""
    spec = mujoco.MjSpec.from_string(SERVO)
    physical.add_backlash(spec, "j", 0.01, k=500.0, damping_ratio=0.1)
    model = physical.compile(spec)
    before, values = softness_of(model, "tendon", 0), {"j backlash.k": 700.0}
    for changed in (quantities.put(model, values), physical.compile(quantities.written_into(spec, values))):
        assert softness_of(changed, "tendon", 0) == pytest.approx((700.0, before[1]), rel=1e-6)
    assert before[1] > 0
