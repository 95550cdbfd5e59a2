import numpy as np
import pytest

from clearance_mj.core.jit import jit
from experiments.testrig import Iwan, physics

from ...verification.test_bouc_wen import benchmark_set, loop, steady_loops


@jit
def step(z, dx, a, beta, gamma, exponent):
    return physics.bouc_wen(dx, z, a, beta, gamma, int(exponent))[0]


@steady_loops
def test_bouc_wen_steady_loop(exponent, reversal, z, energy):
    assert loop(step, float(reversal), 12, 2000, 1.0, 0.5, 0.5, exponent) == pytest.approx((z, energy), rel=3e-6)


@benchmark_set
def test_bouc_wen_benchmark_set(reversal, z, energy):
    assert loop(step, reversal, 12, 2000, 5e4, 1e3 * 0.8, 1e3 * -1.1, 1) == pytest.approx((z, energy), rel=2e-5)


@pytest.mark.parametrize(("exponent", "expected"), [(1, 1 - np.exp(-1.5)), (2, np.tanh(1.5))])
def test_bouc_wen_loading_curve(exponent, expected):
    """verification.md: z = 1 - exp(-x) for n = 1, tanh x for n = 2; Heun's rule is of second order."""
    errors = []
    for steps in (100, 200):
        z = 0.0
        for _ in range(steps):
            z, _ = physics.bouc_wen(1.5 / steps, z, 1.0, 0.5, 0.5, exponent)
        errors.append(abs(z - expected))
    assert errors[1] < 2e-5 and errors[0] / errors[1] == pytest.approx(4, rel=0.05)


YIELDS = Iwan(1e-3, elements=20).parameters


def iwan_path(places):
    """Mean deflection of Iwan's elements at each of the places, one after the other."""
    elements, path, before = np.zeros(YIELDS.size), [], 0.0
    for x in places:
        z, _ = physics.iwan(x - before, elements, YIELDS, elements)
        path.append(z)
        before = x
    return np.array(path)


def backbone(x):
    """Uniform spread of yields up to D = 1 mm (Iwan 1966): x - x²/2D, D/2 from D on."""
    return np.where(x < 1e-3, x - x**2 / 2e-3, 5e-4)


def test_iwan_backbone():
    """At multiples of D/20, where no slider of the twenty stands half way, they equal the continuous spread."""
    x = np.arange(1, 30) * 5e-5
    np.testing.assert_allclose(iwan_path(x), backbone(x), atol=1.3e-6)  # D/8 N²: a slider's half step
    assert iwan_path([2e-3])[0] == pytest.approx(5e-4, rel=1e-12)


@pytest.mark.parametrize("reversal", [3e-4, 6e-4, 1e-3, 1.4e-3])
def test_iwan_masing_loop(reversal):
    """Masing (1926): after the reversal z = f(X) - 2 f((X - x)/2), whatever the steps. Energy: Σ 4 d (X - d)."""
    down = np.linspace(reversal, -reversal, 2001)
    z = iwan_path([reversal, *down[1:]])
    np.testing.assert_allclose(z, backbone(reversal) - 2 * backbone((reversal - down) / 2), atol=3e-6)
    np.testing.assert_allclose(iwan_path([reversal, *down[100::100]])[1:], z[100::100], atol=1e-15)
    energy = np.trapezoid(iwan_path([reversal, *down[1:], *down[-2::-1]])[2000:], down[::-1]) + np.trapezoid(z, down)
    sliding = YIELDS[YIELDS < reversal]
    assert energy == pytest.approx(np.sum(4 * sliding * (reversal - sliding)) / YIELDS.size, rel=1e-4)


@pytest.mark.parametrize("speed", [1e-4, 0.01, -0.02, 0.3])
def test_lugre_steady_sliding(speed):
    """Stribeck's curve: sgn(v) (Z_c + (Z_s - Z_c) exp(-(v/v_s)²)); the bristles no longer move."""
    h, z = 1e-3 / abs(speed) / 100, 0.0
    for _ in range(3000):
        z, _, rate, _ = physics.lugre(speed * h, h, speed, z, 2e-4, 3e-4, 0.02)
    assert z == pytest.approx(np.sign(speed) * (2e-4 + 1e-4 * np.exp(-((speed / 0.02) ** 2))), rel=1e-12)
    assert rate == pytest.approx(0, abs=1e-12 * abs(speed))


def test_lugre_is_a_spring_before_it_slides():
    """Canudas de Wit et al. (1995): dz/dx = 1 for small motions; z = Z_s (1 - exp(-x/Z_s)) on slow loading."""
    z, slope, rate, by_v = physics.lugre(1e-9, 1e-5, 1e-4, 0.0, 2e-4, 3e-4, 0.02)
    assert z == pytest.approx(1e-9, rel=1e-5) and (slope, rate / 1e-4, by_v) == pytest.approx((1, 1, 1), rel=1e-5)
    z = 0.0
    for _ in range(7):  # exact for steps of any size at one speed
        z, *_ = physics.lugre(5e-5, 1.0, 5e-5, z, 2e-4, 3e-4, 0.02)
    limit = 2e-4 + 1e-4 * np.exp(-((5e-5 / 0.02) ** 2))
    assert z == pytest.approx(limit * (1 - np.exp(-3.5e-4 / limit)), rel=1e-12)


@pytest.mark.parametrize("x", [-4e-4, -2e-4, 1e-4, 3.5e-4])
@pytest.mark.parametrize("v", [-0.3, 0.0, 0.2])
@pytest.mark.parametrize(("law", "parameters"), [
    (physics.contact, (3e-4, 2e5, 1.5, 1.5)), (physics.contact, (3e-4, 2e5, 1.2, 1.5)),
    (physics.squeeze_film, (4.0, 7.5e-4, 0.2)),
])  # fmt: skip
def test_derivatives(law, parameters, x, v):
    _, by_x, by_v = law(x, v, *parameters)
    dx, dv = 1e-9, 1e-6
    assert by_x == pytest.approx((law(x + dx, v, *parameters)[0] - law(x - dx, v, *parameters)[0]) / (2 * dx), rel=1e-5)
    assert by_v == pytest.approx((law(x, v + dv, *parameters)[0] - law(x, v - dv, *parameters)[0]) / (2 * dv), rel=1e-5)


def test_contact_force():
    force, *_ = physics.contact(-4e-4, 0.0, 3e-4, 1e6, 1.5, 2.0)
    assert force == pytest.approx(-1e6 * 1e-4**1.5, rel=1e-12)
    # δ̇ = 0.1 m/s into the stop: 1 + 1.5 · 2 · 0.1
    assert physics.contact(-4e-4, -0.1, 3e-4, 1e6, 1.5, 2.0)[0] == pytest.approx(1.3 * force, rel=1e-12)
    assert physics.contact(2.9e-4, 5.0, 3e-4, 1e6, 1.5, 2.0) == (0, 0, 0)
    assert physics.contact(4e-4, -10.0, 3e-4, 1e6, 1.5, 2.0)[0] == 0  # never pulls


def test_squeeze_film_thins():
    assert physics.squeeze_film(0.0, 2.0, 4.0, 1e-3, 0.2)[0] == 8.0
    assert physics.squeeze_film(-5e-4, 2.0, 4.0, 1e-3, 0.2)[0] == pytest.approx(4 * 8.0)
    assert physics.squeeze_film(5e-3, 2.0, 4.0, 1e-3, 0.2)[0] == pytest.approx(25 * 8.0)
