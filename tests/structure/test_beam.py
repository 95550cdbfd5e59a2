"""The uniform cantilever's roots, shapes and static deflection against closed forms."""

import dataclasses

import numpy as np
import pytest
import scipy.optimize

import clearance_mj as cm
from clearance_mj.rig import Rig, Sensor
from clearance_mj.structure import Beam, Clamp, beam


def integrate(function, length, pieces=100):
    """Integral of a function of x (n_x,) over the shaft (Gauss-Legendre), exact to rounding for 60 modes."""
    node, weight = np.polynomial.legendre.leggauss(12)
    h = length / pieces
    x = ((np.arange(pieces)[:, None] + (node + 1) / 2) * h).ravel()
    return np.tensordot(np.tile(weight * h / 2, pieces), function(x), 1)


def test_roots():
    """Blevins (1979), table 8-1, to 16 digits; beyond, sech λ is below rounding and the roots are (2i-1)π/2."""
    known = [1.875104068711961, 4.694091132974175, 7.854757438237613, 10.995540734875467, 14.137168391046471]
    roots = beam.cantilever_roots(300)
    np.testing.assert_allclose(roots[:5], known, rtol=3e-16)
    np.testing.assert_allclose(roots[12:], (2 * np.arange(13, 301) - 1) * np.pi / 2, rtol=3e-16)


def test_low_modes_are_the_printed_formula():
    """Y = cosh βx - cos βx - σ(sinh βx - sin βx), directly: eleven digits are left at mode 3."""
    x, length = np.linspace(0, 1.3, 27), 1.3
    root = beam.cantilever_roots(3)
    sigma = (np.cosh(root) + np.cos(root)) / (np.sinh(root) + np.sin(root))
    np.testing.assert_allclose(sigma, [0.734095514, 1.018467319, 0.999224497], rtol=1e-9)  # Blevins, table 8-1
    bx = x[:, None] * root / length
    direct = np.cosh(bx) - np.cos(bx) - sigma * (np.sinh(bx) - np.sin(bx))
    curvature = (root / length) ** 2 * (np.cosh(bx) + np.cos(bx) - sigma * (np.sinh(bx) + np.sin(bx)))
    np.testing.assert_allclose(beam.cantilever_mode(x, 3, length), direct, atol=1e-11)
    np.testing.assert_allclose(beam.cantilever_mode(x, 3, length, 2), curvature, atol=1e-9)


@pytest.mark.parametrize("mode", [20, 40, 60])
def test_high_modes_are_their_asymptote(mode):
    """For λ >> 1: Y = e^{-βx} - cos βx + sin βx - (-1)^i e^{βx-λ}, with terms of e^{-λ} left out."""
    x, root = np.linspace(0, 1, 1001), (2 * mode - 1) * np.pi / 2
    expected = np.exp(-root * x) - np.cos(root * x) + np.sin(root * x) - (-1) ** mode * np.exp(root * (x - 1))
    np.testing.assert_allclose(beam.cantilever_mode(x, 60)[:, mode - 1], expected, atol=1e-11)


def test_ends():
    """Clamped: Y(0) = Y'(0) = 0; free: Y''(l) = 0, |Y(l)| = 2 with alternating sign."""
    assert np.all(np.abs(beam.cantilever_mode([0.0], 40)) < 1e-14)
    near = beam.cantilever_mode([1e-5], 40)[0]  # Y'' x²/2 without a slope
    np.testing.assert_allclose(near, beam.cantilever_mode([0.0], 40, order=2)[0] * 1e-10 / 2, rtol=1e-3)
    np.testing.assert_allclose(beam.cantilever_mode([1.0], 40)[0], 2 * (-1.0) ** np.arange(40), rtol=1e-12)
    assert np.all(np.abs(beam.cantilever_mode([1.0], 40, order=2)) < 1e-12 * beam.cantilever_roots(40) ** 2)


def test_modes_are_orthogonal():
    """∫Y_i Y_j = l δ_ij and ∫Y_i'' Y_j'' = l (λ_i/l)⁴ δ_ij, up to mode 60."""
    length = 0.8

    for order, size in ((0, 1.0), (2, (length / beam.cantilever_roots(60)) ** 2)):

        def products(x, order=order, size=size):
            shapes = beam.cantilever_mode(x, 60, length, order) * size
            return shapes[:, :, None] * shapes[:, None] / length

        np.testing.assert_allclose(integrate(products, length), np.eye(60), atol=1e-11)


def test_static_deflection_of_the_tip():
    """F l³/(3EI) under the force; F a² (3l - a)/(6EI) under a force at a."""
    shaft = Beam(1.2, 70e9, 2700.0, width=0.02, height=0.005)
    rigidity = 70e9 * 0.02 * 0.005**3 / 12
    known = np.array([1.2**3 / 3, 0.25 * 3.1 / 6]) / rigidity
    np.testing.assert_allclose(beam.static_deflection(shaft, [1.2], [1.2, 0.5])[0], known, rtol=1e-14)


def elastic_clamp_roots(rotation, translation, n):
    """First n roots λ of the cantilever whose clamp gives, k l/(EI) and k l³/(EI) of its springs; inf: rigid.

    Four conditions on a cosh + b sinh + c cos + d sin: moment and shear of the springs at 0, none at l (Blevins, table
    8-1, derives its cases alike).
    """

    def determinant(z):
        c, s, ch, sh = np.cos(z), np.sin(z), np.cosh(z), np.sinh(z)
        moment = [1 / z, -rotation / z**2, -1 / z, -rotation / z**2] if np.isfinite(rotation) else [0, 1, 0, 1]
        shear = [translation / z**3, 1, translation / z**3, -1] if np.isfinite(translation) else [1, 0, 1, 0]
        return np.linalg.det([moment, shear, [ch, sh, -c, -s], [sh, ch, s, -c]]) / ch

    grid = np.arange(0.05, 4 * n, 0.01)
    values = [determinant(z) for z in grid]
    crossings = [i for i in range(grid.size - 1) if values[i] * values[i + 1] < 0][:n]
    return np.array([scipy.optimize.brentq(determinant, grid[i], grid[i + 1], xtol=1e-14) for i in crossings])


@pytest.mark.parametrize(("rotation", "translation"), [(20.0, np.inf), (np.inf, 300.0), (80.0, 5e4), (2.0, 40.0)])
def test_frequencies_with_a_clamp_that_gives(rotation, translation):
    stiff = Beam(0.7, 70e9, 2700.0, diameter=0.01)
    springs = {"rotation": rotation / 0.7, "translation": translation / 0.7**3}
    clamp = Clamp(**{name: k * stiff.bending_stiffness for name, k in springs.items() if np.isfinite(k)})
    rig = Rig("bench", dataclasses.replace(stiff, clamp=clamp), (), (Sensor(1, 0.7),))
    scale = np.sqrt(stiff.bending_stiffness / stiff.mass_per_length) / 0.7**2 / (2 * np.pi)
    expected = elastic_clamp_roots(rotation, translation, 5) ** 2 * scale
    np.testing.assert_allclose(cm.beam.natural_frequencies(rig, 5), expected, rtol=1e-9)
