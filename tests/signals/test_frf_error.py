"""The random error of FRFs against the scatter of estimates whose statistics are known."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.io import results
from clearance_mj.signals import FRF, Response, estimate_frf, random_db, random_error

FS, SEGMENT = 256.0, 256


def noisy(rng, coherence, seconds, gain=2.0):
    """White noise through a gain, with as much noise behind it as makes the coherence."""
    x, noise = rng.standard_normal((2, int(seconds * FS)))
    return Response(FS, x, (gain * (x + np.sqrt(1 / coherence - 1) * noise))[None])


def estimated(rng, coherence, seconds, **options):
    return estimate_frf(noisy(rng, coherence, seconds), resolution=FS / SEGMENT, **options).within((2, 120))


@pytest.mark.parametrize("coherence", [0.99, 0.8, 0.5, 0.2])
def test_what_the_random_error_alone_makes_of_an_rmse_in_db_is_what_200_records_show(rng, coherence, measured):
    """Of the true coherence, which a long record has; each estimate is of 15 half-overlapping segments, 1 s long."""
    frfs = [estimated(rng, coherence, 8.0) for _ in range(200)]
    rms = np.sqrt(np.mean([(20 * np.log10(np.abs(frf.value) / 2.0)) ** 2 for frf in frfs]))
    known = dataclasses.replace(frfs[0], coherence=np.full(frfs[0].value.shape, coherence))
    what = f"RMS of 20 lg of an estimated over the true FRF, coherence {coherence:g}, dB"
    measured.equal(what, float(random_db(known)[0, 0, 0]), rms, "Gaussian noise, 200 records", rel=0.04)
    stated_db = np.sqrt(np.mean([random_db(frf) ** 2 for frf in frfs]))  # of estimated coherences
    assert stated_db == pytest.approx(rms, rel=0.15 if coherence > 0.3 else 0.35)


def test_a_small_error_is_that_of_bendat_and_piersol():
    """√(1-γ²) / (|γ| √(2 n)) = 0.0503 for γ² = 0.95 and n = 10.4; 8.686 times that in dB."""
    frf = FRF(np.array([1.0]), np.ones((1, 1)), np.full((1, 1), 0.95), averages=10.4)
    assert random_error(frf)[0, 0, 0] == pytest.approx(0.0503, abs=5e-5)
    assert random_db(frf)[0, 0, 0] == pytest.approx(8.686 * 0.0503, rel=5e-3)
    assert random_db(dataclasses.replace(frf, coherence=np.ones((1, 1))))[0, 0, 0] == 0


@pytest.mark.parametrize(("window", "overlap"), [("hann", 0.5), ("hann", 0.75), ("boxcar", 0.0), ("boxcar", 0.5)])
def test_averages_are_the_independent_ones_that_scatter_as_much(rng, window, overlap, measured):
    """The variance of a power spectrum from n independent averages of Gaussian noise is its mean squared over n."""
    noise = [Response(FS, rng.standard_normal(int(16 * FS)), np.zeros((1, int(16 * FS)))) for _ in range(300)]
    powers = []
    for one in noise:  # H1 of an ideal response to |x|² would be 1: the spectra themselves are looked at
        starts = np.arange(0, one.excitation.size - SEGMENT + 1, SEGMENT - round(overlap * SEGMENT))
        shape = np.hanning(SEGMENT + 1)[:-1] if window == "hann" else np.ones(SEGMENT)
        segments = np.fft.rfft([one.excitation[s : s + SEGMENT] * shape for s in starts])[:, 3:-3]
        powers.append(np.mean(np.abs(segments) ** 2, axis=0))
    scatter = np.mean(np.mean(powers, axis=0) ** 2 / np.var(powers, axis=0, ddof=1))
    said = estimate_frf(noise[0], resolution=FS / SEGMENT, window=window, overlap=overlap).averages
    measured.equal(f"independent averages, {window}, overlap {overlap:g}", said, scatter, "their scatter", rel=0.03)


def test_what_is_not_known_is_said(rng):
    frf = estimated(rng, 0.9, 8.0)
    with pytest.raises(RecordError, match="the FRF has no coherence, so its random error is not known"):
        random_db(dataclasses.replace(frf, coherence=None))
    with pytest.raises(RecordError, match="the FRF has no number of averages"):
        random_error(dataclasses.replace(frf, averages=None))


def test_averages_go_with_an_frf_and_into_netcdf(rng, tmp_path):
    frf = estimated(rng, 0.9, 8.0)
    assert frf.averages == pytest.approx(15 / (1 + 2 * 14 / 15 / 36))
    assert frf.to_reference(frf.reference).averages == frf.within((5, 50)).averages == frf.averages
    results.save(tmp_path / "frf.nc", frf)
    assert results.load(tmp_path / "frf.nc").averages == frf.averages
    assert dataclasses.replace(frf, averages=None) == frf, "files of other formats do not hold it"
