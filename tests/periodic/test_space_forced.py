"""Harmonic balance of round clearances under an excitation: beside the plane, and beside the modal engine's marches."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj import ClearanceError, Modal, RigError, periodic
from clearance_mj.rig import Friction, Grease, Shaker, Spin

from ..conftest import TABLE1
from ..refusals import assert_refused
from .jeffcott import jeffcott, replaced, unbalanced

SPACE = TABLE1.with_shape("round")
GREASED = replaced(SPACE, offset_y=1e-4, grease=Grease(8e3, 3.0, elastic_ratio=0.4, beta=2e7, gamma=1e7))
RUBBED = replaced(SPACE, offset_y=1e-4, friction=Friction(0.2))
OVAL = replaced(SPACE, offset_y=1e-4, shape="oval", wall={"wide": 4e-5, "across": -3e-5})
ASKEW = {"gravity": (0.0, 2.0, -9.81)}
PER_PERIOD = 400


def marched(rig, frequency, level, periods=200, resolution=0.1):
    """Displacements (2 n_bushings, samples) of the last of so many periods, begun at rest, and those of all."""
    time = np.arange(PER_PERIOD * periods) / (PER_PERIOD * frequency)
    excitation = cm.excitation.Excitation(level * np.cos(2 * np.pi * frequency * time), PER_PERIOD * frequency)
    response = cm.simulate(cm.Model(rig), excitation, engine=Modal(resolution=resolution)).displacement
    return response[:, -PER_PERIOD:], response


def last_orbit(model, ends, **settings):
    """Harmonics of the clearances at the end of a branch."""
    return periodic.follow_response(model, 6.0, ends, stability=False, **settings).clearance_displacement[-1]


def history(branch, index):
    """Displacements (2 n_bushings, samples) of a period, by harmonics."""
    harmonics = branch.clearance_displacement[index]
    angle = 2 * np.pi * np.arange(PER_PERIOD) / PER_PERIOD
    return (harmonics @ np.exp(1j * np.outer(np.arange(harmonics.shape[1]), angle))).real


def test_a_vibration_in_a_plane_is_the_planar_one():
    """Folds and harmonics of the planar code; in any direction across the shaft."""
    plane = periodic.follow_response(cm.Model(TABLE1), 6.0, (40.0, 48.0), stability=False)
    folds = [point.frequency for point in plane.special if point.kind == "fold"]
    assert len(folds) == 2
    angle = 0.7
    turned = SPACE.replace(shaker=Shaker(direction=(0.0, np.sin(angle), np.cos(angle))))
    for rig, y, z in ((SPACE, 0.0, 1.0), (turned, np.sin(angle), np.cos(angle))):
        in_plane = periodic.follow_response(cm.Model(rig), 6.0, (40.0, 48.0), stability=False)
        assert_allclose([p.frequency for p in in_plane.special if p.kind == "fold"], folds, rtol=1e-7)
        sideways, upright = (each.amplitude("clearance_displacement")[-1] for each in (in_plane, plane))
        assert_allclose(sideways[::2], y * upright, rtol=1e-6, atol=1e-12)
        assert_allclose(in_plane.clearance_displacement[-1, 1::2], z * plane.clearance_displacement[-1], atol=1e-9)
    assert in_plane.clearances == tuple(turned.probe_labels)


def test_a_vibration_in_a_plane_may_leave_it():
    """Where a multiplier says so, a march with a sideways force of a millionth of the level grows at that rate."""
    branch = periodic.follow_response(cm.Model(SPACE), 6.0, (41.0, 44.0))
    assert [p.kind for p in branch.special] == ["branch point"]
    assert 42.0 < branch.special[0].frequency < 42.1
    at = int(np.abs(branch.frequency - 43.2).argmin())
    rate = np.abs(branch.multipliers[at, 0])
    assert rate > 1.02
    for index, grows in ((at, True), (0, False)):
        _, whole = marched(SPACE.replace(gravity=(0.0, 1e-4, 0.0)), branch.frequency[index], 6.0, 240, 0.3)
        sideways = np.abs(whole[0]).reshape(-1, 20 * PER_PERIOD).max(axis=1)
        if grows:
            assert_allclose((sideways[-1] / sideways[-4]) ** (1 / 60), rate, rtol=2e-3)
        else:
            assert sideways[-1] < 1.01 * sideways[-4]


@pytest.mark.parametrize(("rig", "periods"), [
    (SPACE.replace(**ASKEW), 200),
    (OVAL.replace(**ASKEW), 200),
    (RUBBED.replace(**ASKEW, spin=Spin(50.0)), 800),  # until what the start has excited along z has died out
    pytest.param(GREASED.replace(**ASKEW), 200, marks=pytest.mark.slow),
], ids=["weight", "an oval wall", "friction of a turning shaft", "hysteresis"])  # fmt: skip
def test_a_march_comes_to_the_same_orbit(rig, periods, measured):
    """Whole orbits of both bushings, over their largest radius, sag included: 0.1 %."""
    branch = periodic.follow_response(cm.Model(rig), 6.0, (38.0, 40.0), stability=False)
    march, _ = marched(rig, 40.0, 6.0, periods, 0.3)
    orbit = history(branch, -1)
    off = np.abs(orbit - march).max() / np.abs(orbit - orbit.mean(axis=1, keepdims=True)).max()
    measured.below("harmonic balance in space, orbits", off, 1e-3, "modal engine's march")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["in a plane", "askew", "rubs and turns"])
def test_every_stable_vibration_stays_when_marched(name, measured):
    turns = RUBBED.replace(**ASKEW, spin=Spin(50.0))
    rig = {"in a plane": SPACE, "askew": SPACE.replace(**ASKEW), "rubs and turns": turns}[name]
    branch = periodic.follow_response(cm.Model(rig), 6.0, (25.0, 45.0))
    first = next((p.index for p in branch.special if p.kind != "first contact"), len(branch.frequency))
    worst = 0.0
    for index in range(0, first, max(first // 10, 1)):
        assert branch.stable[index]
        march = np.fft.rfft(marched(rig, branch.frequency[index], 6.0, 800, 0.3)[0])[:, 1] * 2 / PER_PERIOD
        orbit = branch.clearance_displacement[index, :, 1]
        worst = max(worst, np.abs(orbit - march).max() / np.abs(march).max())
    measured.below(f"harmonic balance in space, {name}: fundamental of orbits", worst, 1e-3, "modal engine's march")


def test_a_round_wall_is_an_oval_one_without_lobes():
    """The nearest point of a circle, by the oval's search."""
    oval = replaced(SPACE, offset_y=1e-4, shape="oval", wall={"wide": 0.0, "across": 0.0}).replace(**ASKEW)
    rigs = oval, replaced(oval, shape="round", wall=None)
    assert_allclose(*(last_orbit(cm.Model(rig), (38.0, 39.0)) for rig in rigs), atol=1e-10)


