"""Responses over constant loads, gaps and spin. Truth: sags in closed form, scaling, branches over frequency."""

from dataclasses import replace

import numpy as np
import pytest

from clearance_mj import ClearanceError, ExcitationError, Model, periodic
from clearance_mj.periodic.coverage import reached
from clearance_mj.rig import OilFilm, Spin

from ..conftest import TABLE1
from ..refusals import assert_refused
from ..test_capabilities import COLUMNS
from .capability_rows import lively
from .jeffcott import FREQUENCY, GAP, MASS, STIFFNESS, jeffcott
from .test_rigs import LAW

DOWN, HZ = {"gravity": (0.0, 0.0, -9.81)}, FREQUENCY / (2 * np.pi)
SAG = MASS * 9.81 / STIFFNESS
"""of the rotor in its ring, whose gap it fills at 0.037 of its weight"""
SHAFT = jeffcott().structure
GYROSCOPIC = replace(SHAFT, discs=(replace(SHAFT.discs[0], position=0.3, inertia=2e-2, polar_inertia=3e-2),))


def over(rig, what, values, frequency=0.3 * HZ, amplitude=0.1, harmonics=5, **settings):
    return periodic.follow_response_over(Model(rig), what, values, frequency, amplitude, harmonics, **settings)


def same(branch, i, known):
    """A point is the other branch's first one, multipliers of its stability too."""
    for name in ("clearance_displacement", "contact_force"):
        right = getattr(known, name)[0]
        np.testing.assert_allclose(getattr(branch, name)[i], right, atol=1e-6 * np.abs(right).max())
    if branch.multipliers is not None:
        np.testing.assert_allclose(np.abs(branch.multipliers[i, :4]), np.abs(known.multipliers[0, :4]), rtol=1e-5)


def test_a_rotor_sags_under_its_weight_and_rests_on_its_ring():
    """k r = s m g in the gap, k r + κ (r - δ) = s m g beyond, κ = 20 k; contact begins where r and amplitude are δ."""
    branch = over(jeffcott(**DOWN), "load", (0.01, 0.2), amplitude=(force := 0.1))
    free, amplitude = branch.share * SAG, force / STIFFNESS / abs(1 - 0.3**2 + 0.03j)
    known = np.where(free < GAP, free, (free + 20 * GAP) / 21)
    apart = np.abs(free - GAP) > 2 * amplitude
    np.testing.assert_allclose(-branch.clearance_displacement[apart, 1, 0].real, known[apart], rtol=1e-6)
    (contact,) = (point for point in branch.special if point.kind == "first contact")
    assert branch.share[contact.index] == pytest.approx((GAP - amplitude) / SAG, rel=1e-4)  # 64 samples
    assert branch.over == "load" and branch.parameter is branch.share and not branch.ended
    assert branch.plot().axes[0].get_xlabel() == "constant loads over the rig's"
    assert branch.to_xarray()["share"].values == pytest.approx(branch.share)


def test_over_loads_as_over_frequency_at_the_rigs_own():
    branch = over(jeffcott(**DOWN), "load", (0.03, 1.0), 0.5 * HZ, 20.0)
    known = periodic.follow_response(Model(jeffcott(**DOWN)), 20.0, (0.5 * HZ, 0.51 * HZ), 5)
    assert branch.contact_force[-1].any()
    same(branch, -1, known)


def test_what_never_touches_does_not_know_the_gap_and_touches_first_where_it_fills_it():
    reached = np.abs(over(jeffcott(), "gap", (2.0, 0.5), amplitude=0.4).clearance_displacement[:, 1, 1])
    np.testing.assert_allclose(reached, reached[0], rtol=1e-9)
    fills = reached[0] / GAP
    branch = over(jeffcott(), "gap", (1.5 * fills, 0.5 * fills), amplitude=0.4)
    (contact,) = (point for point in branch.special if point.kind == "first contact")
    assert branch.share[contact.index] == pytest.approx(fills, rel=1e-4)
    assert not branch.contact_force[: contact.index].any() and branch.contact_force[-1].any()


