"""Inverse inertias: one that is known behind every contact and limit."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.physical.step import softness_of

from .arm import C, K, arm


def test_known_inverse_inertia():
    """k and c stay; a limit that is passed at a speed then has k r + c ṙ without μ α, which was 1e-4 of its inertia."""
    spec = arm()
    physical.joint_limit(spec, "elbow", K, C)
    physical.tendon_limit(spec, "sum", K, C)
    physical.contact(spec, ("ball", "ground"), K, C)
    model = spec.compile()
    physical.set_inverse_inertia(model)
    for row in (("joint", 1), ("tendon", 0), ("pair", 0)):
        assert physical.inverse_inertia(model, *row) == physical.INVERSE_INERTIA
        assert softness_of(model, *row) == pytest.approx((K, C), rel=1e-14)
    np.testing.assert_allclose(model.jnt_solref[1], physical.SOLREF_PER_UNIT * np.array([K, C]), rtol=1e-14)
    data = mujoco.MjData(model)
    data.qpos[1], data.qvel[1] = np.deg2rad(90) + 0.01, 0.3
    mujoco.mj_forward(model, data)
    assert data.qfrc_constraint[1] == pytest.approx(-(K * 0.01 + C * 0.3), rel=1e-6)
    mass = 1e-4 / (1 - 1e-4) / physical.INVERSE_INERTIA
    assert data.qfrc_constraint[1] == pytest.approx(-(K * 0.01 + C * 0.3) - mass * data.qacc[1], rel=1e-12)
