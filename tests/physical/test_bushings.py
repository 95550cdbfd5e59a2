"""Bushings between two sites: k and c along and about each axis, whatever the pose and the masses."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from clearance_mj import physical
from clearance_mj.core.errors import LawError, ModelError

from .stepping import mass_matrix, ringing

pytestmark = pytest.mark.filterwarnings("ignore::clearance_mj.physical.ModelWarning")

K = np.array([2e5, 5e4, 1e4, 300.0, 80.0, 20.0])
C = np.array([200.0, 100.0, 50.0, 1.0, 0.5, 0.2])
SITES = """<mujoco><option timestep="1e-4" gravity="0 0 0"/><worldbody>
  <body name="frame" pos="0 0 1" euler="20 30 40">{holder}<geom size=".05" mass="{frame}" contype="0"/>
    <site name="a" pos=".1 0 .05" euler="10 -20 60"/></body>
  <body name="engine" pos="0 0 1" euler="20 30 40"><freejoint/>
    <geom type="box" size=".1 .06 .04" mass="2" pos=".12 .02 .06" contype="0"/>
    <site name="b" pos=".1 0 .05" euler="10 -20 60"/></body></worldbody><sensor><force site="b"/></sensor></mujoco>"""


def model_of(k=K, c=C, free=False, frame=1.0):
    spec = mujoco.MjSpec.from_string(SITES.format(holder="<freejoint/>" if free else "", frame=frame))
    physical.add_bushing(spec, "a", "b", k, c)
    return physical.compile(spec)


def between(data):
    """Displacement, m, and rotation vector, rad, of site b from site a, in the axes of b."""
    axes = [data.site(name).xmat.reshape(3, 3) for name in "ab"]
    turned = Rotation.from_matrix(axes[1].T @ axes[0]).inv().as_rotvec()
    return axes[1].T @ (data.site("b").xpos - data.site("a").xpos), turned


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("axis", range(6))
def test_a_force_along_or_about_an_axis_moves_that_axis_alone(axis, free):
    """At rest r = F/k and 2 sin(θ/2) = T/k, of forces that turn with the bushing; the frame bears the opposite."""
    model = model_of(free=free)
    data, loads = mujoco.MjData(model), (30.0, 12.0, 5.0, 6.0, 2.0, 1.0)
    bodies = [(model.body("engine").id, 1.0)] + ([(model.body("frame").id, -1.0)] if free else [])
    wanted = np.zeros(6)
    wanted[axis] = loads[axis]
    with physical.Softener(model):
        for _ in range(400):
            axes, place = data.site("b").xmat.reshape(3, 3), data.site("b").xpos
            if data.time == 0:
                mujoco.mj_forward(model, data)
            data.qfrc_applied[:] = 0
            for body, sign in bodies:
                force, torque = sign * axes @ wanted[:3], sign * axes @ wanted[3:]
                mujoco.mj_applyFT(model, data, force, torque, place, body, data.qfrc_applied)
            mujoco.mj_step(model, data, 50)
            if not free:
                data.qvel[:] *= 0.9
    moved, turned = between(data)
    angle = np.linalg.norm(turned)
    turned_back = np.append(moved, turned * (2 * np.sin(angle / 2) / angle if angle else 1.0))
    np.testing.assert_allclose(turned_back, wanted / K, atol=2e-3 * (wanted / K).max())


@pytest.mark.parametrize("frame", [0.5, 50.0])
def test_it_rings_at_its_stiffness_whatever_the_masses(frame):
    """Two free bodies along z of the bushing: ω² = k (1/m + 1/M), the bodies pushed so that they do not turn."""
    k = np.array([1e6, 1e6, 1e4, 1e5, 1e5, 1e5])
    spec = mujoco.MjSpec.from_string(SITES.format(holder="<freejoint/>", frame=frame))
    for name in ("frame", "engine"):  # centres of mass on the bushing's axis
        spec.body(name).first_geom().pos = spec.site("a").pos
    physical.add_bushing(spec, "a", "b", k, np.full(6, 1e-9))
    spec.option.timestep = 5e-5
    model = physical.compile(spec)
    data, masses = mujoco.MjData(model), (frame, 2.0)
    mujoco.mj_forward(model, data)
    z = data.site("b").xmat.reshape(3, 3)[:, 2]
    data.qvel[0:3], data.qvel[6:9] = -0.1 * z / masses[0], 0.1 * z / masses[1]
    path = []
    with physical.Softener(model):
        for _ in range(10000):
            mujoco.mj_step(model, data)
            path.append(between(data)[0][2])
    assert ringing(path, 5e-5) == pytest.approx(np.sqrt(1e4 * sum(1 / m for m in masses)) / (2 * np.pi), rel=2e-3)


def test_the_step_that_it_takes():
    """The hardest axis of the engine alone: h = 2/ω, here of a ball joint in which it turns freely."""
    model = model_of(k=[1e5, 1e4, 1e3], c=[0.0, 0.0, 0.0])
    data, jacobian = mujoco.MjData(model), np.zeros((3, 6))
    inverse = np.linalg.inv(mass_matrix(model, data))
    mujoco.mj_jacSite(model, data, jacobian, None, model.site("b").id)
    rows = data.site("b").xmat.reshape(3, 3).T @ jacobian
    omega = np.sqrt(np.linalg.eigvals(np.diag([1e5, 1e4, 1e3]) @ rows @ inverse @ rows.T).max())
    assert physical.largest_step(model) == pytest.approx(2 / omega, rel=2e-3)
    assert any("has one stiffness in all directions until" in line for line in physical.check(model))


@pytest.mark.parametrize(("arguments", "error", "says"), [
    (("a", "b", [1.0, 2.0], [0.0, 0.0]), LawError, "they need 3 or 6"),
    (("a", "b", -K, C), LawError, "of a bushing must be finite and > 0"),
    (("a", "c", K, C), ModelError, 'no site "c"'),
    (("a", "a", K, C), ModelError, "are on one rigid body"),
])  # fmt: skip
def test_bushings_that_cannot_be(arguments, error, says):
    with pytest.raises(error, match=says):
        physical.add_bushing(mujoco.MjSpec.from_string(SITES.format(holder="", frame=1.0)), *arguments)