def test_folds_over_gaps_are_those_over_level():
    """Walls that are linear beyond their gaps: level and gaps scale all motions alike."""
    given = {"n_harmonics": 9, "stability": False}
    branch = periodic.follow_response_over(Model(TABLE1, LAW), "gap", (1.0, 2.0), 44.0, 6.0, **given)
    known = periodic.follow_response_over_level(Model(TABLE1, LAW), 44.0, (6.0, 3.0), **given)
    shares, levels = ([each.parameter[p.index] for p in each.special if p.kind == "fold"] for each in (branch, known))
    assert len(shares) == 2 and shares == pytest.approx(6.0 / np.array(levels), rel=1e-5)


@pytest.mark.parametrize("ratio", [0.6, 1.4])
def test_another_gap_is_that_of_another_rig(ratio):
    """Of walls, and of oil, whose stiffness and damping follow the gap too; multipliers as well."""
    film = jeffcott(spin=Spin(20.0), **DOWN)
    film = film.replace(bushings=(replace(film.bushings[0], length=0.01, film=OilFilm(0.02)),))
    for rig, law in ((TABLE1, LAW), (film, None)):
        model = Model(rig, law) if law else Model(rig)
        at = (40.0, 4.0, 5) if law else (0.5 * HZ, 20.0, 5)
        branch = periodic.follow_response_over(model, "gap", (1.0, ratio), *at, 128)
        other = model.with_gap([ratio * b.gap for b in rig.bushings])
        same(branch, -1, periodic.follow_response(other, at[1], (at[0], 1.001 * at[0]), 5, 128))


def test_over_spin_as_over_frequency_at_two_spins():
    rig = jeffcott(structure=GYROSCOPIC, spin=Spin(20.0), **DOWN)
    branch = over(rig, "spin", (20.0, 400.0), 0.5 * HZ, 20.0, stability=False)
    assert branch.over == "spin" and branch.parameter[[0, -1]] == pytest.approx([20.0, 400.0])
    for i in (0, -1):
        turning = Model(rig.replace(spin=Spin(branch.spin[i])))
        same(branch, i, periodic.follow_response(turning, 20.0, (0.5 * HZ, 0.51 * HZ), 5, stability=False))
    assert np.abs(branch.displacement[-1] / branch.displacement[0] - 1).max() > 0.01


def test_a_branch_that_comes_onto_a_closed_curve_ends():
    """A lightly damped shaft in a ring, with too few samples: from 11.38 to 11.86 Hz it went round for ever."""
    rig = lively(COLUMNS["round"], gravity=None)
    branch = periodic.follow_response(Model(rig), 2.0, (8.0, 40.0), 21, 256, n_modes=3, stability=False)
    assert branch.ended == "it comes back to where it was" and branch.frequency.size < 200
    last, x = branch.frequency[-1], branch.clearance_displacement[:, :, 1]
    earlier = np.flatnonzero(branch.frequency[:-1] == last)
    assert earlier.size == 1
    np.testing.assert_array_equal(x[earlier[0]], x[-1])
    assert reached(branch) == branch.frequency.max()


@pytest.mark.parametrize(("change", "error", "words"), [
    ({"over": "moon"}, ClearanceError, 'over "moon" is unknown; use load, gap, spin'),
    ({"values": (0.0, 1.0)}, ExcitationError, "values must be two different gaps > 0 times those of the rig"),
    ({"over": "load"}, ClearanceError, "has no constant loads"),
    ({"over": "spin"}, ClearanceError, "no vibration depends on the spin"),
    ({"over": "spin", "kind": "unbalance"}, ExcitationError, "use follow_unbalance"),
    ({"frequency": -1.0}, ExcitationError, "frequency must be > 0 Hz"),
])  # fmt: skip
def test_refusals(change, error, words):
    given = {"model": Model(TABLE1, LAW), "over": "gap", "values": (1.0, 2.0), "frequency": 40.0, "amplitude": 1.0}
    assert_refused(error, words, periodic.follow_response_over, **given | change)
