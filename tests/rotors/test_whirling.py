"""Whirl out of responses: places in turned probes, parts at one speed, 1X of an unbalance beside the linear theory."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj import Bushing, Contact, Grease, RecordError, Rig, Sensor
from clearance_mj.rig import Spin, Unbalance
from clearance_mj.rotors import turning_shaft, whirl
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

from ..refusals import assert_refused

FS = 1024.0
STEEL = Material(2.1e11, 7800.0)


def rotor(**changes):
    """A disc of 3 kg on a shaft of 20 mm, in an empty bushing of 0.5 mm; softer along y at one end."""
    supports = Support(0.0, "pinned"), Support(1.0, translation=2e6, translation_y=1e6)
    disc = Disc(0.35, 3.0, 0.01, polar_inertia=0.02)
    shaft = Shaft((Section(1.0, (0.02, 0.02)),), supports, (disc,), STEEL, (20.0, 0.0))
    bushing = Bushing(0.6, 5e-4, 0.02, Grease(0.0, 0.0), Contact(2e6, 50.0), shape="round")
    given = {"spin": Spin(90.0), "unbalances": (Unbalance(0.35, 2e-5, 0.5),)} | changes
    return Rig("rotor", None, (bushing,), (Sensor(1, 0.35),), structure=shaft, **given)


def response(rig, displacement, spin):
    n = displacement.shape[1]
    return cm.Response(FS, np.zeros(n), np.zeros((1, n)), displacement, contact_share=np.zeros(1), spin=spin)


def test_the_1x_orbit_of_an_unbalance_is_that_of_the_linear_theory():
    """Ellipse of (ω² - Ω² + iΩ(C + ΩG)) q = Ω² f, y and z its real parts times e^(iθ): turning.under_unbalances."""
    rig = rotor()
    response = cm.simulate(rig, cm.excitation.still(6.0, FS), engine="modal")
    orbit = whirl(rig, response).between(4.0).orbits(0).filtered()
    shaft = turning_shaft(rig, 8)
    y, z = (shaft.shapes([0.6]) @ shaft.under_unbalances([90.0]))[0, :, 0]
    assert (orbit.y, orbit.z) == pytest.approx((y, z), rel=2e-3)
    assert 0.1 < orbit.minor / orbit.major < 0.99  # an ellipse that both planes make


def test_places_are_from_the_bushings_middle_along_y_and_z_whatever_the_probes():
    """Probes 30° from y and z read (cos y + sin z, cos z - sin y)."""
    changes = {"offset": -2e-4, "offset_y": 1e-4, "probe_angle": np.pi / 6}
    rig = rotor(spin=Spin(60.0)).replace(bushings=(dataclasses.replace(rotor().bushings[0], **changes),))
    time = np.arange(2048) / FS
    y, z = 3e-5 * np.cos(60 * time), 2e-5 * np.sin(60 * time)
    cos, sin = np.cos(np.pi / 6), np.sin(np.pi / 6)
    orbits_of = whirl(rig, response(rig, np.array([cos * y + sin * z, cos * z - sin * y]), np.full(2048, 60.0)))
    np.testing.assert_allclose(orbits_of.position[0], [y + 1e-4, z - 2e-4], atol=1e-18)
    assert orbits_of.names == ["bushing 1, x = 0.6 m"] and orbits_of.is_steady


def test_the_end_at_one_speed_and_the_part_that_changes():
    """A ramp from 50 to 100 rad/s in 2 s, then 2 s at 100: half a percent below it is reached at 1.98 s."""
    rig = rotor(spin=Spin(50.0, 25.0, 100.0))
    time = np.arange(4096) / FS
    orbits_of = whirl(rig, response(rig, np.zeros((2, 4096)), rig.spin.speed_at(time)))
    np.testing.assert_allclose(orbits_of.angle, rig.spin.angle_at(time), atol=1e-5)
    assert not orbits_of.is_steady
    assert orbits_of.ending(0.5).time[0] == pytest.approx(1.98, abs=2e-3)
    assert orbits_of.ending(3.0).time[0] == pytest.approx(time[-1] - 3.0, abs=2e-3)
    assert orbits_of.ending(0.1, turns=40).orbits(0).time.size >= 40
    assert orbits_of.changing.time[[0, -1]] == pytest.approx([0.0, 2.0], abs=2e-3)
    marks = orbits_of.orbits(0).time
    cut = orbits_of.between(1.0)
    assert cut.orbits(0).time[0] == pytest.approx(marks[marks >= 1.0][0], abs=1e-9)  # the marks stay where they are
    assert_refused(RecordError, r"7 to inf s: no samples; there are some from 0 to 3\.99902 s", orbits_of.between, 7.0)


def test_what_has_no_orbits_is_refused():
    still, rig = rotor(spin=None, unbalances=()), rotor()
    orbits_of = whirl(still, response(still, np.zeros((2, 64)), None))
    assert_refused(RecordError, "rig 'rotor' does not turn, and has no orbits by turn", orbits_of.orbits, 0)
    for of, rows, words in (
        (rig, 1, r"has 1 rows of displacements; 1 bushings need 301:\+Y, 301:\+Z"),
        (still.with_shape(None), 2, 'moves along z alone and has no orbits; give its bushings shape = "round"'),
        (rig.replace(bushings=()), 2, "has no round bushings in which its shaft could whirl"),
    ):
        assert_refused(RecordError, words, whirl, of, response(rig, np.zeros((rows, 64)), None))
