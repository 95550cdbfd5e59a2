"""Contact stiffness from material and geometry, beside closed forms and the exact solution of an elastic layer."""

import numpy as np
import pytest
from scipy.integrate import quad

from clearance_mj.clearance.bushing_layer import (
    LAYER_MATERIALS,
    STEEL,
    YIELDS_AT,
    LayerMaterial,
    layer_contact,
    pressed_layer,
)  # fmt: skip
from clearance_mj.core.errors import ClearanceError

RIGID = 1e20, 0.3
RADIUS, GAP = 5e-3, 1e-5  # so narrow that the touched arc is flat: no half width is more than 6 % of the radius


def layer_kernel(s, nu):
    """Surface deflection of a layer bonded to a rigid base over that of a half-space, under pressure cos(s x/t).

    Plane strain, no friction on top. `test_the_kernel` has its limits.
    """
    kappa, decay = 3 - 4 * nu, np.exp(-2 * np.minimum(s, 300.0))
    top = 2 * kappa * (1 - decay**2) - 8 * s * decay
    return top / (2 * kappa * (1 + decay**2) + 2 * decay * (1 + kappa**2 + 4 * s**2))


def exact(half, nu, n=100):
    """Force, depth and largest pressure under a rigid parabola of radius 1 on a layer of thickness and modulus 1.

    The contact has a given half width: pressures of n strips, by Fourier integrals of the kernel, so that the edges are
    free of pressure.
    """
    width = 2 * half / n
    x = width * (np.arange(n) + 0.5) - half
    k = np.concatenate([np.linspace(1e-6, 20, 4000), np.geomspace(20, 2000 / width, 60000)[1:]])
    spectrum = layer_kernel(k, nu) / k * 2 * np.sin(k * width / 2) / k
    under = [np.trapezoid(spectrum * np.cos(k * width * i), k) for i in range(n)]
    influence = 2 * (1 - nu**2) / np.pi * np.array(under)[np.abs(np.subtract.outer(np.arange(n), np.arange(n)))]
    flat, curved = np.linalg.solve(influence, np.array([np.ones(n), x**2 / 2]).T).T
    depth = curved[0] / flat[0]
    pressure = depth * flat - curved
    return pressure.sum() * width, depth, pressure.max()


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_the_kernel(nu):
    """Short waves feel a half-space, long ones press columns that cannot widen, of modulus E (1-ν)/((1+ν)(1-2ν))."""
    confined = (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    assert layer_kernel(50.0, nu) == pytest.approx(1.0, rel=1e-9)
    assert 2 * (1 - nu**2) * layer_kernel(1e-3, nu) / 1e-3 == pytest.approx(1 / confined, rel=1e-5)


@pytest.mark.parametrize(("nu", "within"), [(0.34, 0.23), (0.4, 0.23), (0.45, 0.34)])
@pytest.mark.parametrize("half", [0.05, 0.2, 0.45, 0.6, 1.0, 2.0, 4.0])
def test_the_exact_layer(nu, within, half):
    """The stiffness at the same largest pressure, from contacts far narrower than the layer to far wider ones."""
    force, depth, pressure = exact(half, nu)
    thickness, relative = 1e-4, RADIUS * (RADIUS + GAP) / GAP
    modulus = 1e9 / pressure * relative / thickness  # so that 1 GPa makes this half width
    found_force, found_depth = pressed_layer(1e9, LayerMaterial(modulus, nu, 1.0), thickness, RADIUS, GAP, RIGID)
    assert found_force / found_depth == pytest.approx(modulus * force / depth, rel=within)


def test_hertz_and_johnson():
    """Johnson, Contact Mechanics: a² = 4PR/(πE*), p = 2P/(πa) (4.45), and the depths of (5.56) and (5.57)."""
    bronze, p, thickness = LAYER_MATERIALS["bronze"], 5e7, 2e-3
    force, depth = pressed_layer(p, bronze, thickness, 5e-3, 3e-4)
    layer, steel = (1 - bronze.poisson_ratio**2) / bronze.young_modulus, (1 - STEEL[1] ** 2) / STEEL[0]
    half = np.sqrt(4 * force / np.pi * (layer + steel) / (1 / 5e-3 - 1 / 5.3e-3))
    assert 2 * force / (np.pi * half) == pytest.approx(p, rel=1e-12)
    nu = bronze.poisson_ratio
    of_layer = force * layer / np.pi * (2 * np.log(2 * thickness / half) - nu / (1 - nu))
    assert depth == pytest.approx(of_layer + force * steel / np.pi * (2 * np.log(4 * 5e-3 / half) - 1), rel=1e-12)


def test_elastic_foundation_around_the_shaft():
    """The pressure K/t ((d + δ) cos θ - d), integrated over the touched arc by quadrature, 37° to each side here."""
    soft, p, thickness, radius, gap = LayerMaterial(1e8, 0.4, 1.0), 1.5e7, 1e-3, 5e-3, 3e-4
    force, depth = pressed_layer(p, soft, thickness, radius, gap, RIGID)
    confined = 1e8 * 0.6 / (1.4 * 0.2)  # E (1-ν)/((1+ν)(1-2ν))
    assert depth == pytest.approx(p * thickness / confined, rel=1e-9)
    arc = np.arccos(gap / (gap + depth))
    along = quad(lambda t: confined / thickness * ((gap + depth) * np.cos(t) - gap) * radius * np.cos(t), -arc, arc)[0]
    assert np.degrees(arc) > 30 and force == pytest.approx(along, rel=1e-9)


def test_what_is_proposed_lies_between_light_and_full_loads():
    """Of a bushing of bronze, 2 mm thick: about 5e8 N/m, not the 1e4 of an example; steel on rubber would be softer."""
    layer = layer_contact("bronze", 2e-3, 0.012, 5e-3, 3e-4)
    assert layer.bearable_force / layer.bearable_depth > layer.stiffness
    p = YIELDS_AT * LAYER_MATERIALS["bronze"].yield_strength
    light, full = (pressed_layer(x * p, LAYER_MATERIALS["bronze"], 2e-3, 5e-3, 3e-4) for x in (0.1, 1.0))
    secant = 0.012 * light[0] / light[1], 0.012 * full[0] / full[1]
    assert secant[0] < layer.stiffness < secant[1] and secant[1] / secant[0] < np.exp(2 * layer.spread)
    assert layer.bearable_depth == full[1] and layer.bearable_force == 0.012 * full[0]
    assert layer_contact("pom", 2e-3, 0.012, 5e-3, 3e-4).stiffness < layer.stiffness / 5


@pytest.mark.parametrize(("changes", "words"), [
    ({"material": "wood"}, 'bushing material "wood" is unknown; use bronze, babbitt'),
    ({"thickness": 0.0}, "thickness of a bushing's contact must be > 0 m, got 0"),
    ({"gap": float("nan")}, "gap of a bushing's contact must be > 0 m, got nan"),
    ({"material": LayerMaterial(5e6, 0.499, 1e6)}, "Poisson's ratio 0.499 of a bushing's layer is more than 0.45"),
])  # fmt: skip
def test_refusals(changes, words):
    given = {"material": "pom", "thickness": 1e-3, "length": 0.01, "radius": 5e-3, "gap": 1e-4} | changes
    with pytest.raises(ClearanceError, match=words):
        layer_contact(**given)
