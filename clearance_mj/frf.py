"""Frequency response functions out of records: H = Y/X for signals that go as e^{+jωt}."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.fft
import scipy.signal

from .errors import RecordError

__all__ = ["ESTIMATORS", "FRF", "WINDOWS", "by_reference", "estimate_frf", "one_or_several"]

WINDOWS = ("hann", "boxcar")
QUANTITY = {"base": "acceleration/acceleration", "force": "acceleration/force"}


@dataclass(frozen=True, eq=False)
class FRF:
    """Frequency response functions of several responses to one reference.

    Raises
    ------
    RecordError
        If the shapes do not fit each other or the frequencies do not rise.
    """

    frequency: np.ndarray
    """(n_f,) Hz, rising"""
    value: np.ndarray
    """(n_sensors, n_f) complex, H = Y/X for signals that go as e^{+jωt}; unit by ``quantity``, SI"""
    coherence: np.ndarray | None = None
    """(n_sensors, n_f) ordinary coherence, 0 to 1; None if unknown, or if only one segment was averaged"""
    responses: tuple[str, ...] = ()
    """degree of freedom of each row, such as "3:+Z"; numbered from 1 if left out"""
    reference: str = "100:+Z"
    """degree of freedom of the excitation"""
    quantity: str = "acceleration/acceleration"
    """"acceleration/acceleration" (base excitation) or "acceleration/force" """

    def __post_init__(self):
        frequency, value = np.asarray(self.frequency, dtype=float), np.asarray(self.value, dtype=complex)
        if frequency.ndim != 1 or value.ndim != 2 or value.shape[1] != frequency.size or not value.size:
            raise RecordError(f"an FRF is (n_sensors, n_f) over (n_f,) lines, got {value.shape} over {frequency.shape}")
        if not np.all(np.diff(frequency) > 0):
            raise RecordError("the frequencies of an FRF must rise from line to line")
        if self.coherence is not None and np.shape(self.coherence) != value.shape:
            raise RecordError(f"coherence has shape {np.shape(self.coherence)}, the FRF {value.shape}")
        responses = tuple(self.responses) or tuple(f"{i + 1}:+Z" for i in range(value.shape[0]))
        if len(responses) != value.shape[0]:
            raise RecordError(f"{len(responses)} response labels for {value.shape[0]} rows: {', '.join(responses)}")
        object.__setattr__(self, "frequency", frequency)
        object.__setattr__(self, "value", value)
        object.__setattr__(self, "responses", responses)

    def within(self, band: tuple[float, float]) -> FRF:
        """Cut to the lines with lo <= f <= hi.

        Parameters
        ----------
        band : (float, float)
            lo and hi, Hz.

        Returns
        -------
        FRF

        Raises
        ------
        RecordError
            If no line lies in the band.
        """
        lines = _lines(self.frequency, band)
        coherence = None if self.coherence is None else self.coherence[:, lines]
        return replace(self, frequency=self.frequency[lines], value=self.value[:, lines], coherence=coherence)


def by_reference(frfs: FRF | Mapping[str, FRF]) -> dict[str, FRF]:
    """FRFs by their reference, be they to one or to several.

    Parameters
    ----------
    frfs : FRF or mapping of str to FRF
        An FRF, or FRFs under their own references.

    Returns
    -------
    dict of str to FRF

    Raises
    ------
    RecordError
        If the mapping is empty, or holds something else or under another name.
    """
    found = {frfs.reference: frfs} if isinstance(frfs, FRF) else dict(frfs)
    if not found:
        raise RecordError("there is no FRF")
    for reference, frf in found.items():
        if not isinstance(frf, FRF) or frf.reference != reference:
            what = f"an FRF to {frf.reference}" if isinstance(frf, FRF) else type(frf).__name__
            raise RecordError(f'under "{reference}" there is {what}; needs the FRF to this reference')
    return found


def one_or_several(frfs: Sequence[FRF]) -> FRF | dict[str, FRF]:
    """Return one FRF as it is, several as a mapping from their references: what readers of files return.

    Parameters
    ----------
    frfs : sequence of FRF
        To different references.
    """
    return frfs[0] if len(frfs) == 1 else {frf.reference: frf for frf in frfs}


def estimate_frf(
    resp,
    estimator: str = "H1",
    resolution: float = 0.5,
    overlap: float = 0.5,
    band: tuple[float, float] | None = None,
    window: str = "hann",
) -> FRF:
    """Estimate the FRFs of a record by averaging over windowed segments (Welch).

    A constant offset of a channel reaches only the lines 0 and 1, so none is removed. For hammer hits and
    burst random take ``window="boxcar"``, ``overlap=0`` and 1 / (time from hit to hit) as the resolution:
    every segment then holds one hit and its whole decay.

    Parameters
    ----------
    resp : Response
        The record; its excitation is the reference, its accelerations are the responses.
    estimator : {"H1", "H2", "Hv"}
        H1 = S_yx/S_xx (noise on the response), H2 = S_yy/S_xy (noise on the excitation), Hv: total least
        squares for each response alone (as much noise on both, in the units of the record).
    resolution : float
        Distance of the lines, Hz; a segment has round(fs / resolution) samples.
    overlap : float
        Share of a segment that the next one repeats, 0 <= overlap < 1.
    band : (float, float), optional
        Lines to return, Hz; else the band of the record's excitation, or every line if that is not known.
    window : {"hann", "boxcar"}
        Periodic Hann, or none.

    Returns
    -------
    FRF
        nan at a line where the excitation is exactly zero.

    Raises
    ------
    RecordError
        If the record is shorter than one segment, sampled below twice the band, constant or not finite in its
        excitation or not finite in a response, or if an argument is unknown or impossible.

    Notes
    -----
    Bendat and Piersol, Random Data, 4th ed., 2010, chapters 6, 9 and 11; Hv: Rocklin, Crowley and Vold,
    A comparison of H1, H2, and Hv frequency response functions, IMAC 3, 1985.
    """
    if estimator not in ESTIMATORS:
        raise RecordError(f'estimator "{estimator}" is unknown; use {", ".join(ESTIMATORS)}')
    if window not in WINDOWS:
        raise RecordError(f'window "{window}" is unknown; use {", ".join(WINDOWS)}')
    band = band or resp.band
    length = _segment_length(resp, resolution, band)
    if not 0 <= overlap < 1:
        raise RecordError(f"overlap must be in 0 <= overlap < 1, got {overlap!r}")
    signals = _signals(resp)

    frequency = np.arange(length // 2 + 1) * (resp.fs / length)
    lines = _lines(frequency, band) if band else slice(None)
    hop = max(1, length - round(overlap * length))
    segments = np.lib.stride_tricks.sliding_window_view(signals, length, axis=1)[:, ::hop]
    spectra = scipy.fft.rfft(segments * scipy.signal.get_window(window, length), overwrite_x=True)[..., lines]
    sxx, syy, syx = _cross_spectra(spectra[0], spectra[1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        value = ESTIMATORS[estimator](sxx, syy, syx)
        coherence = np.abs(syx) ** 2 / (sxx * syy) if segments.shape[1] > 1 else None
    return FRF(frequency[lines], value, coherence, resp.responses, resp.reference, QUANTITY[resp.kind])


def _h1(sxx, syy, syx):
    return syx / sxx


def _h2(sxx, syy, syx):
    return syy / syx.conj()


def _hv(sxx, syy, syx):
    """Minus the ratio of the parts of the eigenvector to the smaller eigenvalue of [[sxx, sxy], [syx, syy]].

    Of its two equal forms the one without cancellation is taken at each line.
    """
    difference = syy - sxx
    root = np.hypot(difference, 2 * np.abs(syx))
    return np.where(difference > 0, (root + difference) / (2 * syx.conj()), 2 * syx / (root - difference))


ESTIMATORS = {"H1": _h1, "H2": _h2, "Hv": _hv}


def _cross_spectra(x, y):
    """S_xx (n_f,), S_yy and S_yx (n, n_f), not normalised, of x (segments, n_f) and y (n, segments, n_f)."""
    sxx = np.sum(x.real**2 + x.imag**2, axis=0)
    syy = np.sum(y.real**2 + y.imag**2, axis=1)
    return sxx, syy, np.sum(y * x.conj(), axis=1)


def _signals(resp) -> np.ndarray:
    """Excitation and responses as the rows of one array."""
    excitation, response = (
        np.asarray(resp.excitation, dtype=float),
        np.asarray(resp.acceleration, dtype=float),
    )
    if response.ndim != 2 or excitation.shape != response.shape[:1]:
        raise RecordError(
            f"acceleration must be (n_t, n_sensors) with n_t samples of excitation, got {response.shape} "
            f"and {excitation.shape}"
        )
    if resp.kind not in QUANTITY:
        raise RecordError(f'kind "{resp.kind}" of the excitation is unknown; use {", ".join(QUANTITY)}')
    signals = np.vstack((excitation, response.T))
    finite = np.isfinite(signals).all(axis=1)
    if not finite.all():
        bad = int(np.argmin(finite))
        raise RecordError(f"{f'acceleration column {bad - 1}' if bad else 'the excitation'} is not finite")
    if np.ptp(excitation) == 0:
        raise RecordError(f"the excitation is constant at {excitation[0]:g}: no FRF can be estimated")
    return signals


def _segment_length(resp, resolution, band) -> int:
    """Return the samples of a segment, or refuse a record that cannot give the resolution or the band."""
    if not 0 < resolution <= resp.fs / 2:
        raise RecordError(f"resolution must be > 0 Hz and at most fs / 2 = {resp.fs / 2:g} Hz, got {resolution!r}")
    if band and resp.fs < 2 * band[1]:
        raise RecordError(f"fs {resp.fs:g} Hz is below twice the band's upper end {band[1]:g} Hz")
    length, n_t = round(min(resp.fs / resolution, 1e18)), len(resp.excitation)
    if n_t < length:
        raise RecordError(
            f"the record lasts {n_t / resp.fs:g} s, shorter than one segment of {length / resp.fs:g} s "
            f"(resolution {resolution:g} Hz)"
        )
    return length


def _lines(frequency, band) -> slice:
    """Lines with lo <= f <= hi, to rounding."""
    low, high = band
    slack = 1e-9 * abs(high)
    lines = slice(*np.searchsorted(frequency, (low - slack, high + slack)))
    if not low <= high or lines.start >= lines.stop:
        raise RecordError(
            f"no line between {low:g} and {high:g} Hz; there are lines from {frequency[0]:g} to {frequency[-1]:g} Hz"
        )
    return lines
