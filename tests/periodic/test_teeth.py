"""Teeth under a mean torque: responses of Kahraman and Singh's gear pair. Truth: exact motions, by shooting.

x'' + 2ζ x' + f(x) = F_m + F_a cos ωt with f = x - 1, 0, x + 1 beyond, between and below ±1, where the teeth alone hold
it: A. Kahraman and R. Singh, "Non-linear dynamics of a spur gear pair", Journal of Sound and Vibration 142 (1990).
"""

import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import clearance_mj as cm
from clearance_mj.clearance import ContactLaw, KelvinVoigt
from clearance_mj.rig import Load

from .one_mass import one_mass
from .piecewise import Oscillator

TURN, DAMPING, MEAN = 2 * np.pi, 0.1, 0.1
QUIET, LOUD = 0.05, 0.2
HARMONICS, SAMPLES = 41, 2048
MODEL = cm.Model(one_mass(0.0, DAMPING, loads=(Load("1:X", force=MEAN),)), ContactLaw(KelvinVoigt(1.0)))
TABLES = {
    QUIET: {
        1.2: (0.992652, 1.206756), 1.1: (0.951161, 1.237332), 1.0: (0.895288, 1.269255), 0.9: (0.816058, 1.305968),
        0.8: (0.700496, 1.350124), 0.7: (0.527275, 1.405221), 0.6: (0.261206, 1.476522), 0.5: (-0.140225, 1.571653),
    },
    LOUD: {
        1.5: (0.947924, 1.235923), 1.2: (0.811129, 1.295143), 1.0: (0.625345, 1.351164), 0.8: (0.258017, 1.432540),
        0.6: (-0.579239, 1.564457), 0.55: (-0.949621, 1.611677),
    },
}  # fmt: skip
"""Lowest and highest place by amplitude and frequency, coming down in frequency from the vibration without impacts"""
MULTIPLIERS = {1.2: 0.76967, 1.1: 0.75156, 1.0: 0.73040, 0.9: 0.70535, 0.8: 0.67523, 0.7: 0.63839, 0.6: 0.59238,
               0.5: 0.53349}  # fmt: skip
"""Largest absolute value of both of the quiet vibration, by frequency; their product is exp(-2ζT)"""
FOLDS = {QUIET: 0.450539, LOUD: 0.543744}
DOUBLES = 1.607666
"""frequency at which the loud vibration's period doubles"""
JOINS = {QUIET: (0.71069, 1.21858), LOUD: (None, 1.72989)}
"""frequencies between which there are impacts: where F_a/|1 - ω² + 2iζω| = F_m"""
STARTS = {QUIET: 1.3, LOUD: 1.8}
POINTS = [(level, omega) for level, rows in TABLES.items() for omega in rows]


def pair(level):
    return Oscillator(DAMPING, (-1.0, 1.0), (1.0, 0.0, 1.0), (MEAN - 1, MEAN, MEAN + 1), level)


@functools.cache
def exact(level):
    """Orbits down to the table's last frequency, by frequency."""
    omegas = np.union1d(np.linspace(STARTS[level], min(TABLES[level]), 400), list(TABLES[level]))[::-1]
    steady = level / (1 - omegas[0] ** 2 + 1j * DAMPING * omegas[0])
    guess = np.array([1 + MEAN + steady.real, (1j * omegas[0] * steady).real])
    return dict(zip(omegas.tolist(), pair(level).branch(omegas, guess)))


@pytest.mark.parametrize(("level", "omega"), POINTS)
def test_shooting_finds_the_table(level, omega):
    orbit = exact(level)[omega]
    assert (orbit.lowest, orbit.highest) == pytest.approx(TABLES[level][omega], abs=1e-6)
    if level == QUIET:
        assert orbit.multiplier == pytest.approx(MULTIPLIERS[omega], abs=1e-5)
    assert np.linalg.det(orbit.monodromy) == pytest.approx(np.exp(-DAMPING * TURN / omega), rel=1e-9)


@pytest.mark.parametrize(("level", "omega"), [(QUIET, 0.7), (QUIET, 0.5), (LOUD, 1.0)])
def test_shooting_is_what_an_ode_solver_finds(level, omega):
    """From the orbit's start it comes back to it, and reaches as far."""

    def rate(time, state):
        x, v = state
        return v, MEAN + level * np.cos(omega * time) - DAMPING * v - np.sign(x) * max(abs(x) - 1, 0)

    start, end = exact(level)[omega].start, TURN / omega
    options = {"t_eval": np.linspace(0, end, 200_001), "rtol": 1e-11, "atol": 1e-13, "max_step": 0.02}
    solution = solve_ivp(rate, (0, end), start, "DOP853", **options)
    np.testing.assert_allclose(solution.y[:, -1], start, atol=1e-9)
    assert (solution.y[0].min(), solution.y[0].max()) == pytest.approx(TABLES[level][omega], abs=1e-6)


