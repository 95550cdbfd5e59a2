"""Comparisons of FRFs: tables, pairs of modes, refusals, and what is remembered between them."""

import dataclasses
import json

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.signals import FRF, comparison, join_references
from clearance_mj.signals.comparison import compare, compare_modes
from clearance_mj.signals.correlation import csac, csac_per_sensor, csf, csf_per_sensor, frac, mre, rmse_db

F = np.arange(5, 220.25, 0.5)
SHAPES = np.array([[1.0, 1.0, 1.0], [0.8, -0.2, -1.0], [0.4, -1.0, 0.9], [0.1, 0.6, 0.3]])
RATES = 30.0, 80.0, 150.0


def modal_frf(rates=RATES, shapes=SHAPES, participation=(1.0, 1.0, 1.0), damping=0.02, frequency=F, **fields):
    """Accelerance of modes: the sum of s² times shape times participation over s² + 2ζωs + ω², with s = jω."""
    s, rates = 2j * np.pi * frequency[:, None], 2 * np.pi * np.array(rates)
    terms = s**2 * np.array(participation) / (s**2 + 2 * damping * rates * s + rates**2)
    return FRF(frequency, 1 + np.asarray(shapes) @ terms.T, **fields)


def whole(test, model, n_modes=4):
    return compare(test, model, compare_modes(test, model, n_modes))


def assert_modes(result, rtol=1e-6, **columns):
    """The table of modes holds these columns; nan equals nan."""
    for name, expected in columns.items():
        np.testing.assert_allclose(result.per_mode[name], expected, rtol=rtol, atol=1e-6, err_msg=name)


def test_a_comparison_holds_the_measures_of_its_frfs():
    test = modal_frf(responses=("3:+Z", "4:+Z", "5:-Y", "9:+X"))
    model = modal_frf((31.5, 80, 147), damping=0.03, responses=test.responses)
    result = whole(test, model)
    np.testing.assert_array_equal(result.frequency, F)
    for criterion in (csac, csf, csac_per_sensor, csf_per_sensor):
        np.testing.assert_array_equal(getattr(result, criterion.__name__), criterion(test.functions, model.functions))
    assert tuple(result.per_sensor["sensor"]) == test.responses
    for criterion in (mre, rmse_db, frac):
        np.testing.assert_array_equal(result.per_sensor[criterion.__name__], criterion(test.functions, model.functions))
    np.testing.assert_array_equal(result.per_sensor["csac"], result.csac_per_sensor.mean(axis=1))
    np.testing.assert_array_equal(result.per_sensor["csf"], result.csf_per_sensor.mean(axis=1))


def test_a_comparison_finds_frequencies_damping_and_mac():
    shapes = SHAPES + np.array([[0, 0, 0], [0, 0.5, 0], [0, 0, 0.6], [0.2, 0, 0]])
    result = whole(modal_frf(), modal_frf((31.5, 80, 147), shapes, damping=0.03), n_modes=3)
    cosines = np.sum(SHAPES * shapes, axis=0) / np.linalg.norm(SHAPES, axis=0) / np.linalg.norm(shapes, axis=0)
    assert_modes(result, mode=[1, 2, 3], test_hz=RATES, model_hz=[31.5, 80, 147], relative_error=[0.05, 0, 0.02])
    assert_modes(result, 1e-4, test_damping=0.02, model_damping=0.03)
    assert_modes(result, 0, mac=cosines**2)


def test_a_comparison_of_frfs_looks_for_no_modes(monkeypatch):
    monkeypatch.setattr(comparison, "paired_modes", lambda *_: pytest.fail("modes are looked for"))
    result = compare(modal_frf(), modal_frf((31, 80, 150)))
    assert len(result.per_mode) == 0 and np.isnan(result.summary()["mac"])


def test_equal_frfs_agree_in_everything():
    summary = whole(modal_frf(), modal_frf(), n_modes=3).summary()
    for name in ("frac", "csac", "csf", "csac_per_sensor", "csf_per_sensor", "mac", "mode_3_mac"):
        assert summary[name] == pytest.approx(1, abs=1e-12)
    for name in ("mre", "rmse_db", "relative_error", "mode_3_relative_error"):
        assert summary[name] == 0


def test_modes_that_cross_are_paired_by_their_shapes():
    """The second and third mode change order between test and model; frequency alone would pair 100 with 101 Hz."""
    result = whole(modal_frf((30, 100, 105)), modal_frf((30, 106, 101)), n_modes=3)
    assert_modes(result, test_hz=[30, 100, 105], model_hz=[30, 106, 101], mac=1)


def test_a_mode_without_partner_has_nan_in_its_row():
    none = np.nan
    test = modal_frf(RATES[:2], SHAPES[:, :2], (1, 1))
    result = whole(test, modal_frf(RATES[1:], SHAPES[:, 1:], (1, 1)), n_modes=4)
    assert_modes(result, mode=[1, 2, 3, 4], test_hz=[30, 80, none, none], model_hz=[none, 80, 150, none])
    assert_modes(result, 1e-4, mac=[none, 1, none, none], model_damping=[none, 0.02, 0.02, none])
    assert result.summary()["mac"] == pytest.approx(1, abs=1e-6)


