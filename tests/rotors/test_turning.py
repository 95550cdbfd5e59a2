"""Turning shafts against closed forms: an overhung disc, a Jeffcott rotor with rotating damping, unbalance."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose

from clearance_mj import Bushing, Contact, Grease, Rig, RigError, Sensor
from clearance_mj.beam import natural_frequencies
from clearance_mj.rig import Spin, Unbalance
from clearance_mj.rotors import campbell, turning_shaft
from clearance_mj.structure import Disc, Material, Section, Shaft, Spring, Support
from clearance_mj.structure.attached import Planes

from ..conftest import TABLE1
from ..refusals import assert_refused
from ..verification.page import Measured

YOUNG = 2.1e11
LIGHT = Material(YOUNG, 1e-2)
INERTIA, PINS = 0.02, (Support(0.0, "pinned"), Support(1.0, "pinned"))


def a_rig(shaft: Shaft, **changes: object) -> Rig:
    return Rig("rotor", None, (), (Sensor(1, shaft.end),), structure=shaft).replace(**changes)


def overhung(**of_disc: float) -> Rig:
    disc = Disc(0.3, 2.0, **{"inertia": INERTIA, **of_disc})
    return a_rig(Shaft((Section(0.3, (0.02, 0.02)),), (Support(0.0, "clamped"),), (disc,), LIGHT, theory="euler"))


def jeffcott(rayleigh: tuple[float, float] = (0.0, 0.0), **of_support: float) -> Rig:
    supports = tuple(Support(x, "elastic", **of_support) for x in (0.0, 1.0)) if of_support else PINS
    sections = (Section(1.0, (0.02, 0.02)),)
    return a_rig(Shaft(sections, supports, (Disc(0.5, 3.0),), LIGHT, rayleigh, theory="euler"))


BENDING = YOUNG * np.pi * 0.02**4 / 64
JEFFCOTT = np.sqrt(48 * BENDING / 3.0)
OVERHUNG = BENDING * np.array([[12 / 0.3**3, -6 / 0.3**2], [-6 / 0.3**2, 4 / 0.3]])
"""Stiffness of the deflection and slope of the overhung disc"""


@pytest.mark.parametrize("polar", [0.04, 0.01])
@pytest.mark.parametrize(("spin", "spring"), [(0.0, 0.0), (200.0, 0.0), (900.0, 0.0), (900.0, 2e4)])
def test_the_gyroscopic_pairs_of_an_overhung_disc(polar: float, spin: float, spring: float, measured: Measured) -> None:
    """det [k11 - m ω², k12; k12, k22 - I ω² + J Ω ω] = 0, with ω > 0 forward and ω < 0 backward whirl.

    A spring from the disc to the base is part of k11.
    """
    k = OVERHUNG + np.diag([spring, 0.0])
    # In e^(iωt): mass INERTIA ω², gyroscopic J Ω ω, as a polynomial in ω.
    translation, tilt = np.array([-2.0, 0.0, k[0, 0]]), np.array([-INERTIA, polar * spin, k[1, 1]])
    roots = np.roots(np.polysub(np.polymul(translation, tilt), [k[0, 1] ** 2])).real
    rig = overhung(polar_inertia=polar)
    shaft = turning_shaft(rig.replace(springs=(Spring(0.3, spring),)) if spring else rig)
    poles = shaft.poles(spin)
    want = roots[np.argsort(np.abs(roots))]
    apart = np.abs(poles.value.imag[:4] / np.abs(want) - 1).max()
    held = f", {spring:g} N/m to the base" if spring else ""
    what = f"overhung disc, J {polar:g} kg m², {spin:g} rad/s{held}: four frequencies, error"
    measured.below(what, apart, 1e-4, "2 x 2 closed form")
    if spin:
        assert_allclose(shaft.sense(poles.motion[:, :4]), np.sign(want), atol=1e-6)


def test_critical_speeds_are_where_the_campbell_diagram_meets_the_spin() -> None:
    shaft = turning_shaft(overhung(polar_inertia=0.01))
    speeds = shaft.critical_speeds[:4]
    for speed in speeds:
        assert np.min(np.abs(shaft.poles(speed).value.imag / speed - 1)) < 1e-6
    # A thin disc's forward tilting mode runs away from the spin: one critical speed less.
    thin, limit = turning_shaft(overhung()).critical_speeds, 1.5 * speeds[3]
    assert (thin < limit).sum() < (shaft.critical_speeds < limit).sum()


@pytest.mark.parametrize("outer, turning", [(4.0, 2e-5), (1.0, 1e-4), (0.0, 5e-5)])
def test_damping_that_turns_makes_a_jeffcott_rotor_whirl(outer: float, turning: float, measured: Measured) -> None:
    """Ω = ω (1 + c_e/c_i), with c_e = η1 m and c_i = η2 k."""
    ratio = outer / (turning * JEFFCOTT**2)
    diagram = campbell(jeffcott((outer, turning)), np.linspace(0.0, 2.5 * JEFFCOTT * (1 + ratio), 12), n=2)
    assert diagram.threshold is not None
    what = f"damping that turns, c_e/c_i = {ratio / JEFFCOTT:.3g}: threshold over ω"
    measured.equal(what, diagram.threshold / JEFFCOTT, 1 + ratio, "1 + c_e/(c_i ω)", rel=1e-4)
    growing = diagram.damping_ratio[:, -1] < 0
    assert_allclose(diagram.sense[growing, -1], 1.0, atol=1e-6)


def test_standing_damping_alone_is_stable_at_any_speed() -> None:
    assert campbell(jeffcott((4.0, 0.0)), np.linspace(0, 10 * JEFFCOTT, 5), n=2).threshold is None


def test_supports_that_differ_split_the_planes_and_hold_back_the_whirl() -> None:
    """k of each plane: shaft and supports in series; unequal ones raise the threshold (Tondl, 1965)."""
    stiff, soft = 4e5, 1e5
    rig = jeffcott(translation=stiff, translation_y=soft)
    want = [np.sqrt(1 / (1 / (48 * BENDING) + 1 / (2 * k)) / 3.0) for k in (soft, stiff)]
    assert_allclose(turning_shaft(rig).poles(0.0).value.imag[:2], want, rtol=1e-4)
    assert_allclose(natural_frequencies(rig, 1), want[1] / (2 * np.pi), rtol=1e-4)
    damped = turning_shaft(jeffcott(translation=1e9, translation_damping=0.0, translation_damping_y=2e3)).poles(0.0)
    assert (np.abs(damped.value.real[:2]) > 1e-6).tolist() in ([True, False], [False, True])
    rigs = (jeffcott((1.0, 1e-4), translation=stiff, translation_y=other) for other in (stiff, soft))
    alike, apart = (turning_shaft(rig).threshold(np.linspace(0, 3000, 31)) for rig in rigs)
    assert alike is not None and (apart is None or apart > 1.05 * alike)


def test_strong_dampers_at_supports_need_few_modes() -> None:
    """A rigid clamp's limit: a damper of 1e9 N s/m in the middle leaves the antisymmetric modes of pinned halves."""
    supports, steel = (*PINS, Support(0.5, "elastic", translation_damping=1e9)), Material(YOUNG, 7800.0)
    rig = a_rig(Shaft((Section(1.0, (0.02, 0.02)),), supports, (), steel, theory="euler"))
    value = turning_shaft(rig, 6).poles(0.0).value
    still = value.imag[np.abs(value.real) < 1e-3 * np.abs(value)]
    wave = np.sqrt(BENDING / (7800.0 * np.pi * 0.01**2))
    roots = np.array([np.pi, 3.92660231])  # of a half that is pinned at the damper; that is clamped there
    assert_allclose(np.unique(np.round(still, 2))[:2], (roots / 0.5) ** 2 * wave, rtol=2e-3)


