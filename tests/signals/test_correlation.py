"""Correlation measures against their formulas in plain loops, and against what they must not see."""

import cmath
import dataclasses
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearance_mj.errors import RecordError
from clearance_mj.signals.correlation import (
    compare,
    csac,
    csac_per_sensor,
    csf,
    csf_per_sensor,
    frac,
    mac,
    mre,
    relative_error,
    rmse_db,
)
from clearance_mj.signals.frf import FRF


def frfs(seed=0, n_resp=4, n_f=30):
    """Two FRF arrays that are alike but not equal."""
    rng = np.random.default_rng(seed)
    test = rng.standard_normal((n_resp, n_f)) + 1j * rng.standard_normal((n_resp, n_f))
    return test, test * (1 + 0.3 * rng.standard_normal((n_resp, n_f))) + 0.2j


def cross_signature(test, model):
    """CSAC and CSF of one vector each (Zang, Grafe and Imregun 2001), term by term."""
    cross = abs(sum(t.conjugate() * m for t, m in zip(test, model)))
    tt, mm = (sum(abs(v) ** 2 for v in values) for values in (test, model))
    return cross**2 / (tt * mm), 2 * cross / (tt + mm)


def test_relative_errors_of_the_articles_table_1():
    """Table 1 of the article: frequencies in Hz and relative errors in % as printed, to four decimals."""
    test = [9.25, 39.75, 92.85, 188.85]
    initial = 100 * relative_error(test, [9.15, 38.35, 97.85, 191.35])
    updated = 100 * relative_error(test, [9.20, 40.25, 91.65, 187.25])
    np.testing.assert_allclose(initial, [1.0811, 3.5220, 5.3850, 1.3238], atol=6e-5)
    np.testing.assert_allclose(updated, [0.5405, 1.2579, 1.2924, 0.8472], atol=6e-5)


def test_csac_and_csf_are_their_formulas_at_each_line():
    test, model = frfs()
    expected = np.array([cross_signature(test[:, k], model[:, k]) for k in range(test.shape[1])])
    np.testing.assert_allclose(csac(test, model), expected[:, 0], rtol=1e-12)
    np.testing.assert_allclose(csf(test, model), expected[:, 1], rtol=1e-12)


def test_the_variants_per_sensor_are_the_formulas_over_a_window_cut_at_the_ends():
    test, model = frfs(n_resp=2)
    for window in (3, 9):
        half = window // 2
        expected = np.array(
            [
                [
                    cross_signature(t[max(0, k - half) : k + half + 1], m[max(0, k - half) : k + half + 1])
                    for k in range(30)
                ]
                for t, m in zip(test, model)
            ]
        )
        np.testing.assert_allclose(csac_per_sensor(test, model, window), expected[..., 0], rtol=1e-12)
        np.testing.assert_allclose(csf_per_sensor(test, model, window), expected[..., 1], rtol=1e-12)
    np.testing.assert_array_equal(csac_per_sensor(test, model), csac_per_sensor(test, model, 9))


def test_frac_mre_and_rmse_are_their_formulas_for_each_response():
    """Heylen and Lammens 1996 for FRAC; MRE and RMSE as the project defines them, the article does not."""
    test, model = frfs()
    for o in range(test.shape[0]):
        t, m = test[o].tolist(), model[o].tolist()
        cross = abs(sum(a * b.conjugate() for a, b in zip(t, m))) ** 2
        energies = sum(abs(a) ** 2 for a in t) * sum(abs(b) ** 2 for b in m)
        assert frac(test, model)[o] == pytest.approx(cross / energies, rel=1e-12)
        errors = [abs(abs(b) - abs(a)) / abs(a) for a, b in zip(t, m)]
        assert mre(test, model)[o] == pytest.approx(math.fsum(errors) / 30, rel=1e-12)
        squares = [(20 * math.log10(abs(b) / abs(a))) ** 2 for a, b in zip(t, m)]
        assert rmse_db(test, model)[o] == pytest.approx(math.sqrt(math.fsum(squares) / 30), rel=1e-12)


def test_a_model_twice_as_large_is_off_by_one_and_6_02_db():
    test, _ = frfs()
    np.testing.assert_allclose(mre(test, 2 * test), 1.0, rtol=1e-12)
    np.testing.assert_allclose(rmse_db(test, 2 * test), 6.020599913, rtol=1e-9)
    np.testing.assert_allclose(csf(test, 2 * test), 0.8, rtol=1e-12)  # 2·2 / (1 + 4)


