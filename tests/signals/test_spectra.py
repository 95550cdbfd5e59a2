"""Spectra as data, and FRFs out of auto and cross spectra against known systems and against Welch's estimates."""

import dataclasses

import numpy as np
import pytest
import scipy.signal

from clearance_mj.core.errors import RecordError
from clearance_mj.signals import FRF, Response, Spectra, estimate_frf, frf_from_spectra

from ..refusals import assert_refused

LINES = np.arange(1.0, 33.0)


def auto(rng, dofs=("3:+Z", "0:S")):
    value = rng.random((len(dofs), LINES.size)) + 0.1
    units = ("(m/s²)²/Hz", "g²/Hz")
    return Spectra("power spectral density", LINES, value, dofs, (), ("a", "b"), ("acceleration", "unknown"), units)


def test_labels_and_defaults(rng):
    spectra = auto(rng)
    assert spectra.labels == ("3:+Z", "b") and spectra.references == ("0:S", "0:S")
    plain = Spectra("spectrum", LINES, rng.random((1, 32)), ("3:+Z",), ("5:+Z",))
    assert (plain.labels, plain.quantities, plain.units, plain.names) == (
        ("3:+Z/5:+Z",), ("unknown",), ("",), ("3:+Z",),
    )  # fmt: skip
    assert plain.value.dtype == float and not plain.value.flags.writeable
    assert Spectra("spectrum", LINES, plain.value + 0j, ("3:+Z",)).value.dtype == float  # no phase
    assert Spectra("spectrum", LINES, plain.value * 1j, ("3:+Z",)).value.dtype == complex


def test_cut_and_picked(rng):
    spectra = auto(rng)
    np.testing.assert_array_equal(spectra.within((5, 7)).value, spectra.value[:, 4:7])
    one = spectra.pick([1])
    assert (one.names, one.units, one.value.shape) == (("b",), ("g²/Hz",), (1, 32))
    assert_refused(RecordError, "rows must be between 0 and 1", spectra.pick, [2])


@pytest.mark.parametrize("factor", [1.0, 1j])
def test_labelled_arrays(rng, factor):
    spectra = dataclasses.replace(auto(rng), value=factor * auto(rng).value, kind="cross spectrum")
    ds = spectra.to_xarray()
    assert ds["value"].dims == ("function", "abscissa") and Spectra.from_xarray(ds) == spectra
    assert_refused(RecordError, 'holds "spectra", needs "frf"', FRF.from_xarray, ds)


def test_overview_and_figure(rng):
    spectra = auto(rng)
    text = repr(spectra)
    for part in ("Spectra: 2 of kind power spectral density", "32: 1 to 32 Hz, 1 Hz apart", "(m/s²)²/Hz"):
        assert part in text
    figure = spectra.plot()
    (curve,) = figure.subfigs[0].axes[0].lines
    np.testing.assert_allclose(curve.get_ydata(), 10 * np.log10(spectra.value[0]))
    assert "dB re 1 (m/s²)²/Hz" in figure.subfigs[0].axes[0].get_ylabel()
    turning = Spectra("cross spectrum", LINES, np.exp(1j * LINES)[None], ("1:+Z",), ("2:+Z",), units=("g·N",))
    phases = turning.plot().axes[1].lines[0].get_ydata()
    np.testing.assert_allclose(phases.data, np.degrees(np.angle(np.exp(1j * LINES))))
    assert Spectra("coherence", LINES[:1], [[0.5]], ("1:+Z",)).plot().axes[0].get_ylim() == (0, 1.05)


@pytest.mark.parametrize(("changes", "part"), [
    ({"value": np.ones((2, 3))}, r"spectra are \(n_functions, n_f\) over \(n_f,\) lines, got \(2, 3\) over \(32,\)"),
    ({"abscissa": LINES[::-1]}, "the frequencies of spectra must rise"),
    ({"names": ("a",)}, "1 names for 2 spectra"),
])  # fmt: skip
def test_impossible(rng, changes, part):
    assert_refused(RecordError, part, dataclasses.replace, auto(rng), **changes)


def test_function_of_something_else():
    over_time = Spectra("auto correlation", [1.0, 0.0], [[1.0, 2.0]], ("1:+Z",), axis="lag", axis_unit="s")
    with pytest.raises(RecordError, match="the auto correlation is a function of lag, not of frequency"):
        _ = over_time.frequency


# FRFs


