"""The oil film of a short bearing against Reynolds' equation, Ocvirk's locus and published stability thresholds."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize
from numpy.testing import assert_allclose

from clearance_mj import LawError
from clearance_mj.clearance import ShortBearing

from ..verification.page import Measured

BEARING = ShortBearing(viscosity=0.02, radius=0.025, length=0.02, clearance=5e-5)
FULL = ShortBearing(0.02, 0.025, 0.02, 5e-5, cavitated=False)
SPIN = 300.0
CHILDS = "Childs, Turbomachinery Rotordynamics, 1993, section 3.5"


def pressed(bearing: ShortBearing, ratio: float, approach: float, whirl: float) -> np.ndarray:
    """Radial and tangential force by quadrature of the pressure over the film: the axial parabola of a short bearing,
    with h = C (1 - ε cos θ) at the angle θ from the journal, cavitated where the pressure is negative.
    """
    theta = np.linspace(0, 2 * np.pi, 20001)[:-1]
    film = bearing.clearance * (1 - ratio * np.cos(theta))
    # In the frame of the line of centres the surfaces turn with Ω - 2φ' together.
    wedge = bearing.clearance * ratio * np.sin(theta) * (SPIN - 2 * whirl) / 2
    squeeze = -bearing.clearance * approach * np.cos(theta)
    pressure = -bearing.viscosity * bearing.length**3 / film**3 * (wedge + squeeze)
    if bearing.cavitated:
        pressure = np.maximum(pressure, 0.0)
    push = -pressure * bearing.radius * (2 * np.pi / theta.size)
    return np.array([push @ np.cos(theta), push @ np.sin(theta)])


@pytest.mark.parametrize("bearing", [BEARING, FULL])
@pytest.mark.parametrize("ratio", [0.1, 0.5, 0.8])
def test_a_steady_film_is_that_of_reynolds_equation(bearing: ShortBearing, ratio: float) -> None:
    at = [ratio * bearing.clearance, 0.0]
    whirl = 40.0
    force = bearing.force(at, [0.0, at[0] * whirl], SPIN)
    assert_allclose(force, pressed(bearing, ratio, 0.0, whirl), rtol=1e-5, atol=1e-6)


def test_an_uncavitated_film_is_that_of_reynolds_equation_in_any_motion() -> None:
    approach, whirl, ratio = 70.0, 220.0, 0.6
    at = ratio * FULL.clearance
    force = FULL.force([at, 0.0], [FULL.clearance * approach, at * whirl], SPIN)
    assert_allclose(force, pressed(FULL, ratio, approach, whirl), rtol=1e-6)


@pytest.mark.parametrize("bearing, half", [(FULL, 1.0), (BEARING, 0.5)])
def test_a_centred_squeeze_film(bearing: ShortBearing, half: float, measured: Measured) -> None:
    """π μ L³ R/C³ has pressure all around; where oil cannot pull it is half of that, as the quadrature says too."""
    c = half * np.pi * bearing.viscosity * bearing.length**3 * bearing.radius / bearing.clearance**3
    _, damping = bearing.coefficients([0.0, 0.0], 0.0)
    what = f"centred squeeze film, {'full' if half == 1 else 'half'}: damping over π μ L³R/C³"
    measured.equal(what, half * damping[0, 0] / c, half, "quadrature of Reynolds' equation", rel=1e-12)
    assert_allclose(damping, c * np.eye(2), rtol=1e-12, atol=1e-9 * c)
    approach = 1e4  # much faster than the rotation
    assert_allclose(pressed(bearing, 0.0, approach, SPIN / 2)[0], -c * bearing.clearance * approach, rtol=1e-6)


def test_a_centred_full_film_carries_across(measured: Measured) -> None:
    stiffness, damping = FULL.coefficients([0.0, 0.0], SPIN)
    cross = damping[0, 0] * SPIN / 2
    measured.equal("centred full film: k_xy over c Ω/2", stiffness[0, 1] / cross, 1.0, "closed form", rel=1e-9)
    assert_allclose(stiffness, [[0.0, cross], [-cross, 0.0]], atol=1e-9 * cross)


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.5, 0.7, 0.9])
def test_a_loaded_journal_lies_on_ocvirks_locus(ratio: float, measured: Measured) -> None:
    """S (L/D)² = (1-ε²)²/(π ε √(π²(1-ε²) + 16 ε²)), tan φ = π √(1-ε²)/(4 ε); ε = 0.5: 0.1060 and 53.68°."""
    b = BEARING
    sommerfeld = (1 - ratio**2) ** 2 / (np.pi * ratio * np.sqrt(np.pi**2 * (1 - ratio**2) + 16 * ratio**2))
    if ratio == 0.5:
        assert round(sommerfeld, 4) == 0.1060
    slenderness = b.length / (2 * b.radius)
    per_area = b.viscosity * SPIN / (2 * np.pi) * (b.radius / b.clearance) ** 2 * slenderness**2 / sommerfeld
    load = per_area * b.length * 2 * b.radius
    y, z = b.equilibrium([0.0, -load], SPIN)
    measured.equal(f"Ocvirk's locus, ε = {ratio:g}: ε", np.hypot(y, z) / b.clearance, ratio, "closed form", rel=1e-9)
    attitude = np.arctan(np.pi * np.sqrt(1 - ratio**2) / (4 * ratio))
    angle = np.degrees(np.angle(complex(y, z) / -1j))
    measured.equal(f"Ocvirk's locus, ε = {ratio:g}: φ (°)", angle, np.degrees(attitude), "closed form", rel=1e-9)
    if ratio == 0.5:
        assert round(np.degrees(attitude), 2) == 53.68
    assert_allclose(b.force([y, z], [0.0, 0.0], SPIN), [0.0, load], rtol=1e-9, atol=1e-9 * load)


@pytest.mark.parametrize("ratio", [0.1, 0.4, 0.8])
def test_the_eight_coefficients_of_a_loaded_film(ratio: float) -> None:
    """Friswell, Penny, Garvey & Lees, Dynamics of Rotating Machines, 2010, page 177: u across the load, v along it."""
    b, e, root = BEARING, ratio, np.sqrt(1 - ratio**2)
    load = float(np.hypot(*b.force([e * b.clearance, 0.0], [0.0, 0.0], SPIN)))
    k, c = b.coefficients(b.equilibrium([0.0, -load], SPIN), SPIN)
    pi2 = np.pi**2
    h = (pi2 * (1 - e**2) + 16 * e**2) ** -1.5
    uu = 4 * h * (pi2 * (2 - e**2) + 16 * e**2)
    uv = np.pi * h * (pi2 * (1 - e**2) ** 2 - 16 * e**4) / (e * root)
    vu = -np.pi * h * (pi2 * (1 - e**2) * (1 + 2 * e**2) + 32 * e**2 * (1 + e**2)) / (e * root)
    vv = 4 * h * (pi2 * (1 + 2 * e**2) + 32 * e**2 * (1 + e**2) / (1 - e**2))
    assert_allclose(k, load / b.clearance * np.array([[uu, uv], [vu, vv]]), rtol=1e-9)
    uu = 2 * np.pi * h * root * (pi2 * (1 + 2 * e**2) - 16 * e**2) / e
    uv = -8 * h * (pi2 * (1 + 2 * e**2) - 16 * e**2)
    vv = 2 * np.pi * h * (pi2 * (1 - e**2) ** 2 + 48 * e**2) / (e * root)
    assert_allclose(c, load / b.clearance / SPIN * np.array([[uu, uv], [uv, vv]]), rtol=1e-9)


@pytest.mark.parametrize("ratio, speed, whirl", [
    (0.1, 2.741, 0.503), (0.3, 2.607, 0.519), (0.5, 2.539, 0.515), (0.6, 2.707, 0.473), (0.7, 3.61, 0.346),
    (0.75, 9.67, 0.128),
])  # fmt: skip
def test_a_rigid_rotor_begins_to_whirl_at_the_known_speed(
    ratio: float, speed: float, whirl: float, measured: Measured
) -> None:
    """Ω √(C/g) and whirl frequency over Ω of a rigid rotor on the short bearing, from the eigenvalues of its motion.

    The known whirl frequencies have three digits; what the eigenvalues say is also that of the closed form
    ω² = ((k - k_yy)(k - k_zz) - k_yz k_zy)/det c, with k = m ω² the stiffness of the whirl (Childs, 1993, section 3.5).
    """
    b, gravity = BEARING, 9.81

    def bearing(dimensionless: float) -> tuple[np.ndarray, np.ndarray, float, float]:
        spin = dimensionless / np.sqrt(b.clearance / gravity)
        load = float(np.hypot(*b.force([ratio * b.clearance, 0.0], [0.0, 0.0], spin)))
        return *b.coefficients(b.equilibrium([0.0, -load], spin), spin), load / gravity, spin

    def largest(dimensionless: float) -> complex:
        k, c, mass, spin = bearing(dimensionless)
        values = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-k / mass, -c / mass]]))
        return complex(max(values[values.imag > 0], key=lambda value: value.real)) / spin

    threshold = scipy.optimize.brentq(lambda p: largest(p).real, 0.8 * speed, 1.2 * speed)
    measured.equal(f"rigid rotor in oil, ε = {ratio:g}: Ω √(C/g) at the threshold", threshold, speed, CHILDS, rel=0.01)
    whirl_ratio = largest(threshold).imag
    measured.equal(f"rigid rotor in oil, ε = {ratio:g}: whirl ratio", whirl_ratio, whirl, CHILDS, abs=1.5e-3)
    k, c, mass, spin = bearing(threshold)
    together = k[0, 0] * c[1, 1] + k[1, 1] * c[0, 0] - k[0, 1] * c[1, 0] - k[1, 0] * c[0, 1]
    of_whirl = together / np.trace(c)
    squared = np.linalg.det(of_whirl * np.eye(2) - k) / np.linalg.det(c)
    assert_allclose(whirl_ratio, np.sqrt(squared) / spin, rtol=1e-6)
    assert_allclose(of_whirl, mass * squared, rtol=1e-6)


def test_a_film_without_cavitation_has_no_stable_speed() -> None:
    """The centred full film whirls at half the speed, from the first revolution on."""
    k, c = FULL.coefficients([0.0, 0.0], SPIN)
    growing = max(np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-k, -c]])), key=lambda value: value.real)
    assert growing.real > 0
    assert_allclose(abs(growing.imag) / SPIN, 0.5, rtol=1e-3)


def test_what_a_film_refuses() -> None:
    with pytest.raises(LawError, match=r"asperities 5e-05 m are as high as the film in the clearance 5e-05 m"):
        ShortBearing(0.02, 0.025, 0.02, 5e-5, asperities=5e-5)
    with pytest.raises(LawError, match=r"carries 0 N at 0 rad/s down to its asperities, the load is 10 N"):
        BEARING.equilibrium([0.0, -10.0], 0.0)
    with pytest.raises(LawError, match=r"viscosity must be"):
        ShortBearing(-1.0, 0.025, 0.02, 5e-5)