def test_modes_too_far_apart_are_no_pair():
    """One mode each, of the same shape, at 30 and at 60 Hz."""
    one = {"shapes": SHAPES[:, :1], "participation": (1,)}
    result = whole(modal_frf((30,), **one), modal_frf((60,), **one), n_modes=2)
    assert_modes(result, test_hz=[30, np.nan], model_hz=[np.nan, 60], relative_error=[np.nan] * 2)


def test_the_strongest_mode_of_the_test_is_found_where_it_is_weak_in_the_model():
    test = modal_frf(participation=(1, 0.01, 0.01))
    modes = whole(test, modal_frf((31, 80, 150), participation=(0.05, 0.01, 1)), n_modes=1).per_mode
    np.testing.assert_allclose([modes["test_hz"], modes["model_hz"]], [[30], [31]], rtol=0.01)


def test_frfs_of_noise_alone_are_compared_without_modes():
    noises = (np.random.default_rng(0).standard_normal((2, 3, F.size, 2)) @ (1, 1j)).reshape(2, 3, F.size)
    result = whole(FRF(F, noises[0]), FRF(F, noises[1]))
    assert all(np.all(np.isnan(column)) for name, column in result.per_mode.items() if name not in ("mode", "why"))
    assert np.isnan(result.summary()["mac"])
    assert result.csac.mean() == pytest.approx(1 / 3, abs=0.06)  # mean squared cosine of random vectors in ℂ³


def test_the_summary_is_flat_floats_with_the_same_names_for_all_frfs():
    full = whole(modal_frf(), modal_frf((31, 80, 150))).summary()
    lacking = whole(modal_frf(RATES[:1], SHAPES[:, :1], (1,)), modal_frf()).summary()
    assert json.loads(json.dumps(full)).keys() == full.keys() == lacking.keys()
    assert all(type(value) is float for value in (*full.values(), *lacking.values()))
    assert full["mode_1_test_hz"] == pytest.approx(30, rel=1e-6)


@pytest.mark.parametrize(("model", "message"), [
    (modal_frf(frequency=F[:-1]), "431 lines from 5 to 220 Hz; the model has 430 lines from 5 to 219.5 Hz"),
    (modal_frf(frequency=F + 0.25), "from 5 to 220 Hz; the model has 431 lines from 5.25 to 220.25 Hz"),
    (modal_frf(responses=("1:+Z", "2:+Z", "3:+Z", "5:+Z")), "2:.Z, 3:.Z, 4:.Z; the model's are 1:.Z, 2:.Z, 3"),
    (modal_frf(quantity="acceleration/force"), "is acceleration/acceleration, the model's acceleration/force"),
])  # fmt: skip
def test_frfs_that_cannot_be_compared_are_refused(model, message):
    with pytest.raises(RecordError, match=message):
        whole(modal_frf(), model)


def test_one_response_has_no_csac_and_no_mac():
    """Both are 1 by definition; all else is told, of twice the level: 20 lg 2 dB, MRE 1, CSF 4/5."""
    test = modal_frf(shapes=SHAPES[:1])
    result = whole(test, dataclasses.replace(test, value=2 * test.value), 3)
    assert np.isnan(result.csac).all() and np.isnan(result.per_mode["mac"]).all()
    np.testing.assert_allclose(result.csf, 0.8, rtol=1e-12)
    summary = result.summary()
    assert (summary["rmse_db"], summary["mre"], summary["frac"]) == pytest.approx((20 * np.log10(2), 1, 1))
    assert summary["relative_error"] == pytest.approx(0, abs=1e-6)
    assert np.isnan(summary["mac"]) and np.isnan(summary["csac"])


def test_one_line_has_no_frac():
    test = modal_frf().within((20, 20))
    result = whole(test, dataclasses.replace(test, value=2 * test.value), 0)
    assert test.frequency.size == 1
    assert np.isnan(result.per_sensor["frac"]).all() and np.isnan(result.csac_per_sensor).all()
    assert result.csac == pytest.approx([1])
    np.testing.assert_allclose(result.csf_per_sensor, 0.8, rtol=1e-12)
    assert result.per_mode["mode"].size == 0 and np.isnan(result.summary()["mac"])


def test_modes_follow_the_content_of_an_frf():
    """They are remembered for a test that is compared with many models: for equal FRFs, never for a changed one."""
    model = modal_frf()
    for shift in (1.0, 1.1, 1.0):
        test = modal_frf(tuple(shift * f for f in RATES))
        np.testing.assert_allclose(whole(test, model, 3).per_mode["test_hz"], np.multiply(shift, RATES), rtol=1e-3)
        with pytest.raises(ValueError, match="read-only"):
            test.value[:] = model.value


def test_every_pair_of_several_references_is_a_row():
    one = modal_frf()
    both = join_references([dataclasses.replace(one, references=(r,)) for r in ("1:+Z", "2:+Z")])
    result = whole(both, both, 3)
    assert result.per_sensor["sensor"].tolist() == [f"{i}/{j}" for j in both.references for i in both.responses]
    assert result.summary()["mac"] == pytest.approx(1)