def measured(rng, n_inputs=1, noise=0.0, n=32768):
    """Spectra, by scipy, of two responses to independent noise: y1 = x1 - 0.5 x1 delayed (+ x2), y2 = 2 x1."""
    x = rng.standard_normal((n_inputs, n))
    y = np.stack([np.convolve(x[0], [1, -0.5])[:n], 2 * x[0]])
    y[0] += 3 * x[1] if n_inputs == 2 else 0
    signals = {f"{200 + i}:+Z": row for i, row in enumerate(x)}
    signals |= {f"{i + 1}:+Z": row + noise * rng.standard_normal(n) for i, row in enumerate(y)}

    def spectrum(a, b):
        return scipy.signal.csd(b, a, 512.0, nperseg=512, detrend=False)  # csd(x, y) = X* Y

    inputs, dofs = [*signals][:n_inputs], [*signals]
    frequency = spectrum(x[0], x[0])[0][1:]
    rows = np.array([spectrum(signals[d], signals[d])[1][1:].real for d in dofs])
    quantities = tuple("force" if d in inputs else "acceleration" for d in dofs)
    auto = Spectra("auto spectrum", frequency, rows, tuple(dofs), (), (), quantities)
    pairs = [(a, b) for b in inputs for a in dofs if a not in inputs[: inputs.index(b) + 1]]
    rows = np.array([spectrum(signals[a], signals[b])[1][1:] for a, b in pairs])
    return auto, Spectra("cross spectrum", frequency, rows, *zip(*pairs)), signals


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_one_reference_is_that_of_the_records(rng, estimator):
    """Against `estimate_frf` of the same records and segments, with noise on the responses."""
    auto, cross, signals = measured(rng, noise=0.3)
    resp = Response(512.0, signals["200:+Z"], np.stack([signals["1:+Z"], signals["2:+Z"]]), kind="force",
                    responses=("1:+Z", "2:+Z"), reference="200:+Z")  # fmt: skip
    expected = estimate_frf(resp, estimator, 1.0)
    got = frf_from_spectra(auto, cross, estimator)
    assert (got.quantity, got.responses, got.reference) == ("acceleration/force", ("1:+Z", "2:+Z"), "200:+Z")
    inner = slice(1, -1)  # scipy doubles all lines but the last
    np.testing.assert_allclose(got.functions[:, inner], expected.functions[:, 1:][:, inner], rtol=1e-9)
    np.testing.assert_allclose(got.coherence[..., inner], expected.coherence[..., 1:][..., inner], rtol=1e-9)


@pytest.mark.parametrize("estimator", ["H1", "Hv"])
def test_two_references_give_the_known_system(rng, estimator):
    """Y1 = (1 - 0.5 e^{-jωT}) X1 + 3 X2, Y2 = 2 X1; exact where there is no noise but for leakage of the delay."""
    auto, cross, _ = measured(rng, n_inputs=2)
    got = frf_from_spectra(auto, cross, estimator)
    assert (got.responses, got.references) == (("1:+Z", "2:+Z"), ("200:+Z", "201:+Z"))
    first = 1 - 0.5 * np.exp(-2j * np.pi * got.frequency / 512)
    known = np.array([[first, np.full_like(first, 3)], [np.full_like(first, 2), np.zeros_like(first)]])
    np.testing.assert_allclose(got.value, known, atol=0.02)
    assert got.coherence is None
    assert_refused(
        RecordError, "H2 needs one reference; use H1 or Hv with several", frf_from_spectra, auto, cross, "H2"
    )


def test_the_other_order_of_a_pair_is_its_conjugate(rng):
    auto, cross, _ = measured(rng)
    swapped = {"responses": cross.references, "references": cross.responses}
    turned = dataclasses.replace(cross, value=cross.value.conj(), **swapped)
    got = frf_from_spectra(auto, turned, references=("200:+Z",))
    np.testing.assert_allclose(got.value, frf_from_spectra(auto, cross).value, rtol=1e-12)


def test_spectra_that_make_no_frf(rng):
    auto, cross, _ = measured(rng)
    cases = (
        ((auto.pick([1, 2]), cross), r"there is no auto spectrum of 200:\+Z"),
        ((auto, auto), "FRFs need auto and cross spectra, got auto spectrum and auto spectrum"),
        ((auto.within((5, 50)), cross), "are not on the same lines"),
        ((auto, dataclasses.replace(cross, value=2 * cross.value)), "coherence would be 4 at .*not scaled alike"),
        ((auto, dataclasses.replace(cross, responses=("0:S", "2:+Z"))), 'cross spectrum "1:.Z" does not say where'),
        (
            (auto, dataclasses.replace(cross, responses=("2:+Z",) * 2)),
            r"cross spectrum of 2:\+Z to 200:\+Z comes twice",
        ),
        ((auto.pick([0, 1]), cross, "Hv"), r"there is no auto spectrum of 2:\+Z"),
        ((auto, cross, "H3"), 'estimator "H3" is unknown; use H1, H2, Hv'),
        ((auto, cross, "H1", ("1:+Z", "2:+Z", "200:+Z")), r"there is no response beside the references"),
    )
    for arguments, part in cases:
        assert_refused(RecordError, part, frf_from_spectra, *arguments)
