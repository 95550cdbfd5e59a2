"""Rattle maps in space: beside closed forms of a Jeffcott rotor, the planar map, branches of single levels."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import clearance_mj as cm
from clearance_mj import ClearanceError, ExcitationError, RigError, periodic
from clearance_mj.engines import static_equilibrium
from clearance_mj.periodic import arcs
from clearance_mj.periodic.map_rows import solver_at
from clearance_mj.rig import Friction, Shaker, Spin
from clearance_mj.rotors import synchronous_rub

from ..conftest import ROOT, TABLE1
from ..refusals import assert_refused
from .jeffcott import FREQUENCY, GAP, MASS, STIFFNESS, jeffcott, replaced, unbalanced
from .test_known_answers import same_maps

HZ = FREQUENCY / (2 * np.pi)
ECCENTRICITY, DAMPING, CONTACT = 0.2, 0.1, 20.0
FILLED = 0.9252, 1.1032
"""Speeds at which the free circle e ω²/|1 - ω² + i c ω| of m = k = δ = 1, c = 0.1, e = 0.2 has the gap's radius"""
NEAR = np.linspace(0.9245, 0.926, 16), np.linspace(1.1025, 1.104, 16), (1.0, 4.32, 4.34)
SPEEDS = np.unique(np.concatenate((np.linspace(0.85, 4.6, 61), *NEAR)))
RUBS = {0.0: (1.008635, 4.328), 0.1: (1.008109, 2.999)}
"""By friction: radius at ω = 1 and end of the branch, of [(k + k_c - ω²) r - k_c]² + [(c ω + μ k_c) r - μ k_c]² =
(e ω²)² with k_c = 20"""
SAMPLED = 1 - np.cos(np.pi / 64)
"""By which a sine's amplitude may be too small of 16 samples for each harmonic, of 3 harmonics and the mean"""


@pytest.fixture(scope="module", params=RUBS)
def swept(request):
    """Friction, and the map over speed at a half and the whole of the unbalance."""
    model = cm.Model(unbalanced(jeffcott(friction=request.param)))
    return request.param, periodic.map_rattle(model, (0.05, 1.0), SPEEDS * HZ, n_harmonics=3, workers=1)


def test_first_contact_is_that_of_the_free_circle(swept):
    _, swept_map = swept
    free = ECCENTRICITY * SPEEDS**2 / np.hypot(1 - SPEEDS**2, DAMPING * SPEEDS)
    assert_allclose(swept_map.first_contact[0], 1 / free, rtol=1e-6)
    above = swept_map.first_contact[0] - 1.0
    at = np.flatnonzero(above[1:] * above[:-1] < 0)
    assert_allclose(SPEEDS[at] - above[at] * np.diff(SPEEDS)[at] / np.diff(above)[at], FILLED, rtol=1e-4)
    assert not swept_map.rattles[0, 0].any()
    assert_allclose(swept_map.displacement[:, 0, 0, :, 0], np.tile(0.05 * free * GAP, (2, 1)), rtol=1e-4)


def test_a_synchronous_rub_is_a_circle(swept):
    """At ω = 1 and all along the upper branch; what touches, touches all the time, with k_c (r - δ)."""
    friction, swept_map = swept
    i = int(np.searchsorted(SPEEDS, 1.0))
    radius, end = RUBS[friction]
    assert_allclose(swept_map.displacement[:, 0, 1, i, 0] / GAP, radius, rtol=5e-5)
    rubs = (SPEEDS > 0.93) & (SPEEDS < 0.99 * end)
    rig = unbalanced(jeffcott(friction=friction))
    rub = synchronous_rub(rig, SPEEDS[rubs] * FREQUENCY, 0.5, ECCENTRICITY * MASS * GAP, friction, n_modes=8)
    upper = np.nanmax(rub.radius, axis=1)
    assert_allclose(swept_map.displacement[0, 0, 1, rubs, 0], upper, rtol=5e-5)
    assert_allclose(swept_map.penetration[0, 0, 1, rubs, 0], upper - GAP, atol=5e-5 * upper[-1])
    accelerated = upper * (SPEEDS[rubs] * FREQUENCY) ** 2
    assert_allclose(swept_map.acceleration[0, 0, 1, rubs, 0], accelerated, rtol=1.5 * SAMPLED)
    pushed = CONTACT * STIFFNESS * (upper - GAP) * np.hypot(1, friction)
    assert_allclose(swept_map.contact_force[0, 0, 1, rubs, 0], pushed, atol=CONTACT * STIFFNESS * 5e-5 * upper[-1])
    assert np.all(swept_map.contact_share[0, 0, 1, rubs] == 1)


