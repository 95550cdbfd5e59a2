"""Modes out of FRFs with known poles: closed forms of small systems, clean, noisy and with a clearance."""

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.signals import FRF, Response, estimate_frf, extract_modes, mac
from clearance_mj.signals.excitation import random

F = np.arange(5, 220.25, 0.5)
M = np.diag([1.0, 0.5])
K = np.array([[9e4, -5e4], [-5e4, 1.2e5]])
C = np.array([[6.0, -2.0], [-2.0, 9.0]])  # not proportional to M and K: complex modes


def true_modes(m=M, c=C, k=K):
    """Frequencies (Hz), damping ratios and complex shapes out of the eigenvalues of the state matrix."""
    n = len(m)
    inverse = np.linalg.inv(m)
    poles, vectors = np.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ k, -inverse @ c]]))
    order = [i for i in np.argsort(np.abs(poles)) if poles[i].imag > 0]
    return np.abs(poles[order]) / (2 * np.pi), -poles[order].real / np.abs(poles[order]), vectors[:n, order]


def two_modes(hertz, damping, heights=(1.0, 1.0)):
    """Terms (n_f, 2) of two modes, s² / (s² + 2ζωs + ω²) times a height each."""
    s, rates = 2j * np.pi * F[:, None], 2 * np.pi * np.array(hertz)
    return s**2 / (s**2 + 2 * np.array(damping) * rates * s + rates**2) * np.array(heights)


def base_frf(frequency=F, m=M, c=C, k=K):
    """Absolute over base acceleration: H = 1 + ω² (K - ω²M + jωC)⁻¹ M 1."""
    w = 2 * np.pi * frequency[:, None, None]
    relative = np.linalg.solve(k - w**2 * m + 1j * w * c, m @ np.ones((len(m), 1)))
    return FRF(frequency, 1 + (w**2 * relative)[..., 0].T)


def force_frf(place, frequency=F, m=M, c=C, k=K):
    """Accelerance: H = -ω² (K - ω²M + jωC)⁻¹ e."""
    w = 2 * np.pi * frequency[:, None, None]
    receptance = np.linalg.solve(k - w**2 * m + 1j * w * c, np.eye(len(m))[:, [place]])
    return FRF(frequency, (-(w**2) * receptance)[..., 0].T, quantity="acceleration/force")


def with_noise(frf, ratio, seed, proportional=False):
    """Complex Gaussian noise: a share of the root mean square of each response, or of each value."""
    rng = np.random.default_rng(seed)
    noise = (rng.standard_normal(frf.value.shape) + 1j * rng.standard_normal(frf.value.shape)) / np.sqrt(2)
    level = frf.value if proportional else np.sqrt(np.mean(np.abs(frf.value) ** 2, axis=2, keepdims=True))
    return FRF(frf.frequency, frf.value + ratio * noise * level)


def chain(n):
    """A chain of n equal masses and springs, fixed at one end: ω_i = 2√(k/m) sin((2i-1)π / (4n+2)); 1 % damping."""
    stiffness = 4e5 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    stiffness[-1, -1] = 4e5
    squares, vectors = np.linalg.eigh(stiffness)
    return np.eye(n), vectors @ np.diag(0.02 * np.sqrt(squares)) @ vectors.T, stiffness, vectors


@pytest.mark.parametrize("frf", [base_frf(), force_frf(0), force_frf(1)], ids=["base", "force 0", "force 1"])
def test_two_degrees_of_freedom_without_noise(frf):
    frequency, damping, shape = true_modes()
    modes = extract_modes(frf, n_modes=2)
    np.testing.assert_allclose(modes.frequency, frequency, rtol=1e-9)
    np.testing.assert_allclose(modes.damping, damping, rtol=1e-7)
    np.testing.assert_allclose(modes.shape, shape / shape[np.argmax(np.abs(shape), axis=0), [0, 1]], atol=1e-7)


@pytest.mark.parametrize(("ratio", "proportional", "of_frequency", "of_damping", "least_mac"), [
    (0.01, False, 1e-3, 0.03, 0.9999), (0.01, True, 1e-3, 0.03, 0.9999), (0.3, False, 0.01, 0.5, 0.99),
])  # fmt: skip
@pytest.mark.parametrize("seed", range(3))
def test_noise(seed, ratio, proportional, of_frequency, of_damping, least_mac):
    frequency, damping, shape = true_modes()
    modes = extract_modes(with_noise(base_frf(), ratio, seed, proportional), n_modes=4)
    np.testing.assert_allclose(modes.frequency, frequency, rtol=of_frequency)
    np.testing.assert_allclose(modes.damping, damping, rtol=of_damping)
    assert np.all(np.diag(mac(modes.shape, shape)) > least_mac)


