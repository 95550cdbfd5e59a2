"""Twist of shafts, and points on shafts with directions: frequencies, static angles, slopes and curvatures."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import brentq

from clearance_mj import Bushing, Contact, Grease, Rig, RigError, Sensor, Shaker, linear_model
from clearance_mj.structure import Beam, Clamp, Disc, Material, Section, Shaft, Shafts, Spring, Support, beam
from clearance_mj.structure.attached import Attached, FixtureMode, PointMass
from clearance_mj.structure.base import in_other_plane, moved, parse_direction, parse_place
from clearance_mj.structure.reduction import vibration_modes

from ..refusals import assert_refused

STEEL = Material(210e9, 7850.0)
SHEAR = STEEL.young_modulus / (2 * (1 + STEEL.poisson_ratio))
SPEED = np.sqrt(SHEAR / STEEL.density)  # m/s, of waves of twist
CLAMPED = (Support(0.0, "clamped"),)


def shaft(*sections, supports=CLAMPED, **more):
    return Shaft(sections, supports, **{"material": STEEL, "theory": "euler"} | more)


def polar(diameter):
    return np.pi * diameter**4 / 32


def twisting(structure, n, at):
    """Lowest n frequencies, 1/s, of twist, whose coordinates no deflection moves and which move none."""
    linear = structure.assemble((at,), n)
    along = [(s.name, x) for s in structure.shafts for x in np.linspace(s.start, s.end, 50)]
    twists = np.any(linear.rows([f"{name}@{x}:RX" for name, x in along]), axis=0)
    assert not linear.mass[twists][:, ~twists].any() and not linear.stiffness[twists][:, ~twists].any()
    return vibration_modes(linear.mass[twists][:, twists], linear.stiffness[twists][:, twists]).omega[:n]


def deflected(structure, load, points):
    """Static motions of points under a unit force or moment."""
    linear = structure.assemble((load,), 8)
    return linear.rows(points) @ np.linalg.solve(linear.stiffness, linear.rows([load])[0])


def roots(equation, highest, n):
    """First n roots of a smooth equation, found on a fine grid."""
    grid = np.linspace(1e-9, highest, 20000)
    value = equation(grid)
    where = np.flatnonzero(value[:-1] * value[1:] < 0)[:n]
    return np.array([brentq(equation, grid[i], grid[i + 1], xtol=1e-14 * highest) for i in where])


def test_points():
    assert parse_place("@0.4:RX") == ("", 0.4) and parse_place("inner@.5:-Z") == ("inner", 0.5)
    directions = {"inner@.5:-Z": ("Z", -1), "@0.4:KY": ("KY", 1), "12:-RZ": ("RZ", -1), "inner@0.4": None}
    assert {point: parse_direction(point) for point in directions} == directions
    assert moved("in@0.5:-RX", 0.25) == "in@0.75:-RX" and moved(0.5, 0.25) == 0.75
    others = {"@1.0:Y": "@1.0:Z", "a@1.0:RZ": "a@1.0:-RY", "@1.0:-RY": "@1.0:RZ", "@1.0:Z": "@1.0:Y"}
    assert {point: in_other_plane(point) for point in others} == others
    assert [in_other_plane(point) for point in (0.5, "a@1")] == [0.5, "a@1"]


def test_clamped_and_free_shaft():
    """ω = (2n - 1) π/2L √(G/ρ); Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-16."""
    exact = (2 * np.arange(1, 9) - 1) * np.pi / 2 / 1.2 * SPEED
    clamps = {}, {"clamp": Clamp(rotation=1e4, translation=1e6)}
    beams = (Beam(1.2, 210e9, 7850.0, 0.03, **clamp) for clamp in clamps)
    for structure in (shaft(Section(1.2, 0.02, 0.01)), *beams):
        np.testing.assert_allclose(twisting(structure, 8, "@1.2:RX"), exact, rtol=1e-12)


def test_free_shaft_turns_as_a_rigid_body():
    hz = twisting(shaft(Section(1.0, 0.02), supports=(Support(0.0, "pinned"), Support(1.0, "pinned"))), 4, "@0:RX")
    np.testing.assert_allclose(hz, np.arange(4) * np.pi * SPEED, rtol=1e-12, atol=1e-3)


def test_stepped_shaft():
    """Clamped and free, of two diameters: J1 tan(ω l2/c) tan(ω l1/c) J2/J1 = 1 from angle and torque at the step."""
    l1, l2, ratio = 0.5, 0.8, polar(0.03) / polar(0.02)
    t1, t2 = l1 / SPEED, l2 / SPEED
    exact = roots(lambda w: np.cos(w * t1) * np.cos(w * t2) - ratio * np.sin(w * t1) * np.sin(w * t2), 60e3, 6)
    np.testing.assert_allclose(twisting(shaft(Section(l1, 0.02), Section(l2, 0.03)), 6, "@1.3:RX"), exact, rtol=1e-11)


def test_two_discs_on_a_light_shaft():
    """ω = √(k (1/J1 + 1/J2)) with k = G J / L; Den Hartog, Mechanical Vibrations, 1956, section 5.2."""
    discs, held = (Disc(0.0, 1.0, 1e-3), Disc(0.5, 1.0, 4e-3, polar_inertia=5e-3)), (Support(0.0, "pinned"),)
    light = shaft(Section(0.5, 0.02), material=Material(210e9, 1e-3), supports=held, discs=discs)
    exact = np.sqrt(SHEAR * polar(0.02) / 0.5 * (1 / 2e-3 + 1 / 5e-3))
    hz = twisting(light, 2, "@0.5:RX")
    assert hz[0] < 1e-3 * exact
    np.testing.assert_allclose(hz[1], exact, rtol=1e-6)


def test_two_discs_on_a_heavy_shaft():
    """(β1 + β2) λ cos λ = (β1 β2 λ² - 1) sin λ, with β = J/(ρ I_p L) and λ = ω L/c, from the torques of both discs."""
    heavy = shaft(Section(0.5, 0.04), supports=(), discs=(Disc(0.0, 1.0, 2e-4), Disc(0.5, 1.0, 7e-4)))
    b1, b2 = np.array([4e-4, 14e-4]) / (STEEL.density * polar(0.04) * 0.5)
    exact = roots(lambda k: (b1 + b2) * k * np.cos(k) - (b1 * b2 * k**2 - 1) * np.sin(k), 20.0, 5) * SPEED / 0.5
    np.testing.assert_allclose(twisting(heavy, 6, "@0.5:RX")[1:], exact, rtol=1e-11)


def test_springs_of_twist():
    """Two discs of a rigid shaft on one spring: ω = √(k/ΣJ); a spring to the base and one between two shafts."""
    light = {"material": Material(2e11, 1e-3), "discs": (Disc(0.0, 1.0, 1e-3),)}
    stub = shaft(Section(0.01, 0.1), supports=(Support(0.0, "pinned", twist=50.0),), **light)
    np.testing.assert_allclose(twisting(stub, 1, "@0:RX"), np.sqrt(50.0 / 2e-3), rtol=1e-6)
    parts = tuple(dataclasses.replace(stub, name=name, supports=(Support(0.0, "pinned"),)) for name in "ab")
    pair = Shafts(parts, (Spring("a@0:RX", 50.0, "b@0:RX"),))
    np.testing.assert_allclose(twisting(pair, 2, "b@0:RX")[1], np.sqrt(2 * 50.0 / 2e-3), rtol=1e-6)
    damped = dataclasses.replace(stub, supports=(Support(0.0, "pinned", twist=50.0, twist_damping=0.1),))
    linear = damped.assemble(("@0:RX",), 4)
    row = np.linalg.solve(linear.mass, linear.rows(["@0:RX"])[0])
    np.testing.assert_allclose(row @ linear.viscous @ row, 0.1 / 2e-3**2, rtol=1e-6)


def test_static_twist_and_its_rate():
    """T L/(G J) at the end, T x/(G J) before it, T/(G J) per length; nothing deflects."""
    tapered = Section(0.6, (0.02, 0.04))
    points = ["@1.0:RX", "@0.3:-RX", "@0.3:KX", 1.0, "@1.0:RY"]
    twist = deflected(shaft(Section(0.4, 0.02), tapered), "@1.0:RX", points) * SHEAR * polar(0.02)
    along = 0.6 / 3 * (1 + 1 / 2 + 1 / 4) / 2  # of a cone: L/3 (1/d1³ - 1/d2³)/(d2 - d1), over that of d1
    np.testing.assert_allclose(twist, [0.4 + along, -0.3, 1.0, 0.0, 0.0], rtol=1e-9, atol=1e-12)
    of_beam = deflected(Beam(1.0, 210e9, 7850.0, 0.02), "@0.5:RX", points[:2]) * SHEAR * polar(0.02)
    np.testing.assert_allclose(of_beam, [0.5, -0.3], rtol=1e-12)


@pytest.mark.parametrize(("ratio", "constant"), [(1.0, 0.1406), (2.0, 0.229), (10.0, 0.312)])
def test_torsion_of_rectangles(ratio, constant):
    """J = k b a³; Timoshenko & Goodier, Theory of Elasticity, 1970, section 109, table."""
    for sides in ({"width": 0.01, "height": 0.01 * ratio}, {"height": 0.01, "width": 0.01 * ratio}):
        section = Section(1.0, **sides).across(np.array([0.5]), 0.3)
        np.testing.assert_allclose(section.torsion_constant, constant * ratio * 0.01**4, rtol=2e-3)
        np.testing.assert_allclose(section.polar_moment, ratio * (1 + ratio**2) / 12 * 0.01**4, rtol=1e-12)


@pytest.mark.parametrize("theory", ["beam", "euler", "timoshenko"])
def test_slopes_and_curvatures(theory):
    """F L²/(2EI) and -M at the tip by the right-hand rule, F (L - x)/(EI); of Timoshenko's, rotation of the section."""
    bending = 210e9 * np.pi * 0.02**4 / 64
    one = Beam(1.5, 210e9, 7850.0, 0.02) if theory == "beam" else shaft(Section(1.5, 0.02), theory=theory)
    points = ["@1.5:RY", "@0.5:RY", "@0:KZ", "@0.75:KZ", "@0.75:Y", "@0.75:RZ", "@0.75:RX"]
    slopes = [-(1.5**2) / 2, -(1.5**2 - 1) / 2]
    shape_of_load = deflected(one, 1.5, points) * bending
    np.testing.assert_allclose(shape_of_load, [*slopes, 1.5, 0.75, 0.0, 0.0, 0.0], rtol=1e-8, atol=1e-9)
    # A moment about y at the tip bends it towards -z with the curvature -M/(EI) everywhere (Betti: -L²/2 at the tip).
    np.testing.assert_allclose(deflected(one, "@1.5:RY", [1.5, "@0.4:KZ"]) * bending, [-(1.5**2) / 2, -1.0], rtol=1e-8)


