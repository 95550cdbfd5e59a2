"""Responses over level. Truth: Duffing's oscillator in closed form, branches over frequency, the linear response."""

import numpy as np
import pytest

from clearance_mj import ClearanceError, ExcitationError, Model, periodic

from ..conftest import TABLE1
from ..refusals import assert_refused
from .test_published import DUFFING, HARDENING, TURN
from .test_rigs import LAW

SPRING, DAMPING = 0.075, 0.05  # ¾ κ and δ of q'' + δ q' + q + κ q³ = F cos Ωt


def squared_force(omega, squared):
    """F² of an amplitude's square, with one harmonic (Nayfeh & Mook, Nonlinear Oscillations, 1979, 4.1)."""
    return squared * ((1 + SPRING * squared - omega**2) ** 2 + (DAMPING * omega) ** 2)


def test_duffing_folds_over_level_in_closed_form():
    """dF²/dA² = 0: 3 g² A⁴ + 4 g s A² + s² + (δ Ω)² = 0 with g = ¾ κ, s = 1 - Ω²."""
    omega = 1.3
    model = Model(DUFFING, HARDENING)
    branch = periodic.follow_response_over_level(model, omega / TURN, (0.01, 1.0), 1, 16, stability=False)
    amplitude = np.abs(branch.displacement[:, 0, 1])
    np.testing.assert_allclose(branch.level[:, 0].real ** 2, squared_force(omega, amplitude**2), rtol=1e-6)
    s = 1 - omega**2
    root = np.sqrt(s**2 - 3 * (DAMPING * omega) ** 2)
    squared = np.array([-2 * s - root, -2 * s + root]) / (3 * SPRING)
    first, second = branch.special
    assert {first.kind, second.kind} == {"fold"}
    assert (first.level, second.level) == pytest.approx(np.sqrt(squared_force(omega, squared)), rel=1e-6)
    assert first.frequency == second.frequency == pytest.approx(omega / TURN)
    assert branch.over == "level" and branch.level[[0, -1], 0].real == pytest.approx([0.01, 1.0])
    axes = branch.plot("displacement").axes[0]
    assert axes.get_xlabel() == "level (N)"
    np.testing.assert_allclose(axes.lines[0].get_xdata(), branch.level[:, 0].real)


def test_between_folds_over_level_it_is_not_stable():
    branch = periodic.follow_response_over_level(Model(DUFFING, HARDENING), 1.3 / TURN, (0.01, 1.0), 7, 29)
    assert [point.kind for point in branch.special] == ["fold", "fold"]
    first, second = (point.index for point in branch.special)
    assert branch.stable[: first - 1].all() and branch.stable[second + 2 :].all()
    assert not branch.stable[first + 2 : second - 1].any()


def test_a_rig_that_is_driven_louder_jumps_where_the_frequency_folds():
    """At the frequency of a fold at 6 m/s² the level folds at 6 m/s²."""
    known = periodic.follow_response(Model(TABLE1, LAW), 6.0, (30, 60), stability=False)
    up, down = (point.frequency for point in known.special if point.kind == "fold")
    louder = periodic.follow_response_over_level(Model(TABLE1, LAW), down, (0.5, 12.0), stability=False)
    softer = periodic.follow_response_over_level(Model(TABLE1, LAW), up, (12.0, 0.5), stability=False)
    for branch, frequency in ((louder, down), (softer, up)):
        assert min(abs(point.level / 6.0 - 1) for point in branch.special) < 1e-4
        np.testing.assert_allclose(branch.frequency, frequency)
    quiet = ~louder.contact_force.any(axis=(1, 2))
    ratio = louder.acceleration[quiet, :, 1] / louder.level[quiet]
    np.testing.assert_allclose(ratio, np.broadcast_to(ratio[0], ratio.shape), rtol=1e-6)


@pytest.mark.parametrize(("change", "error", "words"), [
    ({"frequency": 0.0}, ExcitationError, "frequency must be > 0 Hz, got 0"),
    ({"amplitude_range": 6.0}, ExcitationError, r"amplitude_range is a pair \(from, to\)"),
    ({"amplitude_range": (0.0, 1.0)}, ExcitationError, "must be two different amplitudes > 0, got 0 and 1"),
    ({"amplitude_range": (1.0, 1.0)}, ExcitationError, "amplitude_range must be two different amplitudes > 0"),
    ({"n_harmonics": 0}, ClearanceError, "harmonics must be 1 or more"),
    ({"kind": "sound"}, ExcitationError, 'kind must be "base" or "force"'),
])  # fmt: skip
def test_refusals(change, error, words):
    given = {"model": Model(TABLE1, LAW), "frequency": 40.0, "amplitude_range": (1.0, 2.0)}
    assert_refused(error, words, periodic.follow_response_over_level, **given | change)
