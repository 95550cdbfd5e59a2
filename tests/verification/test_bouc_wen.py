"""Bouc-Wen hysteresis with known loops.

The compiled step is the one that the engines' grease runs through.
"""

import itertools

import numpy as np
import pytest
import scipy.integrate

from clearance_mj.clearance.greases.bouc_wen import bouc_wen_step
from clearance_mj.core.jit import jit


@jit
def along_one(z, dx, a, beta, gamma, exponent):
    """A step of one coordinate."""
    return bouc_wen_step((z,), (dx,), a, beta, gamma, exponent)[0]


@jit
def loop(step, reversal, cycles, steps, a, beta, gamma, exponent):
    """Steady loop between ± reversal by a compiled step: z at the last reversal and energy of the last cycle."""
    z, energy, dx = 0.0, 0.0, reversal / steps
    for _ in range(steps):
        z = step(z, dx, a, beta, gamma, exponent)
    for _ in range(cycles):
        energy = 0.0
        for i in range(4 * steps):
            d = -dx if i < 2 * steps else dx
            new = step(z, d, a, beta, gamma, exponent)
            energy += 0.5 * (z + new) * d
            z = new
    return z, energy


CASES = [(1, 1, 0.721535, 0.593245), (1, 3, 0.993307, 7.04011), (2, 1, 0.825659, 0.463088), (2, 3, 0.999909, 7.61416)]
steady_loops = pytest.mark.parametrize(("exponent", "reversal", "z", "energy"), CASES)
BENCHMARK = [(5e-4, 31.836, 6.4624e-3), (1e-3, 77.757, 4.91645e-2)]
benchmark_set = pytest.mark.parametrize(("reversal", "z", "energy"), BENCHMARK)


@steady_loops
def test_steady_loops(exponent, reversal, z, energy, measured):
    """A = 1, β = γ = 1/2: at the reversal z = 1 - e^{z-2X} for n = 1, z = tanh(2X - z) for n = 2."""
    loop_values = loop(along_one, float(reversal), 30, 3000, 1.0, 0.5, 0.5, float(exponent))
    what, source = f"steady loop, n = {exponent}, X = {reversal}", "closed form, A = 1, β = γ = 1/2"
    measured.equal(f"{what}: z at reversal", loop_values[0], z, source, rel=2e-6)
    measured.equal(f"{what}: energy per cycle", loop_values[1], energy, source, rel=2e-6)


@benchmark_set
def test_benchmark_set(reversal, z, energy, measured):
    """Noël & Schoukens (2016): ż = αẏ - β(γ|ẏ||z|^(ν-1) z + δẏ|z|^ν), α = 5e4, β = 1e3, γ = 0.8, δ = -1.1, ν = 1."""
    loop_values = loop(along_one, reversal, 12, 3000, 5e4, 1e3 * 0.8, 1e3 * -1.1, 1.0)
    what, source = f"benchmark, Y = {reversal * 1e3:g} mm", "parameters of Noël & Schoukens 2016"
    measured.equal(f"{what}: z at reversal (N)", loop_values[0], z, source, rel=1e-5)
    measured.equal(f"{what}: energy per cycle (J)", loop_values[1], energy, source, rel=1e-5)


def along_path(x, *numbers):
    return list(itertools.accumulate(np.diff(x), lambda z, dx: along_one(z, dx, *numbers), initial=0.0))


@pytest.mark.parametrize(("exponent", "curve"), [(1.0, lambda x: 1 - np.exp(-x)), (2.0, np.tanh)])
def test_loading(exponent, curve, measured):
    """z = 1 - e^{-x} for n = 1, tanh x for n = 2; the other way it is the mirror image."""
    x = np.linspace(0, 2.5, 1001)
    for sign in (1.0, -1.0):
        z = along_path(sign * x, 1.0, 0.5, 0.5, exponent)
        what, source = f"loading {'+' if sign > 0 else '-'}, n = {exponent:g}: error", "1 - e^-x, tanh x"
        measured.below(what, np.max(np.abs(z - sign * curve(x))), 2e-6, source)


def test_any_path_and_exponent(measured):
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
    z = along_path(path(t), a, beta, gamma, n)
    measured.below("path of two tones, n = 1.7: error", np.max(np.abs(z - exact)), 2e-6, "ODE solver at 1e-10")