@pytest.mark.parametrize("seed", range(3))
def test_a_mode_narrower_than_the_lines_is_found_under_ten_per_cent_of_noise(seed):
    """9 Hz with 1 % damping is 0.18 Hz wide, between lines 0.5 Hz apart; the mode at 150 Hz stands on 6 lines."""
    shape = np.array([[1.0, 0.5], [0.8, -1.0], [0.4, 0.7], [0.2, 1.0]])
    modes = extract_modes(with_noise(FRF(F, 1 + shape @ two_modes((9.2, 150), 0.01).T), 0.1, seed), n_modes=3)
    np.testing.assert_allclose(modes.frequency, [9.2, 150], rtol=2e-3)


@pytest.mark.parametrize("sensors", [1, 2, 8])
@pytest.mark.parametrize("seed", range(4))
def test_noise_alone_has_no_modes(seed, sensors):
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((sensors, F.size)) + 1j * rng.standard_normal((sensors, F.size))
    modes = extract_modes(FRF(F, noise))
    assert modes.frequency.size == 0 and modes.shape.shape == (sensors, 0)


def test_eight_modes_and_the_modes_outside_the_band():
    """Three of the eight lie in the band of lines; the other five are what the residual terms stand for."""
    n = 8
    mass, damping, stiffness, vectors = chain(n)
    exact = np.sqrt(4e5) / np.pi * np.sin((2 * np.arange(1, n + 1) - 1) * np.pi / (4 * n + 2))
    whole = base_frf(np.arange(5, 250.25, 0.5), mass, damping, stiffness)
    modes = extract_modes(whole, n_modes=8)
    np.testing.assert_allclose(modes.frequency, exact, rtol=1e-9)
    np.testing.assert_allclose(modes.damping, 0.01, rtol=1e-7)
    part = extract_modes(whole, n_modes=8, band=(5, 105))
    np.testing.assert_allclose(part.frequency, exact[:3], rtol=1e-4)
    np.testing.assert_allclose(part.damping, 0.01, rtol=0.01)
    assert np.all(np.diag(mac(part.shape, vectors[:, :3])) > 0.9999)


def test_the_strongest_mode_comes_first():
    """A base shakes the first mode of a chain most; it stands 9 times as high as the second here."""
    mass, damping, stiffness, _ = chain(2)
    modes = extract_modes(base_frf(np.arange(20, 180.25, 0.5), mass, damping, stiffness), n_modes=1)
    assert modes.frequency == pytest.approx([np.sqrt(4e5) / np.pi * np.sin(np.pi / 10)], rel=0.01)


def test_a_mode_500_times_weaker_than_its_neighbour():
    """Peaks of 25 and of 0.05, under noise of 1e-4 of the root mean square."""
    shape = np.array([[1.0, 0.5], [0.8, -1.0], [0.2, 0.7], [0.0, 1.0]])
    peaks = two_modes((40, 120), 0.02, (1.0, 0.002))
    modes = extract_modes(with_noise(FRF(F, shape @ peaks.T), 1e-4, 0), n_modes=3)
    np.testing.assert_allclose(modes.frequency, [40, 120], rtol=2e-3)


def test_two_modes_closer_than_their_half_power_bandwidth():
    """100 and 101.5 Hz with 1 % damping: 2 Hz wide each."""
    rates = 2 * np.pi * np.array([100.0, 101.5])
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    stiffness, damping = (turn @ np.diag(d) @ turn.T for d in (rates**2, 0.02 * rates))
    frf = with_noise(force_frf(0, np.arange(60, 150.25, 0.25), np.eye(2), damping, stiffness), 0.002, 0)
    modes = extract_modes(frf, n_modes=2)
    np.testing.assert_allclose(modes.frequency, [100, 101.5], rtol=5e-4)
    np.testing.assert_allclose(modes.damping, 0.01, rtol=0.05)
    assert np.all(np.diag(mac(modes.shape, turn)) > 0.99)


