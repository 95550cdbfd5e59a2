"""The oil film of a bearing of finite width beside Reynolds' equation on a grid, published tables, and both limits."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import scipy.optimize
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj import LawError, periodic
from clearance_mj.clearance import FiniteBearing, ShortBearing
from clearance_mj.clearance.family import FILLING_FAMILIES, ROUND_FILLING_FAMILIES
from clearance_mj.clearance.law_files import law_from_dict
from clearance_mj.clearance.oil_bearing import OilBearing
from clearance_mj.clearance.record import fillings_of
from clearance_mj.engines import Modal, static_equilibrium
from clearance_mj.rig import OilFilm, Rig
from experiments.benches.film import force, grid

from ..periodic.jeffcott import CLEARANCE, GRAVITY, LENGTH, SURFACE, replaced, rigid_in_oil
from ..verification.page import Measured

SPIN = 300.0
RAIMONDI = "Raimondi & Boyd, ASLE Transactions 1, 1958, part III"
CHILDS = "Childs, Turbomachinery Rotordynamics, 1993, section 3.5"


def bearing(width: float, cavitated: bool = True) -> FiniteBearing:
    return FiniteBearing(0.02, 0.025, 0.05 * width, 5e-5, cavitated=cavitated)


def over_scale(b: FiniteBearing, ratio: float, psi: np.ndarray) -> np.ndarray:
    """Force y + i z over 12 μ A R L (R/C)² of a journal that lies along y and moves in directions ψ."""
    speed = b.clearance * np.stack((np.sin(psi), -np.cos(psi)), axis=-1)
    return np.asarray(b.force([ratio * b.clearance, 0.0], speed, 0.0) / (b.scale * b.clearance) @ [1, 1j])


@pytest.mark.parametrize("cavitated", [True, False])
@pytest.mark.parametrize("width", [0.25, 0.5, 1.0])
def test_any_motion_is_that_of_reynolds_equation_on_a_grid(width: float, cavitated: bool, measured: Measured) -> None:
    """Turning, approach, separation and all between them, off the nodes of the table."""
    psi = np.radians([-171.0, -122.0, -90.0, -73.0, -38.0, 0.0, 29.0, 62.0, 90.0])
    size, turned = [], []
    for ratio in (0.05, 0.37, 0.62, 0.83, 0.9):
        on = grid(ratio, width)
        reference = np.array([complex(*force(on, float(each), cavitated)) for each in psi])
        computed = over_scale(bearing(width, cavitated), ratio, psi)
        size.append(np.abs(np.abs(computed / reference) - 1).max())
        turned.append(np.degrees(np.abs(np.angle(computed / reference)).max()))
    what = f"finite film, L/D = {width:g}{'' if cavitated else ', uncavitated'}, ε 0.05 to 0.9"
    measured.below(f"{what}: force", 100 * max(size), 1.0, "Reynolds' equation on a grid", "%")
    measured.below(f"{what}: direction", max(turned), 0.5, "Reynolds' equation on a grid", "°")


@pytest.mark.parametrize("cavitated", [True, False])
@pytest.mark.parametrize("ratio", [0.1, 0.5, 0.8])
def test_a_narrow_bearing_is_ocvirks(ratio: float, cavitated: bool) -> None:
    """Forces of turning, and all eight coefficients, at L/D = 0.02."""
    values = 0.02, 0.025, 0.001, 5e-5, 0.0, cavitated
    finite, short = FiniteBearing(*values), ShortBearing(*values)
    at = [0.6 * ratio * 5e-5, 0.8 * ratio * 5e-5]
    ocvirk = short.force(at, [0.0, 0.0], SPIN)
    assert_allclose(finite.force(at, [0.0, 0.0], SPIN), ocvirk, atol=2e-3 * np.hypot(*ocvirk))
    for computed, known in zip(finite.coefficients(at, SPIN), short.coefficients(at, SPIN)):
        assert_allclose(computed, known, atol=5e-3 * np.abs(known).max())


@pytest.mark.parametrize("ratio", [0.1, 0.5, 0.9])
def test_a_long_whole_film_is_sommerfelds(ratio: float) -> None:
    """W/(12 μ A R L (R/C)²) with A = ε Ω/2 is 2π / ((2 + ε²) √(1 - ε²)), across the displacement."""
    force = over_scale(bearing(400.0, cavitated=False), ratio, np.zeros(1))[0]
    want = 2 * np.pi / ((2 + ratio**2) * np.sqrt(1 - ratio**2))
    assert abs(force - 1j * want) < 5e-3 * want


@pytest.mark.parametrize("width, ratio, sommerfeld, attitude", [
    (1.0, 0.4, 0.264, 63.10), (1.0, 0.6, 0.121, 50.58), (1.0, 0.8, 0.0446, 36.24), (0.5, 0.4, 0.779, 61.45),
    (0.5, 0.6, 0.319, 48.14), (0.5, 0.8, 0.0923, 33.31), (0.25, 0.6, 1.07, 46.72), (0.25, 0.8, 0.261, 31.04),
])  # fmt: skip
def test_a_loaded_journal_rests_where_raimondi_and_boyd_say(
    width: float, ratio: float, sommerfeld: float, attitude: float, measured: Measured
) -> None:
    """S = μ N L D/W (R/C)². Their film begins where it is thickest, this one where it is pressed: 2.3° at L/D = 1."""
    b = bearing(width)
    load = b.viscosity * SPIN / (2 * np.pi) * b.length * 2 * b.radius / sommerfeld * (b.radius / b.clearance) ** 2
    y, z = b.equilibrium([0.0, -load], SPIN)
    what = f"finite film, L/D = {width:g}, S = {sommerfeld:g}"
    measured.equal(f"{what}: ε", np.hypot(y, z) / b.clearance, ratio, RAIMONDI, abs=0.005)
    measured.equal(f"{what}: attitude, °", np.degrees(np.angle(complex(y, z) / -1j)), attitude, RAIMONDI, abs=2.5)
    assert_allclose(b.force([y, z], [0.0, 0.0], SPIN), [0.0, load], atol=1e-9 * load)


def test_a_turned_motion_has_the_turned_force_and_a_faster_one_more() -> None:
    """Forces are homogeneous of degree one in velocity and spin together."""
    b, r, v, angle = bearing(0.5), np.array([2e-5, 1.5e-5]), np.array([-3e-3, 4e-3]), 0.8
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    force = b.force(r, v, SPIN)
    assert_allclose(b.force(turn @ r, turn @ v, SPIN), turn @ force, rtol=1e-11)
    assert_allclose(b.force(r, 3.5 * v, 3.5 * SPIN), 3.5 * force, rtol=1e-11)
    # A motion and its image in a mirror.
    mirror = np.array([1.0, -1.0])
    assert_allclose(b.force(mirror * r, mirror * v, -SPIN), mirror * force, rtol=1e-11)


def test_coefficients_are_slopes_of_the_force() -> None:
    b, small = bearing(0.5), 1e-7
    at = np.array([1e-5, -3e-5])
    stiffness, damping = b.coefficients(at, SPIN)
    for d, step in enumerate(np.eye(2)):
        slope = b.force(at, small * step, SPIN) - b.force(at, -small * step, SPIN)
        assert_allclose(-slope / (2 * small), damping[:, d], rtol=1e-5)
        small_step = 1e-3 * small * step
        slope = b.force(at + small_step, [0.0, 0.0], SPIN) - b.force(at - small_step, [0.0, 0.0], SPIN)
        assert_allclose(-slope / (2e-3 * small), stiffness[:, d], rtol=1e-4)
    assert np.linalg.eigvalsh(damping)[0] > 0


@pytest.mark.parametrize("cavitated", [True, False])
def test_a_centred_film(cavitated: bool) -> None:
    """No direction at rest; of a full film that turns k_yz = c Ω/2, and half of both where oil cannot pull."""
    b = bearing(0.5, cavitated)
    stiffness, damping = b.coefficients([0.0, 0.0], SPIN)
    c = b.small_motion()[1]
    assert_allclose(damping, c * np.eye(2), rtol=1e-12, atol=1e-12 * c)
    assert_allclose(stiffness, c * SPIN / 2 * np.array([[0.0, 1.0], [-1.0, 0.0]]), atol=1e-4 * c * SPIN)
    assert_allclose(c, bearing(0.5, False).small_motion()[1] * (0.5 if cavitated else 1.0), rtol=0.12)


def test_a_squeeze_on_a_line_is_that_of_the_plane() -> None:
    b, planar, space = bearing(0.5), [0.0] * 2, [0.0] * 6
    for x, dx in ((2e-5, 1e-7), (-3e-5, 1e-7), (4e-5, -1e-7)):
        b.law(b.parameters(), [], (x,), (dx,), 0.0, 1e-4, planar)
        b.law(b.parameters(), [], (0.0, x), (0.0, dx), 0.0, 1e-4, space)
        assert_allclose(space[:2], 0.0, atol=1e-12)
        assert_allclose(space[5], planar[1], rtol=1e-12)


def threshold(b: OilBearing, ratio: float, near: float) -> tuple[float, float]:
    """Ω √(C/g) at which a rigid rotor on a bearing begins to whirl, and the whirl over Ω there, by eigenvalues."""

    def largest(dimensionless: float) -> complex:
        spin = dimensionless / np.sqrt(b.clearance / GRAVITY)
        load = float(np.hypot(*b.force([ratio * b.clearance, 0.0], [0.0, 0.0], spin)))
        k, c = b.coefficients(b.equilibrium([0.0, -load], spin), spin)
        mass = load / GRAVITY
        values = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-k / mass, -c / mass]]))
        return complex(max(values[values.imag > 0], key=lambda value: value.real)) / spin

    root = scipy.optimize.brentq(lambda p: largest(p).real, 0.8 * near, 1.2 * near)
    return root, largest(root).imag


@pytest.mark.parametrize("ratio, speed, whirl", [(0.1, 2.741, 0.503), (0.3, 2.607, 0.519), (0.6, 2.707, 0.473)])
def test_a_narrow_bearing_whirls_as_ocvirks(ratio: float, speed: float, whirl: float, measured: Measured) -> None:
    onset = threshold(bearing(0.02), ratio, speed)
    measured.equal(f"narrow finite film, ε = {ratio:g}: Ω √(C/g) at the threshold", onset[0], speed, CHILDS, rel=0.01)
    measured.equal(f"narrow finite film, ε = {ratio:g}: whirl ratio", onset[1], whirl, CHILDS, rel=0.01)


def in_finite_oil(ratio: float, speed: float, **changes: float) -> tuple[Rig, FiniteBearing]:
    """A rigid rotor in two bearings of L/D = 1/3 in which it rests at an eccentricity ratio; one of the bearings."""
    rig = rigid_in_oil(1.0, speed)
    unit = FiniteBearing(1.0, SURFACE, LENGTH, CLEARANCE, **changes)
    viscosity = rig.total_mass * GRAVITY / 2 / float(np.hypot(*unit.force([ratio * CLEARANCE, 0.0], [0.0, 0.0], speed)))
    rig = replaced(rig, film=OilFilm(viscosity, width="finite", **changes))
    return rig, dataclasses.replace(unit, viscosity=viscosity)


def test_a_released_journal_settles_where_it_rests() -> None:
    speed = 1.5 * np.sqrt(GRAVITY / CLEARANCE)
    rig, b = in_finite_oil(0.7, speed, asperities=1e-6)
    assert fillings_of(rig, cm.clearance.nominal_law(rig)) == [b, b]
    resting = b.equilibrium([0.0, -rig.total_mass * GRAVITY / 2], speed)
    assert_allclose(static_equilibrium(rig).displacement, np.tile(resting, 2), rtol=1e-5, atol=1e-5 * CLEARANCE)
    law, engine = cm.clearance.nominal_law(rig), Modal(modes=2)
    run = engine.start(rig, law, "force", engine.largest_step(rig, law))
    run.motion.v[:] += 3e-3 * np.linalg.pinv(run.model.at_bushings) @ [1.0, 0.5, 1.0, 0.5]
    motion = run.advance(np.zeros(int(0.3 / run.step)))
    assert np.ptp(motion[:, 1]) > 0.05 * CLEARANCE
    assert_allclose(motion[-1, 1:5], np.tile(resting, 2), atol=1e-3 * CLEARANCE)


def test_whirl_begins_where_the_coefficients_say() -> None:
    """Harmonic balance's rest and eigenvalues beside those of a rigid body on the eight coefficients."""
    ratio = 0.4
    _, b = in_finite_oil(ratio, SPIN)
    dimensionless, whirl = threshold(b, ratio, 2.55)
    speed = dimensionless * np.sqrt(GRAVITY / CLEARANCE)
    rig, _ = in_finite_oil(ratio, speed)
    onset = periodic.find_whirl_onset(cm.Model(rig), (0.8 * speed, 1.2 * speed), 2)
    assert_allclose(onset.speed, speed, rtol=2e-3)
    assert_allclose(2 * np.pi * onset.frequency / onset.speed, whirl, rtol=2e-3)


