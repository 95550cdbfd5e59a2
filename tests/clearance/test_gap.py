"""The gap function (Eq. 11) and its describing function."""

import numpy as np
import pytest
import scipy.integrate

from clearance_mj.clearance import describing_function, gap


def test_gap():
    x = np.array([-5.0, -2.0, -1.0, 0.0, 1.0, 2.0, 2.5])
    np.testing.assert_array_equal(gap(x, 2.0), [-3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5])
    np.testing.assert_array_equal(gap(x, 0.0), x)


def test_gap_of_each_bushing():
    np.testing.assert_allclose(gap([[4e-4, -4e-4], [1e-4, -1e-3]], [3e-4, 5e-4]), [[1e-4, 0], [0, -5e-4]], atol=1e-19)


def test_gap_hides_no_nan():
    with np.errstate(invalid="ignore"):
        assert np.isnan(gap(np.nan, 1.0))


@pytest.mark.parametrize(("ratio", "expected"), [(2.0, 0.391002), (3.0, 0.583583)])
def test_describing_function(ratio, expected):
    """physics.md, section 3 (Gelb & Vander Velde 1968, dead zone)."""
    assert describing_function(ratio * 3e-4, 3e-4) == pytest.approx(expected, abs=1e-6)


def test_describing_function_is_the_first_harmonic():
    """(1/πX) ∫ gap(X cos φ) cos φ dφ over a turn, by quadrature."""
    for a in (1.0001, 1.2, 2.0, 10.0, 300.0):
        integral = scipy.integrate.quad(lambda p, a=a: (a * np.cos(p) - 1) * np.cos(p), 0, np.arccos(1 / a))[0]
        assert describing_function(a, 1.0) == pytest.approx(4 / (np.pi * a) * integral, rel=1e-7, abs=1e-12)


def test_describing_function_inside_the_gap():
    np.testing.assert_allclose(describing_function([1e-9, 0.5, 1.0], 1.0), 0, atol=1e-15)
    assert describing_function(1.0, 0.0) == 1
