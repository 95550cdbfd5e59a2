"""Two times against a march with an accelerated wear, and jumps on the way."""

import numpy as np
import pytest

from clearance_mj import ExcitationError, LawError, Model, RigError, TimeLaw, beam
from clearance_mj.periodic import follow_folds, follow_response
from clearance_mj.signals.excitation import random
from clearance_mj.wear import Marched, Sine, predict_life
from experiments.benches.wear import accelerated

from ..conftest import TABLE1
from ..refusals import assert_refused

K = 1e-12


def worn_model(count: int = 2, coefficient: float = K) -> Model:
    return accelerated.worn_model(TABLE1.replace(bushings=TABLE1.bushings[:count]), coefficient)


QUICK, SLOW = (Sine(9.25, 2.0), 2e-6), pytest.param(Sine(39.0, 5.0), 2e-5, marks=pytest.mark.slow)


@pytest.mark.parametrize("sine, coefficient", [QUICK, SLOW])
def test_two_times_agree_with_a_march_of_accelerated_wear(sine, coefficient):
    """Over a doubling of the gap; the march knows neither harmonic balance nor the pair of orders 2 and 3."""
    life = predict_life(worn_model(), sine, "0.6 mm")
    assert life.ended == "limit"
    assert life.life * K == pytest.approx(accelerated.whole_march(TABLE1, sine, coefficient), rel=5e-3)


@pytest.mark.slow
def test_the_accuracy_does_not_decide():
    coarse, fine = (predict_life(worn_model(), Sine(9.25, 2.0), "0.6 mm", accuracy=a) for a in (1e-2, 1e-5))
    assert coarse.life == pytest.approx(fine.life, rel=2e-3) and fine.hours.size > coarse.hours.size


def test_life_goes_with_one_over_the_coefficient():
    lives = [predict_life(worn_model(2, k), Sine(9.25, 2.0), "0.6 mm").life * k for k in (1e-12, 3e-10)]
    assert lives[0] == pytest.approx(lives[1], rel=1e-6)


def test_what_does_not_touch_does_not_wear():
    life = predict_life(worn_model(), Sine(42.0, 0.1), "x2")
    assert life.ended == "no rubbing" and life.life == np.inf and life.hours.size == 1
    assert "does not wear further" in life.words()[-1]


@pytest.mark.slow
def test_a_branch_that_folds_on_the_way_is_found_where_folds_over_the_gap_are():
    """The contacting branch of mode 2 ends as the gap grows; the shaft then vibrates in its gap and wears no more."""
    model, frequency, level = worn_model(1), 42.0, 4.0
    second = beam.natural_frequencies(model.rig, 2)[1]
    life = predict_life(model, Sine(frequency, level, swept_from=0.9 * second), "0.6 mm")
    assert life.ended == "no rubbing" and life.jumps[-1].after == (0.0,) and life.jumps[-1].before[0] > 1e-4
    branch = follow_response(model, level, (0.9 * second, 1.5 * second))
    fold = max((point for point in branch.special if point.kind == "fold"), key=lambda point: point.frequency)
    curve = follow_folds(branch, fold, 4e-4, over="gap")
    order = np.argsort(curve.frequency)
    gap = np.interp(frequency, curve.frequency[order], curve.value[order])
    assert life.jumps[-1].gap[0] == pytest.approx(gap, rel=2e-3)


def test_random_vibration_wears_as_long_as_its_error_says():
    drives = (Marched(random(2.0, 2048.0, rms=8.0, seed=seed)) for seed in (0, 1))
    lives = [predict_life(worn_model(), drive, "0.33 mm", hours=1e5, accuracy=0.05) for drive in drives]
    rates = np.array([life.rubbing[0].max() for life in lives])
    errors = np.array([life.error[0].max() for life in lives])
    assert abs(np.diff(rates)) < 4 * np.hypot(*errors) and all(life.gap[-1].max() > 3e-4 for life in lives)


def test_a_force_needs_a_place():
    with pytest.raises(ExcitationError, match=r"shaker\.position"):
        predict_life(worn_model(), Sine(39.0, 5.0, kind="force"), "x2")


@pytest.mark.parametrize("operation", [Sine(39.0, 5.0), Marched(random(0.5, 2048.0, rms=1.0))])
def test_a_law_over_time_is_refused(operation):
    law = TimeLaw(np.array([0.0, 1.0]), np.array([8e3, 7e3]), np.array([4.0, 4.0]))
    assert_refused(LawError, "law over time", lambda: predict_life(Model(worn_model().rig, law), operation, "x2"))


def test_nothing_wears_without_a_coefficient():
    assert_refused(RigError, r"bushings\[0\].wear", lambda: predict_life(Model(TABLE1), Sine(39.0, 5.0), "x2"))
