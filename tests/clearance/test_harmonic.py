"""Elements with memory under a harmonic motion. Closed forms, and an oscillator marched to its steady state."""

import numpy as np
import pytest

from clearance_mj.clearance import MaxwellSlip
from clearance_mj.clearance.harmonic import harmonic_stiffness, periodic_amplitudes, slip_stiffness
from clearance_mj.core.errors import LawError

SPRINGS, FORCES = (2e4, 5e3, 8e3), (2.0, 1.5, 0.4)
GRID = np.geomspace(1e-6, 1.0, 2000)


def test_energy_of_a_slider():
    """A cycle of a spring with a Coulomb slider is a parallelogram of 4 F (X - F/k)."""
    x, k, f = np.array([2e-4, 1e-3, 5e-2]), 1e4, 1.0
    np.testing.assert_allclose(np.pi * x**2 * slip_stiffness(x, [k], [f]).imag, 4 * f * (x - f / k), rtol=1e-12)


def test_before_slip_and_far_beyond():
    """All springs before slip; beyond, a Coulomb force: 4 F / (π X), all of it damping."""
    assert slip_stiffness(1e-5, SPRINGS, FORCES) == pytest.approx(sum(SPRINGS))
    far = slip_stiffness(10.0, [1e4], [3.0])
    assert far.imag == pytest.approx(4 * 3.0 / (np.pi * 10), rel=1e-3)
    assert far.real < 0.01 * far.imag


def test_half_slipped():
    """X = 2 F/k: θ = π/2, so the stiffness is k/2 and the imaginary part k/π (Caughey 1960)."""
    assert slip_stiffness(2e-3, [1e4], [10.0]) == pytest.approx(5e3 + 1j * 1e4 / np.pi)


def test_marching_the_law_agrees_with_the_closed_form(measured):
    x, omega = np.array([5e-5, 2e-4, 5e-4, 3e-3]), 500.0
    model = MaxwellSlip(springs=SPRINGS, forces=FORCES, elastic=1e3, damping=2.0)
    known = slip_stiffness(x, SPRINGS, FORCES) + 1e3 + 2j * omega
    error = np.abs(harmonic_stiffness(model, x, omega) / known - 1).max()
    measured.below("Maxwell-slip marched over two periods: complex stiffness", error, 1e-4, "Caughey's closed form")


def test_stiffer_before_it_slides():
    """A static friction above the sliding one needs more force in a slow motion than in a fast one."""
    model = MaxwellSlip(springs=(1e4,), forces=(1.0,), static_ratio=1.5, stribeck_speed=1e-2)
    slow, fast = (harmonic_stiffness(model, 1e-3, omega).imag for omega in (0.1, 1e5))
    coulomb = slip_stiffness(1e-3, [1e4], [1.5]).imag, slip_stiffness(1e-3, [1e4], [1.0]).imag
    assert slow == pytest.approx(coulomb[0], rel=1e-3)
    assert fast == pytest.approx(coulomb[1], rel=0.01)


def test_response_against_marching(measured):
    """m x'' + c x' + k x + sliders = F cos ωt, by the explicit central difference until nothing changes."""
    mass, elastic, damping, force = 1.0, 2e5, 4.0, 3.0
    springs, forces = np.array([1e4, 1e4, 1e4]), np.array([0.3, 1.5, 6.0])
    for omega in (440.0, 462.0, 480.0):
        stiffness = slip_stiffness(GRID, springs, forces) + elastic + 1j * omega * damping
        [amplitude] = periodic_amplitudes(GRID, stiffness, mass, omega, force)
        per_period, periods = 256, 250
        step = 2 * np.pi / omega / per_period
        x = before = 0.0
        stretch, path = np.zeros(3), np.empty(per_period * periods)
        drive = force * np.cos(omega * step * np.arange(path.size))
        limit = forces / springs
        for i in range(path.size):
            pull = elastic * x + springs @ stretch
            inner = 2 * x - before + step**2 / mass * (drive[i] - pull) + damping * step / (2 * mass) * before
            after = inner / (1 + damping * step / (2 * mass))
            stretch = np.minimum(np.maximum(stretch + after - x, -limit), limit)
            before, x = x, after
            path[i] = x
        marched = 2 * np.abs(np.mean(path[-per_period:] * np.exp(-2j * np.pi * np.arange(per_period) / per_period)))
        what = f"oscillator with three sliders at {omega:g} rad/s: amplitude by harmonic balance, relative error"
        measured.below(what, abs(amplitude / marched - 1), 0.01, "marched over 250 periods")


def test_a_linear_oscillator_has_one_amplitude():
    """F / |k - m ω² + jωc|"""
    [amplitude] = periodic_amplitudes(GRID, np.full(GRID.shape, 100 + 3j), 1.0, 9.0, 2.0)
    assert amplitude == pytest.approx(2.0 / abs(19 + 3j), rel=1e-6)


def test_a_bent_resonance_has_three():
    """Duffing's softening k (1 - X²): where F is large enough for the fold, three solutions of the same equation."""
    amplitudes = periodic_amplitudes(GRID, 1 - 0.75 * GRID**2 + 0.02j, 1.0, 0.95, 0.01)
    assert amplitudes.size == 3
    np.testing.assert_allclose(np.abs(1 - 0.75 * amplitudes**2 + 0.02j - 0.95**2) * amplitudes, 0.01, rtol=1e-3)


@pytest.mark.parametrize(("call", "message"), [
    (lambda: slip_stiffness(0.0, [1.0], [1.0]), "must be > 0 m"),
    (lambda: slip_stiffness(1.0, [1.0, 2.0], [1.0]), r"got \(2,\) and \(1,\)"),
    (lambda: harmonic_stiffness(MaxwellSlip((1.0,), (1.0,)), 1.0, 0.0), "must be > 0"),
    (lambda: periodic_amplitudes(GRID[::-1], GRID, 1.0, 1.0, 1.0), "must rise"),
    (lambda: periodic_amplitudes(GRID, GRID[1:], 1.0, 1.0, 1.0), r"got \(2000,\) and \(1999,\)"),
])  # fmt: skip
def test_refused(call, message):
    with pytest.raises(LawError, match=message):
        call()
