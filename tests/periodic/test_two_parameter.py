"""Special points over two parameters. Truth: closed forms, branches at other levels, exact shooting."""

from dataclasses import replace

import numpy as np
import pytest

from clearance_mj import ClearanceError, ExcitationError, Model, periodic
from clearance_mj.clearance import ConstantLaw
from experiments.periodic.verification import SLIDERS

from ..conftest import TABLE1
from ..refusals import assert_refused
from . import test_teeth as teeth
from .jeffcott import CLEARANCE, GRAVITY, rigid_in_oil, viscosity_at
from .test_over_level import DAMPING, SPRING, squared_force
from .test_published import DUFFING, HARDENING, TURN
from .test_rigs import LAW
from .test_space_forced import SPACE


def test_duffing_folds_meet_in_a_cusp():
    """Folds: 3 g² A⁴ + 4 g s A² + s² + (δ Ω)² = 0 (Nayfeh & Mook 1979, 4.1); both meet where s² = 3 (δ Ω)²."""
    branch = periodic.follow_response(Model(DUFFING, HARDENING), 0.18, (0.5 / TURN, 1.6 / TURN), 1, 16, stability=False)
    curve = periodic.follow_folds(branch, max(branch.special, key=lambda point: point.frequency), 0.01)
    omega = TURN * curve.frequency
    s = 1 - omega**2
    root = np.sqrt(np.maximum(s**2 - 3 * (DAMPING * omega) ** 2, 0))
    known = [np.sqrt(squared_force(omega, (-2 * s + sign * root) / (3 * SPRING))) for sign in (-1, 1)]
    assert np.min(np.abs(np.array(known) / curve.value - 1), axis=0).max() < 1e-5 and not curve.ended
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
    assert curve.frequency[-1] == pytest.approx(known.frequency, rel=1e-4)
    assert curve.value[-1] == pytest.approx(8.0) and not curve.ended


@pytest.mark.slow
def test_over_the_gap_it_is_the_level_in_other_words():
    """Without preload everything scales: a gap twice as large at twice the level folds at the same frequency."""
    branch = periodic.follow_response(Model(TABLE1, LAW), 6.0, (40, 50), stability=False)
    up = branch.special[0]
    over_gap = periodic.follow_folds(branch, up, 4e-4, "gap")
    over_level = periodic.follow_folds(branch, up, 6.0 * 3 / 4)
    assert over_gap.value[-1] == pytest.approx(4e-4)
    assert over_gap.frequency[-1] == pytest.approx(over_level.frequency[-1], rel=1e-5)


REMEMBERS = ConstantLaw(7.8e3, 4.0, grease=SLIDERS)


@pytest.mark.parametrize(("law", "frequencies"), [
    (LAW, [10.0, 30.0, 39.0, 60.0]), pytest.param(REMEMBERS, [39.0, 45.0], marks=pytest.mark.slow),
], ids=["linear grease", "grease that remembers"])  # fmt: skip
def test_beyond_the_level_of_first_contact_a_response_touches(law, frequencies):
    curve = periodic.find_first_contact(Model(TABLE1, law), frequencies)
    for frequency, level in zip(curve.frequency, curve.value):
        for factor in (0.999, 1.001):
            ends = frequency, 1.0001 * frequency
            branch = periodic.follow_response(Model(TABLE1, law), factor * level, ends, stability=False)
            assert branch.contact_force[0].any() == (factor > 1)


def special(branch, kind):
    return next(point for point in branch.special if point.kind == kind)


def test_a_first_contact_over_the_gap_is_where_the_linear_response_reaches_the_wall(measured):
    """Without contact everything scales: the gap is proportional to the level of first contact."""
    branch = periodic.follow_response(Model(TABLE1, LAW), 6.0, (30, 35), n_samples=1024, stability=False)
    curve = periodic.follow_special(branch, special(branch, "first contact"), 6e-4, "gap")
    level = periodic.find_first_contact(Model(TABLE1, LAW), curve.frequency).value
    assert not curve.ended and curve.value[-1] == pytest.approx(6e-4)
    off = np.abs(level * curve.value / (6.0 * TABLE1.bushings[0].gap) - 1).max()
    measured.below("first contact over the gap: level", off, 2e-5, "closed form of the linear response")


def test_a_first_contact_over_the_offset_of_a_bushing():
    branch = periodic.follow_response(Model(TABLE1, LAW), 6.0, (30, 35), n_samples=1024, stability=False)
    curve = periodic.follow_special(branch, special(branch, "first contact"), 5e-5, "bushings[0].offset")
    first, *others = TABLE1.bushings
    aside = TABLE1.replace(bushings=(replace(first, offset=5e-5), *others))
    assert curve.unit == "m" and curve.value[0] == first.offset and curve.value[-1] == pytest.approx(5e-5)
    known = periodic.find_first_contact(Model(aside, LAW), [curve.frequency[-1]])
    assert known.value[0] == pytest.approx(6.0, rel=2e-5)


