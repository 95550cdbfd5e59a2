"""Correlation measures against their formulas in plain loops, and against what they must not see."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearance_mj.core.errors import RecordError
from clearance_mj.signals import relative_error
from clearance_mj.signals.correlation import csac, csac_per_sensor, csf, csf_per_sensor, frac, mac, mre, rmse_db

from ..refusals import assert_refused

CRITERIA = frac, csac, csf, mre, rmse_db, csac_per_sensor, csf_per_sensor
of_every_criterion = pytest.mark.parametrize("criterion", CRITERIA)


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
        cuts = [slice(max(0, k - half), k + half + 1) for k in range(30)]
        expected = np.array([[cross_signature(t[c], m[c]) for c in cuts] for t, m in zip(test, model)])
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


def test_of_one_response_csac_is_refused_and_csf_compares_levels():
    """CSAC is 1 whatever the FRFs are; CSF is 2ab / (a² + b²) of the magnitudes a, b."""
    test, model = frfs(n_resp=1)
    assert_refused(RecordError, r"CSAC .* at least 2, got 1; use csac_per_sensor", csac, test, model)
    a, b = np.abs(test[0]), np.abs(model[0])
    np.testing.assert_allclose(csf(test, model), 2 * a * b / (a**2 + b**2), rtol=1e-12)


@of_every_criterion
def test_shapes_that_differ_are_refused(criterion):
    assert_refused(RecordError, r"\(4, 30\) and \(4, 29\)", criterion, np.ones((4, 30)), np.ones((4, 29)))
    assert_refused(RecordError, r"\(30,\) and \(30,\)", criterion, np.ones(30), np.ones(30))


def test_modes_that_do_not_fit_are_refused():
    assert_refused(RecordError, r"\(8, 4\) and \(7, 4\)", mac, np.ones((8, 4)), np.ones((7, 4)))
    assert_refused(RecordError, r"\(8,\) and \(8,\)", mac, np.ones(8), np.ones(8))
    assert_refused(RecordError, r"\(4,\) and \(3,\)", relative_error, np.ones(4), np.ones(3))


@pytest.mark.parametrize("window", [1, 8, -3])
def test_windows_without_a_centre_are_refused(window):
    assert_refused(RecordError, f"odd number of lines >= 3, got {window}", csac_per_sensor, *frfs(), window)


@of_every_criterion
def test_each_input_is_compared_for_itself(criterion):
    """(n_outputs, n_inputs, n_f): sums run over the lines, or over the outputs."""
    test, model = frfs(n_f=60)
    split = [np.stack((value[:, :30], value[:, 30:]), axis=1) for value in (test, model)]
    expected = [criterion(test[:, part], model[:, part]) for part in (slice(30), slice(30, 60))]
    axis = 0 if criterion in (csac, csf) else 1
    np.testing.assert_allclose(criterion(*split), np.stack(expected, axis=axis), rtol=1e-12)