@pytest.mark.parametrize("level", TABLES)
def test_shooting_finds_where_stability_changes(level):
    orbits = exact(level)
    last = min(orbits)
    guess = pair(level).branch(np.linspace(last, FOLDS[level] + 1e-3, 30), orbits[last].start)[-1]
    if level == LOUD:
        guess = pair(level).period(0.5438, [-0.95137681, 0.18576768])  # it touches the other flank
    assert pair(level).where(1.0, FOLDS[level] + 1e-4, guess)[0] == pytest.approx(FOLDS[level], abs=1e-6)
    if level == LOUD:
        near = min(orbits, key=lambda omega: abs(omega - DOUBLES))
        assert pair(level).where(-1.0, near, orbits[near])[0] == pytest.approx(DOUBLES, abs=1e-6)


@pytest.mark.parametrize("level", TABLES)
def test_impacts_begin_where_the_vibration_about_the_rest_loses_the_flank(level):
    """Both in the closed form and by the pieces of exact orbits."""
    low, high = JOINS[level]
    for omega in (low, high) if low else (high,):
        assert level / abs(1 - omega**2 + 1j * DAMPING * omega) == pytest.approx(MEAN, rel=1e-4)
    for omega, orbit in exact(level).items():
        assert (len(orbit.pieces) > 1) == (omega < high)


def histories(harmonics):
    """Places at 65,536 samples of a period."""
    return np.fft.irfft(harmonics * np.append(1.0, np.full(harmonics.shape[-1] - 1, 0.5)), 65536) * 65536


@pytest.mark.parametrize(("level", "omega"), POINTS)
def test_so_many_harmonics_suffice(level, omega):
    """Those of the exact orbit, integrated over its samples' cubic splines, reach as far as it to 2e-6."""
    orbit = exact(level)[omega]
    time, first = np.unique(orbit.time, return_index=True)
    even = TURN / omega * np.arange(65536) / 65536
    whole = np.fft.rfft(CubicSpline(time, orbit.place[first])(even)) / 32768
    whole[0] /= 2
    place = histories(whole[: HARMONICS + 1])
    assert (place.min(), place.max()) == pytest.approx((orbit.lowest, orbit.highest), abs=2e-6)


def followed(level, omega, **settings):
    """The branch from above impacts down to a frequency, 1/s."""
    ends = STARTS[level] / TURN, omega / TURN
    return cm.periodic.follow_response(MODEL, level, ends, HARMONICS, SAMPLES, **settings)


@pytest.mark.parametrize(("level", "omega"), POINTS)
def test_a_response_reaches_as_far_as_the_exact_one(level, omega, measured):
    branch = followed(level, omega)
    assert TURN * branch.frequency[-1] == pytest.approx(omega, rel=1e-9) and not branch.ended
    place, orbit = histories(branch.clearance_displacement[-1, 0]), exact(level)[omega]
    off = max(abs(place.min() - orbit.lowest), abs(place.max() - orbit.highest))
    name = f"harmonic balance, teeth under a mean torque, {level:g} at {omega:g}"
    measured.below(f"{name}: lowest and highest place over half the backlash", off, 1e-5, "exact shooting")
    assert abs(branch.multipliers[-1, 0]) == pytest.approx(orbit.multiplier, abs=1e-4 if level == QUIET else 3e-4)
    assert np.prod(branch.multipliers[-1]).real == pytest.approx(np.exp(-DAMPING * TURN / omega), rel=1e-4)
    assert branch.stable[-1] == (level == QUIET)


@pytest.mark.parametrize("level", TABLES)
def test_a_branch_folds_where_the_exact_one_does(level):
    branch = followed(level, 0.9 * FOLDS[level], stability=False) if level == QUIET else followed(level, 0.5)
    (fold, *_) = (point for point in branch.special if point.kind == "fold")
    assert TURN * fold.frequency == pytest.approx(FOLDS[level], abs=1e-5)


def test_its_period_doubles_where_the_exact_multiplier_passes_minus_one():
    branch = followed(LOUD, 1.5)
    (doubling,) = branch.special
    assert doubling.kind == "period doubling"
    assert TURN * doubling.frequency == pytest.approx(DOUBLES, abs=2e-5)
    at = TURN * branch.frequency
    np.testing.assert_array_equal(branch.stable[at > DOUBLES + 1e-3], True)
    np.testing.assert_array_equal(branch.stable[at < DOUBLES - 1e-3], False)


@pytest.mark.parametrize("level", TABLES)
def test_without_impacts_it_is_the_linear_response_about_the_rest(level):
    """Outside of the interval with impacts; at its end the flank is left."""
    low, high = JOINS[level]
    for end in (1.0001 * high, *([0.9999 * low] if low else [])):
        far = 1.3 * end if end > 1 else 0.5 * end
        branch = cm.periodic.follow_response(MODEL, level, (far / TURN, end / TURN), HARMONICS, SAMPLES)
        omega, x = TURN * branch.frequency, branch.clearance_displacement[:, 0]
        np.testing.assert_allclose(x[:, 0], 1 + MEAN, rtol=1e-9)
        np.testing.assert_allclose(x[:, 1], level / (1 - omega**2 + 1j * DAMPING * omega), rtol=1e-6)
        assert np.abs(x[:, 2:]).max() < 1e-9 and branch.stable.all()
        assert histories(x[-1]).min() == pytest.approx(1.0, abs=2e-3 * MEAN)
    beyond = cm.periodic.follow_response(MODEL, level, (STARTS[level] / TURN, 0.998 * high / TURN), HARMONICS, SAMPLES)
    assert np.abs(beyond.clearance_displacement[-1, 0, 2]) > 1e-6
