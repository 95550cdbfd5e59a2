"""Gears in periodic analyses: as teeth of one coordinate, against marches, and rattle maps against branches."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.clearance import TimeLaw, mesh_law
from clearance_mj.core.errors import LawError, RigError
from clearance_mj.periodic.impact_maps import IMPACTS
from clearance_mj.rig import Bushing, Contact, Grease, Load, Order, Rig, Sensor, Shaker, Spin
from clearance_mj.structure import Gears, Inertia

from ..conftest import ROOT
from ..refusals import assert_refused
from .test_teeth import DAMPING, LOUD, MEAN, QUIET, TURN, histories
from .test_teeth import MODEL as TEETH

RADII, MASSES = (0.04, 0.05), (3.0, 1.5)  # m1 m2/(m1 + m2) = 1 as in test_teeth


def gears(mean=MEAN, **more):
    """Two gears whose teeth move relative to each other as those of test_teeth."""
    inertias = tuple(Inertia(i, mass * r**2, r) for i, mass, r in zip((1, 2), MASSES, RADII))
    loads = Load("1:RX", torque=mean * RADII[0]), Load("2:RX", torque=-mean * RADII[1])
    teeth = Bushing("1:X", 1.0, 0.0, Grease(0.0, DAMPING), Contact(1.0), to="2:X")
    given = {"structure": Gears(inertias), "loads": loads, "shaker": Shaker("force", "1:RX"), **more}
    return Rig("gears", None, (teeth,), (Sensor(1, "1:X"), Sensor(2, "2:X")), **given)


def torque(level):
    """N m on gear 1 that excites the teeth as a force would."""
    return level * RADII[0] * MASSES[0]


PAIR = cm.Model(gears(), TEETH.law)
ORDERS = cm.Model(gears(orders=(Order("1:RX", 2, torque=torque(LOUD)),), spin=Spin(1.0)), TEETH.law)


def same(branch, teeth):
    """Transmission error and multipliers; gears have two more of 1, of turning together."""
    x, known = branch.clearance_displacement[-1, 0], teeth.clearance_displacement[-1, 0]
    np.testing.assert_allclose(x, known, rtol=0, atol=1e-6 * np.abs(known).max())
    for value in teeth.multipliers[-1]:
        assert np.abs(branch.multipliers[-1] - value).min() < 1e-5
    assert np.sum(np.abs(branch.multipliers[-1] - 1) < 5e-3) == 2
    assert branch.stable[-1] == teeth.stable[-1]


@pytest.mark.parametrize(("level", "omega"), [(QUIET, 0.6), (LOUD, 0.8)])
class TestAsTeeth:
    def test_response(self, level, omega):
        ends, follow = (1.8 / TURN, omega / TURN), cm.periodic.follow_response
        same(follow(PAIR, torque(level), ends, 41, 2048), follow(TEETH, level, ends, 41, 2048))

    def test_over_level(self, level, omega):
        ends, follow = np.array((0.05 * level, level)), cm.periodic.follow_response_over_level
        same(follow(PAIR, 1.5 / TURN, torque(ends), 41, 2048), follow(TEETH, 1.5 / TURN, ends, 41, 2048))

    def test_orders_are_a_force_so_many_times_in_a_turn(self, level, omega):
        branch = cm.periodic.follow_unbalance(ORDERS, (0.9, omega / 2), 41, 2048, factor=level / LOUD)
        assert TURN * branch.frequency[-1] == pytest.approx(omega / 2)
        known = cm.periodic.follow_response(TEETH, level, (1.8 / TURN, omega / TURN), 41, 2048)
        x, of_teeth = (np.abs(each.clearance_displacement[-1, 0]) for each in (branch, known))
        np.testing.assert_allclose(x, of_teeth, rtol=0, atol=1e-6)


def test_teeth_under_load_touch_at_rest():
    np.testing.assert_array_equal(cm.periodic.find_first_contact(PAIR, [0.1, 0.2]).value, 0)


def test_an_idler_rests_between_its_mates():
    """Each mesh carries the torque over its base radius; a small ripple leaves the teeth in contact."""
    inertias = tuple(Inertia(i, 1e-3 * i, 0.02 * i) for i in (1, 2, 3))
    gaps, filling, stiff = (1e-4, 3e-5), Grease(0.0, 1.0), Contact(1e6)
    meshes = tuple(Bushing(f"{i}:X", gap, 0.0, filling, stiff, to=f"{i + 1}:X") for i, gap in enumerate(gaps, 1))
    rig = Rig(
        "idler", None, meshes, (Sensor(1, "1:X"),), shaker=Shaker("force", "1:RX"),
        structure=Gears(inertias), loads=(Load("1:RX", torque=0.6), Load("3:RX", torque=-1.8)),
    )  # fmt: skip
    branch = cm.periodic.follow_response(cm.Model(rig), 0.01, (10.0, 20.0), 5)
    assert not branch.ended and branch.stable.all()
    np.testing.assert_allclose(branch.contact_force[-1, :, 0].real, 0.6 / 0.02, rtol=1e-6)
    np.testing.assert_allclose(branch.clearance_displacement[-1, :, 0].real, np.add(gaps, 30 / 1e6), rtol=1e-6)


# Stiffness over the mesh period


def test_a_mesh_moves_as_it_does_in_time(measured):
    """Fifth gear of a car under load, with one and two pairs of teeth; truth: the modal engine."""
    rig = Rig.load(ROOT / "models" / "gear_pair.toml")
    radii = [each.base_radius for each in rig.structure.inertias]
    loads = Load("1:RX", torque=100.0), Load("2:RX", torque=-100.0 * radii[1] / radii[0])
    driving = rig.replace(orders=(), loads=loads, spin=Spin(314.16))
    law = mesh_law(driving, teeth=35, contact_ratio=1.6)
    branch = cm.periodic.follow_unbalance(cm.Model(driving, law), (0.8 * 314.16, 314.16), 61, 2048)
    assert not branch.ended and branch.stable[-1]
    place, samples = histories(branch.clearance_displacement[-1, 0]), 2048
    period = TURN / (35 * 314.16)
    response = cm.simulate(driving, cm.excitation.still(400 * period, samples / period, "force"), law)
    last = response.displacement[0, -samples:]
    off = max(abs(place.max() - last.max()), abs(place.min() - last.min())) / np.ptp(last)
    what = "harmonic balance, mesh with one and two pairs of teeth: transmission error"
    measured.below(what, off, 1e-3, "modal march")


def test_orders_and_mesh_have_a_common_period():
    """An order of 2 beside a mesh of 3 teeth comes again after a turn; truth: the modal engine."""
    speed = 0.3
    rig = gears(spin=Spin(speed), orders=(Order("1:RX", 2, torque=torque(0.02)),))
    law = mesh_law(rig, teeth=3, contact_ratio=1.5, rise=0.1)
    branch = cm.periodic.follow_unbalance(cm.Model(rig, law), (0.4, speed), 41, 1024)
    assert TURN * branch.frequency[-1] == pytest.approx(speed) and branch.stable[-1]
    period, samples = TURN / speed, 4096
    response = cm.simulate(rig, cm.excitation.still(20 * period, samples / period, "force"), law)
    place, last = histories(branch.clearance_displacement[-1, 0]), response.displacement[0, -samples:]
    assert (last.min(), last.max()) == pytest.approx((place.min(), place.max()), abs=1e-3 * np.ptp(last))


def test_the_law_follows_the_speed():
    """A law given at another speed of the same gear is the same law."""
    t, k = np.array([0.0, 0.4, 0.5, 0.9]), np.array([[1.2], [1.2], [0.8], [0.8]])
    orbits_at = []
    for speed in (1.0, 3.0):
        law = TimeLaw(t * TURN / speed, k, np.zeros((4, 1)), period=TURN / speed)
        model = cm.Model(gears(spin=Spin(speed)), law)
        orbits_at.append(cm.periodic.follow_unbalance(model, (3.0, 2.5), 15).clearance_displacement[-1, 0])
    np.testing.assert_allclose(orbits_at[0], orbits_at[1], atol=1e-9)


def test_a_law_over_time_turns_with_the_shaft():
    law = TimeLaw(np.zeros(1), np.ones((1, 1)), np.zeros((1, 1)), period=TURN)
    for model in (cm.Model(gears(), law), cm.Model(gears(spin=Spin(1.0)), dataclasses.replace(law, period=None))):
        assert_refused(LawError, "turns with the shaft", cm.periodic.follow_unbalance, model, (1.0, 2.0))
    with pytest.raises(LawError, match="turns with the shaft"):
        cm.periodic.follow_response(cm.Model(gears(spin=Spin(1.0)), law), 0.1, (0.1, 0.2))
    assert_refused(RigError, "orders", cm.periodic.follow_unbalance, PAIR, (1.0, 2.0))


# Rattle maps


def kinds_of(place):
    """Which walls a history hits, as a number of IMPACTS."""
    upper, lower = place > 1, place < -1
    if upper.any() and lower.any():
        return 3
    return 1 if upper.all() else 2 if upper.any() else 0


@pytest.fixture(scope="module")
def mapped():
    levels, loads = torque(np.linspace(0.02, 0.4, 15)), np.linspace(0.8, 2.0, 5)
    return cm.periodic.map_impacts(PAIR, levels, [0.8 / TURN], loads, workers=1)


def test_cells_are_those_of_branches_over_level(mapped):
    assert mapped.unknown == 0 and set(np.unique(mapped.impacts)) >= {1, 2}
    for i, load in enumerate(mapped.load):
        model = cm.Model(gears(MEAN * load), PAIR.law)
        branch = cm.periodic.follow_response_over_level(model, 0.8 / TURN, torque(np.array((0.01, 0.42))))
        level = branch.level[:, 0].real
        for j, wanted in enumerate(mapped.level):
            at = np.flatnonzero((level[:-1] < wanted) != (level[1:] < wanted))
            assert at.size == mapped.vibrations[i, j, 0]
            for sweep, k in zip((0, 1), (at[0], at[-1])):
                ends = {kinds_of(histories(branch.clearance_displacement[n, 0])) for n in (k, k + 1)}
                assert mapped.impacts[sweep, i, j, 0] in ends


def test_impacts_begin_where_the_vibration_about_the_rest_loses_the_flank(mapped):
    """Where the amplitude F_a/|1 - ω² + 2iζω| of the teeth is the mean F_m (Kahraman and Singh)."""
    known = MEAN * mapped.load * abs(1 - 0.8**2 + 1j * DAMPING * 0.8)
    np.testing.assert_allclose(mapped.onset[:, 0], torque(known), rtol=2e-2)


def test_over_speed_and_ripple():
    """Without load the teeth cross the backlash; orders come twice in a turn."""
    impact_map = cm.periodic.map_impacts(ORDERS, np.linspace(0.1, 4.0, 12), np.linspace(0.2, 1.0, 9) / TURN, workers=1)
    assert impact_map.kind == "unbalance" and set(np.unique(impact_map.impacts)) >= {1, 2, 3}
    force = cm.periodic.map_impacts(PAIR, LOUD * torque(impact_map.level), 2 * impact_map.frequency, workers=1)
    np.testing.assert_array_equal(impact_map.impacts, force.impacts)
    assert impact_map.to_xarray().impacts.sel(sweep="up", load=1.0).shape == (12, 9) and len(IMPACTS) == 4
    assert impact_map.plot("down").axes
