"""Drawn rigs of every kind of clearance: what is stable stays when it is marched. Truth: the modal engine's march."""

import numpy as np
import pytest

import clearance_mj as cm
from experiments.periodic.drawn import CLOSE, SLOW, Vibration, marches, outcome, table
from experiments.periodic.drawn_rigs import KINDS, MODES, draw

NO_BRANCH = 0.02  # share of rigs of which no first vibration may be found


def test_the_same_number_draws_the_same_rig():
    for number, kind in enumerate(KINDS):
        one, other = draw(number), draw(number)
        assert one.kind == kind and one.model == other.model and one.level == other.level
    assert draw(0, seed=1).model != draw(0).model


@pytest.mark.parametrize("count", [len(KINDS), pytest.param(200, marks=pytest.mark.slow)])
def test_stable_vibrations_stay_and_unstable_ones_leave(count, measured):
    """One rig of each kind in the quick suite; of three points of each, those whose transients die out in time."""
    outcomes = [outcome(number) for number in range(count)]
    lost = [each.refused for each in outcomes if each.refused]
    assert len(lost) <= NO_BRANCH * count, "\n".join(lost)
    points = [point for each in outcomes for point in each.points]
    stable = [point.off for point in points if point.multiplier < SLOW]
    assert len(stable) > count and {point.kind for point in points} == set(KINDS), table(outcomes)
    assert all(point.passes for point in points if point.multiplier > 1), table(outcomes)
    what = f"harmonic balance, {count} drawn rigs of every kind, {len(stable)} points: displacement of every clearance"
    measured.below(what, np.max(stable), CLOSE, "modal engine's march")


SETTLES = {0: "slot", 2: "teeth under a mean torque", 44: "slot under weight", 25: "slot with friction",
           8: "round turning with film", 49: "both kinds in one rig"}  # fmt: skip
"""Numbers of rigs whose march from rest comes to a vibration of the excitation's period"""


@pytest.mark.parametrize("number", SETTLES)
def test_a_settled_march_goes_on_from_its_own_harmonics(number):
    """The check by itself, of every kind: place and velocity from harmonics, which here come from a march."""
    drawn = draw(number)
    assert drawn.kind == SETTLES[number]
    rig, law = drawn.model.rig, drawn.model.law
    steps = 8192
    run = cm.Modal(MODES, 0.06).start(rig, law, "force", 1 / (drawn.frequency * steps))
    push = drawn.level * np.cos(2 * np.pi * np.arange(steps) / steps)
    for _ in range(300):
        before, known = run.motion.q.copy(), run.advance(push)
    assert np.abs(run.motion.q - before).max() < 1e-6 * np.abs(before).max()
    count = len(rig.sensors)
    harmonics = np.fft.rfft(known[:, : count + rig.n_rows], axis=0)[:61].T * 2 / steps
    harmonics[:, 0] /= 2
    vibration = Vibration(
        drawn.model, "force", 1, MODES, np.array([drawn.frequency]), np.array([[complex(drawn.level)]]),
        harmonics[None, :count], harmonics[None, count:],
    )  # fmt: skip
    assert known[:, -len(rig.bushings) - (rig.spin is not None)].any()  # it touches
    assert next(marches(vibration, 0, 0.06, 40)) < CLOSE