def test_a_mode_that_noise_hides_from_lscf_is_found_in_what_is_left():
    """A broad mode under noise of its own height, beside a clean one; the poles of it that LSCF finds are unstable."""
    rng = np.random.default_rng(1)
    shape = np.array([[1.0, 0.5], [0.8, -1.0], [0.2, 0.7], [-0.4, 1.0]])
    around = np.exp(-(((F - 120) / 40) ** 2))
    noise = (rng.standard_normal((4, F.size)) + 1j * rng.standard_normal((4, F.size))) * around
    modes = extract_modes(FRF(F, shape @ two_modes((40, 120), (0.02, 0.06), (0.3, 0.1)).T + 0.6 * noise))
    np.testing.assert_allclose(modes.frequency, [40, 120], rtol=0.03)
    assert np.diag(mac(modes.shape, shape)) == pytest.approx(1, abs=0.05)


def test_a_smooth_curve_between_two_modes_is_no_mode():
    mass, damping, stiffness, _ = chain(2)  # 62.2 and 162.9 Hz
    modes = extract_modes(base_frf(np.arange(20, 220.25, 0.5), mass, damping, stiffness), band=(85, 140))
    assert modes.frequency.size == 0


def bumping(level, gap=4e-4, stiffness=2e5, fs=2048, steps=4):
    """Accelerations of the two masses when the second one meets stops, by semi-implicit Euler."""
    shake = random(8.0, fs, (5, 220), level, seed=2)
    base = np.interp(np.arange(shake.value.size * steps) / steps / fs, shake.time, shake.value).tolist()
    (k11, k12), (_, k22) = K.tolist()
    (c11, c12), (_, c22) = C.tolist()
    x = y = u = v = 0.0
    out = []
    dt = 1 / fs / steps
    for a in base:
        over = max(y - gap, 0.0) + min(y + gap, 0.0)
        p = -k11 * x - k12 * y - c11 * u - c12 * v
        q = (-k12 * x - k22 * y - c12 * u - c22 * v - stiffness * over) / 0.5
        out.append((p, q))
        u += dt * (p - a)
        v += dt * (q - a)
        x += dt * u
        y += dt * v
    return Response(float(fs), shake.value, np.array(out)[::steps].T, band=shake.band)


def test_a_clearance_raises_the_frequencies_towards_those_in_contact():
    """Below the gap the modes are those of K; always in contact they would be those of K + 2e5 N/m at the stop."""
    free, _, _ = true_modes()
    closed, _, _ = true_modes(k=K + np.diag([0, 2e5]))
    low, high = (extract_modes(estimate_frf(bumping(level)), n_modes=2) for level in (0.5, 20.0))
    np.testing.assert_allclose(low.frequency, free, rtol=3e-3)
    assert high.frequency.size == 2 and np.all(high.frequency > 1.01 * low.frequency)
    assert np.all(high.frequency < closed)


def test_it_is_deterministic_and_the_level_of_the_frf_does_not_matter():
    frf = with_noise(base_frf(), 0.05, 1)
    modes, again, scaled = extract_modes(frf), extract_modes(frf), extract_modes(FRF(F, 1e-6 * frf.value))
    assert modes == again
    np.testing.assert_allclose(modes.frequency, scaled.frequency, rtol=1e-7)
    np.testing.assert_allclose(modes.damping, scaled.damping, rtol=1e-5)


@pytest.mark.parametrize(("frf", "options", "tolerance"), [
    (base_frf(), {"n_modes": 6}, 1e-6),  # no more than the system has
    (base_frf(), {"n_modes": 2, "max_order": 6}, 1e-9),
    (base_frf(), {"n_modes": 2, "max_order": 135}, 1e-9),
    (force_frf(0, np.arange(0, 220.25, 0.5)), {"n_modes": 2}, 1e-9),
], ids=["six modes", "low order", "high order", "from 0 Hz"])  # fmt: skip
def test_options_that_leave_the_modes_as_they_are(frf, options, tolerance):
    np.testing.assert_allclose(extract_modes(frf, **options).frequency, true_modes()[0], rtol=tolerance)


@pytest.mark.parametrize(("frf", "arguments", "message"), [
    (base_frf(), {"n_modes": 0}, "n_modes must be >= 1"),
    (base_frf(), {"max_order": 5}, "max_order > 5"),
    (base_frf(), {"band": (300, 400)}, "no line between 300 and 400 Hz"),
    (base_frf(), {"band": (50, 53)}, "modes need at least 18 lines, the band holds 7"),
    (FRF(F, np.where(F == 50, np.nan, 1.0)[None]), {}, "not finite at 50 Hz"),
    (FRF(F, np.zeros((2, F.size))), {}, "zero at every line"),
])  # fmt: skip
def test_frfs_without_modes_to_find_are_refused(frf, arguments, message):
    with pytest.raises(RecordError, match=message):
        extract_modes(frf, **arguments)
