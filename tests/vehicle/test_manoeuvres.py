"""Manoeuvres that controllers are compared on: gates of the standard, room at the cones, needed accelerations."""

import itertools

import numpy as np
import pytest

from clearance_mj.core.errors import ManoeuvreError
from clearance_mj.vehicle import manoeuvres
from clearance_mj.vehicle.experiment import Case, check
from clearance_mj.vehicle.nominal import Vehicle
from clearance_mj.vehicle.path import lane_changes

from ..refusals import assert_refused

WIDTH, LENGTH = 1.61, 4.508  # m, of the vehicle


def test_gates_of_part_2():
    """ISO 3888-2:2011, table 1: 12, 13.5, 11, 12.5 and 12 m, 61 m in all; 1 m between the first two gates' edges."""
    first, second, third = manoeuvres.iso3888_2_gates(1.8)
    borders = [border for gate in (first, second, third) for border in (gate.start, gate.end)]
    np.testing.assert_allclose(np.diff(borders), [12, 13.5, 11, 12.5, 12])
    assert third.end - first.start == 61
    assert [gate.width for gate in (first, second, third)] == pytest.approx([2.23, 2.8, 3.0])
    assert manoeuvres.iso3888_2_gates(2.2)[2].width == pytest.approx(1.3 * 2.2 + 0.25)
    edges = [(gate.centre - gate.width / 2, gate.centre + gate.width / 2) for gate in (first, second, third)]
    assert (edges[1][0] - edges[0][1], edges[2][0]) == pytest.approx((1.0, edges[0][0]))


@pytest.mark.parametrize(("path", "gates", "room"), [
    (manoeuvres.iso_lane_change(), manoeuvres.iso3888_gates(WIDTH), 0.0),
    (manoeuvres.iso_lane_change(2.0), manoeuvres.iso3888_gates(WIDTH, 2.0), 0.0),
    (manoeuvres.obstacle_avoidance(), manoeuvres.iso3888_2_gates(WIDTH), 0.0),
    (manoeuvres.swift_obstacle_avoidance(), manoeuvres.iso3888_2_gates(WIDTH), 0.1),
], ids=["part 1", "part 1 x 2", "part 2", "part 2, swift"])  # fmt: skip
def test_corners_stay_within_the_gates(path, gates, room):
    """A vehicle that follows the path exactly keeps its four corners at least so far from every cone."""
    s = np.linspace(0, path.length, 40001)
    heading = path.heading(s)
    ahead, left = np.stack((np.cos(heading), np.sin(heading))), np.stack((-np.sin(heading), np.cos(heading)))
    inside = 0
    for front, side in itertools.product((LENGTH / 2, -LENGTH / 2), (WIDTH / 2, -WIDTH / 2)):
        x, y = path.position(s) + front * ahead + side * left
        for gate in gates:
            within = (x > gate.start) & (x < gate.end)
            inside += within.sum()
            assert np.all(np.abs(y[within] - gate.centre) <= gate.width / 2 - room)
    assert inside > 1000


def test_slalom_passes_beside_the_cones():
    path = manoeuvres.slalom(30.0, 1.5, 4)
    for cone in range(4):
        _, off, heading, curvature = path.locate(30.0 * cone, (-1) ** cone * 1.5)
        assert abs(off) < 1e-8 and abs(heading) < 1e-8
        assert curvature == pytest.approx(-((-1) ** cone) * 1.5 * (np.pi / 30) ** 2, rel=1e-6)


def test_paths_have_no_corner():
    """Heading and curvature are continuous: between samples 5 mm apart they change by what their slopes allow."""
    for name, manoeuvre in manoeuvres.MANOEUVRES.items():
        path = manoeuvre.path()
        s = np.arange(0, path.length, 0.005)
        np.testing.assert_allclose(np.diff(path.heading(s)), 0.005 * path.curvature(s[:-1] + 0.0025), atol=1e-7)
        assert np.abs(np.diff(path.curvature(s))).max() < 2e-4, name


CLOSED_FORMS = {
    "lane-change": (10 / np.sqrt(3) * 3.5 / 60**2 * 25.0**2, 0.01),
    "slalom": (1.2 * (np.pi / 36) ** 2 * (80 / 3.6) ** 2, 1e-4),
    "gusts": ((80 / 3.6) ** 2 / 200, 1e-9),
    "on-centre": (0.0, 0.0),
    # A change by h over a length L between gates; slopes of up to 0.3 take a share of it.
    "obstacle-40": (10 / np.sqrt(3) * 3.3155 / 20.25**2 * (40 / 3.6) ** 2, 0.05),
    "obstacle-60": (10 / np.sqrt(3) * 3.42 / 26.09**2 * (60 / 3.6) ** 2, 0.04),
}


@pytest.mark.parametrize("name", manoeuvres.MANOEUVRES)
def test_needed_accelerations(name):
    """κ v² with the largest curvature of the closed form, which the friction of the worst vehicle's tyres allows."""
    manoeuvre = manoeuvres.MANOEUVRES[name]
    needed, tolerance = CLOSED_FORMS[name]
    acceleration = manoeuvre.path().needed_acceleration(manoeuvre.speed / 3.6)
    assert acceleration == pytest.approx(needed, rel=tolerance)
    assert acceleration < 0.8 * Vehicle.bmw320i().tyre.friction * 9.81
    check(Case("smc", manoeuvre.speed, manoeuvre=name))


@pytest.mark.parametrize(("refused", "message"), [
    (lambda: manoeuvres.get_manoeuvre("moose"), 'manoeuvre "moose" is unknown; use lane-change, slalom, obstacle-40'),
    (lambda: check(Case("smc", 80.0, manoeuvre="moose")), 'manoeuvre "moose" is unknown'),
    (lambda: check(Case("smc", 80.0, manoeuvre="slalom", length_factor=2.0)), 'manoeuvre "slalom" has none'),
    (lambda: check(Case("smc", 160.0, manoeuvre="slalom")), r"path 'slalom' needs .* 18\.\d m/s²"),
    (lambda: manoeuvres.single_lane_change(0.0), "length must be > 0"),
    (lambda: manoeuvres.slalom(amplitude=-1.0), "amplitude must be > 0"),
    (lambda: manoeuvres.iso3888_2_gates(0.0), "width must be > 0"),
    (lambda: lane_changes("back", [(0, 10, 1), (5, 20, 0)], -5, 30), "no lane change from X = 5 to 20 m after 10"),
])  # fmt: skip
def test_refusals(refused, message):
    assert_refused(ManoeuvreError, message, refused)
