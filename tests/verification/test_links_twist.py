"""Twist of the links engine's chains against closed forms of Saint-Venant's torsion, and beside the modal engine."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import brentq

import clearance_mj as cm
from clearance_mj.engines import build_links
from clearance_mj.engines.linkage import linkage
from clearance_mj.rig import Bushing, Contact, Grease, Load, PointMass, Rig, Sensor, Shaker, Spin
from clearance_mj.structure import Disc, Section, Shafts, Spring, Support
from clearance_mj.structure.reduction import vibration_modes

from ..physical.stepping import mass_matrix
from ..structure.test_twist import SHEAR, SPEED, STEEL, polar, shaft

STEPS = (0.0, 0.5, 0.02), (0.5, 1.2, 0.03), (1.2, 1.5, 0.012)  # m from, to, diameter


def rig(structure, at, **more):
    """A rig with a torque of 1 N m."""
    more = {"sensors": (Sensor(1, f"@{at}:RX", quantity="angle"),)} | more
    return Rig("twist", None, more.pop("bushings", ()), structure=structure, loads=(Load(at, torque=1.0),), **more)


STEPPED = shaft(*(Section(end - start, d) for start, end, d in STEPS))


def compliance(x):
    """rad/(N m) of the stepped shaft between its clamp and x."""
    return sum(max(0.0, min(x, end) - start) / (SHEAR * polar(d)) for start, end, d in STEPS)


def twisting(of, links):
    """Natural frequencies, 1/s, of twist, which bending does not couple to."""
    whole = linkage(of, links)
    rows = np.concatenate([np.arange(whole.size)[member.part] for member in whole.along("x")])
    free = whole.free[rows][:, whole.free[rows].any(axis=0)]
    assert not np.delete(whole.mass[rows], rows, axis=1).any()
    mass, stiffness = (matrix[np.ix_(rows, rows)] for matrix in (whole.mass, whole.whole_stiffness))
    return vibration_modes(free.T @ mass @ free, free.T @ stiffness @ free).omega


@pytest.mark.parametrize("at", [0.5, 0.83, 1.5])
@pytest.mark.parametrize("links", [12, 15, 16])
def test_static_twist_of_a_stepped_shaft(at, links):
    """T ∫ dx/(GJ) up to the torque, and no more behind it, anywhere on the shaft."""
    whole, x = linkage(rig(STEPPED, at), links), np.linspace(0.01, 1.5, 40)
    angle = np.linalg.solve(whole.whole_stiffness, whole.along_own([f"@{at}:RX"])[0])
    twists = [compliance(min(place, at)) for place in x]
    np.testing.assert_allclose(whole.along_own([f"@{place!r}:RX" for place in x.tolist()]) @ angle, twists, rtol=1e-9)
    rate = whole.along_own(["@0.3:KX", "@1.49:KX"]) @ angle
    behind = 1 / (SHEAR * polar(0.012)) * (at == 1.5)
    np.testing.assert_allclose(rate, [1 / (SHEAR * polar(0.02)), behind], rtol=1e-6, atol=1e-12)


def test_frequencies_of_a_clamped_shaft(measured):
    """ω = (2n - 1) π/2L √(G/ρ) (Blevins, 1979, table 8-16), of second order, as the links' docstring tells."""
    of, exact = rig(shaft(Section(1.2, 0.02)), 1.2), (2 * np.arange(1, 3) - 1) * np.pi / 2.4 * SPEED
    errors = {n: np.abs(twisting(of, n)[:2] / exact - 1) for n in (8, 16, 32, 64)}
    measured.below("f1 and f2 of twist, 16 links: error", errors[16].max(), 5e-3, "Blevins, table 8-16")
    order = np.log2(errors[32] / errors[64])
    measured.above("order of convergence of twist, 32 to 64 links", order.min(), 1.98, "Blevins, table 8-16")
    assert errors[64][0] == pytest.approx((np.pi / 2 / 64) ** 2 / 22.4, rel=0.01)


