"""Cases of the experiments, and their statistics against known values."""

import numpy as np
import pytest

from clearance_mj.vehicle.experiment import GAP, REGIMES, Case, run_all, run_case


def test_clearance_model_is_worth_the_articles_share():
    """At 120 km/h and 0.2°, peak e_y of SMC-CM below SMC's by the article's 14 % or more, in both regimes."""
    for regime in ("torque", "friction"):
        runs = (run_case(Case(name, 120.0, regime=regime)).run for name in ("smc", "smc-cm"))
        smc, model = (run.metrics()["peak_e_y"] for run in runs)
        assert model < 0.857 * smc, regime


def test_assumed_stiffness_is_the_clearance_models_compliance():
    """Assuming half the datasheet's stiffness, the model's compliance is once the datasheet's 1/k too large."""
    case = Case("smc-cm", 72.0, assumed_stiffness=0.5)
    assert case.tuned_controller.lost_motion.compliance == pytest.approx(1 / case.steering.lost_motion.stiffness)
    assert Case("smc-cm", 72.0, stiffness=0.5).tuned_controller.lost_motion.compliance == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("regime", REGIMES)
@pytest.mark.parametrize("name", ["smc-cm", pytest.param("mpc-cm", marks=pytest.mark.release)])
def test_true_gap_is_the_best_assumption(name, regime):
    """At 120 km/h: of gaps from half to twice the steering's the true one leaves the least peak of e_y with SMC-CM.

    With MPC-CM none leaves one that is 4 mm less. Medians over noises; with tyres that do not saturate in the design
    model it is 25 and 12 mm less, torque-driven.
    """
    factors, seeds = (0.5, 0.75, 1.0, 1.25, 1.5, 2.0), range(8)
    cases = [Case(name, 120.0, regime=regime, assumed_gap=f * GAP, seed=seed) for f in factors for seed in seeds]
    peaks = [outcome.run.metrics()["peak_e_y"] for outcome in run_all(cases)]
    medians = dict(zip(factors, np.median(np.reshape(peaks, (len(factors), -1)), axis=1)))
    assert medians[1.0] <= min(medians.values()) + (0.0 if name == "smc-cm" else 0.004)
    assert medians[1.0] < 0.6 * min(medians[0.5], medians[2.0])