@pytest.mark.parametrize("spin", [0.5, 0.98, 1.02, 3.0])
def test_unbalance_of_a_jeffcott_rotor(spin: float) -> None:
    """r = m e Ω²/(k - m Ω² + i Ω c_e), circular and forward: damping that turns sees no velocity in it."""
    outer, moment, omega = 4.0, 3e-5, spin * JEFFCOTT
    want = moment * omega**2 / (3.0 * (JEFFCOTT**2 - omega**2 + 1j * outer * omega))
    turning = {"spin": Spin(omega), "unbalances": (Unbalance(0.5, moment),)}
    shaft = turning_shaft(jeffcott((outer, 2e-5)).replace(**turning))
    shape_under = (shaft.shapes([0.5]) @ shaft.under_unbalances([omega]))[0, :, 0]
    assert_allclose(shape_under, [want, -1j * want], rtol=1e-4)


def test_a_shaft_at_rest_has_the_planar_modes_twice() -> None:
    diagram, planar = campbell(TABLE1, [0.0, 100.0], n=6), natural_frequencies(TABLE1, 3)
    assert_allclose(diagram.frequency[::2, 0], planar, rtol=2e-3)  # those are undamped
    assert_allclose(diagram.frequency[1::2, 0], diagram.frequency[::2, 0], rtol=1e-9)
    assert_allclose(np.sort(turning_shaft(TABLE1).model.omega)[:6:2] / (2 * np.pi), planar, rtol=1e-7)


def test_sections_turn_too() -> None:
    """A pinned Timoshenko shaft, w ~ sin βx and slope ~ cos βx: a 2 x 2 determinant with ρ I (ω² - 2 Ω ω)."""
    density, radius, spin, nu = 7800.0, 0.02, 2000.0, 0.3
    section = Section(1.0, (2 * radius, 2 * radius))
    shaft = turning_shaft(a_rig(Shaft((section,), PINS, (), Material(YOUNG, density, nu), theory="timoshenko")))
    area, second, beta = np.pi * radius**2, np.pi * radius**4 / 4, np.pi / 1.0
    shear = 6 * (1 + nu) / (7 + 6 * nu) * YOUNG / (2 * (1 + nu)) * area
    translation = [-density * area, 0.0, shear * beta**2]
    tilt = [-density * second, 2 * density * second * spin, YOUNG * second * beta**2 + shear]
    want = np.sort(np.abs(np.roots(np.polysub(np.polymul(translation, tilt), [(shear * beta) ** 2])).real))[:2]
    assert_allclose(shaft.poles(spin).value.imag[:2], want, rtol=1e-7)


