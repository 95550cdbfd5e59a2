"""Stable vibrations of the Table-1 rig stay when they are marched in time; a stepped sine jumps at the folds.

Truth: the modal engine's and links' marches, and the virtual rig, which shares no code with harmonic balance.
"""

import numpy as np
import pytest

from clearance_mj import Model, periodic
from experiments.periodic import verification
from experiments.periodic.verification import BAND, CLOSE, LAWS, LEVELS, TRUTHS, jump, marched, rig_s_law, steep

from ..conftest import TABLE1

FEW, SOME = 3, 10  # points of a branch in the quick suite, of one level, and in the slow one; at a release all
CASES = [
    pytest.param(law, level, points, marks=marks)
    for law in LAWS
    for levels, points, marks in (
        ([6.0], FEW, []), ([2.0, 8.0], SOME, pytest.mark.slow), (LEVELS, None, pytest.mark.release)
    )
    for level in levels
]  # fmt: skip


@pytest.mark.parametrize(("name", "level", "points"), CASES)
def test_stable_vibrations_stay_when_marched(name, level, points, measured):
    """Fundamentals of every sensor and clearance, of points that are not steep."""
    branch = periodic.follow_response(Model(TABLE1, LAWS[name]), level, BAND)
    at = np.flatnonzero(branch.stable & ~steep(branch))
    if points is not None:
        at = at[np.linspace(0.1 * (at.size - 1), 0.9 * (at.size - 1), points).astype(int)]
    off = max(marched(branch, i)["fundamental"] for i in at)
    what = f"harmonic balance, {name}, {level:g} m/s², {at.size} points: fundamental of every channel"
    measured.below(what, off, CLOSE, "modal engine's march")


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_links_march_the_same_vibrations(name, measured):
    branch = periodic.follow_response(Model(TABLE1, LAWS[name]), 6.0, BAND)
    off = max(verification.by_links(branch, i) for i in verification.of_links(branch))
    measured.below(f"harmonic balance, {name}, 6 m/s²: fundamental of every channel", off, 0.01, "links' march")


@pytest.mark.slow
@pytest.mark.parametrize("name", TRUTHS)
def test_the_virtual_rig_jumps_at_the_folds(name, measured):
    """A stepped sine upwards and downwards, in steps of 0.05 Hz."""
    truth = TRUTHS[name]
    branch = periodic.follow_response(Model(TABLE1, rig_s_law(truth)), 6.0, (35, 60))
    up, down = (point.frequency for point in branch.special if point.kind == "fold")
    for way, fold, outside in (("up", up, down - 1), ("down", down, up + 1)):
        _, _, at = jump(TABLE1, truth, 6.0, fold, outside)
        measured.below(f"fold {way}, {name}: frequency", abs(at / fold - 1), 5e-3, "virtual rig's stepped sine")
