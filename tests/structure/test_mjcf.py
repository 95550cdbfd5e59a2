"""MuJoCo models linearised: closed forms, marched small motions, closed loops, and models that have no equilibrium."""

import dataclasses
import pickle

import mujoco
import numpy as np
import pytest
import scipy.integrate
import scipy.optimize

import clearance_mj as cm
from clearance_mj import Bushing, Contact, Grease, Rig, RigError, Sensor, Shaker
from clearance_mj.structure import Matrices, Mjcf

from ..refusals import assert_refused

POINT = '<inertial mass="1" pos="{0}" diaginertia="1e-9 1e-9 1e-9"/>'
DOUBLE_PENDULUM = f"""<mujoco><option gravity="0 0 -9.81" integrator="RK4" timestep="5e-4"/><worldbody>
<body name="upper"><joint name="shoulder" axis="0 1 0" damping="0.02"/>{POINT.format("0 0 -1")}
<site name="elbow" pos="0 0 -1"/>
<body name="lower" pos="0 0 -1"><joint name="bend" axis="0 1 0" {{spring}}/>{POINT.format("0 0 -1")}
<site name="tip" pos="0 0 -1"/></body></body></worldbody>
<keyframe><key name="aside" qpos="0.8 -2"/><key name="upright" qpos="3.141592653589793 0"/></keyframe></mujoco>"""
CHAIN = """<mujoco><option gravity="0 0 0"/><worldbody>
<body name="m1"><joint name="j1" axis="0 0 1" type="slide" stiffness="300" damping="0.5"/><inertial mass="2" pos="0 0 0"
 diaginertia="1 1 1"/></body>
<body name="m2"><joint name="j2" axis="0 0 1" type="slide"/><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/></body>
</worldbody><tendon><fixed stiffness="100"><joint joint="j1" coef="1"/><joint joint="j2" coef="-1"/></fixed></tendon>
</mujoco>"""
PARALLELOGRAM = """<mujoco><worldbody>
<body name="left"><joint name="a" axis="0 1 0"/><inertial mass="1e-6" pos="0 0 -1" diaginertia="1e-9 1e-9 1e-9"/>
 <body name="bar" pos="0 0 -1"><joint name="b" axis="0 1 0"/><inertial mass="3" pos="0.2 0 0"
  diaginertia="0.01 0.3 0.3"/><site name="end" pos="0.5 0 0"/></body></body>
<body name="right" pos="0.5 0 0"><joint name="c" axis="0 1 0"/><inertial mass="1e-6" pos="0 0 -1"
 diaginertia="1e-9 1e-9 1e-9"/><site name="foot" pos="0 0 -1"/></body></worldbody>
<equality><connect site1="end" site2="foot"/></equality></mujoco>"""


def structure_of(folder, text, **fields):
    (folder / "model.xml").write_text(text, encoding="utf-8")
    return Mjcf(file=folder / "model.xml", **fields)


def rig_of(structure, sensor="tip:+X", **more):
    return Rig("mjcf", None, (), (Sensor(1, sensor),), structure=structure, **more)


@pytest.mark.parametrize("keyframe", [None, "aside"])
def test_double_pendulum(tmp_path, keyframe):
    """ω² = (2 ∓ √2) g/l of equal point masses (Landau & Lifshitz, Mechanics, § 23), hanging or let go from aside."""
    structure = structure_of(tmp_path, DOUBLE_PENDULUM.format(spring=""), keyframe=keyframe)
    model = cm.linear_model(rig_of(structure))
    np.testing.assert_allclose(model.omega**2, 9.81 * (2 + np.array([-1, 1]) * np.sqrt(2)), rtol=2e-8)
    assert structure.total_mass == 2.0
    np.testing.assert_allclose(structure.coordinates("tip:+X"), [0.0, 0.0, -2.0], atol=1e-8)
    # About Y: M R of X is -(2 + 1) and -1 for angles from above to below.
    np.testing.assert_allclose(np.abs(structure.assemble((), 8).influence), [[3, 0, 0], [1, 0, 0]], atol=1e-8)


def test_masses_on_springs_are_the_same_as_their_matrices(tmp_path):
    matrices = np.diag([2.0, 1.0]), [[400.0, -100.0], [-100.0, 100.0]], np.diag([0.5, 0.0])
    lumped = Matrices("m-kg-s", None, *matrices, ["1:Z", "2:Z"])
    cases = ((structure_of(tmp_path, CHAIN), "m2:+Z", "m1:Z"), (lumped, "2:+Z", "1:Z"))
    models = [cm.linear_model(rig_of(of, sensor, shaker=Shaker("force", at))) for of, sensor, at in cases]
    omega = np.array([3.0, 9.0, 20.0])
    for kind in ("base", "force"):
        transfer_, expected = (m.responses(m.at_sensors, m.input(kind)[:, None], omega) for m in models)
        np.testing.assert_allclose(transfer_, expected, rtol=1e-8)