@pytest.mark.parametrize(("over", "to"), [("level", 0.3), ("load", 1.1), ("gap", 1.1)])
def test_a_period_doubles_where_the_exact_multiplier_passes_minus_one(over, to, measured):
    """Everything scales: a gap of 1.1 is as good as load and level over 1.1."""
    branch = teeth.followed(teeth.LOUD, 1.55)
    curve = periodic.follow_special(branch, special(branch, "period doubling"), to, over)
    assert not curve.ended and curve.what == "period doubling"
    orbits, omega = teeth.exact(teeth.LOUD), teeth.DOUBLES
    orbit = orbits[min(orbits, key=lambda each: abs(each - omega))]
    last = {"level": (teeth.MEAN, to), "load": (teeth.MEAN * to, teeth.LOUD)}.get(over)
    for mean, level in np.linspace((teeth.MEAN, teeth.LOUD), last or (teeth.MEAN / to, teeth.LOUD / to), 12):
        omega, orbit = replace(teeth.pair(level), pull=(mean - 1, mean, mean + 1)).where(-1.0, omega, orbit)
    off = abs(teeth.TURN * curve.frequency[-1] / omega - 1)
    measured.below(f"period doubling of teeth over the {over}: frequency", off, 1e-5, "exact shooting")


def test_a_vibration_leaves_its_plane_at_other_levels_where_branches_do():
    branch = periodic.follow_response(Model(SPACE), 6.0, (41.0, 43.0))
    curve = periodic.follow_special(branch, special(branch, "branch point"), 8.0)
    assert not curve.ended
    known = special(periodic.follow_response(Model(SPACE), 8.0, (41.0, 43.0)), "branch point")
    assert curve.frequency[-1] == pytest.approx(known.frequency, rel=1e-5)


@pytest.mark.parametrize("over", ["gap", "bushings.film.viscosity"])
def test_an_onset_of_whirl_is_that_of_the_other_rig(over):
    speed = 2.55 * np.sqrt(GRAVITY / CLEARANCE)
    viscosity, ends = viscosity_at(0.3, speed), (0.8 * speed, 1.3 * speed)
    model = Model(rigid_in_oil(viscosity, speed))
    to = 1.1 * (CLEARANCE if over == "gap" else viscosity)
    curve = periodic.follow_whirl_onset(model, ends, to, over, 2)
    other = model.with_gap(to) if over == "gap" else Model(rigid_in_oil(to, speed))
    known = periodic.find_whirl_onset(other, (0.5 * speed, 1.5 * speed), 2)
    assert not curve.ended and curve.value[-1] == pytest.approx(to)
    assert (curve.speed[-1], curve.frequency[-1]) == pytest.approx((known.speed, known.frequency), rel=1e-6)
    assert curve.plot().axes[0].get_xlabel() == "speed (rad/s)"


def test_what_cannot_be_followed_is_refused():
    branch = periodic.follow_response(Model(TABLE1, LAW), 6.0, (30, 35), stability=False)
    contact = special(branch, "first contact")
    with pytest.raises(ClearanceError, match=r"give law\. instead"):
        periodic.follow_special(branch, contact, 1e6, "bushings[0].contact.stiffness")
    assert_refused(ClearanceError, "the shaft does not turn", periodic.follow_special, branch, contact, 10.0, "spin")
    assert_refused(ClearanceError, "leads nowhere", periodic.follow_special, branch, contact, 10.0, "wheels[0].mass")


def test_figure_dataset_and_refusals():
    branch = periodic.follow_response(Model(DUFFING, HARDENING), 0.18, (0.5 / TURN, 1.6 / TURN), 1, 16, stability=False)
    fold = branch.special[0]
    curve = periodic.follow_folds(branch, fold, 0.2)
    assert curve.plot().axes[0].get_ylabel() == "level (N)"
    assert curve.to_xarray().level.attrs["units"] == "N"
    assert_refused(ClearanceError, 'over must be "level" or "gap"', periodic.follow_folds, branch, fold, 0.2, "mass")
    with pytest.raises(ClearanceError, match=r"to must be > 0 and another level than that of the fold, 0\.18"):
        periodic.follow_folds(branch, fold, 0.0)
    with pytest.raises(ClearanceError, match="point must be a fold of the branch"):
        periodic.follow_folds(branch, periodic.SpecialPoint("Neimark-Sacker", 1.0, 1.0, 0), 0.2)
    with pytest.raises(ExcitationError, match="frequencies must be numbers > 0 Hz"):
        periodic.find_first_contact(Model(TABLE1, LAW), [0.0])
