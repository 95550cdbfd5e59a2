"""A rig with slots and round clearances as chains of rigid links: its rows, statics, and MuJoCo model."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.engines import build_links
from clearance_mj.engines.links_plant import links_plant
from clearance_mj.linear import linear_model
from clearance_mj.physical.rows import softness_of
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor, Spin
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

GREASE, CONTACT = Grease(500.0, 3.0), Contact(5e4, 5.0)
SHAFT = Shaft(
    (Section(0.4, 0.016), Section(0.4, 0.012)), (Support(0.0, "clamped"),), (Disc(0.8, 0.2, 1e-4),),
    Material(210e9, 7850.0), (1.0, 1e-6), theory="euler",
)  # fmt: skip
BUSHINGS = (
    Bushing("@0.8:RX", 2e-3, 0.0, Grease(1.0), CONTACT, stops="upper"),
    Bushing(0.3, 1e-4, 0.01, GREASE, CONTACT, shape="round", offset_y=2e-5),
    Bushing(0.6, 3e-4, 0.02, GREASE, CONTACT),
    Bushing("@0.5:Y", 4e-4, 0.0, GREASE, CONTACT),
    Bushing("@0.7:RY", 5e-3, 0.0, Grease(0.0), CONTACT),
)
MIXED = Rig("mixed", None, BUSHINGS, (Sensor(1, 0.7), Sensor(2, "@0.8:RX")), structure=SHAFT, spin=Spin(50.0))


@pytest.fixture(scope="module")
def plant():
    return links_plant(MIXED, 16)


def test_compliance_is_that_of_the_linear_model(plant):
    """Displacements of all rows under forces in all clearances, which both have exactly: the middles end elements."""
    rows, whole, modal = plant.maps.at_rows[: MIXED.n_rows], plant.whole, linear_model(MIXED)
    assert MIXED.n_rows == 6 and rows.shape == (6, 16 + 16 + 16)
    compliance = rows @ np.linalg.solve(whole.whole_stiffness, rows.T)
    reference = (modal.at_bushings / modal.omega**2) @ modal.at_bushings.T
    scale = np.sqrt(np.outer(reference.diagonal(), reference.diagonal()))
    np.testing.assert_allclose(compliance / scale, reference / scale, rtol=0, atol=1e-12)


def test_coordinates_stand_by_axis(plant):
    """Along y, along z, twist; a row moves those of its own axis alone, and MuJoCo's numbers are of every one."""
    maps = plant.maps
    assert [(span.start, span.stop) for span in plant.whole.spans] == [(0, 16), (16, 48)]
    np.testing.assert_array_equal(np.sort(maps.order), np.arange(48))
    moved = [{i // 16 for i in np.flatnonzero(row)} for row in maps.at_rows[: MIXED.n_rows]]
    assert moved == [{2}, {0}, {1}, {1}, {0}, {1}]
    names = [plant.model.joint(int(plant.model.dof_jntid[i])).name for i in maps.order]
    assert [names[i] for i in (0, 16, 32)] == ["hinge0_y", "hinge0_z", "hinge0_x"]
    turned = plant.whole.gyroscopic
    assert turned.any() and not turned[32:].any() and not maps.circulatory[:, 32:].any()
    np.testing.assert_array_equal(turned, -turned.T)


def test_clearances_are_tendons(plant):
    """Lengths of slots are their rows, of the round one the distance from its axis; walls are their limits."""
    model, maps = plant.model, plant.maps
    assert model.npair == 0 and (maps.pairs == -1).all() and (maps.limits >= 0).all()
    data = mujoco.MjData(model)
    q = 1e-4 * np.random.default_rng(0).standard_normal(48)
    data.qpos[maps.order] = q
    mujoco.mj_forward(model, data)
    ends = maps.at_rows[MIXED.n_rows + MIXED.end_rows] @ q  # (n_rows, 2)
    lengths = data.ten_length[maps.limits].reshape(-1, 2)
    np.testing.assert_allclose(lengths[[0, 2, 3, 4]], ends[[0, 3, 4, 5]], rtol=1e-12)
    np.testing.assert_allclose(lengths[1], np.hypot(ends[1] + 2e-5, ends[2]), rtol=1e-5)
    limits = model.tendon_range[maps.limits[::2]]
    np.testing.assert_allclose(limits, [[-1e3, 2e-3], [0, 1e-4], [-3e-4, 3e-4], [-4e-4, 4e-4], [-5e-3, 5e-3]])


def test_the_model_in_a_file_has_the_datasheet_softness_and_is_stable():
    model = mujoco.MjModel.from_xml_string(build_links(MIXED, 8).to_xml())
    assert physical.check(model) == () and model.ntendon == 10
    np.testing.assert_allclose([softness_of(model, "tendon", i) for i in range(10)], [(2.5e4, 2.5)] * 10, rtol=1e-5)
    data = mujoco.MjData(model)
    data.qvel[:] = 0.05
    mujoco.mj_step(model, data, round(0.2 / model.opt.timestep))
    assert not data.warning.number.any() and np.abs(data.qpos).max() < 0.1