def test_curvature_of_a_mode():
    """That of the printed cantilever mode: Y'' and -Y' in closed form, on the shaft's elements and on the beam's."""
    at = np.array([0.0, 0.3, 0.77])
    exact = beam.cantilever_mode(at, 3, order=2)
    for one in (Beam(1.0, 210e9, 7850.0, 0.02), shaft(Section(1.0, 0.02))):
        linear = one.assemble((), 8)
        _, shapes = vibration_modes(linear.mass, linear.stiffness)
        size = np.sqrt(7850.0 * np.pi / 4 * 0.02**2) * np.sign(linear.rows([1.0]) @ shapes[:, :3])
        size *= np.sign(beam.cantilever_mode([1.0], 3))
        curvature = linear.rows([f"@{x}:KZ" for x in at]) @ shapes[:, :3] * size
        np.testing.assert_allclose(curvature, exact, rtol=1e-6, atol=1e-6)
        step = 1e-6
        slope = (beam.cantilever_mode(at + step, 3) - beam.cantilever_mode(at - step, 3))[1:] / (2 * step)
        curvature = linear.rows([f"@{x}:RY" for x in at[1:]]) @ shapes[:, :3] * size
        np.testing.assert_allclose(curvature, -slope, rtol=1e-6)


def test_planes_in_space():
    """A strip: a force along y and a moment about z bend it in its other plane by 1/(3EI) and 1/(2EI), L = 1."""
    strip = shaft(Section(1.0, width=0.02, height=0.01))
    rig = Rig("strip", None, (), (Sensor(1, "@1.0:RX"), Sensor(2, "@1:RZ")), structure=strip)
    forces = ("@1.0:Y", "@1.0:Z", "@1.0:RX")
    inertias = {"@1.0:Y": 210e9 * 0.01 * 0.02**3 / 12, "@1.0:Z": 210e9 * 0.02 * 0.01**3 / 12}
    for force in forces:
        model = linear_model(rig.replace(shaker=Shaker("force", force)), 12)
        q = model.push() / model.omega**2
        y, z, about_x, about_y, about_z = model.directed([*forces, "@1.0:RY", "@1.0:RZ"], np.array([0.0, 0.0, 1.0])) @ q
        stiffness = inertias.get(force, np.inf)
        expected = {"@1.0:Y": (1 / 3, 0, 0, 0, 1 / 2), "@1.0:Z": (0, 1 / 3, 0, -1 / 2, 0)}.get(force, (0, 0, 0, 0, 0))
        twist = (force == "@1.0:RX") / (SHEAR * 0.229 * 0.02 * 0.01**3)
        np.testing.assert_allclose([y, z, about_y, about_z], np.delete(expected, 2) / stiffness, rtol=1e-9, atol=1e-18)
        np.testing.assert_allclose(about_x, twist, rtol=2e-3)
    assert rig.sensor_labels == ["1:+RX", "2:+RZ"]
    mass = linear_model(rig.replace(masses=(PointMass("@1.0:Y", 5.0),)), 12)
    bare = linear_model(rig, 12)
    assert mass.omega[mass.planes[0].span][0] < 0.6 * bare.omega[bare.planes[0].span][0]
    np.testing.assert_array_equal(mass.omega[mass.planes[1].span], bare.omega[bare.planes[1].span])


