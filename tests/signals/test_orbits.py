"""Orbits turn by turn and the ellipses in them: of motions that are known in closed form."""

from pathlib import Path

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.core.errors import RecordError
from clearance_mj.signals import Response, orbits_by_turn, shaft_angle

from ..refusals import assert_refused

FS = 2000.0
TIME = np.arange(4000) / FS
RAMP = 2 * np.pi * (8 + 6 * TIME)  # rad/s: from 8 to 20 turns a second in 2 s, 28 turns
ANGLE = shaft_angle(RAMP, FS, 0.3)


def moved(w, angle=ANGLE, **settings):
    return orbits_by_turn(w.real, w.imag, FS, angle, **settings)


def test_the_angle_of_a_ramp_is_exact():
    np.testing.assert_allclose(ANGLE, 0.3 + 2 * np.pi * (8 * TIME + 3 * TIME**2), rtol=1e-12)


def test_marks_are_where_the_shaft_has_made_whole_turns():
    """θ = 2π k at t = (-8 + √(64 + 12 (k - 0.3/2π)))/6, k = 1 to 28; the last mark ends the last turn."""
    turns_of = moved(np.exp(1j * ANGLE))
    turns = np.arange(1, 28)
    np.testing.assert_allclose(turns_of.time, (-8 + np.sqrt(64 + 12 * (turns - 0.3 / (2 * np.pi)))) / 6, atol=1e-7)
    assert turns_of.position.shape == (27, 2, 128)
    np.testing.assert_allclose(turns_of.speed[0], 2 * np.pi * (8 + 6 * turns_of.time[:2].mean()), rtol=1e-4)


def test_an_ellipse_that_goes_with_the_shaft_has_its_axes_phase_and_sense():
    """Semi-axes 5 and 2, 0.4 rad from y; on its larger axis when the mark is 0.9 rad past; whatever the speed does."""
    a, b, lean, lag = 5e-5, 2e-5, 0.4, 0.9
    turn = ANGLE - lag
    for sense in (1, -1):
        w = 1e-5 - 3e-5j + np.exp(1j * lean) * (a * np.cos(turn) + sense * 1j * b * np.sin(turn))
        ellipse = moved(w).filtered()
        assert (ellipse.major, ellipse.minor) == pytest.approx((a, b), rel=1e-6)
        assert ellipse.inclination == pytest.approx(lean, abs=1e-6)
        assert ellipse.sense == pytest.approx(sense * 2 * a * b / (a**2 + b**2), rel=1e-6)
        assert ellipse.centre == pytest.approx(1e-5 - 3e-5j, rel=1e-6)
        assert np.abs(ellipse.forward) == pytest.approx((a + sense * b) / 2, rel=1e-6)
        path = ellipse.path(721) - np.array([[1e-5], [-3e-5]])
        assert np.hypot(*path).max() == pytest.approx(a, rel=1e-4)
        assert np.argmax(np.hypot(*path)) % 360 == pytest.approx(np.degrees(2 * lag), abs=2)  # half degrees
    y = moved(5e-5 * np.cos(ANGLE - lag) + 0j).filtered()
    assert np.angle(y.y) == pytest.approx(-lag, abs=1e-6)
    assert np.abs(y.y) == pytest.approx(5e-5, rel=1e-6)
    assert np.abs(y.z) == pytest.approx(0.0, abs=1e-12)
    assert y.sense == pytest.approx(0.0, abs=1e-9)


def test_multiples_are_told_apart_and_forward_is_with_the_spin_either_way():
    w = 3e-5 * np.exp(1j * ANGLE) + 1e-5 * np.exp(-2j * ANGLE)
    for mirrored, angle in ((w, ANGLE), (w.conj(), -ANGLE)):  # the other one turns from z to y
        turns_of = moved(mirrored, angle)
        assert np.sign(turns_of.speed).tolist() == [np.sign(angle[-1])] * turns_of.speed.size
        once, twice = turns_of.filtered(1), turns_of.filtered(2)
        assert (once.sense, twice.sense) == (pytest.approx(1.0, abs=1e-6), pytest.approx(-1.0, abs=1e-6))
        assert (once.major, twice.major) == (pytest.approx(3e-5, rel=1e-6), pytest.approx(1e-5, rel=1e-6))


def test_an_amplitude_that_grows_with_speed_is_had_turn_by_turn():
    """Run-ups: F of every turn is the amplitude at the turn's middle, to second order in a turn."""
    turns_of = moved(1e-6 * RAMP * np.exp(1j * (ANGLE + 0.5)))
    forward, backward = turns_of.harmonic()
    np.testing.assert_allclose(np.abs(forward), 1e-6 * turns_of.speed, rtol=2e-3)
    np.testing.assert_allclose(np.angle(forward), 0.5, atol=2e-2)
    assert np.abs(backward).max() < 0.05 * np.abs(forward).max()