def test_frequencies_of_a_stepped_shaft():
    """Clamped and free, of two diameters: J1 = J2 tan(ω l1/c) tan(ω l2/c), from angle and torque at the step."""
    (l1, d1), (l2, d2) = (0.7, 0.03), (0.5, 0.02)

    def equation(omega):
        return polar(d2) * np.tan(omega * l1 / SPEED) * np.tan(omega * l2 / SPEED) - polar(d1)

    exact = brentq(equation, 100.0, 0.999 * np.pi / 2 * SPEED / l1)
    assert twisting(rig(shaft(Section(l1, d1), Section(l2, d2)), 1.2), 24)[0] == pytest.approx(exact, rel=1e-3)


def test_discs_on_a_shaft_that_nothing_holds():
    """Two discs and a light shaft: 0 and √(k (1/I1 + 1/I2)); an inertia at RX, and springs of supports."""
    light = dataclasses.replace(STEEL, density=1e-3)
    discs = Disc(0.0, 1.0, 2e-3), Disc(0.8, 1.0, 1e-3, polar_inertia=1.5e-3)
    pins = Support(0.0, "pinned"), Support(0.8, "pinned")
    free = shaft(Section(0.8, 0.02), supports=pins, discs=discs, material=light)
    stiffness = SHEAR * polar(0.02) / 0.8
    omega = twisting(rig(free, 0.8), 16)
    np.testing.assert_allclose(omega[:2], [0, np.sqrt(stiffness * (1 / 4e-3 + 1 / 1.5e-3))], rtol=1e-5, atol=1e-2)
    heavier = rig(free, 0.8, masses=(PointMass("@0.8:RX", 3e-3),))
    np.testing.assert_allclose(twisting(heavier, 16)[1], np.sqrt(stiffness * (1 / 4e-3 + 1 / 4.5e-3)), rtol=1e-5)
    for supports in ((Support(0.0, "pinned", twist=900.0),), (Support(0.0, "pinned"), Support(0.8, twist=900.0))):
        whole = linkage(rig(dataclasses.replace(free, supports=supports, discs=()), 0.4), 16)
        twist = whole.along("x")[0].part
        force, at_spring = whole.along_own(["@0.4:RX", f"@{supports[-1].position}:RX"])[:, twist]
        at_spring = at_spring @ np.linalg.solve(whole.whole_stiffness[twist, twist], force)
        np.testing.assert_allclose(at_spring, 1 / 900, rtol=1e-9)


def test_supports_that_hold_the_twist(measured):
    """Clamped at both ends: n π/L √(G/ρ); the right end is an equality in MuJoCo, which holds."""
    ends = Support(0.0, "clamped"), Support(1.0, "pinned", twist="rigid")
    of = rig(shaft(Section(1.0, 0.02), supports=ends, rayleigh=(2.0, 1e-6)), 0.4, shaker=Shaker("force", "@0.4:RX"))
    np.testing.assert_allclose(twisting(of, 32)[:2], np.pi * np.arange(1, 3) * SPEED, rtol=3e-3)
    torque = cm.excitation.random(0.02, 20000.0, band=(100, 900), rms=2.0, seed=2, kind="force")
    links, modal = (cm.simulate(of, torque, engine=e).channels[0] for e in ("links", "modal"))
    np.testing.assert_allclose(links, modal, rtol=0, atol=0.02 * np.ptp(modal))
    still = cm.Excitation(np.zeros(10), 20000.0, "force")
    rest = [cm.simulate(of, still, engine=e).channels[0, 0] for e in ("links", "modal")]
    np.testing.assert_allclose(rest, 0.4 * 0.6 / (SHEAR * polar(0.02)), rtol=1e-8)


def test_mujoco_has_the_same_matrices():
    """Mass matrix by mj_fullM, stiffness and damping of the joints, in the order of the coordinates."""
    of = rig(dataclasses.replace(STEPPED, rayleigh=(0.0, 1e-5)), 1.5)
    whole, model = linkage(of, 12), build_links(of, 12).compile()
    mass = mass_matrix(model)
    np.testing.assert_allclose(whole.mass, mass, rtol=0, atol=1e-12 * mass.max())
    np.testing.assert_allclose(model.jnt_stiffness, whole.stiffness, rtol=1e-12)
    np.testing.assert_allclose(model.dof_damping, 1e-5 * whole.stiffness, rtol=1e-12)