def test_sweeps_jump_where_the_rub_ends_and_where_the_free_circle_fills_the_gap(swept):
    friction, swept_map = swept
    jumps = {jump.sweep: jump for jump in swept_map.jumps}
    assert len(swept_map.jumps) == 2 and {jump.level for jump in swept_map.jumps} == {1.0}
    end = RUBS[friction][1]
    assert_allclose(jumps["up"].frequency / HZ, end, rtol=3e-4)
    assert_allclose(jumps["down"].frequency / HZ, FILLED[1], rtol=1e-4)
    assert swept_map.unknown == 0 and not swept_map.ended
    touches = swept_map.contact_share[:, 0, 1, :, 0] > 0
    clear = np.abs(SPEEDS[:, None] - np.array((*FILLED, end))).min(axis=1) > 2e-3
    assert_array_equal(touches[0][clear], ((SPEEDS > FILLED[0]) & (SPEEDS < end))[clear])
    assert_array_equal(touches[1][clear], ((SPEEDS > FILLED[0]) & (SPEEDS < FILLED[1]))[clear])
    assert_array_equal(swept_map.vibrations[0, 1][clear], np.where((SPEEDS > FILLED[1]) & (SPEEDS < end), 3, 1)[clear])


def test_figure_and_dataset_say_what_unbalance_is(swept):
    _, swept_map = swept
    (axes, *_) = swept_map.plot().axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("turns in a second (Hz)", "unbalance over the rig's")
    assert swept_map.kind == "unbalance" and swept_map.to_xarray().first_contact.attrs["units"] == "1"
    assert swept_map.clearances == ("1:+Z",) and swept_map.displacement.shape == (2, 1, 2, SPEEDS.size, 1)


def test_first_contact_of_an_orbit_beside_the_middle():
    """A circle of radius ρ beside the middle by s touches where s + ρ = δ, a line across s where s² + ρ² = δ²."""
    sag = 0.3
    speeds = np.array((0.5, 0.7, 1.6))
    heavy = jeffcott().replace(gravity=(0.0, 0.0, -sag * GAP * FREQUENCY**2))
    circles = periodic.map_rattle(cm.Model(unbalanced(heavy)), (0.1,), speeds * HZ, n_harmonics=1, workers=1)
    free = ECCENTRICITY * speeds**2 / np.hypot(1 - speeds**2, DAMPING * speeds)
    assert_allclose(circles.first_contact[0], (1 - sag) / free, rtol=1e-5)
    sideways = heavy.replace(shaker=Shaker("force", 0.5, direction=(0.0, 1.0, 0.0)))
    lines = periodic.map_rattle(cm.Model(sideways), (0.01,), speeds * HZ, n_harmonics=1, workers=1)
    per_newton = 1 / (STIFFNESS * np.hypot(1 - speeds**2, DAMPING * speeds))
    assert_allclose(lines.first_contact[0], np.sqrt(1 - sag**2) * GAP / per_newton, rtol=1e-5)
    assert_allclose(lines.displacement[0, 0, 0, :, 0], 0.01 * per_newton, rtol=4 * SAMPLED)


def test_a_planar_rig_in_space_has_the_planar_map():
    frequencies = np.linspace(36.0, 48.0, 31)
    models = cm.Model(TABLE1), cm.Model(TABLE1.with_shape("round"))
    plane, space = (periodic.map_rattle(m, (1.0, 6.0), frequencies, n_harmonics=7, workers=1) for m in models)
    assert len(plane.jumps) == 2
    same_maps(space, plane, jumps=1e-5, cells=1e-3)


def test_a_cell_is_what_a_branch_comes_to():
    """Weight, friction and a steady spin, a shaken base: from below for a sweep upwards, with what the branch knows."""
    rig = replaced(TABLE1.with_shape("round"), offset_y=1e-4, friction=Friction(0.2))
    rig = rig.replace(gravity=(0.0, 2.0, -9.81), spin=Spin(50.0))
    frequencies = np.linspace(36.0, 40.0, 5)
    rattle = periodic.map_rattle(cm.Model(rig), (6.0,), frequencies, n_harmonics=5, workers=1)
    branch = periodic.follow_response(cm.Model(rig), 6.0, (36.0, 39.0), 5, stability=False)
    assert_allclose(rattle.displacement[0, 0, 0, 3], branch.excursion()[-1], rtol=1e-3)
    assert_allclose(rattle.acceleration[0, 0, 0, 3], branch.amplitude()[-1], rtol=5e-3, atol=1e-3)
    assert rattle.rattles[0, 0, 3]


