"""Bouc-Wen hysteresis with known loops (verification.md) and the loops that the engines' grease runs through."""

import numba
import numpy as np
import pytest
import scipy.integrate

from clearance_mj.clearance.grease import bouc_wen_step


@numba.njit
def loop(reversal, cycles, steps, a, beta, gamma, exponent):
    """Steady loop between ± reversal: z at the last reversal and energy of the last cycle."""
    z, energy, dx = 0.0, 0.0, reversal / steps
    for _ in range(steps):
        z = bouc_wen_step(z, dx, a, beta, gamma, exponent)
    for _ in range(cycles):
        energy = 0.0
        for i in range(4 * steps):
            d = -dx if i < 2 * steps else dx
            new = bouc_wen_step(z, d, a, beta, gamma, exponent)
            energy += 0.5 * (z + new) * d
            z = new
    return z, energy


@pytest.mark.parametrize(
    ("exponent", "reversal", "z", "energy"),
    [(1, 1, 0.721535, 0.593245), (1, 3, 0.993307, 7.04011), (2, 1, 0.825659, 0.463088), (2, 3, 0.999909, 7.61416)],
)
def test_steady_loops(exponent, reversal, z, energy):
    """verification.md: A = 1, β = γ = 1/2."""
    found = loop(float(reversal), 30, 3000, 1.0, 0.5, 0.5, float(exponent))
    assert found == pytest.approx((z, energy), rel=2e-6)


@pytest.mark.parametrize(("reversal", "z", "energy"), [(5e-4, 31.836, 6.4624e-3), (1e-3, 77.757, 4.91645e-2)])
def test_benchmark_set(reversal, z, energy):
    """Noël & Schoukens (2016): ż = αẏ - β(γ|ẏ||z|^(ν-1) z + δẏ|z|^ν), α = 5e4, β = 1e3, γ = 0.8, δ = -1.1, ν = 1."""
    found = loop(reversal, 12, 3000, 5e4, 1e3 * 0.8, 1e3 * -1.1, 1.0)
    assert found == pytest.approx((z, energy), rel=1e-5)


@pytest.mark.parametrize(("exponent", "curve"), [(1.0, lambda x: 1 - np.exp(-x)), (2.0, np.tanh)])
def test_loading(exponent, curve):
    """z = 1 - e^{-x} for n = 1, tanh x for n = 2; the other way it is the mirror image."""
    x = np.linspace(0, 2.5, 1001)
    for sign in (1.0, -1.0):
        z = [0.0]
        for dx in np.diff(x):
            z.append(bouc_wen_step(z[-1], sign * dx, 1.0, 0.5, 0.5, exponent))
        np.testing.assert_allclose(z, sign * curve(x), atol=2e-6)


def test_any_path_and_exponent():
    """An ODE solver along a path of two tones, n = 1.7, piece by piece between the turning points."""
    a, beta, gamma, n = 0.9, 6.0, -2.0, 1.7
    t = np.linspace(0, 6, 12001)

    def path(t):
        return 0.4 * np.sin(2 * t) + 0.25 * np.sin(7.3 * t)

    def speed(t):
        return 0.8 * np.cos(2 * t) + 1.825 * np.cos(7.3 * t)

    def rate(t, z):
        v, z = speed(t), z[0]
        return [a * v - beta * abs(v) * abs(z) ** (n - 1) * z - gamma * v * abs(z) ** n]

    exact = scipy.integrate.solve_ivp(rate, (0, 6), [0.0], rtol=1e-10, atol=1e-12, t_eval=t, max_step=0.01).y[0]
    z = [0.0]
    for dx in np.diff(path(t)):
        z.append(bouc_wen_step(z[-1], dx, a, beta, gamma, n))
    np.testing.assert_allclose(z, exact, atol=2e-6)