def test_the_diagram_is_drawn() -> None:
    speeds = np.linspace(0, 2.5 * JEFFCOTT, 9)
    (axes,) = campbell(jeffcott((1.0, 1e-4)), speeds, n=6, operating=(300.0, 350.0)).plot().axes
    assert axes.get_xlabel() == "Spin (rev/min)"
    drawn = dict(zip(*axes.get_legend_handles_labels()[::-1]))
    assert {"forward", "backward", "spin (1X)", "grows by itself", "operating speeds", "required margin"} <= set(drawn)
    assert drawn["forward"].get_linestyle() != drawn["backward"].get_linestyle()
    assert_allclose(drawn["critical speed"].get_data(), [[JEFFCOTT * 30 / np.pi], [JEFFCOTT / (2 * np.pi)]], rtol=1e-4)
    # Other modes are a hundred times higher; what matters is where the line of the spin is.
    assert_allclose(axes.get_ylim(), [0.0, 1.25 * speeds[-1] / (2 * np.pi)])


def test_critical_speeds_of_an_overhung_disc_by_their_whirl() -> None:
    """det [k11 - m Ω², k12; k12, k22 - (I ∓ J) Ω²] = 0: forward and backward whirl with the spin, Ω = ω."""
    criticals = campbell(overhung(polar_inertia=0.01), [0.0, 5000.0], n=4).criticals
    for whirl, sign in (("forward", -1), ("backward", 1)):
        want = np.sqrt(scipy.linalg.eigvalsh(OVERHUNG, np.diag([2.0, INERTIA + sign * 0.01])))
        assert_allclose(criticals.spin_rad_s[criticals.whirl == whirl], want, rtol=1e-4)
        assert (criticals.amplification_factor[criticals.whirl == whirl] > 0).all() == (whirl == "forward")


def test_amplification_and_margin_of_a_critical_speed() -> None:
    """A Jeffcott rotor has ζ = c/(2 m ω) and AF = 1/(2 ζ); API 617 then requires 17 (1 - 1/(AF - 1.5)) %."""
    outer = 0.2 * JEFFCOTT
    operating = 1.2 * JEFFCOTT, 1.5 * JEFFCOTT
    criticals = campbell(jeffcott((outer, 0.0)), [0.0, 2 * JEFFCOTT], n=2, operating=operating).criticals
    (critical_speed,) = criticals.query("whirl == 'forward'").to_dict("records")
    want = {
        "spin_rad_s": JEFFCOTT, "damping_ratio": 0.1, "amplification_factor": 5.0,
        "separation_margin_percent": 100 * 0.2 / 1.2, "required_margin_percent": 17 * (1 - 1 / 3.5),
    }  # fmt: skip
    assert {name: critical_speed[name] for name in want} == pytest.approx(want, rel=1e-3)
    assert critical_speed["margin"] == "met"


def test_what_does_not_turn_is_refused() -> None:
    flat = a_rig(Shaft((Section(0.5, None, None, (0.02, 0.02), (0.01, 0.01)),), (Support(0.0, "clamped"),), (), LIGHT))
    rig, inner = jeffcott(), Bushing(0.5, 1e-3, 0.0, Grease(2e5), Contact(1e6), to=0.7, shape="round")
    free = turning_shaft(rig.replace(structure=dataclasses.replace(rig.structure, supports=())))  # type: ignore[type-var]
    for call, words in (
        (lambda: turning_shaft(flat), r"sections\[0\] is .* a shaft that turns needs sections that are as stiff in"),
        (lambda: turning_shaft(rig.replace(bushings=(inner,))),
         r"bushings\[0\].to is on the shaft itself, which turns"),
        (lambda: turning_shaft(rig.with_shape(None).replace(planes=Planes(0.1, 0.3))),
         "a shaft that turns has no fixture and no planes of its own"),
        (lambda: campbell(rig, [100.0, 50.0]), "speeds must be rising spins in rad/s"),
        (lambda: Disc(0.3, 2.0, INERTIA, polar_inertia=0.05),
         "polar_inertia 0.05 kg m² is more than twice inertia 0.02 kg m²"),
        (lambda: Support(0.0, "pinned", translation_y=1e5), "translation_y has no effect without translation"),
        (lambda: Support(0.0, "pinned", translation_damping_y=1e5),
         'translation_damping_y has no effect, as a support of kind "pinned"'),
        (lambda: free.critical_speeds, "can move without bending; add a support"),
    ):  # fmt: skip
        assert_refused(RigError, words, call)


def test_bushings_hold_the_shaft_in_both_planes() -> None:
    filled = Bushing(0.5, 1e-3, 0.0, Grease(2e5, 0.0), Contact(1e6), shape="round")
    squares = turning_shaft(jeffcott().replace(bushings=(filled,))).poles(100.0).value.imag[:2]
    assert_allclose(squares, np.sqrt((48 * BENDING + 2e5) / 3.0), rtol=1e-4)
