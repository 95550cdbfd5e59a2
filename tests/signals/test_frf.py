"""FRF estimators against closed forms, scipy's Welch spectra, numpy's eigenvectors and pyFRF."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from clearance_mj.core.errors import RecordError
from clearance_mj.signals import FRF, Response, estimate_frf

from ..refusals import assert_refused

FS = 512.0


def record(seed=0, n_t=4096, sensors=3, noise=0.3, excitation_noise=0.2, **fields):
    """Second-order filters driven by white noise, with noise on both sides."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal(n_t)
    y = np.stack([scipy.signal.lfilter([1.0, 0.4 * i], [1.0, -1.2, 0.5 + 0.1 * i], x) for i in range(sensors)])
    y += noise * rng.standard_normal(y.shape)
    return Response(FS, x + excitation_noise * rng.standard_normal(n_t), y, **fields)


def welch(resp, resolution=1.0):
    """S_xx, S_yy, S_yx by scipy: periodic Hann, half overlap; its csd(x, y) is the mean of conj(X) Y."""
    settings = {"fs": FS, "window": "hann", "nperseg": round(FS / resolution), "detrend": False}
    x, y = resp.excitation, resp.acceleration
    sxx = scipy.signal.welch(x, **settings)[1]
    return sxx, scipy.signal.welch(y, **settings)[1], scipy.signal.csd(x, y, **settings)[1]


def test_estimators_and_coherence_are_those_of_the_welch_spectra():
    """Hv by the smallest eigenvector of E[z zᴴ], z = (x, y): zᴴ v is least, y = -(v0/v1)* x."""
    resp = record()
    sxx, syy, syx = welch(resp)
    h1, h2, hv = (estimate_frf(resp, name, resolution=1.0) for name in ("H1", "H2", "Hv"))
    np.testing.assert_allclose(h1.functions, syx / sxx, rtol=1e-11)
    np.testing.assert_allclose(h2.functions, syy / syx.conj(), rtol=1e-11)
    np.testing.assert_allclose(h1.coherence[:, 0], np.abs(syx) ** 2 / (sxx * syy), rtol=1e-11)
    np.testing.assert_allclose(h1.frequency, np.arange(257), rtol=1e-14)
    for o in range(3):
        smallest = np.linalg.eigh(np.array([[sxx, syx[o].conj()], [syx[o], syy[o]]]).transpose(2, 0, 1))[1][:, :, 0]
        np.testing.assert_allclose(hv.functions[o], -(smallest[:, 0] / smallest[:, 1]).conj(), rtol=1e-8)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), noise=st.floats(0.01, 3), excitation_noise=st.floats(0.01, 3))
def test_h1_hv_h2_rise_in_magnitude(seed, noise, excitation_noise):
    resp = record(seed, 2048, 2, noise, excitation_noise)
    h1, hv, h2 = (np.abs(estimate_frf(resp, e, resolution=4.0).value) for e in ("H1", "Hv", "H2"))
    assert np.all(h1 <= hv * (1 + 1e-12)) and np.all(hv <= h2 * (1 + 1e-12))


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_pyfrf_gives_the_same(estimator):
    """pyFRF 1.5.0; compared without window, for its Hann is the symmetric one."""
    pyfrf = pytest.importorskip("pyFRF")
    resp = record()
    settings = {"exc_type": "f", "resp_type": "a", "window": "none", "nperseg": 512, "fft_len": 512}
    other = pyfrf.FRF(int(FS), frf_estimator=estimator, noverlap=256, **settings)
    other.add_data(resp.excitation[None, None], resp.acceleration[None])
    theirs = np.squeeze(other.get_FRF(frf_form="accelerance"))
    ours = estimate_frf(resp, estimator, resolution=1.0, window="boxcar")
    np.testing.assert_allclose(ours.functions[:, 1:], theirs[:, 1:], rtol=1e-11)


def test_a_delay_turns_the_phase_backwards():
    """Y/X of a delay τ is e^{-jωτ} with e^{+jωt}; exact for a circular delay of one whole segment."""
    x = np.random.default_rng(3).standard_normal(512)
    H = estimate_frf(Response(FS, x, np.roll(x, 5)[None]), resolution=1.0, window="boxcar")
    np.testing.assert_allclose(H.functions[0], np.exp(-2j * np.pi * H.frequency * 5 / FS), rtol=1e-9)


def test_hammer_hits_with_a_boxcar_give_the_exact_frf_of_a_decaying_system():
    """y[i] = 0.9 y[i-1] + x[i] has H = 1 / (1 - 0.9 e^{-jω/fs}); 0.9^512 = 4e-24 is left at the next hit."""
    x = np.zeros(2048)
    x[10::512] = [1.0, 0.7, 1.3, 0.9]
    y = scipy.signal.lfilter([1.0], [1.0, -0.9], x)
    H = estimate_frf(Response(FS, x, y[None], kind="force"), resolution=1.0, overlap=0.0, window="boxcar")
    np.testing.assert_allclose(H.functions[0], 1 / (1 - 0.9 * np.exp(-2j * np.pi * H.frequency / FS)), rtol=1e-10)
    np.testing.assert_allclose(H.coherence, 1.0, atol=1e-12)
    assert H.quantity == "acceleration/force"