def test_unbalances_beside_an_excitation_and_changing_speeds_are_refused():
    with pytest.raises(ClearanceError, match="use follow_unbalance"):
        periodic.follow_response(cm.Model(unbalanced(jeffcott())), 1.0, (5.0, 6.0))
    with pytest.raises(RigError, match="needs a steady speed"):
        periodic.follow_response(cm.Model(jeffcott(spin=Spin(10.0, rate=5.0))), 1.0, (5.0, 6.0))
    assert_refused(RigError, "has no unbalances", periodic.follow_unbalance, cm.Model(jeffcott()), (5.0, 6.0))
    assert_refused(RigError, "does not turn", periodic.follow_unbalance, cm.Model(TABLE1), (5.0, 6.0))
    assert_refused(RigError, "does not turn", periodic.follow_whirl, cm.Model(jeffcott()), (5.0, 6.0))


def test_a_branch_in_space_as_a_labelled_dataset():
    turns = SPACE.replace(spin=Spin(20.0))
    labelled = periodic.follow_response(cm.Model(turns), 1.0, (30.0, 31.0), 3).to_xarray()
    assert list(labelled.clearance.values) == turns.probe_labels
    assert_allclose(labelled.spin, 20.0)


def test_an_end_without_length_is_like_both():
    """A bushing of no length has both ends in its middle: the same orbits as of one that is very short."""
    rigs = (replaced(SPACE, length=length).replace(**ASKEW) for length in (1e-6, 0.0))
    short, shorter = (last_orbit(cm.Model(rig), (39.7, 40.0)) for rig in rigs)
    assert_allclose(shorter, short, rtol=0, atol=1e-5 * np.abs(short).max())


def test_contacts_that_know_their_impact_are_followed():
    """Hunt-Crossley's damping by the speed of impact: the planar branch, in space."""
    models = (cm.Model(rig, cm.ContactLaw(cm.clearance.HuntCrossley1975(2e6, 4e5))) for rig in (TABLE1, SPACE))
    plane, space = (last_orbit(model, (40.0, 43.0), n_samples=1024) for model in models)
    assert_allclose(space[1::2], plane, atol=2e-9)  # both find impacts between samples, each in its way