def test_the_last_turns_and_their_marks():
    np.testing.assert_allclose(moved(np.exp(1j * ANGLE)).last(3).marks, [[1, 1, 1], [0, 0, 0]], atol=1e-4)
    assert moved(np.exp(1j * ANGLE)).last(99).time.size == 27


def test_what_has_no_turns_is_refused():
    still = np.zeros(4000)
    assert_refused(RecordError, "does not turn in one sense", orbits_by_turn, still, still, FS, np.cos(4 * TIME))
    with pytest.raises(RecordError, match="makes no whole turn from mark to mark in 2 s"):
        orbits_by_turn(still, still, FS, 0.1 + TIME)
    assert_refused(RecordError, "a turn has less than 4 samples", orbits_by_turn, still, still, FS, 4000 * TIME)
    assert_refused(RecordError, "order 64: must be 1 to 63", moved(np.exp(1j * ANGLE)).filtered, 64)


def test_the_figure_shows_wall_orbit_marks_and_ellipse_in_micrometres():
    (ax,) = moved(2e-5 * np.exp(1j * ANGLE)).last(2).plot(gap=5e-5).axes
    once, marks, path, wall = (np.array(line.get_data()) for line in ax.get_lines())
    np.testing.assert_allclose(np.hypot(*path), 20.0, rtol=1e-4)
    np.testing.assert_allclose(np.hypot(*once), 20.0, rtol=1e-4)
    np.testing.assert_allclose(np.hypot(*wall), 50.0)
    np.testing.assert_allclose(marks, [[20.0, 20.0], [0.0, 0.0]], atol=1e-2)
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_aspect()) == ("y (µm)", "z (µm)", 1.0)
    assert ax.get_title("left").startswith("2 turns at ")


def test_a_response_in_space_names_its_rows_and_keeps_its_spin():
    rows = 1e-5 * np.arange(4.0)[:, None] * np.ones(100)
    spin = np.linspace(10.0, 20.0, 100)
    still = np.zeros((1, 100))
    response = Response(FS, still[0], still, rows, 0 * rows, 0 * rows, contact_share=np.zeros(2), spin=spin)
    assert response.clearance_rows == [slice(0, 2), slice(2, 4)]
    again = Response.from_xarray(response.to_xarray())
    assert again == response and again.clearance_rows == response.clearance_rows
    assert response.to_xarray()["displacement"].dims == ("coordinate", "time")
    axes = {ax.get_ylabel(): ax for ax in response.plot().axes}
    names = [line.get_label() for line in axes["Displacement (mm)"].get_lines()]
    assert names == ["bushing 1, y", "bushing 1, z", "bushing 2, y", "bushing 2, z"]
    shown = axes["Spin (rev/min)"].get_lines()[0].get_ydata()
    np.testing.assert_allclose(shown[[0, -1]], [95.493, 190.986], rtol=1e-4)
    plane = Response(FS, np.zeros(100), np.zeros((1, 100)), rows[:2], contact_share=np.zeros(2))
    assert plane.clearance_rows == [slice(0, 1), slice(1, 2)]
    assert plane.to_xarray()["displacement"].dims == ("coordinate", "time")


def test_rows_of_clearances_have_the_labels_of_their_probes_and_older_files_load():
    """Slots have one row, round clearances two; files of before call the dimension of slots "bushing"."""
    rig = cm.Rig.load(Path(__file__).parents[2] / "models" / "table1_rig.toml")
    for shape, labels in ((None, ("6:+Z", "7:+Z")), ("round", ("6:+Y", "6:+Z", "7:+Y", "7:+Z"))):
        response = cm.simulate(rig.with_shape(shape), cm.excitation.random(0.1, 2048.0, seed=0), engine="modal")
        data = response.to_xarray()
        assert response.coordinates == labels == tuple(data["contact_force"]["coordinate"].values)
        assert Response.from_xarray(data) == response
    before = Response.from_xarray(response.to_xarray().drop_vars("coordinate"))
    assert before.coordinates == () and np.array_equal(before.displacement, response.displacement)
    plane = cm.simulate(rig, cm.excitation.random(0.1, 2048.0, seed=0), engine="modal")
    older = plane.to_xarray().drop_vars("coordinate")
    shares = older["contact_share"].rename(bushing="share")
    older = older.drop_vars("contact_share").rename(coordinate="bushing")
    older["contact_share"] = shares.rename(share="bushing")
    assert np.array_equal(Response.from_xarray(older).contact_force, plane.contact_force)