def test_small_motions_marched_by_mujoco(tmp_path):
    """MuJoCo steps (RK4) the pendulum, held aside by a spring, on a base that shakes by 1 mm/s².

    The base's acceleration is a change of gravity; what is not linear is of the order of the motion, 1e-5 rad.
    """
    text = DOUBLE_PENDULUM.format(spring='stiffness="15" springref="60" damping="0.05"')
    structure = structure_of(tmp_path, text)
    linear = structure.assemble((), 8)
    model = mujoco.MjModel.from_xml_path(structure.file)
    data = mujoco.MjData(model)
    row = linear.rows(["tip:+X"])[0]

    def shaken(t):
        return 1e-3 * np.sin(7.0 * t)

    def motion(t, state):
        force = -linear.influence[:, 0] * shaken(t) - linear.viscous @ state[2:] - linear.stiffness @ state[:2]
        return np.concatenate((state[2:], np.linalg.solve(linear.mass, force)))

    times = np.arange(1, 4001) * model.opt.timestep
    options = {"method": "DOP853", "t_eval": times, "rtol": 1e-10, "atol": 1e-16}
    expected = row @ scipy.integrate.solve_ivp(motion, (0, times[-1]), np.zeros(4), **options).y[:2]
    at_rest = structure.coordinates("tip:+X")[0]
    data.qpos[:] = equilibrium(structure)
    places = []
    for t in times:
        model.opt.gravity[0] = -shaken(t - model.opt.timestep / 2)  # RK4 holds gravity over its stages
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        places.append(data.site("tip").xpos[0] - at_rest)
    assert abs(at_rest) > 0.2
    assert np.abs(np.array(places) - expected).max() < 3e-4 * np.abs(expected).max()


def equilibrium(structure):
    """Joint angles at which MuJoCo itself feels no force, found by a general solver."""
    model = mujoco.MjModel.from_xml_path(structure.file)
    data = mujoco.MjData(model)

    def acceleration(angles):
        data.qpos[:], data.qvel[:] = angles, 0.0
        mujoco.mj_forward(model, data)
        return data.qacc.copy()

    return scipy.optimize.fsolve(acceleration, [0.1, 0.1], xtol=1e-12)


def test_closed_loop_of_a_parallelogram(tmp_path):
    """The bar of a hanging parallelogram moves without turning, as a simple pendulum: ω² = g/l."""
    model = cm.linear_model(rig_of(structure_of(tmp_path, PARALLELOGRAM), "end:+X"))
    np.testing.assert_allclose(model.omega**2, [9.81], rtol=1e-5)
    np.testing.assert_allclose(model.shapes(["end:+X"]) ** 2, [[1 / 3]], rtol=1e-5)


def test_clearance_between_sites_in_a_rig_file(tmp_path):
    """The same contact as with the closed form's matrices: M = 1, K = g/l [[3, -1], [-1, 1]] for horizontal motions."""
    structure = structure_of(tmp_path, DOUBLE_PENDULUM.format(spring=""))
    bushing = Bushing("tip:+X", 1e-3, 0.0, Grease(0.0), Contact(1e4, 1.0), to="elbow:+X")
    rig = rig_of(structure, shaker=Shaker(direction=(1, 0, 0))).replace(bushings=(bushing,))
    rig.save(file := tmp_path / "rig.toml")
    assert 'file = "model.xml"' in file.read_text(encoding="utf-8")
    read = Rig.load(file)
    assert read == rig and hash(read) == hash(rig) and pickle.loads(pickle.dumps(read)) == rig
    excitation = cm.excitation.random(3.0, 512, band=(0.3, 5), rms=0.5, seed=0)
    response = cm.simulate(rig, excitation, cm.ConstantLaw(1e4, 1.0), engine="modal")
    matrices = np.eye(2), [[29.43, -9.81], [-9.81, 9.81]], np.diag([0.02, 0.0])
    weights = Matrices("m-kg-s", None, *matrices, ["1:X", "2:X"])
    bushing = dataclasses.replace(bushing, position="2:X", to="1:X")
    lumped = rig.replace(structure=weights, bushings=(bushing,), sensors=(Sensor(1, "2:+X"),))
    expected = cm.simulate(lumped, excitation, cm.ConstantLaw(1e4, 1.0), engine="modal")
    assert response.contact_force.any()
    size = np.abs(expected.displacement).max()
    np.testing.assert_allclose(response.displacement, expected.displacement, rtol=0, atol=1e-4 * size)


def test_named_points_are_those_that_move(tmp_path):
    structure = structure_of(tmp_path, DOUBLE_PENDULUM.format(spring=""))
    assert {"tip:X", "elbow:X", "tip:RY"} <= set(structure.named_points)
    assert not {"tip:Y", "tip:Z"} & set(structure.named_points)


FREE = '<mujoco><worldbody><body name="box"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>'


@pytest.mark.parametrize("text, fields, message", [
    (FREE, {}, "no equilibrium is found: forces stay unbalanced at joint number 0; hold it by a spring"),
    (DOUBLE_PENDULUM.format(spring=""), {"keyframe": "upright"}, "the equilibrium is unstable, joint .* moves away"),
    (DOUBLE_PENDULUM.format(spring=""), {"keyframe": "up"}, 'keyframe "up" is none of .*; it has aside, upright'),
    ("<mujoco><worldbody/></mujoco>", {}, "the model has no joints, so nothing moves"),
    ("<mujoco><worldbdy/></mujoco>", {}, "file .*model.xml: .*worldbdy"),
])  # fmt: skip
def test_models_without_an_equilibrium_are_refused(tmp_path, text, fields, message):
    assert_refused(RigError, message, structure_of, tmp_path, text, **fields)


@pytest.mark.parametrize("point, message", [
    ("tips:+X", '"tips:\\+X" is at no site or body of model.xml; the nearest names are tip'),
    ("tip:+Y", '"tip:\\+Y" cannot move'),
    (0.3, '"0.3" is no point of a MuJoCo model, such as "tip:\\+Z"'),
])  # fmt: skip
def test_points_that_do_not_exist_are_refused(tmp_path, point, message):
    structure = structure_of(tmp_path, DOUBLE_PENDULUM.format(spring=""))
    assert_refused(RigError, rf"sensors\[0\].position {message}", rig_of, structure, point)


def test_free_body_without_gravity_is_free(tmp_path):
    structure = structure_of(tmp_path, FREE.replace("<worldbody>", '<option gravity="0 0 0"/><worldbody>'))
    assert np.all(cm.linear_model(rig_of(structure, "box:+Z")).omega == 0)