def test_an_offset_leaves_every_line_but_the_first_two():
    resp = record()
    moved = Response(FS, resp.excitation + 3, resp.acceleration - 50)
    a, b = (estimate_frf(r, resolution=1.0).functions for r in (resp, moved))
    np.testing.assert_allclose(a[:, 2:], b[:, 2:], rtol=1e-9)
    assert np.abs(a[:, 0] / b[:, 0] - 1).min() > 0.1


def test_the_band_of_the_record_is_the_default_and_band_overrides_it():
    resp = record(band=(20, 60), responses=("3:+Z", "4:+Z", "5:-Y"), reference="7:+Z")
    H = estimate_frf(resp, resolution=0.5)
    assert (H.frequency[0], H.frequency[-1], H.frequency.size) == (20, 60, 81)
    assert (H.responses, H.reference, H.quantity) == (resp.responses, "7:+Z", "acceleration/acceleration")
    wide = estimate_frf(resp, resolution=0.5, band=(10, 100))
    assert (wide.frequency[0], wide.frequency[-1]) == (10, 100)
    cut = wide.within((20, 60))
    for name in ("frequency", "value", "coherence"):
        np.testing.assert_array_equal(getattr(cut, name), getattr(H, name))


def test_band_edges_survive_the_rounding_of_the_lines():
    """Line 3 of fs/n = 0.1 Hz is 0.30000000000000004 Hz in floating point."""
    H = FRF(np.arange(10) * 0.1, np.ones((2, 10)))
    assert H.within((0.3, 0.7)).frequency.size == 5
    assert H.responses == ("1:+Z", "2:+Z")  # numbered where they have no labels


def test_one_segment_has_no_coherence_and_equal_estimators():
    resp = record(n_t=600)
    h1, h2 = estimate_frf(resp, resolution=1.0), estimate_frf(resp, "H2", resolution=1.0)
    assert h1.coherence is None
    np.testing.assert_allclose(h1.value, h2.value, rtol=1e-10)


def test_a_line_without_excitation_is_nan():
    x = np.tile([1.0, -1.0], 512)  # exactly zero at every line but fs/2
    H = estimate_frf(Response(FS, x, x[None]), resolution=1.0, window="boxcar")
    assert np.isnan(H.value[0, 0, 5]) and H.value[0, 0, 256] == pytest.approx(1.0)


@pytest.mark.parametrize(("arguments", "message"), [
    ({"estimator": "H3"}, '"H3" is unknown; use H1, H2, Hv'),
    ({"window": "flattop"}, '"flattop" is unknown; use hann, boxcar'),
    ({"resolution": 0.1}, r"lasts 8 s, shorter than one segment of 10 s"),
    ({"resolution": 0.0}, "resolution must be > 0 Hz"),
    ({"overlap": 1.0}, "overlap must be"),
    ({"band": (5, 300)}, "fs 512 Hz is below twice the band's upper end 300 Hz"),
    ({"band": (60, 20)}, "no line between 60 and 20 Hz"),
    ({"band": (20.1, 20.2)}, "no line between 20.1 and 20.2 Hz"),
])  # fmt: skip
def test_impossible_arguments_are_refused(arguments, message):
    assert_refused(RecordError, message, estimate_frf, record(), **arguments)


@pytest.mark.parametrize(("excitation", "acceleration", "message"), [
    (np.zeros(1024), np.ones((1, 1024)), "the excitation is constant at 0"),
    (np.full(1024, 2.5), np.ones((1, 1024)), "the excitation is constant at 2.5"),
    (np.where(np.arange(1024) == 7, np.nan, 1.0), np.ones((1, 1024)), "the excitation is not finite"),
    (np.arange(1024.0), np.full((1024, 2), [1.0, np.inf]).T, "acceleration row 1 is not finite"),
    (np.arange(1024.0), np.ones((2, 1000)), r"\(2, 1000\) and \(1024,\)"),
    (np.arange(1024.0), np.ones(1024), r"\(1024,\) and \(1024,\)"),
])  # fmt: skip
def test_records_that_hold_no_frf_are_refused(excitation, acceleration, message):
    assert_refused(RecordError, message, lambda: estimate_frf(Response(FS, excitation, acceleration)))


@pytest.mark.parametrize(("fields", "message"), [
    ({"frequency": np.arange(4.0)}, r"\(2, 3\) over \(4,\)"),
    ({"frequency": [1.0, 3.0, 2.0]}, "must rise"),
    ({"coherence": np.ones((2, 4))}, r"coherence has shape \(2, 1, 4\), the FRF \(2, 1, 3\)"),
    ({"responses": ("1:+Z",)}, "1 response labels for 2 responses"),
])  # fmt: skip
def test_frf_fields_must_fit(fields, message):
    assert_refused(RecordError, message, FRF, **{"frequency": np.arange(3.0), "value": np.ones((2, 3)), **fields})