def test_mac_of_vectors_at_45_degrees_is_one_half():
    """cos² 45°; a complex factor j on one component makes (1, 1) and (1, j) as far apart as (1, 1) and (1, 0)."""
    a = np.array([[1.0, 1.0], [0.0, 1.0]])
    b = np.array([[1.0, 0.0, 1.0], [1.0, 1.0, 1.0j]])
    np.testing.assert_allclose(mac(a, b), [[0.5, 0.0, 0.5], [1.0, 0.5, 0.5]], atol=1e-15)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), size=st.floats(1e-6, 1e6), phase=st.floats(0, 6.28))
def test_complex_scale_factors(seed, size, phase):
    """MAC, FRAC and CSAC do not see one; CSF of a scaled copy is 2s/(1 + s²)."""
    test, model = frfs(seed, 3, 12)
    factor = size * cmath.exp(1j * phase)
    for criterion in (frac, csac, csac_per_sensor):
        np.testing.assert_allclose(criterion(test, factor * model), criterion(test, model), rtol=1e-9)
    np.testing.assert_allclose(np.diag(mac(test, factor * test)), 1.0, rtol=1e-12)
    for criterion in (csf, csf_per_sensor):
        np.testing.assert_allclose(criterion(test, factor * test), 2 * size / (1 + size**2), rtol=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), n_resp=st.integers(2, 6), n_f=st.integers(1, 20))
def test_bounds(seed, n_resp, n_f):
    """All lie between 0 and 1, and CSF ≤ √CSAC (arithmetic over geometric mean of the two energies)."""
    test, model = frfs(seed, n_resp, n_f)
    for criterion in (frac, csac, csf, csac_per_sensor, csf_per_sensor):
        value = criterion(test, model)
        assert np.all((value >= 0) & (value <= 1 + 1e-12))
    assert np.all(csf(test, model) <= np.sqrt(csac(test, model)) * (1 + 1e-12))


def test_csac_of_one_response_is_refused():
    """It is 1 whatever the FRFs are."""
    with pytest.raises(RecordError, match=r"CSAC .* at least 2, got 1; use csac_per_sensor"):
        csac(*frfs(n_resp=1))


def test_csf_of_one_response_compares_levels():
    """2ab / (a² + b²) of the magnitudes a, b."""
    test, model = frfs(n_resp=1)
    a, b = np.abs(test[0]), np.abs(model[0])
    np.testing.assert_allclose(csf(test, model), 2 * a * b / (a**2 + b**2), rtol=1e-12)


@pytest.mark.parametrize("criterion", [frac, csac, csf, mre, rmse_db, csac_per_sensor, csf_per_sensor])
def test_shapes_that_differ_are_refused(criterion):
    with pytest.raises(RecordError, match=r"\(4, 30\) and \(4, 29\)"):
        criterion(np.ones((4, 30)), np.ones((4, 29)))
    with pytest.raises(RecordError, match=r"\(30,\) and \(30,\)"):
        criterion(np.ones(30), np.ones(30))


def test_modes_that_do_not_fit_are_refused():
    with pytest.raises(RecordError, match=r"\(8, 4\) and \(7, 4\)"):
        mac(np.ones((8, 4)), np.ones((7, 4)))
    with pytest.raises(RecordError, match=r"\(8,\) and \(8,\)"):
        mac(np.ones(8), np.ones(8))
    with pytest.raises(RecordError, match=r"\(4,\) and \(3,\)"):
        relative_error(np.ones(4), np.ones(3))


@pytest.mark.parametrize("window", [1, 8, -3])
def test_windows_without_a_centre_are_refused(window):
    with pytest.raises(RecordError, match=f"odd number of lines >= 3, got {window}"):
        csac_per_sensor(*frfs(), window)


F = np.arange(5, 220.25, 0.5)
SHAPES = np.array([[1.0, 1.0, 1.0], [0.8, -0.2, -1.0], [0.4, -1.0, 0.9], [0.1, 0.6, 0.3]])
RATES = 30.0, 80.0, 150.0


