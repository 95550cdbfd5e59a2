"""Misfit of a rig and its law in the records they are identified from: by sensor, level and frequency, and in decays.

The modal engine is driven by each record's excitation. Records under a lasting excitation count in pieces of 5 s,
so that a level ramp shows at which level the law misses, and in bands of `BANDS` equal ratios. Test and model see the
same excitation: the FRF of the difference of their responses is the difference of their FRFs, and its `random_error`
comes from its own coherence. Noise, and impacts that the model does not repeat, are in it; scatter common to both is
not. Impacts of the identified law need no further allowance: with gaps changed by 1e-5 the same FRFs come out, to
0.01 dB. A record of hits is compared by the RMS of both halves of every decay.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.signal
import scipy.stats

from ...core.tasks import run_tasks
from ...engines import simulate
from ...model import Model
from ...signals.arrays import runs
from ...signals.frf import estimate_frf
from ...signals.frf_error import random_error
from ...signals.response import Response
from ..records.in_test import in_test
from ..records.prepared import PreparedRecord
from .output_error import DB, RESOLUTION, holds_hits, piece_of, pieces_of

__all__ = ["DecayMisfit", "LawMisfit", "Stretch", "law_misfit"]

BANDS = 8  # of frequency, between the ends of the records' own bands
WIDEST = 0.4  # of fs: upper end of a record whose band is not known
NORMAL = 1.4826  # standard deviation of a normal variable over the median of its size
TOO_FAR = 3.0  # random errors: beyond, a warning says where the law misses
MIN_MISSED = 0.1  # dB, 1 %, as a sensor's gain may be off: smaller misses are not worth a warning
CORRELATED_LINES = 2.0  # adjacent lines of a Hann window counted as one independent observation
CARRIED = 1e-4  # of the loudest line's power: lines with less are not excited
LASTING = 1 / 3  # of a piece's segments must count at a line; of noise 0.55 do, of a sweep that passes it once 0.2
REST = 0.1  # of an excitation's largest peak: smaller peaks are no hits
SHORTEST = 0.5  # s, of a decay


@dataclass(frozen=True, eq=False)
class Stretch:
    """A piece of a record, with the differences of its FRFs from those of the law."""

    record: str  #: its name
    start: float  #: s
    duration: float  #: s
    level: float  #: RMS of the excitation, m/s² or N
    missed: np.ndarray
    """(n_sensors, n_bands) dB, typical difference of the magnitudes: its median size as a standard deviation; nan in
    bands and at sensors that the record does not have, and where the excitation only passes"""
    random: np.ndarray
    """(n_sensors, n_bands) dB, typical random error of that difference, larger where few lines tell it"""

    @property
    def ratio(self) -> np.ndarray:
        """(n_sensors, n_bands) difference over its random error."""
        return self.missed / self.random


@dataclass(frozen=True, eq=False)
class DecayMisfit:
    """The motion after a hit, with the difference of the law's from it."""

    record: str  #: its name
    start: float  #: s
    duration: float  #: s
    peak: float  #: of the hit, m/s² or N
    missed: np.ndarray
    """(n_sensors, 2) dB, RMS of the model over that of the record, first and second half; nan where not recorded"""