def test_films_in_files_and_what_they_refuse() -> None:
    b = FiniteBearing(0.02, 0.025, 0.02, 5e-5, asperities=1e-6, cavitated=False)
    law = cm.clearance.ContactLaw(cm.clearance.KelvinVoigt(1e6, 10.0), grease=b)
    assert law_from_dict(law.to_dict()).grease == (b,)
    assert law.to_dict()["grease"][0]["model"] == "finite-bearing"
    rig, _ = in_finite_oil(0.5, SPIN)
    assert Rig.from_dict(rig.to_dict()) == rig
    assert rig.to_dict()["bushings"][0]["film"]["width"] == "finite"
    assert "width" not in rigid_in_oil(0.02, SPIN).to_dict()["bushings"][0]["film"]
    with pytest.raises(LawError, match=r"asperities 5e-05 m are as high as the film"):
        FiniteBearing(0.02, 0.025, 0.02, 5e-5, asperities=5e-5)
    with pytest.raises(LawError, match=r"carries 0 N at 0 rad/s down to its asperities, the load is 10 N"):
        b.equilibrium([0.0, -10.0], 0.0)


@pytest.mark.parametrize("width, kind", [("short", ShortBearing), ("finite", FiniteBearing)])
def test_the_family_of_oil_films_has_its_viscosity_free(width: str, kind: type[OilBearing]) -> None:
    """Of round clearances alone: families of planar bushings stay those that there are."""
    family = ROUND_FILLING_FAMILIES["oil film"]
    assert "oil film" not in FILLING_FAMILIES
    dry = rigid_in_oil(0.02, SPIN).bushings[0]
    bushing = dataclasses.replace(dry, film=OilFilm(0.02, 1e-6, width=width), radius=SURFACE)  # type: ignore[arg-type]
    (viscosity,) = family.parameters(bushing)
    assert (viscosity.name, viscosity.unit, viscosity.start) == ("grease viscosity", "Pa s", 0.02)
    made = family.make(bushing, 0.03)
    assert made == kind(0.03, SURFACE, LENGTH, CLEARANCE, asperities=1e-6)
    assert family.holds(made) and family.values(bushing, made) == {"grease viscosity": 0.03}
    with pytest.raises(LawError, match=r"the radius of the shaft in the bushing is missing"):
        family.make(dataclasses.replace(bushing, radius=None), 0.03)
    with pytest.raises(LawError, match=r"the bushing has no oil of which a viscosity could be found"):
        family.parameters(dataclasses.replace(bushing, film=None))
