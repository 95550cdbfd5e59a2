"""Branches found from random starts. Truth: the subharmonic vibration of Duffing's oscillator in closed form."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from clearance_mj import ClearanceError, ExcitationError, Model, periodic

from ..refusals import assert_refused
from .one_mass import one_mass
from .test_published import HARDENING, TURN

DAMPING, CUBIC, FORCE = 0.2, 0.1, 20.0
OSCILLATOR = one_mass(damping=DAMPING, gap=5.0)  # which it never reaches
RANGE = (3.0 / TURN, 8.0 / TURN)


def searched(harmonics, samples, known=(), **settings):
    branch = periodic.follow_response(Model(OSCILLATOR, HARDENING), FORCE, RANGE, harmonics, samples)
    options = {"n_starts": 16, "frequencies": [4.25 / TURN], "seed": 1, "reach": 4.0, **settings}
    return periodic.find_isolas((branch, *known), **options)


def test_the_third_order_subharmonic_of_duffings_oscillator():
    """Terms a at ω = Ω/3 and b at Ω: both equations of Nayfeh & Mook, Nonlinear Oscillations, 1979, 4.1.4, unabridged.

    (1 - ω² + iδω) a + ¾ κ (a |a|² + 2 a |b|² + b ā²) = 0, (1 - Ω² + iδΩ) b + ¼ κ (3 b |b|² + 6 b |a|² + a³) = F
    """
    isolas = searched(1, 16)
    (isola,) = isolas.branches
    assert isola.periods == 3 and isola.ended == "it comes back to its beginning"
    np.testing.assert_allclose(isola.displacement[0], isola.displacement[-1], atol=1e-6)
    a, b = isola.displacement[:, 0, 1], isola.displacement[:, 0, 3]
    whole = TURN * isola.frequency
    omega = whole / 3
    of_a = (1 - omega**2 + 1j * DAMPING * omega) * a
    of_a += 0.75 * CUBIC * (a * np.abs(a) ** 2 + 2 * a * np.abs(b) ** 2 + b * a.conj() ** 2)
    of_b = (1 - whole**2 + 1j * DAMPING * whole) * b
    of_b += 0.25 * CUBIC * (3 * b * np.abs(b) ** 2 + 6 * b * np.abs(a) ** 2 + a**3)
    np.testing.assert_allclose(of_a, 0, atol=1e-6)
    np.testing.assert_allclose(of_b, FORCE, rtol=1e-7)
    np.testing.assert_allclose(isola.displacement[:, 0, [0, 2]], 0, atol=1e-9)
    # Between two folds, the upper half is stable.
    low, high = sorted(point.frequency for point in isola.special)
    assert [point.kind for point in isola.special] == ["fold", "fold"]
    assert isola.frequency.min() == pytest.approx(low) and isola.frequency.max() == pytest.approx(high)
    size = np.abs(a)
    middle = np.flatnonzero(np.diff(np.sign(isola.frequency - 4.4 / TURN)))
    assert list(isola.stable[middle[np.argsort(size[middle])]]) == [False, True]
    # Starts come to the known branch or to this one.
    known, new, none = isolas.basins[0]
    assert known + new == 1 and known > 0 and new > 0 and none == 0


def test_an_isola_is_what_long_marches_come_to(measured):
    """With 21 harmonics of a third of the excitation's frequency, at both ends of its stable half."""
    (isola,) = searched(7, 96).branches
    off = []
    for index in np.flatnonzero(isola.stable)[[4, -4]]:
        off.append(np.abs(isola.displacement[index, 0, [1, 3]] / marched(isola, index)[[1, 3]] - 1).max())
    measured.below("isola, Duffing's oscillator: orders 1/3 and 1", max(off), 1e-3, "DOP853's march")
    # What is known is not found again, wherever in its period a march comes to it.
    again = searched(7, 96, [isola], frequencies=[4.25 / TURN, 4.5 / TURN], seed=2)
    assert not again.branches and again.basins[:, 1].min() > 0


def test_what_has_not_settled_is_counted():
    isolas = searched(1, 16, longest=1)
    assert not isolas.branches and isolas.basins.tolist() == [[0, 1]]


def marched(isola, index):
    """Harmonics of the displacement after 40 vibrations from a point of an isola, disturbed by a hundredth."""
    omega = TURN * isola.frequency[index] / 3
    x = isola.displacement[index, 0]
    start = 1.01 * np.array([x.sum().real, (1j * omega * np.arange(x.size) * x).sum().real])

    def rate(t, state):
        x, v = state
        return v, FORCE * np.cos(3 * omega * t) - DAMPING * v - x - CUBIC * x**3

    times = (40 + np.arange(64) / 64) * TURN / omega
    return np.fft.fft(solve_ivp(rate, (0, times[-1]), start, "DOP853", times, rtol=1e-9, atol=1e-10).y[0]) / 32


@pytest.mark.parametrize(("change", "error", "words"), [
    ({"n_starts": 0}, ClearanceError, "n_starts must be a whole number from 1 on, got 0"),
    ({"n_starts": 10_000}, ClearanceError, "at most 1000 starts at a frequency"),
    ({"periods": 2.5}, ClearanceError, "periods must be a whole number from 1 on, got 2.5"),
    ({"longest": True}, ClearanceError, "longest must be a whole number"),
    ({"reach": -1.0}, ClearanceError, "reach must be a displacement > 0 m"),
    ({"frequencies": [5.0]}, ExcitationError, "Hz between 0.477465 and 1.27324, the known branches' range"),
    ({"frequencies": 0}, ExcitationError, "frequencies must be their number, 1 or more"),
])  # fmt: skip
def test_refusals(change, error, words):
    assert_refused(error, words, searched, 1, 16, **change)


def test_known_branches_are_of_one_excitation():
    level = periodic.follow_response(Model(OSCILLATOR, HARDENING), 1.0, RANGE, 1, 16)
    assert_refused(ClearanceError, "known branches must be of one rig, law, level", searched, 1, 16, [level])
    assert_refused(ClearanceError, "isolas are searched beside known branches", periodic.find_isolas, [])


def test_figure_and_dataset():
    isolas = searched(1, 16)
    upper, lower = isolas.plot("displacement").axes
    np.testing.assert_array_equal(upper.lines[2].get_ydata(), isolas.branches[0].amplitude("displacement")[:, 0])
    assert [bar.get_height() for bar in lower.patches] == pytest.approx([*isolas.basins[0, :2], 0])
    assert_refused(ClearanceError, "row must be between 0 and 0, got 1", isolas.plot, row=1)
    data = isolas.to_xarray()
    assert data.basin.sel(attractor="new 1").values == pytest.approx(isolas.basins[:, 1])
    assert data.branch.shape == (1, 16)
