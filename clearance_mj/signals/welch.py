"""Estimates of FRFs from averaged spectra of windowed segments (Welch), block by block."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.fft
import scipy.signal

from ..core.errors import RecordError
from .response import Response

__all__ = ["ESTIMATORS", "WINDOWS", "SegmentAverages", "Welch", "lines_within"]

WINDOWS = ("hann", "boxcar")
Band = tuple[float, float]
Estimator = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""H (n_outputs, n_f) from S_xx (n_f,), S_yy and S_yx (n_outputs, n_f)"""


def _hv(sxx: np.ndarray, syy: np.ndarray, syx: np.ndarray) -> np.ndarray:
    """Return minus the ratio of the parts of the eigenvector to the smaller eigenvalue of [[sxx, sxy], [syx, syy]].

    Of its two equal forms the one without cancellation is taken at each line.
    """
    difference = syy - sxx
    root = np.hypot(difference, 2 * np.abs(syx))
    return np.where(difference > 0, (root + difference) / (2 * syx.conj()), 2 * syx / (root - difference))


ESTIMATORS: dict[str, Estimator] = {
    "H1": lambda sxx, syy, syx: syx / sxx, "H2": lambda sxx, syy, syx: syy / syx.conj(), "Hv": _hv,
}  # fmt: skip


