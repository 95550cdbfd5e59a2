"""The live page of a rig in space: figures hold what the library's calls give; sliders of weight, spin, friction."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj import Bushing, ClearanceError, Contact, Grease, Rig, Sensor
from clearance_mj.live import Session, on_demand
from clearance_mj.live.controls import build_model
from clearance_mj.live.export import exported
from clearance_mj.rig import Friction, Spin, Unbalance
from clearance_mj.rotors import turning_shaft, whirl
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

SHORT = {"duration": 4.0, "fs": 1024.0}


@pytest.fixture
def rig():
    """A rotor whose disc of 3 kg hangs in a bushing of 0.2 mm at 120 rad/s."""
    supports = Support(0.0, "pinned"), Support(1.0, "pinned")
    disc = Disc(0.35, 3.0, 0.01, polar_inertia=0.02)
    shaft = Shaft((Section(1.0, (0.02, 0.02)),), supports, (disc,), Material(2.1e11, 7800.0), (4.0, 1e-6))
    bushing = Bushing(0.6, 2e-4, 0.02, Grease(0.0, 5.0), Contact(2e5, 50.0), friction=Friction(0.1), shape="round")
    return Rig(
        "rotor", None, (bushing,), (Sensor(1, 0.35),), structure=shaft, gravity=(0.0, 0.0, -9.81),
        spin=Spin(120.0), unbalances=(Unbalance(0.35, 2e-4),),
    )  # fmt: skip


@pytest.fixture
def session(rig):
    return Session(cm.Model(rig))


def test_figures_hold_what_the_library_gives(session, rig):
    numbers = session.show(session.setting(SHORT | {"gravity": 4.0, "spin.speed": 100.0, "bushings[0].friction": 0.3}))
    bushing = dataclasses.replace(rig.bushings[0], friction=Friction(0.3))
    changed = rig.replace(gravity=(0.0, 0.0, -4.0), spin=Spin(100.0), bushings=(bushing,))
    assert session.shown.model.rig == changed
    response = cm.simulate(changed, cm.excitation.still(4.0, 1024.0), engine="modal")
    place = whirl(changed, response).position[0]
    np.testing.assert_allclose(numbers.arrays["displacement"].max(axis=1), place.max(axis=1), rtol=1e-12)
    (row,) = numbers.facts["clearances"]
    known = np.hypot(*place).max(), np.hypot(*response.contact_force).max(), response.contact_share[0]
    assert (row["peak"], row["force"], row["share"]) == pytest.approx(known)
    assert numbers.facts["walls"] == [[-2e-4, 2e-4]] * 2
    poles = turning_shaft(changed).poles(100.0).value.imag / (2 * np.pi)
    np.testing.assert_allclose(numbers.facts["natural"][:2], poles[:2], rtol=1e-9)
    assert numbers.facts["spectrum"]  # without an excitation there is no FRF
    described = session.described()
    assert described["orbits"] == [(0, 1, True)]
    assert described["rows"] == ["clearance 1, x = 0.6 m, y", "clearance 1, x = 0.6 m, z"]


def test_the_shaft_is_seen_from_the_side_and_from_above(session):
    numbers = session.show(session.setting(SHORT))
    facts, arrays = numbers.facts["shaft"], numbers.arrays
    half = arrays["position"].size // 2
    assert set(arrays["number"][:half]) == {0.0} and set(arrays["number"][half:]) == {1.0}
    assert [place[0] for place in facts["places"]] == [0, 1] and len(facts["walls"]) == 2
    at = np.argmin(np.abs(arrays["position"][:half] - 0.35))
    disc_z, disc_y = arrays["lift"][:, at], arrays["lift"][:, half + at]
    assert disc_z.mean() < -1e-5  # it hangs
    assert abs(disc_y.mean()) < abs(disc_z.mean())


def test_whether_it_leans_or_rattles(session):
    """Heavy and well balanced it leans on one side, light and far out of balance it goes all around."""
    leaning = session.show(session.setting(SHORT | {"unbalances[0].moment": 2e-6, "gravity": 19.6}))
    around = session.show(session.setting(SHORT | {"unbalances[0].moment": 1e-3, "gravity": 0.0}))
    free = session.show(session.setting(SHORT | {"unbalances[0].moment": 2e-6, "gravity": 0.0}))
    states = [numbers.facts["clearances"][0]["rattle"] for numbers in (leaning, around, free)]
    assert states == ["touches one side", "rattles", "free"]


def test_identified_settings_are_the_rig_that_was_given(session, rig):
    assert build_model(session.model, session.identified).rig == rig
    ramp = rig.replace(spin=Spin(50.0, 20.0, 150.0))
    other = Session(cm.Model(ramp))
    assert build_model(other.model, other.identified).rig == ramp
    down = build_model(other.model, other.setting({"spin.until": 10.0, "spin.rate": 5.0})).rig
    assert down.spin == Spin(50.0, -5.0, 10.0)
    assert build_model(other.model, other.setting({"spin.until": 50.0})).rig.spin == Spin(50.0)


def test_what_the_plane_alone_knows_is_refused_and_sweeps_go_on(session):
    with pytest.raises(ClearanceError, match="branch of periodic vibrations knows planar rigs"):
        on_demand.branch(session, session.setting(SHORT), 5.0, 20.0, lambda progress: None)
    sweep = on_demand.sweep(session, session.setting(SHORT), "gravity", 1.0, 20.0, 2, lambda progress: None)
    assert sweep.facts["failed"] == "" and sweep.arrays["share"].shape == (1, 2)
    assert sweep.arrays["share"][0, 1] > sweep.arrays["share"][0, 0]
    session.show(session.setting(SHORT))
    assert exported(session.shown)[:2] == b"PK"
