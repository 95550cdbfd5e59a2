"""The committed MJCF model: what the builder writes, and what it should be."""

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.beam import natural_frequencies
from clearance_mj.engines import build_links
from clearance_mj.physical.rows import softness_of

from ..conftest import TABLE1 as RIG
from ..physical.stepping import mass_matrix, with_data

NUMBER = re.compile(r"(-?\d+\.?\d*(?:e[-+]?\d+)?)")
MODEL = Path(__file__).parents[2] / "models" / "table1_rig_links.xml"


def load():
    model, data = with_data(mujoco.MjModel.from_xml_path(str(MODEL)))
    mujoco.mj_forward(model, data)
    return model, data


def test_the_committed_model_is_what_the_builder_writes():
    """Otherwise: make models. MJCF holds six digits, of which the last may differ from one machine to another."""
    committed, built = MODEL.read_text(encoding="utf-8"), build_links(RIG).to_xml()
    texts, numbers = zip(*((parts[::2], parts[1::2]) for parts in (NUMBER.split(text) for text in (committed, built))))
    assert texts[0] == texts[1]
    np.testing.assert_allclose(*(np.array(row, dtype=float) for row in numbers), rtol=3e-6, atol=1e-12)


def test_links_model():
    """Sixteen hinges; its frequencies are the shaft's, without grease, which is not in the model."""
    model, data = load()
    assert (model.nv, model.npair) == (16, 8)
    square = np.linalg.eigvals(np.linalg.solve(mass_matrix(model, data), np.diag(model.jnt_stiffness)))
    frequency = np.sqrt(np.sort(square)[:4]) / (2 * np.pi)
    np.testing.assert_allclose(frequency, natural_frequencies(RIG.replace(bushings=()), 4), rtol=3e-3)


def test_timestep_is_stable():
    """An hour in the viewer begins with a second here: a shove at the tip rings down."""
    model, data = load()
    data.qvel[:] = 0.05
    energy = []
    for _ in range(4):
        for _ in range(round(0.25 / model.opt.timestep)):
            mujoco.mj_step(model, data)
        energy.append(np.sum(data.qvel**2))
    assert energy[-1] < energy[0]
    assert not np.any(data.warning.number)


def test_links_touch_their_bushings():
    """Lifted by more than the gap the shaft meets the upper plates, lowered the lower ones, and none in between."""
    model, data = load()
    hinge = model.body("link0").pos[0]
    for lift, side in ((6e-4, "upper"), (-6e-4, "lower"), (2e-4, None)):
        # The first hinge lifts the inner bushing, at 0.5484 m, by this much; the outer one by half as much again.
        data.qpos[:] = lift / (0.5484 - hinge) * np.eye(model.nq)[0]
        mujoco.mj_forward(model, data)
        pressed = [c for c in data.contact[: data.ncon] if c.dist < 0]
        touched = {model.geom(g).name for c in pressed for g in c.geom if model.geom(g).name.startswith("bushing")}
        assert touched == ({f"bushing0_{side}", f"bushing1_{side}"} if side else set())
        assert data.sensor("displacement0").data[2] == pytest.approx(lift, rel=1e-5)
        depths = sorted(-c.dist for c in pressed)
        ends = [abs(lift) * (x - hinge) / (0.5484 - hinge) - 3e-4 for b in RIG.bushings for x in b.ends]
        np.testing.assert_allclose(depths, sorted(ends) if side else [], atol=1e-8)


def test_datasheet_softness():
    """k and c of the rig, half at each end; of six digits as the masses are, exact once the file is in memory."""
    model, _ = load()
    assert (model.npair, model.ntendon, physical.check(model)) == (8, 0, ())
    for tolerance in (1e-5, 1e-14):
        np.testing.assert_allclose([softness_of(model, "pair", i) for i in range(8)], [(3.9e3, 2)] * 8, rtol=tolerance)
        physical.apply(model)
