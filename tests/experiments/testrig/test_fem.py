import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

from clearance_mj import Beam, PointMass, RigError
from experiments.testrig.fem import FiniteElements

from ...conftest import dense
from ...refusals import assert_refused

BEAM = Beam(length=0.8, young_modulus=70e9, density=2700.0, diameter=0.01)


def frequencies(elements, extra_stiffness=0.0):
    """Natural frequencies in Hz of the assembled matrices."""
    values = scipy.linalg.eigh(dense(elements.stiffness) + extra_stiffness, dense(elements.mass), eigvals_only=True)
    return np.sqrt(values) / (2 * np.pi)


def hertz(roots):
    return np.array(roots) ** 2 * np.sqrt(BEAM.bending_stiffness / BEAM.mass_per_length) / BEAM.length**2 / (2 * np.pi)


def test_cantilever_with_tip_mass():
    # 1 + cos cosh + μ λ (cos sinh - sin cosh) = 0, μ the tip mass over the beam's (Blevins 1979, table 8-8).

    def equation(x):
        return 1 + np.cos(x) * np.cosh(x) + 0.6 * x * (np.cos(x) * np.sinh(x) - np.sin(x) * np.cosh(x))

    roots = [scipy.optimize.brentq(equation, a, b) for a, b in ((0.5, 1.8), (3.9, 4.6), (7.0, 7.8))]
    elements = FiniteElements.of_shaft(BEAM, [PointMass(BEAM.length, 0.6 * BEAM.mass_per_length * BEAM.length)])
    np.testing.assert_allclose(frequencies(elements)[:3], hertz(roots), rtol=1e-6)


def test_a_mass_inside_an_element_counts_as_much_as_one_at_a_node():
    place = 0.5 * BEAM.length
    even, odd = (FiniteElements.of_shaft(BEAM, [PointMass(place, 0.2)], n) for n in (64, 65))
    np.testing.assert_allclose(frequencies(even)[:4], frequencies(odd)[:4], rtol=2e-5)


@pytest.mark.parametrize("place", [0.25, 0.62503, 1.0])
def test_static_deflection(place):
    # Load F at a reads F a²(3 x - a) / (6 EI) at x >= a.
    elements = FiniteElements.of_shaft(BEAM)
    load, tip = elements.points([place * BEAM.length, BEAM.length]).dense(elements.count)
    deflection = tip @ scipy.linalg.solveh_banded(elements.stiffness, load, lower=True)
    a = place * BEAM.length
    assert deflection == pytest.approx(a**2 * (3 * BEAM.length - a) / (6 * BEAM.bending_stiffness), rel=1e-8)


def test_inertia_is_the_load_of_the_shaken_clamp():
    # A shaft under its own weight w per length sags w l⁴ / (8 EI) at the tip, and m l³ / (3 EI) for a tip mass.
    mass, l = 0.3, BEAM.length
    elements = FiniteElements.of_shaft(BEAM, [PointMass(l, mass)])
    sag = scipy.linalg.solveh_banded(elements.stiffness, elements.inertia, lower=True)[-2]
    expected = (BEAM.mass_per_length * l**4 / 8 + mass * l**3 / 3) / BEAM.bending_stiffness
    assert sag == pytest.approx(expected, rel=1e-9)


def test_points_read_a_cubic_exactly():
    elements = FiniteElements.of_shaft(BEAM, elements=8)
    nodes = np.arange(1, 9) * BEAM.length / 8
    motion = np.stack((nodes**2 + nodes**3, 2 * nodes + 3 * nodes**2), axis=1).ravel()
    x = np.array([0.01, 0.1, 0.33, 0.55, 0.8])
    np.testing.assert_allclose(elements.points(x).dense(elements.count) @ motion, x**2 + x**3, rtol=1e-12)


def test_needs_two_elements():
    assert_refused(RigError, "at least 2 elements, got 1", FiniteElements.of_shaft, BEAM, elements=1)
