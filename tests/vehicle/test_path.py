"""Paths against their closed forms, quadrature, Fresnel integrals and finite differences."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import fresnel

from clearance_mj.core.errors import ManoeuvreError
from clearance_mj.vehicle import manoeuvres
from clearance_mj.vehicle.manoeuvres import clothoid_arc, double_lane_change, iso3888_gates, iso_lane_change, straight

from ..refusals import assert_refused

PATHS = {
    "double lane change": double_lane_change(), "long double lane change": double_lane_change(2.5),
    "ISO 3888-1": iso_lane_change(), "clothoid-arc": clothoid_arc(), "straight": straight(80.0),
}  # fmt: skip
every_path = pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)


def lane_change(x, factor):
    """Y, heading and curvature of the double lane change, written out for one position."""
    y = slope = bend = 0.0
    for sign, dx, dy, start in ((1, 25, 4.05, 27.19), (-1, 21.95, 5.7, 56.46)):
        a = 2.4 / (factor * dx)
        z = a * (x - factor * start) - 1.2
        y += sign * dy / 2 * (1 + np.tanh(z))
        slope += sign * dy * (1.2 / (factor * dx)) / np.cosh(z) ** 2
        bend -= sign * dy * a**2 * np.tanh(z) / np.cosh(z) ** 2
    return y, np.arctan(slope), bend / (1 + slope**2) ** 1.5


@pytest.mark.parametrize("factor", [1.0, 2.5])
def test_double_lane_change_is_the_closed_form(factor):
    path = double_lane_change(factor)
    s = np.random.default_rng(0).uniform(0, path.length, 2000)
    x, y = path.position(s)
    np.testing.assert_allclose((y, path.heading(s), path.curvature(s)), lane_change(x, factor), atol=1e-8)


def test_arc_length_of_the_double_lane_change():
    path = double_lane_change()
    ends = [0.0, 40.0, 90.0, path.length]

    def rate(x):
        return np.sqrt(1 + np.tan(lane_change(x, 1.0)[1]) ** 2)

    x = path.position(ends)[0]
    for a, b, sa, sb in zip(x, x[1:], ends, ends[1:]):
        assert quad(rate, a, b, epsabs=1e-12, limit=200)[0] == pytest.approx(sb - sa, abs=1e-8)


@every_path
def test_heading_and_curvature_by_finite_differences(path):
    """Central differences, at places where no clothoid or quintic begins within the step."""
    s, h = np.linspace(1.0, path.length - 1.0, 997) + 0.0123, 1e-4
    dx, dy = (path.position(s + h) - path.position(s - h)) / (2 * h)
    np.testing.assert_allclose(np.hypot(dx, dy), 1, atol=1e-6)
    np.testing.assert_allclose(np.arctan2(dy, dx), path.heading(s), atol=1e-6)
    np.testing.assert_allclose((path.heading(s + h) - path.heading(s - h)) / (2 * h), path.curvature(s), atol=1e-6)


def test_clothoid_is_fresnels():
    """x = a C(s/a), y = a S(s/a), a = √(π R L), from the clothoid's beginning."""
    radius, length, lead = 200.0, 60.0, 30.0
    path = clothoid_arc(radius, length, lead=lead)
    s, a = np.linspace(0, length, 301), np.sqrt(np.pi * radius * length)
    sine, cosine = fresnel(s / a)
    x, y = path.position(lead + s)
    np.testing.assert_allclose((x - lead, y), (a * cosine, a * sine), atol=1e-9)
    np.testing.assert_allclose(path.heading(lead + s), s**2 / (2 * radius * length), atol=1e-12)


@every_path
@pytest.mark.parametrize("guess", ["near", "far", None])
def test_foot_point(path, guess):
    """A point put beside the path is found where it was put, wherever the search begins."""
    generator = np.random.default_rng(1)
    for s, off in zip(generator.uniform(0, path.length, 300), generator.uniform(-4, 4, 300)):
        x, y = path.position(s)
        heading = float(path.heading(s))
        begin = {"near": s + generator.uniform(-2, 2), "far": path.length - s, None: None}[guess]
        foot = path.locate(x - off * np.sin(heading), y + off * np.cos(heading), begin)
        assert foot == pytest.approx((s, off, heading, float(path.curvature(s))), abs=1e-7)


def test_straight_beyond_the_ends():
    path = clothoid_arc(tail=10.0)
    end, heading = path.position(path.length), float(path.heading(path.length))
    ahead = end + 7 * np.array([np.cos(heading), np.sin(heading)])
    np.testing.assert_allclose(path.position(path.length + 7), ahead, rtol=1e-12)
    assert path.locate(*ahead) == pytest.approx((path.length + 7, 0, heading, 0), abs=1e-7)
    assert path.locate(-5.0, 1.0) == pytest.approx((-5, 1, 0, 0), abs=1e-7)
    np.testing.assert_array_equal(path.curvature([-1.0, path.length + 1]), 0)


@pytest.mark.parametrize(("factor", "speed", "needed"), [(1, 72, 10.9), (1, 120, 30.1), (2.5, 120, 5.02)])
def test_needed_acceleration(factor, speed, needed):
    """Largest curvature times speed squared, from a dense grid of the closed form."""
    curvature = lane_change(np.linspace(-30 * factor, 125 * factor, 200001), factor)[2]
    acceleration = double_lane_change(factor).needed_acceleration(speed / 3.6)
    assert acceleration == pytest.approx(np.abs(curvature).max() * (speed / 3.6) ** 2, rel=1e-4)
    assert acceleration == pytest.approx(needed, rel=6e-3)


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_gates_of_part_1(factor):
    gates = iso3888_gates(1.61, factor)
    assert [g.end - g.start for g in gates] == [factor * l for l in (15, 25, 30)]
    assert [b.start - a.end for a, b in zip(gates, gates[1:])] == [factor * l for l in (30, 25)]


@pytest.mark.parametrize("make", [double_lane_change, iso_lane_change, straight, clothoid_arc])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_sizes(make, value):
    assert_refused(ManoeuvreError, "must be > 0", make, value)


check_feasible = manoeuvres.check_feasible
INFEASIBLE = r"30\.1 m/s² at 120 km/h.*allows 10\.3; drive at most 70 km/h"


@pytest.mark.parametrize(("call", "arguments", "message"), [
    (check_feasible, (double_lane_change(), 120 / 3.6, 1.0489), INFEASIBLE),
    *((check_feasible, (straight(10.0), v, 1.0), "speed must be in 18..180") for v in (0, -3, 100, np.nan)),
    (straight(10.0).locate, (float("nan"), 0.0), "not finite"),
])  # fmt: skip
def test_refusals(call, arguments, message):
    check_feasible(double_lane_change(), 15.0, 1.0489)
    assert_refused(ManoeuvreError, message, call, *arguments)