class Welch:
    """Sums of the segments' spectra, and the samples pending for further segments."""

    def __init__(self, fs: float, resolution: float, overlap: float, band: Band | None, window: str) -> None:
        if not 0 < resolution <= fs / 2:
            raise RecordError(f"resolution must be > 0 Hz and at most fs / 2 = {fs / 2:g} Hz, got {resolution!r}")
        if band and fs < 2 * band[1]:
            raise RecordError(f"fs {fs:g} Hz is below twice the band's upper end {band[1]:g} Hz")
        self.fs, self.length, self.averages = fs, round(min(fs / resolution, 1e18)), 0
        self.hop = max(1, self.length - round(overlap * self.length))
        self.band, self.shape = band, window
        self.sums: tuple[np.ndarray, ...] | None = None
        self.pending: np.ndarray | None = None
        self.limits = np.inf, -np.inf

    def _prepare(self) -> None:
        """Make the window and the lines of a segment, once there is one."""
        self.window = scipy.signal.get_window(self.shape, self.length)
        frequency = np.arange(self.length // 2 + 1) * (self.fs / self.length)
        self.lines = lines_within(frequency, self.band) if self.band else slice(None)
        self.frequency = frequency[self.lines]

    def push(self, block: Response) -> None:
        """Add every segment that a block completes."""
        excitation, n_inputs = block.excitation, len(block.inputs)
        signals = np.vstack((excitation, block.channels))
        finite = np.isfinite(signals).all(axis=1)
        if not finite.all():
            bad = max(int(np.argmin(finite)) - n_inputs + 1, 0)
            name = f"{block.quantities[bad - 1]} row {bad - 1}" if bad else "the excitation"
            raise RecordError(f"{name} is not finite")
        low, high = self.limits
        self.limits = min(low, excitation.min(initial=np.inf)), max(high, excitation.max(initial=-np.inf))
        pending = signals if self.pending is None else np.hstack((self.pending, signals))
        if self.sums is None and pending.shape[1] >= self.length:
            self._prepare()
        while pending.shape[1] >= self.length:
            x, y = np.split(scipy.fft.rfft(pending[:, : self.length] * self.window)[:, self.lines], [n_inputs])
            auto, cross = x.real**2 + x.imag**2, y[:, None] * x.conj()
            if n_inputs > 1:
                auto = x[:, None] * x.conj()
            spectra = auto.squeeze(), y.real**2 + y.imag**2, cross[:, 0] if n_inputs == 1 else cross
            self.sums = spectra if self.sums is None else tuple(map(np.add, self.sums, spectra))
            self.averages += 1
            pending = pending[:, self.hop :]
        self.pending = pending

    def independent_averages(self) -> float:
        """Return the number of independent segments that the overlapping ones amount to.

        Neighbours are correlated by the autocorrelation of the window, 1/6 of half-overlapping Hann windows (P. D.
        Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Transactions on Audio and
        Electroacoustics 15, 1967).
        """
        n, window = self.averages, self.window
        lags = np.arange(1, min(n, -(-self.length // self.hop)))
        products = np.array([np.dot(window[lag * self.hop :], window[: self.length - lag * self.hop]) for lag in lags])
        squares = (products / np.dot(window, window)) ** 2
        return float(n / (1 + 2 * np.sum((1 - lags / n) * squares)))

    def estimate(self, estimator: Estimator) -> tuple[np.ndarray, np.ndarray | None]:
        """Return FRFs and coherence, which one segment alone does not have."""
        if self.sums is None:
            samples = 0 if self.pending is None else self.pending.shape[1]
            raise RecordError(
                f"the record lasts {samples / self.fs:g} s, shorter than one segment of "
                f"{self.length / self.fs:g} s (resolution {self.fs / self.length:g} Hz)"
            )
        low, high = self.limits
        if low == high:
            raise RecordError(f"the excitation is constant at {low:g}: no FRF can be estimated")
        sxx, syy, syx = self.sums
        if sxx.ndim == 3:
            if self.averages < len(sxx):
                raise RecordError(f"{self.averages} segments do not tell {len(sxx)} inputs apart; take more")
            return np.einsum("ojf,fjk->okf", syx, np.linalg.pinv(sxx.transpose(2, 0, 1), hermitian=True)), None
        with np.errstate(divide="ignore", invalid="ignore"):
            coherence = np.abs(syx) ** 2 / (sxx * syy) if self.averages > 1 else None
            return estimator(sxx, syy, syx), coherence


class SegmentAverages:
    """The H1 estimates of `estimate_frf` of many responses to one excitation, whose spectra are computed once.

    Parameters
    ----------
    excitation : ndarray, shape (n_t,)
        Samples of the excitation, at least one segment.
    fs : float
        Samples per second.
    resolution : float
        Hz; segments are periodic Hann windows, half overlapping.
    band : (float, float) or None
        Lines to return, Hz; None: all.
    """

    def __init__(self, excitation: np.ndarray, fs: float, resolution: float, band: Band | None) -> None:
        welch = Welch(fs, resolution, 0.5, band, "hann")
        welch._prepare()
        self._window, self._lines, self._hop = welch.window, welch.lines, welch.hop
        self.frequency = welch.frequency
        x = self._spectra(excitation)
        self._weights = x.conj() / np.sum(x.real**2 + x.imag**2, axis=0)

    def _spectra(self, signals: np.ndarray) -> np.ndarray:
        """Return spectra (..., n_segments, n_f) of signals (..., n_t)."""
        segments = np.lib.stride_tricks.sliding_window_view(signals, self._window.size, axis=-1)[..., :: self._hop, :]
        return scipy.fft.rfft(segments * self._window, overwrite_x=True)[..., self._lines]

    def frf(self, responses: np.ndarray) -> np.ndarray:
        """Return the FRFs (n_outputs, n_f) of responses.

        Parameters
        ----------
        responses : ndarray, shape (n_outputs, n_t)
            Samples at the same times as the excitation's.
        """
        return np.einsum("osf,sf->of", self._spectra(responses), self._weights)


def lines_within(frequency: np.ndarray, band: Band) -> slice:
    """Return the lines with lo <= f <= hi, to rounding."""
    low, high = band
    slack = 1e-9 * abs(high)
    lines = slice(*np.searchsorted(frequency, (low - slack, high + slack)))
    if not low <= high or lines.start >= lines.stop:
        raise RecordError(
            f"no line between {low:g} and {high:g} Hz; there are lines from {frequency[0]:g} to {frequency[-1]:g} Hz"
        )
    return lines
