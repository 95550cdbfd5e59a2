"""Histories of gaps: what they say of coefficients and of what is left, and what is refused."""

import dataclasses
import math

import numpy as np
import pytest

from clearance_mj import ClearanceError, Model, RecordError
from clearance_mj.identify.structure.priors import priors
from clearance_mj.rig import Tolerance
from clearance_mj.wear import GapHistory, Sine, predict_life, predict_remaining
from clearance_mj.wear.clock import fit_wear_rate
from clearance_mj.wear.coefficients import drawn_models, spreads

from ..conftest import TABLE1
from ..refusals import assert_refused

SINE = Sine(9.25, 2.0, n_harmonics=5)


def model_of(coefficient: float) -> Model:
    return Model(TABLE1.replace(bushings=tuple(dataclasses.replace(b, wear=coefficient) for b in TABLE1.bushings)))


@pytest.fixture(scope="module")
def life():
    return predict_life(model_of(1e-12), SINE, "0.6 mm")


def history_of(life, part_of_life: float, n: int = 12, error: float = 0.005, seed: int = 0) -> GapHistory:
    """Gaps of the second bushing in the first share of a life; the first one does not touch."""
    hours = np.linspace(0.0, part_of_life * life.life, n)
    gap = life.gap_at(hours)
    std = error * gap
    seen = gap + std * np.random.default_rng(seed).standard_normal(gap.shape)
    seen[:, 0] = np.nan
    return GapHistory(hours, seen, std)


def test_a_history_tells_coefficient_and_what_is_left(life):
    """The model begins thirty times too quick; what is left is known, as two thirds of the true life."""
    prediction = predict_remaining(model_of(3e-11), SINE, history_of(life, 1 / 3), "0.6 mm")
    low, high = prediction.interval()
    assert low[1] < 2 / 3 * life.life < high[1]
    assert prediction.median[1] == pytest.approx(2 / 3 * life.life, rel=0.15)
    k_low, k_high = prediction.coefficient_interval()
    assert k_low[1] < 1e-12 < k_high[1] and np.median(prediction.coefficient[1]) == pytest.approx(1e-12, rel=0.15)
    assert np.isnan(prediction.coefficient[0]).all() and "remaining life" in prediction.words()[-1]


@pytest.mark.slow
def test_a_longer_history_narrows_the_interval(life):
    histories = (history_of(life, part_of_life) for part_of_life in (0.2, 0.6))
    intervals = (predict_remaining(model_of(1e-12), SINE, each, "0.6 mm").interval() for each in histories)
    short, long = (math.log(high[1] / low[1]) for low, high in intervals)
    assert long < 0.7 * short


def line(hours):
    return 1e-4 + 1e-9 * np.asarray(hours)


def slope(hours):
    return np.full(np.shape(hours), 1e-9)


def test_a_steady_pace_is_that_of_the_straight_line():
    """G is a straight line and the walk all but forbidden: the pace is that of weighted least squares."""
    rng = np.random.default_rng(3)
    hours, std = np.linspace(0.0, 1e4, 21), np.full(21, 2e-7)
    gap = line(1.5 * hours) + std * rng.standard_normal(21)
    (exact, first), covariance = np.polyfit(hours, gap, 1, w=1 / std, cov="unscaled")
    missed = np.sum(((gap - first - exact * hours) / std) ** 2) / 19  # more than 1: the errors were given too small
    fit = fit_wear_rate(hours, gap, std, line, slope, 0.0, (0.0, np.inf), 1e-4, 20000, np.random.default_rng(0))
    pace = np.exp(fit.log_pace)
    assert pace.mean() == pytest.approx(exact / 1e-9, rel=1e-3)
    assert pace.std() == pytest.approx(math.sqrt(covariance[0, 0] * missed) / 1e-9, rel=0.05) and missed > 1