def modal_frf(rates=RATES, shapes=SHAPES, participation=(1.0, 1.0, 1.0), damping=0.02, frequency=F, **fields):
    """Accelerance of modes: the sum of s² times shape times participation over s² + 2ζωs + ω², with s = jω."""
    s, rates = 2j * np.pi * frequency[:, None], 2 * np.pi * np.array(rates)
    terms = s**2 * np.array(participation) / (s**2 + 2 * damping * rates * s + rates**2)
    return FRF(frequency, 1 + np.asarray(shapes) @ terms.T, **fields)


def test_a_comparison_holds_the_measures_of_its_frfs():
    test = modal_frf(responses=("3:+Z", "4:+Z", "5:-Y", "9:+X"))
    model = modal_frf((31.5, 80, 147), damping=0.03, responses=test.responses)
    found = compare(test, model)
    np.testing.assert_array_equal(found.frequency, F)
    for criterion in (csac, csf, csac_per_sensor, csf_per_sensor):
        np.testing.assert_array_equal(getattr(found, criterion.__name__), criterion(test.functions, model.functions))
    assert found.per_sensor["sensor"] == test.responses
    for criterion in (mre, rmse_db, frac):
        np.testing.assert_array_equal(found.per_sensor[criterion.__name__], criterion(test.functions, model.functions))
    np.testing.assert_array_equal(found.per_sensor["csac"], found.csac_per_sensor.mean(axis=1))
    np.testing.assert_array_equal(found.per_sensor["csf"], found.csf_per_sensor.mean(axis=1))


def test_a_comparison_finds_frequencies_damping_and_mac():
    shapes = SHAPES + np.array([[0, 0, 0], [0, 0.5, 0], [0, 0, 0.6], [0.2, 0, 0]])
    found = compare(modal_frf(), modal_frf((31.5, 80, 147), shapes, damping=0.03), n_modes=3).per_mode
    np.testing.assert_array_equal(found["mode"], [1, 2, 3])
    np.testing.assert_allclose(found["test_hz"], RATES, rtol=1e-6)
    np.testing.assert_allclose(found["model_hz"], [31.5, 80, 147], rtol=1e-6)
    np.testing.assert_allclose(found["relative_error"], [0.05, 0, 0.02], atol=1e-6)
    np.testing.assert_allclose(found["test_damping"], 0.02, rtol=1e-4)
    np.testing.assert_allclose(found["model_damping"], 0.03, rtol=1e-4)
    cosines = np.sum(SHAPES * shapes, axis=0) / np.linalg.norm(SHAPES, axis=0) / np.linalg.norm(shapes, axis=0)
    np.testing.assert_allclose(found["mac"], cosines**2, atol=1e-6)


def test_equal_frfs_agree_in_everything():
    summary = compare(modal_frf(), modal_frf(), n_modes=3).summary()
    for name in ("frac", "csac", "csf", "csac_per_sensor", "csf_per_sensor", "mac", "mode_3_mac"):
        assert summary[name] == pytest.approx(1, abs=1e-12)
    for name in ("mre", "rmse_db", "relative_error", "mode_3_relative_error"):
        assert summary[name] == 0


def test_modes_that_cross_are_paired_by_their_shapes():
    """The second and third mode swap places between test and model; frequency alone would pair 100 with 101 Hz."""
    found = compare(modal_frf((30, 100, 105)), modal_frf((30, 106, 101)), n_modes=3).per_mode
    np.testing.assert_allclose(found["test_hz"], [30, 100, 105], rtol=1e-6)
    np.testing.assert_allclose(found["model_hz"], [30, 106, 101], rtol=1e-6)
    np.testing.assert_allclose(found["mac"], 1, atol=1e-6)


def test_a_mode_without_partner_has_nan_in_its_place():
    test = modal_frf(RATES[:2], SHAPES[:, :2], (1, 1))
    model = modal_frf(RATES[1:], SHAPES[:, 1:], (1, 1))
    found = compare(test, model, n_modes=4)
    columns = found.per_mode
    np.testing.assert_allclose(columns["test_hz"], [30, 80, np.nan, np.nan], rtol=1e-6)
    np.testing.assert_allclose(columns["model_hz"], [np.nan, 80, 150, np.nan], rtol=1e-6)
    np.testing.assert_allclose(columns["mac"], [np.nan, 1, np.nan, np.nan], rtol=1e-6)
    np.testing.assert_allclose(columns["model_damping"], [np.nan, 0.02, 0.02, np.nan], rtol=1e-4)
    np.testing.assert_array_equal(columns["mode"], [1, 2, 3, 4])
    assert found.summary()["mac"] == pytest.approx(1, abs=1e-6)