def gears(**more):
    """Two shafts that mesh, by a spring or a clearance, whose torques are equal and opposite at rest."""
    parts = tuple(shaft(Section(0.5, 0.02), name=name, rayleigh=(5.0, 1e-6)) for name in "ab")
    springs = more.pop("springs", ())
    sensors = tuple(Sensor(i, f"{s}@0.5:RX", quantity="angle") for i, s in enumerate("ab", 1))
    return Rig("gears", None, structure=Shafts(parts, springs), sensors=sensors, **{"bushings": ()} | more)


def test_a_spring_between_two_shafts_shares_a_torque():
    """k/(c + k) of a torque goes over a spring k to a shaft as stiff, where the first one's own is c in parallel."""
    torsion, spring = SHEAR * polar(0.02) / 0.5, 2e3
    of = gears(springs=(Spring("a@0.5:RX", spring, "b@0.5:RX"),), loads=(Load("a@0.5:RX", torque=3.0),))
    channels = cm.simulate(of, cm.Excitation(np.zeros(20), 2048.0, "base"), engine="links").channels[:, 0]
    through = 3.0 / (2 + torsion / spring)
    np.testing.assert_allclose(channels, [(3.0 - through) / torsion, through / torsion], rtol=1e-9)


def test_teeth_between_two_shafts_rattle_as_modes_do():
    teeth = Bushing("a@0.5:RX", 1e-3, 0.0, Grease(5.0, 0.02), Contact(4e3, 0.3), to="b@0.5:RX")
    of = gears(bushings=(teeth,), loads=(Load("a@0.5:RX", torque=2.0),), shaker=Shaker("force", "a@0.5:RX"))
    model = build_links(of, 8).compile()
    assert (model.npair, model.ntendon) == (0, 2)
    drive = cm.Excitation(25.0 * np.sin(2 * np.pi * 150.0 * np.arange(1600) / 40000.0), 40000.0, "force")
    links, modal = (cm.simulate(of, drive, engine=e) for e in ("links", "modal"))
    assert np.ptp(np.sign(modal.contact_force)) == 2  # on both flanks
    for name, allowed_error in (("displacement", 1e-2), ("contact_force", 3e-2)):
        by_modes = getattr(modal, name)
        assert np.std(getattr(links, name) - by_modes) < allowed_error * np.std(by_modes)


def test_a_shaft_that_turns_in_a_round_bushing_twists_too():
    """A torque twists it by T x/(GJ), and it bends as its modes do."""
    round_one = Bushing(0.4, 1e-4, 0.0, Grease(500.0, 3.0), Contact(5e4, 5.0), shape="round")
    structure = shaft(Section(0.8, 0.015), rayleigh=(1.0, 1e-6))
    y, z = (Sensor(i, 0.8, direction=along) for i, along in ((2, (0.0, 1.0, 0.0)), (3, (0.0, 0.0, 1.0))))
    of = rig(structure, 0.8, bushings=(round_one,), spin=Spin(100.0), gravity=(0.0, 0.0, -9.81))
    of = of.replace(sensors=(*of.sensors, y, z), shaker=Shaker(direction=(0.0, 1.0, 1.0)))
    noise = cm.excitation.random(0.1, 4096.0, band=(5, 400), rms=4.0, seed=4)
    links, modal = (cm.simulate(of, noise, engine=e) for e in ("links", "modal"))
    for response, allowed_error in ((links, 1e-9), (modal, 1e-6)):
        np.testing.assert_allclose(response.channels[0], 0.8 / (SHEAR * polar(0.015)), rtol=allowed_error)
    np.testing.assert_allclose(links.displacement, modal.displacement, rtol=0, atol=0.02 * np.ptp(modal.displacement))