@dataclass(frozen=True, eq=False)
class LawMisfit:
    """Misfit of a rig and its law in records."""

    sensors: tuple[str, ...]  #: (n_sensors,) labels
    unit: str  #: of the levels
    edges: np.ndarray  #: (n_bands + 1,) Hz
    stretches: tuple[Stretch, ...]  #: by rising level; none if all records are hits
    decays: tuple[DecayMisfit, ...]  #: in the order of the records

    @cached_property
    def widening(self) -> float:
        """Factor by which standard deviations of gaps, offsets and laws grow: RMS of `Stretch.ratio`, not below 1.

        Birge's ratio: residuals larger than their random errors mean that all of these are too small by one factor
        (R. T. Birge, The calculation of errors by the method of least squares, Physical Review 40, 1932).
        """
        ratios = np.array([s.ratio for s in self.stretches])
        return max(1.0, float(np.sqrt(np.nanmean(ratios**2)))) if np.isfinite(ratios).any() else 1.0

    def spread(self, frequency: np.ndarray, level: float, duration: float, resolution: float) -> np.ndarray:
        """Return the relative standard deviation of a record's FRF magnitudes about those that rig and law predict.

        σ² = max(0, m² - r²) + r² (T Δf) / (T' Δf'), with the miss m and the random error r of the stretches of T = 5 s
        and the resolution Δf = 1 Hz: the miss beyond random error stays however long a record is, random error
        falls with the number of averages. m² and r² are interpolated over the logarithm of the level and taken from the
        nearest band and level.

        Parameters
        ----------
        frequency : ndarray, shape (n_f,)
            Hz.
        level : float
            RMS of the excitation, m/s² or N.
        duration : float
            s, T' of the record.
        resolution : float
            Hz, Δf' of its FRFs.

        Returns
        -------
        ndarray, shape (n_sensors, n_f)
            0 if all records are hits.
        """
        if not self.stretches:
            return np.zeros((len(self.sensors), np.size(frequency)))
        levels = np.log([s.level for s in self.stretches])
        ratio = RESOLUTION * np.array([s.duration for s in self.stretches]) / (duration * resolution)
        squares = [np.maximum(0, s.missed**2 - s.random**2) + s.random**2 * f for s, f in zip(self.stretches, ratio)]
        squares_by_level = np.array(squares).reshape(levels.size, -1)
        variances = np.array([_interpolated(np.log(level), levels, column) for column in squares_by_level.T])
        band = np.clip(np.searchsorted(self.edges, frequency, side="right") - 1, 0, self.edges.size - 2)
        return np.sqrt(variances.reshape(len(self.sensors), -1)[:, band]) / DB

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plain words on where the law misses by more than three times its random error, and by more than 0.1 dB.

        A miss in one band of one sensor at one level, and in no neighbouring one, counts as chance.
        """
        if not self.stretches:
            return ()
        ratio = np.array([np.where(s.missed > MIN_MISSED, s.ratio, 0.0) for s in self.stretches])
        far = ratio > TOO_FAR
        isolated = sum(far.sum(axis=axis, keepdims=True) for axis in range(3)) == 3
        ratio[far & isolated] = 0.0  # the chance of one cell out of hundreds
        too_far = np.any(ratio > TOO_FAR, axis=(0, 1))
        return tuple(self._warning(ratio, slice(*bands)) for bands in runs(too_far).tolist())

    def _warning(self, ratio: np.ndarray, bands: slice) -> str:
        part = ratio[:, :, bands]
        sizes = np.where(part > TOO_FAR, [s.missed[:, bands] for s in self.stretches], 0.0)
        worst = np.unravel_index(np.argmax(sizes), sizes.shape)
        stretch, missed = self.stretches[worst[0]], sizes[worst]
        missed_sensors = np.flatnonzero((part > TOO_FAR).any(axis=(0, 2)))
        levels = [s.level for s, row in zip(self.stretches, part) if (row > TOO_FAR).any()]
        names = ", ".join(self.sensors[i] for i in missed_sensors)
        sensors = "every sensor" if missed_sensors.size == len(self.sensors) else f"sensors {names}"
        at = f"{levels[0]:.2g}" if len(levels) == 1 else f"{levels[0]:.2g} to {levels[-1]:.2g}"
        return (
            f"the law misses FRFs between {self.edges[bands.start]:.3g} and {self.edges[bands.stop]:.3g} Hz by more "
            f"than {TOO_FAR:g} times their random error at {sensors}, at {at} {self.unit} RMS; most at sensor "
            f"{self.sensors[worst[1]]}, by {missed:.2g} dB, {part[worst]:.1f} times, at {stretch.level:.2g} {self.unit}"
        )

    def rows(self) -> list[dict[str, Any]]:
        """Return a row of plain data for each stretch, sensor and band that the record has."""
        return [
            {"record": s.record, "start": s.start, "duration": s.duration, "level": s.level, "sensor": sensor,
             "from_hz": float(low), "to_hz": float(high), "missed_db": float(missed), "random_db": float(random),
             "ratio": float(missed / random)}
            for s in self.stretches
            for sensor, row, error in zip(self.sensors, s.missed, s.random)
            for (low, high), missed, random in zip(itertools.pairwise(self.edges), row, error)
            if np.isfinite(missed)
        ]  # fmt: skip

    def decay_rows(self) -> list[dict[str, Any]]:
        """Return a row of plain data for each decay and sensor."""
        return [
            {"record": d.record, "start": d.start, "duration": d.duration, "peak": d.peak, "sensor": sensor,
             "first_half_db": float(first), "second_half_db": float(second)}
            for d in self.decays
            for sensor, (first, second) in zip(self.sensors, d.missed)
            if np.isfinite(first)
        ]  # fmt: skip


def _interpolated(at: float, levels: np.ndarray, values: np.ndarray) -> float:
    finite = np.isfinite(values)
    return float(np.interp(at, levels[finite], values[finite])) if finite.any() else 0.0


def law_misfit(records: Sequence[PreparedRecord], model: Model, progress: bool = False) -> LawMisfit:
    """Simulate a model under the excitation of records, and compare.

    Parameters
    ----------
    records : sequence of PreparedRecord
        Those that the model was identified from.
    model : Model
        The identified one; its sensors are those of the records.
    progress : bool
        Show a progress bar.

    Raises
    ------
    ClearanceError
        Whatever `simulate` raises.
    """

    def simulated(record: PreparedRecord) -> Response:
        return simulate(in_test(model, record.tested, record.turning), record.excitation(), engine="modal")

    responses = dict(run_tasks(simulated, records, progress="misfit" if progress else ""))
    pairs = [(record.name, record.response(), responses[record]) for record in records]
    lasting, struck = ([pair for pair in pairs if holds_hits(pair[1].excitation) == hits] for hits in (False, True))
    bands = [_band(test) for _, test, _ in lasting]
    edges = np.geomspace(min(b[0] for b in bands), max(b[1] for b in bands), BANDS + 1) if bands else np.empty(0)
    stretches = [_stretch(*pair, piece, edges) for pair in lasting for piece in pieces_of(pair[1])]
    decays = [decay for pair in struck for decay in _decays(*pair)]
    unit = "N" if records[0].kind == "force" else "m/s²"
    stretches.sort(key=lambda s: s.level)
    return LawMisfit(tuple(model.rig.sensor_labels), unit, edges, tuple(stretches), tuple(decays))


def _recorded_rows(test: Response, model: Response) -> list[int]:
    """Return the indices of a model's sensors that were recorded."""
    sensors = [*zip(model.responses, model.quantities)]
    return [sensors.index(pair) for pair in zip(test.responses, test.quantities)]


