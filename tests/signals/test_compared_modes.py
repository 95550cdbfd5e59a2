"""Modes that are hardly extracted are not compared, and it is said; those that all records show well are."""

import numpy as np
import pytest

from clearance_mj.signals.compared_modes import common_modes, distinct_modes, mode_errors
from clearance_mj.signals.comparison import compare, compare_modes
from clearance_mj.signals.frf import FRF
from clearance_mj.statistics import repeatability
from clearance_mj.study.rows import level_summaries

from .test_comparison import RATES, SHAPES, F, modal_frf

HIDDEN = 0.004
"""Participation of a mode that stands in noise of 2 % of the FRFs."""


def noisy(rng, participation, rates=RATES, noise=0.02):
    clean = modal_frf(rates, participation=participation)
    error = rng.standard_normal((*clean.value.shape, 2)) @ (1, 1j) / np.sqrt(2)
    return FRF(F, clean.value + noise * np.abs(clean.value) * error, np.full(clean.value.shape, 0.99), averages=20.0)


def test_a_mode_is_known_as_well_as_repeated_noise_shows(rng, measured):
    """Over 24 FRFs: the standard deviation of the first natural frequency, and that of its shape."""
    noisy_modes = [(frf, distinct_modes(frf, 3)) for frf in (noisy(rng, (1, 1, 1)) for _ in range(24))]
    errors = [mode_errors(*each) for each in noisy_modes]
    scatter = np.std([np.log(modes.frequency[0]) for _, modes in noisy_modes])
    measured.equal(
        "relative standard deviation of a natural frequency", float(np.mean([t.frequency[0] for t in errors])), scatter,
        "its scatter over 24 FRFs with noise", rel=0.4,
    )  # fmt: skip
    assert not any(t.hardly.any() for t in errors)


def test_a_mode_in_the_noise_is_hardly_extracted_or_not_found(rng):
    """Where the third mode is seen at all, its row says why it is not compared, and holds no error and no MAC."""
    seen, reasons = 0, ("not found in the test's FRFs between 10", "hardly extracted from the te")
    for _ in range(8):
        test, model = noisy(rng, (1, 1, HIDDEN)), modal_frf(participation=(1, 1, HIDDEN))
        for _, row in compare_modes(test, model, 3).iterrows():
            if not 140 < np.nanmax([row["test_hz"], row["model_hz"]]) < 160:
                continue
            seen += 1
            assert np.isnan(row["relative_error"]) == np.isnan(row["mac"]) == bool(row["why"])
            assert not row["why"] or row["why"].startswith(reasons)
    assert seen >= 8


def test_a_mode_that_the_model_lacks_is_said_with_where_it_was_looked_for():
    """Two modes of one shape are a pair up to a ratio of exp(0.15 √(2 ln 20)) = 1.44."""
    test, model = modal_frf(), modal_frf(RATES[:2], SHAPES[:, :2], (1, 1))
    comparison = compare_modes(test, model, 3)
    assert comparison["why"].tolist() == ["", "", "not found in the model's FRFs between 104 and 217 Hz"]


def test_two_poles_of_one_peak_are_one_mode():
    """Two modes of one shape within each other's half-power bands, as a nonlinear hump is fitted."""
    one = np.repeat(SHAPES[:, :1], 2, axis=1)
    modes = distinct_modes(modal_frf((30.0, 32.0, 150.0), np.hstack((one, SHAPES[:, 2:])), damping=0.06), 3)
    assert modes.frequency == pytest.approx([31.0, 150.0], rel=0.03)
    assert modes.frequency.size == 2


def test_modes_that_one_record_lacks_or_hides_are_left_out_of_all(rng):
    names, whole, two = ("a", "b"), noisy(rng, (1, 1, 1)), modal_frf(RATES[:2], SHAPES[:, :2], (1, 1))
    modes, said = common_modes([whole, two], names, 3)
    assert [m.frequency.size for m in modes] == [2, 2]
    np.testing.assert_allclose(modes[0].frequency, modes[1].frequency, rtol=0.01)
    assert said == ["the mode near 150 Hz of record a is not found in b"]
    _, said = common_modes([two, whole], names, 3)
    assert said == ["the mode near 150 Hz of record b is not found in a"]


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))])
def test_rows_of_records_with_poor_modes_stay_within_what_they_can_be(seed):
    """Two levels of two records, of laws good and poor, with modes from plain to hidden."""
    rng = np.random.default_rng(seed)
    participation = (1, *(10.0 ** rng.uniform(-3, 0, 2)))
    noises = {1.0: 0.05, 4.0: 0.3}
    tests = {level: [noisy(rng, participation, noise=noise) for _ in "ab"] for level, noise in noises.items()}
    modes = {level: common_modes(records, ("a", "b"), 4)[0] for level, records in tests.items()}
    for rates in (RATES, tuple(1.05 * f for f in RATES), (27.0, 100.0, 140.0)):
        by_level, model = {}, modal_frf(rates, participation=participation)
        for level, records in tests.items():
            pairs = [compare(t, model, compare_modes(t, model, 4, m)) for t, m in zip(records, modes[level])]
            by_level[level] = level_summaries(pairs)
        for row in repeatability.mean_rows(by_level).values():
            for key in filter(repeatability.has_interval, by_level[1.0][0]):
                low, high = row[f"{key}_low"], row[f"{key}_high"]
                most = 1.0 if key.endswith(("mac", "frac", "csac", "csf", "_per_sensor")) else np.inf
                assert np.isnan(row[key]) or 0 <= row[key] <= most
                assert (0 <= low <= high <= most) != bool(row[f"{key}_no_interval"]) or np.isnan(row[key])
