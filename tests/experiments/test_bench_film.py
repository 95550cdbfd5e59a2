"""The benches' oil film on a grid beside closed forms and a published table."""

import re

import numpy as np
import pytest
import scipy.optimize

from experiments.benches.film import force, grid

from ..conftest import ROOT


def short(eccentricity, width, psi):
    """P = -(1 - ξ²) (L/D)² sin(θ - ψ) / (2 H³) where it is positive, and 2/3 of it is the mean along the bearing."""
    angle = np.linspace(0, 2 * np.pi, 20001)[:-1]
    mean = width**2 / 3 * np.maximum(-np.sin(angle - psi), 0.0) / (1 - eccentricity * np.cos(angle)) ** 3
    return [-float(np.mean(mean * part) * 2 * np.pi) for part in (np.cos(angle), np.sin(angle))]


@pytest.mark.parametrize("eccentricity", [0.2, 0.5, 0.7])
@pytest.mark.parametrize(("turning", "squeezing"), [(1.0, 0.0), (0.0, 1.0), (0.6, -0.8)])
def test_a_short_bearing_is_ocvirks(eccentricity, turning, squeezing):
    """Turning in closed form, and any motion by the integral over the half in which the film is pressed."""
    width, psi = 0.02, np.arctan2(squeezing, turning)
    want = short(eccentricity, width, psi)
    assert force(grid(eccentricity, width), psi) == pytest.approx(want, rel=0.01, abs=0.01 * np.hypot(*want))
    if not squeezing:  # Ocvirk's integrals
        rest = 1 - eccentricity**2
        closed = [-2 * eccentricity / rest**2, np.pi / (2 * rest**1.5)]
        assert want == pytest.approx([width**2 / 3 * value for value in closed], rel=1e-4)


@pytest.mark.parametrize("eccentricity", [0.1, 0.4, 0.7])
def test_a_long_bearing_with_a_whole_film_is_sommerfelds(eccentricity):
    """W/(12 μ A R L (R/C)²) with A = ε Ω/2 is 2π / ((2 + ε²) √(1 - ε²)), across the displacement."""
    outwards, across = force(grid(eccentricity, 400.0), 0.0, cavitated=False)
    want = 2 * np.pi / ((2 + eccentricity**2) * np.sqrt(1 - eccentricity**2))
    assert (outwards, across) == pytest.approx((0.0, want), abs=2e-3 * want)


def test_how_far_a_short_bearing_is_from_one_of_finite_width():
    """The table of the page on structures."""
    page = (ROOT / "docs" / "structures.md").read_text("utf-8")
    rows = re.findall(r"^\| (0\.\d+|1\.0)((?: \| \d\.\d\d){4}) \|$", page, re.M)
    assert len(rows) == 4
    for width, ratios in rows:
        for eccentricity, ratio in zip((0.2, 0.5, 0.8, 0.9), ratios.split("|")[1:]):
            finite = force(grid(eccentricity, float(width)), 0.0)
            load_ratio = np.hypot(*short(eccentricity, float(width), 0.0)) / np.hypot(*finite)
            assert load_ratio == pytest.approx(float(ratio), abs=0.0051)


def test_two_grooves_beside_lund_and_thomsen():
    """L/D = 1, grooves of 20° across the load, S = 0.235: ε = 0.460, attitude 49.27° (Lund & Thomsen, 1978)."""

    def load_and_attitude(attitude, eccentricity):
        across = np.pi / 2 * np.array((1, -1)) - attitude  # the load acts at -attitude
        outwards, along = force(grid(eccentricity, 1.0, tuple(across), np.radians(20)), 0.0)
        return np.hypot(outwards, along), np.arctan2(along, -outwards)

    eccentricity = 0.460
    attitude = scipy.optimize.brentq(lambda at: load_and_attitude(at, eccentricity)[1] - at, 0.3, 1.4, xtol=1e-3)
    load = 12 * load_and_attitude(attitude, eccentricity)[0] * eccentricity / 2  # W / (μ Ω R L (R/C)²)
    sommerfeld = 2 / (2 * np.pi * load)  # S = μ N D L (R/C)² / W
    assert np.degrees(attitude) == pytest.approx(49.27, rel=0.02) and sommerfeld == pytest.approx(0.235, rel=0.02)