def test_a_shaft_that_rests_on_its_bushing():
    """models/rotor.toml, both of whose ends touch at rest: its place is that of the static equilibrium."""
    rig = cm.Rig.load(ROOT / "models" / "rotor.toml")
    rattle = periodic.map_rattle(cm.Model(rig), (0.01,), (14.0, 16.0), n_harmonics=3, workers=1)
    assert rattle.rattles.all() and not rattle.ended
    assert_array_equal(rattle.first_contact, 0.0)
    speed = 2 * np.pi * 15.0
    rest = static_equilibrium(rig.replace(spin=Spin(speed))).displacement
    branch = periodic.follow_unbalance(cm.Model(rig), (speed, 1.01 * speed), 3, stability=False, factor=1e-3)
    assert_allclose(branch.clearance_displacement[0, :, 0].real, rest, atol=1e-4 * np.abs(rest).max())


def test_a_branch_under_a_multiple_of_the_unbalance():
    """In the gap it is as many times as large; its level says so."""
    given = cm.Model(unbalanced(jeffcott())), (0.5 * FREQUENCY, 0.6 * FREQUENCY)
    one, half = (periodic.follow_unbalance(*given, 3, stability=False, factor=factor) for factor in (1.0, 0.5))
    assert_allclose(half.excursion()[[0, -1]], 0.5 * one.excursion()[[0, -1]], rtol=1e-6)
    assert_allclose(np.abs(half.level), 0.5)
    words = "factor of the unbalances must be > 0, got 0"
    assert_refused(ExcitationError, words, periodic.follow_unbalance, *given, factor=0)


@pytest.mark.parametrize("where", ["on an executor", pytest.param("with more workers", marks=pytest.mark.slow)])
def test_it_is_the_same_elsewhere(where):
    model = cm.Model(unbalanced(jeffcott(friction=0.1)))
    speeds = np.linspace(0.9, 3.2, 6) * HZ
    with ThreadPoolExecutor(2) as pool:
        one, other = (
            periodic.map_rattle(model, (0.5, 1.0), speeds, gaps=[GAP, 2 * GAP], n_harmonics=1, **workers)
            for workers in ({"workers": 1}, {"executor": pool} if where == "on an executor" else {"workers": 2})
        )
    for name in ("vibrations", "contact_share", "displacement", "acceleration", "first_contact"):
        assert_array_equal(getattr(one, name), getattr(other, name))
    assert one.jumps == other.jumps and len(one.jumps) > 1


@pytest.mark.parametrize(("rig", "change", "error", "words"), [
    (TABLE1, {"kind": "unbalance"}, RigError, "rig 'table1' does not turn; give"),
    (jeffcott(), {"kind": "unbalance"}, RigError, "has no unbalances; give"),
    (jeffcott(), {"kind": "sound"}, ExcitationError, 'or "unbalance" of what turns with the shaft'),
    (jeffcott(), {"amplitudes": (0.0, 1.0)}, ExcitationError, "amplitudes must be > 0"),
    (unbalanced(jeffcott()), {"kind": "force"}, ExcitationError, "unbalances and orders at their own speed"),
    (jeffcott(spin=Spin(10.0, rate=5.0)), {}, RigError, "needs a steady speed"),
    (jeffcott(bushings=()), {}, ClearanceError, "has no clearance"),
])  # fmt: skip
def test_refusals(rig, change, error, words):
    given = {"amplitudes": (1.0,), "frequencies": (10.0, 20.0), "workers": 1, **change}
    assert_refused(error, words, periodic.map_rattle, cm.Model(rig), **given)


def test_a_curve_that_ends_and_is_not_met_from_above(monkeypatch):
    """What was found from below stays, and where it ended is said."""
    omega = 2 * np.pi * np.linspace(6.0, 8.0, 5)
    solver = solver_at(cm.Model(unbalanced(jeffcott())), "unbalance", 1.0, float(omega[-1]), 3, 64, 2)
    z, y = arcs.without_contact(solver, omega)
    kept = arcs.ArcVibrations(np.arange(2), z[:2], y[:2])
    monkeypatch.setattr(arcs, "linear_in_gap", lambda solver: False)
    monkeypatch.setattr(arcs, "_continued_links", lambda *_: iter([arcs._Link((arcs.LOW, arcs.BROKEN), kept)]))
    assert_array_equal(arcs.curve(solver, omega).order.cell, [0, 1])


def test_a_corner_that_shows_as_a_fold_too_is_one_jump():
    """The Jeffcott rotor's, whose arc turns back 4e-7 from its corner with one kind of sums and not with another."""
    corner, up = (61.115, False), (239.76, True)
    folds = ((61.115 * (1 - 4e-7), False), (61.115 * (1 - 4e-7), True), (61.2, False), up)
    assert list(arcs._folds_off_corners(folds, (corner,))) == [folds[1], folds[2], up]
    assert list(arcs._folds_off_corners(folds, ())) == list(folds)
