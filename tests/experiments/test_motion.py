"""Statistics of the items on motion control, on rows with known answers."""

import itertools

import numpy as np
import pandas as pd
import pytest
import scipy.stats

from clearance_mj.vehicle.experiment import CONTROLLERS, REGIMES
from experiments.article.motion import COMPARED, comparison, median, over_seeds, reduction, seeds_table

ERRORS = ("peak_e_y", "rms_e_y", "peak_e_psi", "peak_yaw_rate_error", "peak_yaw_rate", "peak_lateral_acceleration")


def rows(value):
    cases = itertools.product(range(30), REGIMES, CONTROLLERS)
    keys = ({"controller": name, "regime": regime, "seed": seed} for seed, regime, name in cases)
    return pd.DataFrame(key | dict.fromkeys(ERRORS, value(key["controller"], key["seed"])) for key in keys)


def test_reduction_is_of_the_same_seed():
    """SMC scatters from seed to seed, SMC-CM is 20 % below it under each."""
    peaks = rows(lambda c, s: (0.8 if c == "smc-cm" else 1.0) * (1 + s))
    np.testing.assert_allclose(over_seeds(peaks, "smc", "torque", "peak_e_y"), 1 + np.arange(30))
    np.testing.assert_allclose(reduction(peaks, "smc-cm", "smc", "friction", "peak_e_y"), 20.0)


def test_table_of_medians():
    """Median of 1 … 30 mm, between the 10th and the 21st."""
    table = seeds_table(rows(lambda c, s: 1e-3 * (1 + s)), "medians")
    assert len(table.rows) == len(REGIMES) * len(CONTROLLERS)
    assert table.rows[0][2:4] == (pytest.approx(15.5), "10.0 to 21.0")


def test_comparison_has_each_once():
    cases = comparison(speeds=(72.0,), seed=3)
    assert {(c.controller, c.regime) for c in cases} == {(n, r) for n in COMPARED for r in ("torque", "friction")}
    assert len(cases) == 2 * len(COMPARED)


def test_median_and_interval():
    """Of 1 … 30: order statistics 10 and 21 enclose the median with 95 % (binomial, e.g. Conover 1999, 3.2)."""
    interval = median(np.arange(1.0, 31.0))
    assert interval.value == 15.5 and (interval.low, interval.high) == (10.0, 21.0)
    assert scipy.stats.binom.cdf(20, 30, 0.5) - scipy.stats.binom.cdf(9, 30, 0.5) >= 0.95
