"""Long records block by block: random excitation, and FRFs out of a response, at memory that does not grow.

Between them stands `simulate_blocks`::

    drive = streaming.random_blocks(3600, 2048, band=(5, 220), rms=2.0)
    frf = streaming.estimate_frf_blocks(simulate_blocks(rig, drive, law, "modal"))
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import scipy.fft
import scipy.signal

from .errors import RecordError
from .excitation import BAND, Excitation, _described, _noise, _require, _size
from .frf import ESTIMATORS, FRF, QUANTITY, WINDOWS, _cross_spectra, _lines
from .response import Response

__all__ = ["estimate_frf_blocks", "random_blocks"]

HALF = 8.0
"""s of noise that are made at once"""


def random_blocks(
    duration: float, fs: float, band=BAND, rms: float = 1.0, seed: int = 0, kind: str = "base"
) -> Iterator[Excitation]:
    """Band-limited Gaussian noise of any duration, in pieces of some seconds.

    Segments of `excitation.random` overlap by half under a power-complementary window (Vorbis I specification, 1.3.2),
    so that the noise is stationary and has no seams. It is 60 dB down 1 Hz outside the band.

    Parameters
    ----------
    duration : float
        s.
    fs : float
        Samples per second.
    band : (float, float)
        Hz; the upper end at most fs / 2.
    rms : float
        Expected root mean square, m/s² or N.
    seed : int
        Seed of the random numbers.
    kind : {"base", "force"}
        Base acceleration, or force at the shaker.

    Yields
    ------
    Excitation
        Pieces that follow each other without a break.

    Raises
    ------
    ExcitationError
        If a parameter is impossible; the message names it.
    """
    _require(0 <= rms < np.inf, "rms", rms, "must be >= 0")
    size, half = _size(duration, fs), _size(HALF, fs)
    window = np.sin(np.pi / 2 * np.sin(np.pi / 2 * (np.arange(half) + 0.5) / half) ** 2)

    def segment(number):
        return _noise(2 * half / fs, fs, band, [seed, number]).reshape(2, half)

    _, falling = segment(0)
    for number, start in enumerate(range(0, size, half), 1):
        rising, after = segment(number)
        value = rms * (window[::-1] * falling + window * rising)[: size - start]
        falling = after
        yield _described("random_blocks", value, fs, kind, band, duration=duration, rms=rms, seed=seed)


def estimate_frf_blocks(
    blocks: Iterable[Response],
    estimator: str = "H1",
    resolution: float = 0.5,
    overlap: float = 0.5,
    band: tuple[float, float] | None = None,
    window: str = "hann",
) -> FRF:
    """Estimate the FRFs of a record that comes block by block, as `estimate_frf` does of a whole one.

    Parameters
    ----------
    blocks : iterable of Response
        Consecutive blocks of any lengths, such as `simulate_blocks` yields.
    estimator, resolution, overlap, band, window
        As in `estimate_frf`.

    Returns
    -------
    FRF
        That of the whole record, to rounding.

    Raises
    ------
    RecordError
        As `estimate_frf`.
    """
    for name, value, known in (("estimator", estimator, ESTIMATORS), ("window", window, WINDOWS)):
        if value not in known:
            raise RecordError(f'{name} "{value}" is unknown; use {", ".join(known)}')
    if not 0 <= overlap < 1:
        raise RecordError(f"overlap must be in 0 <= overlap < 1, got {overlap!r}")
    blocks = iter(blocks)
    first = next(blocks, None)
    if first is None:
        raise RecordError("there is no block of a record")
    spectra = _Welch(first.fs, resolution, overlap, band or first.band, window)
    spectra.push(first)
    for block in blocks:
        spectra.push(block)
    value, coherence = spectra.estimate(ESTIMATORS[estimator])
    return FRF(spectra.frequency, value, coherence, first.responses, first.reference, QUANTITY[first.kind])


class _Welch:
    """Sums of the segments' spectra, and the samples of which further segments will be made."""

    def __init__(self, fs, resolution, overlap, band, window):
        if not 0 < resolution <= fs / 2:
            raise RecordError(f"resolution must be > 0 Hz and at most fs / 2 = {fs / 2:g} Hz, got {resolution!r}")
        if band and fs < 2 * band[1]:
            raise RecordError(f"fs {fs:g} Hz is below twice the band's upper end {band[1]:g} Hz")
        self.fs, self.length, self.averages = fs, round(fs / resolution), 0
        self.hop = max(1, self.length - round(overlap * self.length))
        self.window = scipy.signal.get_window(window, self.length)
        frequency = np.arange(self.length // 2 + 1) * (fs / self.length)
        self.lines = _lines(frequency, band) if band else slice(None)
        self.frequency = frequency[self.lines]
        self.sums = self.held = None
        self.limits = np.inf, -np.inf

    def push(self, block):
        """Add every segment that a block completes."""
        signals = np.vstack((block.excitation, block.acceleration.T))
        finite = np.isfinite(signals).all(axis=1)
        if not finite.all():
            bad = int(np.argmin(finite))
            raise RecordError(f"{f'acceleration column {bad - 1}' if bad else 'the excitation'} is not finite")
        low, high = self.limits
        self.limits = min(low, block.excitation.min()), max(high, block.excitation.max())
        held = signals if self.held is None else np.hstack((self.held, signals))
        while held.shape[1] >= self.length:
            spectra = scipy.fft.rfft(held[:, : self.length] * self.window)[:, self.lines]
            found = _cross_spectra(spectra[:1], spectra[1:, None])
            self.sums = found if self.sums is None else tuple(map(np.add, self.sums, found))
            self.averages += 1
            held = held[:, self.hop :]
        self.held = held

    def estimate(self, estimator):
        """Return FRFs and coherence, which one segment alone does not have."""
        if not self.averages:
            raise RecordError(
                f"the record lasts {self.held.shape[1] / self.fs:g} s, shorter than one segment of "
                f"{self.length / self.fs:g} s"
            )
        low, high = self.limits
        if low == high:
            raise RecordError(f"the excitation is constant at {low:g}: no FRF can be estimated")
        sxx, syy, syx = self.sums
        with np.errstate(divide="ignore", invalid="ignore"):
            coherence = np.abs(syx) ** 2 / (sxx * syy) if self.averages > 1 else None
            return estimator(sxx, syy, syx), coherence
