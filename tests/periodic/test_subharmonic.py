"""Branches that leave period doublings. Truth: closed forms of one and two terms, and motions integrated in time."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from clearance_mj import ClearanceError, ConstantLaw, Model, periodic
from clearance_mj.periodic import SpecialPoint

from .one_mass import PolynomialSpring, one_mass
from .test_published import STIFFNESS, STOP, TURN, UNILATERAL

DAMPING, SQUARE, CUBIC, FORCE = 0.05, 0.1, 0.03, 2.4


QUADRATIC = one_mass(damping=DAMPING, gap=8.0)
SOFT, HARD = (ConstantLaw(0.0, 0.0, grease=PolynomialSpring(SQUARE, cubic)) for cubic in (0.0, CUBIC))
RANGE = (2.6 / TURN, 1.6 / TURN)


def doublings(branch):
    return [point for point in branch.special if point.kind == "period doubling"]


def quadratic(x, v):
    return -DAMPING * v - x - SQUARE * x**2 - CUBIC * x**3


def marched(force, branch, index, mass_of, vibrations):
    """Harmonics (n_sensors, 3) of displacements at the end of a march from a point of a branch, at its frequency."""
    omega = TURN * branch.frequency[index] / branch.periods
    x = branch.displacement[index]
    order = 1j * omega * np.arange(x.shape[1])
    start = np.concatenate((x.sum(axis=1).real, (x * order).sum(axis=1).real))
    n = len(x)

    def rate(t, state):
        drive = branch.level[index, 0].real * np.cos(branch.periods * omega * t)
        return np.concatenate((state[n:], force(state[:n], state[n:]) + drive * mass_of))

    period, samples = TURN / omega, 64
    times = (vibrations - 1 + np.arange(samples) / samples) * period
    solution = solve_ivp(rate, (0, times[-1]), start, "DOP853", times, rtol=1e-9, atol=1e-10)
    return 2 / samples * np.fft.fft(solution.y[:n])[:, :3]


def test_two_terms_of_a_quadratic_oscillator():
    """Mean c, b at Ω and a at ω = Ω/2 of x'' + δ x' + x + β x² = F cos Ωt: three balances of harmonics, all along it.

    That at ω, (1 - ω² + 2βc + iδω) a + β b ā = 0, is Mathieu's equation about the motion of one period (Nayfeh & Mook,
    Nonlinear Oscillations, 1979, chapter 5).
    """
    branch = periodic.follow_response(Model(QUADRATIC, SOFT), FORCE, RANGE, 1, 32)
    ends = doublings(branch)
    assert len(ends) == 2
    for point in ends:
        twice = periodic.follow_doubled(branch, point)
        c, a, b = twice.displacement[:, 0].T
        c, omega = c.real, TURN * twice.frequency / 2
        linear = 1 - omega**2 + 1j * DAMPING * omega + 2 * SQUARE * c
        np.testing.assert_allclose(linear * a + SQUARE * b * a.conj(), 0, atol=1e-7)
        of_b = (1 - 4 * omega**2 + 2j * DAMPING * omega + 2 * SQUARE * c) * b + SQUARE * a**2 / 2
        np.testing.assert_allclose(of_b, FORCE, rtol=1e-7)
        np.testing.assert_allclose(c + SQUARE * (c**2 + np.abs(a) ** 2 / 2 + np.abs(b) ** 2 / 2), 0, atol=1e-7)
        assert twice.periods == 2 and twice.frequency[0] == pytest.approx(point.frequency, rel=1e-3)
        assert abs(a[0]) < 0.02 * abs(b[0]) and np.abs(a).max() > 1
        assert twice.frequency[-1] == pytest.approx(RANGE[1]) and not twice.ended


def test_doubled_vibrations_are_those_of_a_long_march(measured):
    branch = periodic.follow_response(Model(QUADRATIC, HARD), FORCE, RANGE, 6, 96)
    first, second = doublings(branch)
    twice = periodic.follow_doubled(branch, first)
    off = []
    for index in np.flatnonzero(twice.stable)[[5, 30]]:
        known = marched(quadratic, twice, index, np.ones(1), 60)
        off.append(np.abs(twice.displacement[index, 0, 1:3] / known[0, 1:] - 1).max())
    measured.below("doubled period, quadratic oscillator: orders 1/2 and 1", max(off), 1e-3, "DOP853's march")
    # The doubling that ends it is the other one, from which it comes back.
    assert twice.frequency[[0, -1]] == pytest.approx([first.frequency, second.frequency], rel=1e-4)
    assert twice.ended.startswith("its period is halved at 0.3118")
    back = periodic.follow_doubled(branch, second)
    assert back.frequency[[-1, 0]] == pytest.approx(twice.frequency[[0, -1]], rel=1e-4)
    assert [point.kind for point in twice.special] == ["fold"]
    assert back.special[0].frequency == pytest.approx(twice.special[0].frequency, rel=1e-4)


def test_a_doubled_branch_doubles_again():
    branch = periodic.follow_response(Model(QUADRATIC, SOFT), FORCE, RANGE, 6, 96)
    twice = periodic.follow_doubled(branch, doublings(branch)[0])
    again = periodic.follow_doubled(twice, doublings(twice)[0])
    assert again.periods == 4
    assert again.frequency[0] == pytest.approx(doublings(twice)[0].frequency, rel=1e-3)
    x = again.displacement[:, 0]
    assert np.linalg.norm(x[-1, 1::2]) > 0.1 * np.linalg.norm(x[-1])  # orders 1/4, 3/4, ...


@pytest.mark.slow
def test_two_masses_and_a_one_sided_spring_with_twice_the_period(measured):
    """NLvib's third example, with twice the period between its two doublings."""
    branch = periodic.follow_response(Model(UNILATERAL, STOP), 0.1, (0.8 / TURN, 0.5 / TURN), 61, 1024)
    first, second = doublings(branch)
    twice = periodic.follow_doubled(branch, second)
    assert twice.ended.startswith("its period is halved")
    # The multiplier passes -1 where the balance doubles but for the few samples of the contact.
    assert twice.frequency[[-1, 0]] == pytest.approx([first.frequency, second.frequency], rel=5e-3)

    def force(x, v):
        return -STIFFNESS @ x - 0.03 * STIFFNESS @ v - np.array([100.0 * max(x[0] - 1, 0), 0])

    index = np.argmin(np.abs(TURN * twice.frequency - 0.745))
    assert twice.stable[index]
    known = marched(force, twice, index, np.array([0.0, 1.0]), 250)
    off = np.abs(twice.displacement[index, :, 1:3] / known[:, 1:] - 1).max()
    measured.below("doubled period, one-sided spring: orders 1/2 and 1", off, 1e-3, "DOP853's march")


def test_refusals():
    branch = periodic.follow_response(Model(QUADRATIC, SOFT), FORCE, RANGE, 1, 16)
    point = doublings(branch)[0]
    elsewhere = SpecialPoint("fold", point.frequency, FORCE, point.index)
    with pytest.raises(ClearanceError, match=r"point must be a period doubling of the branch, which has 0\.\d+ Hz"):
        periodic.follow_doubled(branch, elsewhere)
    unknown = periodic.follow_response(Model(QUADRATIC, SOFT), FORCE, RANGE, 1, 16, stability=False)
    with pytest.raises(ClearanceError, match="without stability, so it knows no period doubling"):
        periodic.follow_doubled(unknown, point)
