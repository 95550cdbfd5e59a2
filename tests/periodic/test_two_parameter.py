"""Folds and first contact over two parameters. Truth: closed forms, branches at other levels, the linear response."""

import numpy as np
import pytest

from clearance_mj import periodic
from clearance_mj.clearance import ConstantLaw, MaxwellSlip
from clearance_mj.core.errors import ClearanceError, ExcitationError
from clearance_mj.model import Model

from ..conftest import TABLE1
from .test_over_level import DAMPING, SPRING, squared_force
from .test_published import DUFFING, HARDENING, TURN
from .test_rigs import LAW

SLIDERS = MaxwellSlip(springs=(1500.0, 1500.0), forces=(0.1, 0.25), elastic=1500.0, damping=3.0)


def test_duffing_folds_meet_in_a_cusp():
    """Folds: 3 g² A⁴ + 4 g s A² + s² + (δ Ω)² = 0 (Nayfeh & Mook 1979, 4.1); both meet where s² = 3 (δ Ω)²."""
    branch = periodic.follow_response(Model(DUFFING, HARDENING), 0.18, (0.5 / TURN, 1.6 / TURN), 1, 16, stability=False)
    upper = max(branch.special, key=lambda point: point.frequency)
    curve = periodic.follow_folds(branch, upper, 0.01)
    omega = TURN * curve.frequency
    s = 1 - omega**2
    root = np.sqrt(np.maximum(s**2 - 3 * (DAMPING * omega) ** 2, 0))
    known = [np.sqrt(squared_force(omega, (-2 * s + sign * root) / (3 * SPRING))) for sign in (-1, 1)]
    off = np.min(np.abs(np.array(known) / curve.value - 1), axis=0)
    assert off.max() < 1e-5 and not curve.ended
    (cusp,) = curve.turns
    at = (np.sqrt(3) * DAMPING + np.sqrt(3 * DAMPING**2 + 4)) / 2  # Ω² - 1 = √3 δ Ω
    assert omega[cusp] == pytest.approx(at, rel=2e-3)
    lowest = np.sqrt(squared_force(at, 2 * (at**2 - 1) / (3 * SPRING)))
    assert curve.value[cusp] == pytest.approx(lowest, rel=1e-3)
    other = min(branch.special, key=lambda point: point.frequency)  # where the curve ends: at the level it began with
    assert curve.frequency[-1] == pytest.approx(other.frequency, rel=1e-4)


@pytest.mark.parametrize("i", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_rigs_folds_are_those_of_branches_at_other_levels(i):
    branch = periodic.follow_response(Model(TABLE1, LAW), 6.0, (40, 50), stability=False)
    curve = periodic.follow_folds(branch, branch.special[i], 8.0)
    known = periodic.follow_response(Model(TABLE1, LAW), 8.0, (40, 55), stability=False).special[i]
    assert not curve.ended
    assert curve.frequency[-1] == pytest.approx(known.frequency, rel=1e-4)
    assert curve.value[-1] == pytest.approx(8.0)


@pytest.mark.slow
def test_over_the_gap_it_is_the_level_in_other_words():
    """Without preload everything scales: a gap twice as large at twice the level folds at the same frequency."""
    branch = periodic.follow_response(Model(TABLE1, LAW), 6.0, (40, 50), stability=False)
    up = branch.special[0]
    over_gap = periodic.follow_folds(branch, up, 4e-4, "gap")
    over_level = periodic.follow_folds(branch, up, 6.0 * 3 / 4)
    assert over_gap.value[-1] == pytest.approx(4e-4)
    assert over_gap.frequency[-1] == pytest.approx(over_level.frequency[-1], rel=1e-5)


def test_first_contact_in_closed_form():
    frequency = np.array([10.0, 30.0, 39.0, 60.0])
    curve = periodic.find_first_contact(Model(TABLE1, LAW), frequency)
    for i, level in enumerate(curve.value):
        for factor in (0.999, 1.001):
            branch = periodic.follow_response(
                Model(TABLE1, LAW), factor * level, (frequency[i], 1.0001 * frequency[i]), stability=False
            )
            assert branch.contact_force[0].any() == (factor > 1)


@pytest.mark.slow
def test_first_contact_of_grease_that_remembers():
    law = ConstantLaw(7.8e3, 4.0, grease=SLIDERS)
    curve = periodic.find_first_contact(Model(TABLE1, law), [39.0, 45.0])
    for frequency, level in zip(curve.frequency, curve.value):
        for factor in (0.999, 1.001):
            branch = periodic.follow_response(
                Model(TABLE1, law), factor * level, (frequency, 1.0001 * frequency), stability=False
            )
            assert branch.contact_force[0].any() == (factor > 1)


def test_figure_dataset_and_refusals():
    branch = periodic.follow_response(Model(DUFFING, HARDENING), 0.18, (0.5 / TURN, 1.6 / TURN), 1, 16, stability=False)
    fold = branch.special[0]
    curve = periodic.follow_folds(branch, fold, 0.2)
    assert curve.plot().axes[0].get_ylabel() == "level (N)"
    assert curve.to_xarray().level.attrs["units"] == "N"
    with pytest.raises(ClearanceError, match='over must be "level" or "gap"'):
        periodic.follow_folds(branch, fold, 0.2, "mass")
    with pytest.raises(ClearanceError, match=r"to must be > 0 and another level than that of the fold, 0\.18"):
        periodic.follow_folds(branch, fold, 0.0)
    with pytest.raises(ClearanceError, match="point must be a fold of the branch"):
        periodic.follow_folds(branch, periodic.SpecialPoint("Neimark-Sacker", 1.0, 1.0, 0), 0.2)
    with pytest.raises(ExcitationError, match="frequencies must be numbers > 0 Hz"):
        periodic.find_first_contact(Model(TABLE1, LAW), [0.0])