def test_modes_too_far_apart_are_no_pair():
    """One mode each, of the same shape, at 30 and at 60 Hz."""
    one = {"shapes": SHAPES[:, :1], "participation": (1,)}
    found = compare(modal_frf((30,), **one), modal_frf((60,), **one), n_modes=2).per_mode
    np.testing.assert_allclose(found["test_hz"], [30, np.nan], rtol=1e-6)
    np.testing.assert_allclose(found["model_hz"], [np.nan, 60], rtol=1e-6)
    assert np.all(np.isnan(found["relative_error"]))


def test_the_strongest_mode_of_the_test_is_found_where_it_is_weak_in_the_model():
    test = modal_frf(participation=(1, 0.01, 0.01))
    model = modal_frf((31, 80, 150), participation=(0.05, 0.01, 1))
    found = compare(test, model, n_modes=1).per_mode
    np.testing.assert_allclose([found["test_hz"], found["model_hz"]], [[30], [31]], rtol=0.01)


def test_frfs_of_noise_alone_are_compared_without_modes():
    rng = np.random.default_rng(0)
    noises = (rng.standard_normal((2, 3, F.size, 2)) @ (1, 1j)).reshape(2, 3, F.size)
    found = compare(FRF(F, noises[0]), FRF(F, noises[1]))
    assert all(np.all(np.isnan(column)) for name, column in found.per_mode.items() if name != "mode")
    assert np.isnan(found.summary()["mac"])
    assert found.csac.mean() == pytest.approx(1 / 3, abs=0.06)  # mean squared cosine of random vectors in ℂ³


def test_the_summary_is_flat_floats_with_the_same_names_for_all_frfs():
    full = compare(modal_frf(), modal_frf((31, 80, 150))).summary()
    lacking = compare(modal_frf(RATES[:1], SHAPES[:, :1], (1,)), modal_frf()).summary()
    assert json.loads(json.dumps(full)).keys() == full.keys() == lacking.keys()
    assert all(type(value) is float for value in (*full.values(), *lacking.values()))
    assert full["mode_1_test_hz"] == pytest.approx(30, rel=1e-6)


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (modal_frf(frequency=F[:-1]), "431 lines from 5 to 220 Hz; the model has 430 lines from 5 to 219.5 Hz"),
        (modal_frf(frequency=F + 0.25), "from 5 to 220 Hz; the model has 431 lines from 5.25 to 220.25 Hz"),
        (
            modal_frf(responses=("1:+Z", "2:+Z", "3:+Z", "5:+Z")),
            "1:.Z, 2:.Z, 3:.Z, 4:.Z; the model's are 1:.Z, 2:.Z, 3",
        ),
        (modal_frf(quantity="acceleration/force"), "is acceleration/acceleration, the model's acceleration/force"),
    ],
)
def test_frfs_that_cannot_be_compared_are_refused(model, message):
    with pytest.raises(RecordError, match=message):
        compare(modal_frf(), model)


def test_one_response_has_no_csac_and_no_mac():
    """Both are 1 by definition; all else is told, of twice the level: 20 lg 2 dB, MRE 1, CSF 4/5."""
    test = modal_frf(shapes=SHAPES[:1])
    model = dataclasses.replace(test, value=2 * test.value)
    found = compare(test, model, 3)
    assert np.isnan(found.csac).all() and np.isnan(found.per_mode["mac"]).all()
    np.testing.assert_allclose(found.csf, 0.8, rtol=1e-12)
    summary = found.summary()
    assert (summary["rmse_db"], summary["mre"], summary["frac"]) == pytest.approx((20 * np.log10(2), 1, 1))
    assert summary["relative_error"] == pytest.approx(0, abs=1e-6)
    assert np.isnan(summary["mac"]) and np.isnan(summary["csac"])


def test_one_line_has_no_frac():
    test = modal_frf().within((20, 20))
    found = compare(test, dataclasses.replace(test, value=2 * test.value), 0)
    assert test.frequency.size == 1
    assert np.isnan(found.per_sensor["frac"]).all() and np.isnan(found.csac_per_sensor).all()
    assert found.csac == pytest.approx([1])
    np.testing.assert_allclose(found.csf_per_sensor, 0.8, rtol=1e-12)
    assert found.per_mode["mode"].size == 0 and np.isnan(found.summary()["mac"])