def _band(response: Response) -> tuple[float, float]:
    return response.band or (RESOLUTION, WIDEST * response.fs)


def _stretch(name: str, test: Response, model: Response, part: slice, edges: np.ndarray) -> Stretch:
    measured = replace(piece_of(test, part), band=_band(test))
    rows = _recorded_rows(test, model)
    delta = replace(measured, channels=(test.channels - model.channels[rows])[:, part])
    frf, difference = (estimate_frf(response, resolution=RESOLUTION, window="hann") for response in (measured, delta))
    noise = random_error(difference)[:, 0] * np.abs(difference.functions)
    # In the test's magnitude, the model's or both: |H|² + σ², σ² = 2 noise², so that none is missed where it is all.
    of_both = frf.functions, frf.functions - difference.functions
    test_size, model_size = (np.sqrt(np.abs(functions) ** 2 + 2 * noise**2) for functions in of_both)
    missed = DB * np.abs(np.log(model_size / test_size))
    error = DB * noise / np.maximum(model_size, test_size)
    carried, lasting = _excited_lines(measured, frf.frequency)
    band = np.where(carried, np.searchsorted(edges, frf.frequency, side="right") - 1, -1)
    values = np.full((2, len(model.responses), edges.size - 1), np.nan)
    for i in range(edges.size - 1):
        if (mask := band == i).any() and np.median(lasting[mask]) > LASTING:
            wider = _scatter_of_median(mask.sum() / CORRELATED_LINES, 2 * ((difference.averages or 2.0) - 1))
            values[:, rows, i] = NORMAL * np.median(missed[:, mask], axis=1), wider * np.median(error[:, mask], axis=1)
    start, level = part.start / test.fs, float(np.std(measured.excitation))
    return Stretch(name, start, measured.duration, level, values[0], values[1])


def _excited_lines(response: Response, frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which lines (n_f,) of FRFs are excited, and the fraction (n_f,) of the averaged segments that excite each.

    Of powers p that is (Σ p)² / Σ p². A sine that passes a line once leaves one segment, which is always coherent.
    """
    size = round(response.fs / RESOLUTION)
    overlap = size - size // 2
    *_, power = scipy.signal.spectrogram(response.excitation, response.fs, "hann", size, overlap, detrend=False)
    power = power[np.round(frequency / RESOLUTION).astype(int)]
    total = power.sum(axis=1)
    excited = total > CARRIED * total.max()
    squares = np.sum(power**2, axis=1) * power.shape[1]
    return excited, np.divide(total**2, squares, out=np.zeros(total.size), where=excited)


def _scatter_of_median(lines: float, freedom: float) -> float:
    """Return the factor on a random error, at least 1, that makes `TOO_FAR` times it as rare for a median of few lines.

    The median of m sizes is a Beta variable of (m + 1) / 2 twice over their distribution, Student's as errors are
    estimated from few averages, too.
    """
    quantile = scipy.stats.beta.ppf(2 * scipy.stats.norm.sf(TOO_FAR), (lines + 1) / 2, (lines + 1) / 2)
    return max(1.0, float(NORMAL * scipy.stats.t.isf(quantile / 2, freedom)) / TOO_FAR)


def _decays(name: str, test: Response, model: Response) -> list[DecayMisfit]:
    """Return the decays, each from a hit to the next."""
    size = np.abs(test.excitation)
    struck = np.flatnonzero(size > REST * size.max())
    shortest = int(SHORTEST * test.fs)
    first = struck[np.diff(struck, prepend=-shortest) >= shortest]
    rows, decays = _recorded_rows(test, model), list[DecayMisfit]()
    for begin, end in itertools.pairwise([*first.tolist(), size.size]):
        if end - begin >= shortest:
            halves = np.array_split(np.arange(begin, end), 2)
            signals = model.channels[rows], test.channels
            modelled, measured = ([np.std(signal[:, half], axis=1) for half in halves] for signal in signals)
            missed = np.full((len(model.responses), 2), np.nan)
            missed[rows] = DB * np.log(np.divide(modelled, measured)).T
            peak = float(size[begin : begin + shortest].max())
            decays.append(DecayMisfit(name, begin / test.fs, (end - begin) / test.fs, peak, missed))
    return decays
