"""The comparison of steering controllers: its statistics on rows with known answers, and a small one that is run."""

import numpy as np
import pandas as pd

from clearance_mj.vehicle.experiment import GAP, REGIMES
from clearance_mj.vehicle.manoeuvres import MANOEUVRES
from experiments.article.motion import median
from experiments.steering import comparison as steering_comparison
from experiments.steering.comparison import Group
from experiments.steering.comparison_page import write_page
from experiments.steering.comparison_statistics import below, below_both, paired, values


def test_medians_with_runs_that_left_the_path():
    """Eleven of thirty did: order statistics 10 and 21 of 1 ... 19 and infinities (Conover 1999, 3.2)."""
    assert median(np.r_[np.arange(1.0, 20.0), np.full(11, np.inf)]) == (15.5, 10.0, np.inf)
    assert median(np.full(30, np.inf)) == (np.inf, np.inf, np.inf)


def test_leaving_the_path_is_worse_than_any_error():
    """20 % below; better and worse without limit; both left: no difference."""
    new, old = np.array([0.8, 0.8, np.inf, np.inf]), np.array([1.0, np.inf, 1.0, np.inf])
    np.testing.assert_allclose(below(new, old), [20.0, 100.0, -np.inf, 0.0])


def made_rows(peak, turns):
    """Rows of 30 seeds whose peak and reversals are functions of controller and seed."""
    return pd.DataFrame(
        {"manoeuvre": "slalom", "regime": regime, "controller": name, "seed": seed, "left": ""}
        | dict.fromkeys(("peak_e_y", "rms_e_y"), peak(name, seed))
        | dict.fromkeys(("servo_rms_rate", "servo_fast_rate", "contact_reversals"), 0.1)
        | {"servo_reversals": turns(name), "outside_layer": 0.25 if name.startswith("smc") else np.inf}
        for regime in REGIMES
        for name in ("smc", "smc-cm", "smc-dob", "mpc-cm", "mpc-dob")
        for seed in reversed(range(30))
    )


def test_pairs_are_of_the_same_vehicle():
    """Errors scatter thirtyfold from vehicle to vehicle, but SMC-CM is always 25 % below SMC-DOB, MPC-CM as MPC-DOB."""
    worth = {"smc-cm": 0.75, "mpc-cm": 1.0}
    rows = made_rows(lambda name, seed: worth.get(name, 1.0) * (1 + seed), lambda name: 4.0 + (name == "smc-cm"))
    np.testing.assert_array_equal(values(rows, "slalom", "torque", "smc", "peak_e_y"), 1 + np.arange(30))
    comparisons = {(one.regime, one.new): one for one in paired(rows)}
    assert set(comparisons) == {(regime, new) for regime in REGIMES for new in worth}
    sliding, predictive = comparisons["friction", "smc-cm"], comparisons["friction", "mpc-cm"]
    np.testing.assert_allclose(sliding.below, 25.0)
    assert sliding.reversals == 1.0 and sliding.verdict == "better, more reversals"
    assert predictive.verdict == "no difference" and sliding._replace(reversals=0.0).verdict == "better"
    assert sliding._replace(below=median(np.full(30, -5.0))).verdict == "worse"


def test_how_often_a_controller_is_below_both_observers():
    """SMC-CM is below both, but with one reversal more than MPC-DOB, the better one; MPC-CM only below SMC-DOB."""
    peaks = {"smc-cm": 1.0, "mpc-dob": 2.0, "mpc-cm": 2.5, "smc-dob": 3.0}
    turns = {"mpc-dob": 4.0, "smc-dob": 9.0}
    rows = made_rows(lambda name, seed: peaks.get(name, 4.0), lambda name: turns.get(name, 5.0))
    assert below_both(rows, "torque", "smc-cm") == (1, 0) and below_both(rows, "friction", "mpc-cm") == (0, 0)
    rows.loc[rows["controller"] == "smc-cm", "servo_reversals"] = 4.0
    assert below_both(rows, "torque", "smc-cm") == (1, 1)


def test_page_says_who_wins_and_who_left(tmp_path):
    rows = made_rows(lambda name, seed: {"smc-cm": 0.02, "mpc-cm": np.inf}.get(name, 0.05), lambda name: 4.0)
    write_page(rows, "car", tmp_path)
    text = (tmp_path / "vehicle_comparison.md").read_text(encoding="utf-8")
    assert "| Slalom | torque | 60 (60…60) | left (left…left) |" in text
    assert "| SMC-CM | 1 (1) | 1 (1) | 2 | 0 | 0 | 0 |" in text
    assert "| MPC-CM | 0 (0) | 0 (0) | 0 | 0 | 0 | 2 |" in text
    assert "| MPC-CM | left/left | 30/30 |" in text and "SMC-CM 25 to 25 %; " in text and "MPC-CM 25" not in text
    for name in ("torque", "friction", "pairs", "effort"):
        assert (tmp_path / f"vehicle_comparison_{name}.png").read_bytes()[:4] == b"\x89PNG"


def test_two_vehicles_on_one_manoeuvre(tmp_path, monkeypatch):
    """Every run has a row with its metrics; what is in the folder is not run again."""
    monkeypatch.setattr(steering_comparison, "run_tasks", lambda run, groups, *_, **__: [(g, run(g)) for g in groups])
    groups = [Group("lane-change", "torque", name, 2, "ideal") for name in ("smc", "smc-cm")]
    rows = steering_comparison.run_all(groups, tmp_path)
    assert list(zip(rows["controller"], rows["seed"])) == [("smc", 1), ("smc", 2), ("smc-cm", 1), ("smc-cm", 2)]
    assert (rows["left"] == "").all()
    assert np.isfinite(rows.drop(columns=["manoeuvre", "regime", "controller", "left"]).to_numpy(float)).all()
    monkeypatch.setattr(steering_comparison, "run_group", None)
    pd.testing.assert_frame_equal(steering_comparison.run_all(groups, tmp_path), rows)


def test_runs_that_leave_the_path_are_kept(tmp_path, monkeypatch):
    """Where 10 mm is off the path, none reaches the end: why it did not, and infinite metrics beside the others'."""
    monkeypatch.setattr(steering_comparison, "run_tasks", lambda run, groups, *_, **__: [(g, run(g)) for g in groups])
    steering_comparison.run_all([Group("lane-change", "torque", "smc-cm", 1, "ideal")], tmp_path)
    monkeypatch.setattr("clearance_mj.vehicle.run.LARGEST_ERROR", 0.01)
    groups = [Group("lane-change", "torque", name, 1, "ideal") for name in ("smc", "smc-cm")]
    lost, other = steering_comparison.run_all(groups, tmp_path).to_dict("records")
    assert "left the path" in lost["left"] and lost["peak_e_y"] == lost["servo_reversals"] == np.inf
    assert np.isfinite(other["peak_e_y"])


def test_twins_begin_with_half_the_gap():
    case = Group("slalom", "friction", "smc-twin", 1, "car").cases()[0]
    assert (case.assumed_gap, case.half_gap) == (0.5 * GAP, GAP)
    assert (case.speed, case.spread, case.sensors) == (MANOEUVRES["slalom"].speed, True, "car")