@pytest.mark.slow
def test_intervals_of_walking_paces_hold():
    """Of 60 histories whose log K walks as the prior says, 90 % intervals hold the end in 80 to 97 %."""
    inside = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        fine = np.linspace(0.0, 1.0, 1201)  # the history is the first third
        sigma = 0.3 * abs(rng.standard_normal()) * math.sqrt(3.0)  # over the whole
        pace = np.exp(np.cumsum(np.append(0.0, sigma * math.sqrt(1 / 1200) * rng.standard_normal(1200))))
        worn = np.concatenate(([0.0], np.cumsum((pace[1:] + pace[:-1]) / 2400))) * 3e5
        hours, at = fine[:401:40] * 3e5, line(worn[:401:40])
        std = 0.005 * at
        gap = at + std * rng.standard_normal(at.size)
        fit = fit_wear_rate(hours, gap, std, line, slope, 0.0, (0.0, np.inf), 0.3, 1000, rng)
        low, high = np.quantile(fit.hours_to(float(worn[-1]), rng), [0.05, 0.95], method="nearest")
        inside.append(low <= 2e5 <= high)
    assert 0.80 <= np.mean(inside) <= 0.97


def test_tolerances_are_spreads_and_draws():
    tolerances = Tolerance("bushings.wear", "30 %"), Tolerance("bushings[1].wear", "2e-4 mm3/(N m)")
    rig = model_of(1e-12).rig.replace(tolerances=tolerances)
    np.testing.assert_allclose(spreads(rig), [math.log(1.3), math.log(1.2)])
    drawn = drawn_models(Model(rig), 400, 0)
    first, second = np.transpose([[b.wear for b in one.rig.bushings] for one in drawn])
    assert np.log(first).std() == pytest.approx(math.log(1.3), rel=0.05)
    assert second.std() == pytest.approx(2e-13, rel=0.05)
    assert {b.gap for one in drawn for b in one.rig.bushings} == {3e-4}


def test_identification_leaves_the_coefficient_alone():
    rig = model_of(1e-12).rig
    assert priors(rig.replace(tolerances=(Tolerance("bushings.wear", "30 %"),))) == priors(rig)


def history(**changes) -> GapHistory:
    hours = np.arange(4.0)
    gap = np.column_stack((np.full(4, np.nan), 3e-4 + 1e-6 * hours))
    return GapHistory(**{"hours": hours, "gap": gap, "std": 1e-7 * np.ones((4, 2))} | changes)


@pytest.mark.parametrize("changes, words", [
    ({"hours": np.array([0.0, 2.0, 1.0, 3.0])}, "rise from point to point"),
    ({"gap": np.full((4, 2), 3e-4) - 1e-6 * np.arange(4.0)[:, None]}, "shrinks"),
    ({"std": np.zeros((4, 2))}, "standard deviation of 0"),
    ({"gap": -np.ones((4, 2))}, "gaps are above 0"),
    ({"hours": np.arange(2.0), "gap": np.full((2, 2), 3e-4), "std": np.ones((2, 2))}, "2 points; give 3"),
])  # fmt: skip
def test_impossible_histories_are_refused_in_one_line(changes, words):
    assert_refused(RecordError, words, history, **changes)


def test_a_history_beyond_the_limit_is_refused():
    with pytest.raises(ClearanceError, match="no life is left"):
        predict_remaining(model_of(1e-12), SINE, history(), "0.301 mm")


def test_a_bushing_that_does_not_wear_is_refused():
    one = dataclasses.replace(TABLE1.bushings[0], wear=1e-12)
    with pytest.raises(RecordError, match="needs a coefficient"):
        predict_remaining(Model(TABLE1.replace(bushings=(one, TABLE1.bushings[1]))), SINE, history(), "0.6 mm")


@pytest.mark.parametrize("text, words", [
    ("hours,bushing,gap_m\n0,0,3e-4\n", "no column std_m"),
    ("hours,bushing,gap_m,std_m\n0,7,3e-4,1e-6\n", "bushing 7"),
    ("hours,bushing,gap_m,std_m\n0,0,wide,1e-6\n", "no number"),
    ("", "cannot be read"),
])  # fmt: skip
def test_impossible_files_are_refused_in_one_line(tmp_path, text, words):
    path = tmp_path / "history.csv"
    path.write_text(text)
    with pytest.raises(RecordError, match=words) as error:
        GapHistory.load(path, 2)
    assert str(path) in str(error.value)


def test_a_file_holds_a_history(tmp_path):
    path = tmp_path / "history.csv"
    path.write_text("hours,bushing,gap_m,std_m\n" + "".join(f"{h},1,{3e-4 + 1e-6 * h},1e-7\n" for h in range(4)))
    assert GapHistory.load(path, 2).until(10.0).of(1)[1] == pytest.approx(history().of(1)[1])
    assert GapHistory.load(path, 2).known == (1,)