def test_feet_of_a_rocking_base():
    attached = Attached(fixture=(FixtureMode(50.0, rocking=2.0, about=0.1, participation=0.5),))
    feet = [attached.foot_motion(point)[0] for point in (0.4, "@0.4:-Z", "@0.4:RY", "@0.4:RX")]
    np.testing.assert_allclose(feet, [0.5 + 2 * 0.3, -0.5 - 2 * 0.3, -2.0, 0.0])


RIG = Rig("shaft", None, (), (Sensor(1, 0.5),), structure=shaft(Section(1.0, 0.02)))
TEETH = Bushing("@0.5:RX", 1e-3, 0.0, Grease(0.0), Contact(1e5))


@pytest.mark.parametrize(("changes", "message"), [
    ({"sensors": (Sensor(1, "@0.5:X"),)}, '"@0.5:X": a shaft does not move along X; give Y, Z, RX'),
    ({"shaker": Shaker("force", "@0:RX")}, '"@0:RX" cannot twist: the support there holds it; give'),
    ({"bushings": (dataclasses.replace(TEETH, length=0.1),)}, "bushings[0].length must be 0, as its position is a"),
    ({"bushings": (dataclasses.replace(TEETH, to=0.9),)}, "one is an angle, one a length"),
    ({"bushings": (dataclasses.replace(TEETH, shape="round"),)}, "bushings[0].position names RX, but it moves"),
])  # fmt: skip
def test_refused(changes, message):
    assert message in assert_refused(RigError, None, RIG.replace, **changes)


def test_damper_of_a_twist_that_is_held():
    with pytest.raises(RigError, match="twist_damping has no effect, as the support allows no twist"):
        Support(0.0, "clamped", twist_damping=1.0)
    assert not Support(0.0, "clamped", twist=10.0).holds_twist and Support(0.0, "pinned", twist="rigid").holds_twist
