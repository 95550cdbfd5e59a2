"""Limits, contacts and backlash of models that nobody here wrote: static force, ringing and play in random poses.

The models come with gymnasium, dm_control and gymnasium-robotics, of which only the files are read; a model whose
package is not installed is skipped.
"""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.physical.rows import softness_of
from experiments.physical.model_rows import MODELS, load, path_of, softened
from experiments.physical.models import measure, measure_backlash

QUICK = ("gymnasium reacher", "gymnasium ant", "dm_control ball_in_cup")


def foreign(name):
    if not path_of(name):
        package = MODELS[name].partition("/")[0]
        pytest.skip(f"{package} is not installed; its files are enough: pip install --no-deps {package}")
    return name


def right(name, poses):
    """Static error <= 1e-6, √(k a - (c a/2)²) within 0.1 %, a = J M⁻¹ Jᵀ of the pose; play and teeth within 1e-6."""
    errors = measure(*softened(name), poses)
    assert sum(e.cases for e in errors.values()) >= poses
    assert max(e.static for e in errors.values()) <= 1e-6
    assert max(e.ringing for e in errors.values()) <= 1e-3
    backlash = measure_backlash(name, poses)
    assert backlash["stiffness"] <= 1e-6
    assert backlash["play"] <= 1e-6
    assert backlash["ringing"] <= 1e-3
    return backlash["joints"], backlash["two hinges, stiffest over softest"]


@pytest.mark.parametrize("name", QUICK)
def test_model(name):
    """One pose; teeth by the recipe of two hinges depend on the link's mass and the pose."""
    joints, recipe = right(foreign(name), 1)
    assert np.isnan(recipe) if not joints else recipe > 1.5


FEWER = {"dm_control quadruped": 4, "dm_control humanoid_CMU": 4}
"""Poses of models that take minutes for twenty, which `experiments.physical.models` measures"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.release) for name in MODELS]
)
def test_model_in_many_poses(name):
    right(foreign(name), FEWER.get(name, 20))


@pytest.mark.parametrize("name", QUICK)
def test_file_of_a_foreign_model(name):
    """MJCF saved as it is written keeps k and c within 1e-6."""
    spec = load(foreign(name))
    model = spec.compile()
    kind, limited = ("joint", model.jnt_limited) if model.jnt_limited.any() else ("tendon", model.tendon_limited)
    names = [getattr(model, kind)(i).name for i in np.flatnonzero(limited)]
    getattr(physical, f"{kind}_limit")(spec, names, 730.1234567, 1.9876543)
    spec.compiler.savecompiled = spec.compiler.savecanonical = False
    model = mujoco.MjModel.from_xml_string(spec.to_xml(), spec.assets)
    for i in np.flatnonzero(limited):
        np.testing.assert_allclose(softness_of(model, kind, i), (730.1234567, 1.9876543), rtol=1e-6)


def eigenvalues(model, step):
    """Of one step about the initial pose, in which forces hold the model at rest, by central differences."""
    model.opt.timestep, data = step, mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    data.qacc[:] = 0
    mujoco.mj_inverse(model, data)
    data.qfrc_applied[:] = data.qfrc_inverse - data.qfrc_actuator
    rest, activations, columns = data.qpos.copy(), data.act.copy(), []
    for move in 1e-6 * np.eye(2 * model.nv):
        after = []
        for sign in (1, -1):
            data.qpos[:], data.qvel[:], data.act[:] = rest, sign * move[model.nv :], activations
            mujoco.mj_integratePos(model, data.qpos, sign * move[: model.nv], 1.0)
            mujoco.mj_step(model, data)
            moved = np.zeros(model.nv)
            mujoco.mj_differentiatePos(model, moved, 1.0, rest, data.qpos)
            after.append(np.concatenate((moved, data.qvel)))
        columns.append((after[0] - after[1]) / 2e-6)
    return np.linalg.eigvals(np.transpose(columns))


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", MODELS)
def test_step_of_a_foreign_model(name):
    """Its springs, dampers and servos: an eigenvalue of the step is -1 at the limit, of Runge-Kutta's 1 in size."""
    model = load(foreign(name)).compile()
    bits = mujoco.mjtDisableBit
    nothing_else = bits.mjDSBL_CONTACT | bits.mjDSBL_LIMIT | bits.mjDSBL_EQUALITY | bits.mjDSBL_FRICTIONLOSS
    model.opt.disableflags |= int(nothing_else | bits.mjDSBL_GRAVITY)
    step = physical.largest_step(model)
    if step == np.inf:
        assert not model.jnt_stiffness.any() and not model.actuator_biasprm[:, 1:3].any()
        return
    size = np.abs if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4 else lambda values: -values.real
    below, at, above = (size(eigenvalues(model, fraction * step)).max() for fraction in (0.99, 1.0, 1.01))
    assert at == pytest.approx(1, abs=1e-5) and below < 1 + 1e-5 < 1.01 < above
