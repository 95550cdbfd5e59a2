"""Hammer tests: from records of hits to averaged FRFs with coherence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft

from ..core.errors import RecordError
from ..core.kinds import checks_kinds
from .frf import FRF, estimate_frf_blocks
from .hits import DECAYED, TRIGGER, Hit, find_hits, left_out_notes, tail_level, windowed_blocks
from .references import join_references
from .response import Response
from .welch import Band

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["HammerTest", "hammer_frf"]

DECAYED_TO = 0.01  # level that the exponential window takes responses down to
SHOWN = 6  # lengths of a touch that its figure shows
WEAKEST = 0.1  # of the force's strongest line (-20 dB): where the band of the FRFs ends


@dataclass(frozen=True, eq=False)
class HammerTest:
    """FRFs of a hammer test, and the hits that they are made of."""

    frf: FRF
    """averaged over the hits that are not left out; its ``window_rate`` is that of the exponential window"""
    hits: tuple[Hit, ...]
    """all hits in the order of the records, also those that are left out"""
    records: tuple[Response, ...]
    """records that were measured"""
    blocks: tuple[Response, ...]
    """blocks that were averaged, with their windows"""
    notes: tuple[str, ...]
    """remarks on the estimate and on faults of the test, in words"""

    @property
    def spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Lines (n_f,), Hz, and the RMS over the blocks of the force's spectrum at them, over the strongest line."""
        return _spectrum(self.blocks)

    def plot(self) -> Figure:
        """Draw the forces with their hits, the blocks, and the force's spectrum; ``frf.plot()`` draws the FRFs."""
        from ..core.drawing import ALARM, COLOURS, REPEAT, TEST, canvas, envelope, tidy

        figure, first = canvas(4.6), self.blocks[0]
        (hits, pulses), (response, spectrum) = figure.subplots(2, 2)
        starts = np.cumsum([0.0, *(record.duration for record in self.records)])
        for start, record in zip(starts, self.records):
            hits.plot(*envelope(start + record.time, record.excitation), color=TEST, lw=0.7)
        for faulty, marker, colour, label in ((False, "o", COLOURS[0], "averaged"), (True, "x", ALARM, "left out")):
            points = [(starts[hit.record] + hit.time, hit.peak) for hit in self.hits if bool(hit.fault) == faulty]
            if points:
                hits.plot(*zip(*points), marker, color=colour, ms=5, label=f"{label}: {len(points)}")
        averaged = [hit for hit in self.hits if not hit.fault]
        for hit, block in zip(averaged, self.blocks):
            record, (touch, release) = self.records[hit.record], hit.pulse
            width = release - touch
            part = np.arange(max(0, hit.start, touch - width), min(touch + SHOWN * width, record.excitation.size))
            time = 1e3 * (part - touch) / record.fs
            pulses.plot(time, record.excitation[part], color=REPEAT, lw=1.6)
            pulses.plot(time, block.excitation[part - hit.start], color=COLOURS[0], lw=0.8)
        response.plot(*envelope(first.time, first.channels[0]), color=TEST, lw=0.7)
        frequency, level = self.spectrum
        spectrum.plot(frequency, 20 * np.log10(np.maximum(level, 1e-6)), color=COLOURS[0], lw=1.0)
        spectrum.axvspan(*self.frf.frequency[[0, -1]], color=REPEAT, alpha=0.25, lw=0, label="lines of the FRFs")
        spectrum.set_ylim(-60, 3)
        tidy(hits, "Hits", "Force (N)", "Time (s)")
        tidy(pulses, "Touches that are averaged (grey: without windows)", "Force (N)", "Time (ms)")
        tidy(response, "First block that is averaged", f"Acceleration {self.frf.responses[0]} (m/s²)", "Time (s)")
        tidy(spectrum, "Force over frequency", "Level (dB)", "Frequency (Hz)")
        for ax in (hits, spectrum):
            ax.legend(fontsize=7, frameon=False)
        return figure


@checks_kinds
def hammer_frf(
    records: Response | Sequence[Response], estimator: str = "H1", band: Band | None = None, block: float | None = None,
    force_window: float = 0.0, exponential: float | None = None, trigger: float = TRIGGER, pre_trigger: float = 0.0,
) -> HammerTest:  # fmt: skip
    """Estimate FRFs of records of hits: one block a hit, windows for hits, averages over the hits.

    Hits are detected by the force, of either sign. Left out, with a note, are double hits, hits in whose block a
    channel is clipped, and those of which the records do not hold a whole block.

    Parameters
    ----------
    records : Response or sequence of Response
        Records with one hit or several. Those with the same reference and responses are averaged; others, of a hammer
        or accelerometers that rove, become further references and responses of one FRF.
    estimator : {"H1", "H2", "Hv"}
        As in `estimate_frf`.
    band : (float, float), optional
        Lines to return, Hz; else up to where the force's spectrum has fallen by 20 dB.
    block : float, optional
        s from before a hit on; else as long as the hits are apart. Lines are 1 / block apart.
    force_window : float
        s for which the force is kept after the touch; as long as a block: no force window.
    exponential : float, optional
        Value of the exponential window at the end of a block; 1: none. Else none where the responses have decayed to
        5 % there, and a window that takes them down to 1 % where they have not.
    trigger : float
        Fraction of a record's largest hit from which on a pulse is a hit.
    pre_trigger : float
        s of a block before the peak; at least twice the length of a touch.

    Returns
    -------
    HammerTest
        FRFs with coherence, the hits, and notes.

    Raises
    ------
    RecordError
        If no hit is left, the records' rates differ, or a number is impossible.
    """
    records = (records,) if isinstance(records, Response) else tuple(records)
    given = {"block": block, "exponential": exponential, "trigger": trigger}
    if bad := [name for name, x in given.items() if x is not None and not (0 < x and (x <= 1 or name == "block"))]:
        raise RecordError(f"{bad[0]} must be > 0{'' if bad[0] == 'block' else ' and at most 1'}, got {given[bad[0]]!r}")
    if not records or min(pre_trigger, force_window) < 0:
        raise RecordError("hammer_frf needs a record, and pre_trigger and force_window of 0 s or more")
    fs = records[0].fs
    length = None if block is None else round(min(block * fs, 1e18))
    hits, length = find_hits(records, length, trigger, round(min(pre_trigger * fs, 1e18)))
    notes = left_out_notes(hits)

    def blocks(rate: float) -> list[Response]:
        groups = [[hit for hit in hits if hit.record == i] for i in range(len(records))]
        parts = (windowed_blocks(record, group, length, force_window, rate) for record, group in zip(records, groups))
        return [block for part in parts for block in part]

    averaged = blocks(0.0)
    places = list(dict.fromkeys(map(_place, records)))
    if empty := [place[0] for place in places if place not in map(_place, averaged)]:
        raise RecordError(f"no hit at {empty[0]} is left: {'; '.join(notes)}")
    level = tail_level(averaged)
    if exponential is None:
        exponential = min(1.0, DECAYED_TO / level) if level > DECAYED else 1.0
    rate = -float(np.log(exponential)) * fs / length
    averaged = blocks(rate) if rate else averaged
    if band is None:
        frequency, spectrum = _spectrum(averaged)
        weak = np.append(np.flatnonzero(spectrum < WEAKEST), frequency.size)
        band = float(frequency[1]), float(frequency[weak[weak > np.argmax(spectrum)][0] - 1])
        notes.append(f"the FRFs end at {band[1]:.4g} Hz, where the force has fallen by 20 dB; band goes further")
    by_place = [[block for block in averaged if _place(block) == place] for place in places]
    frfs = [estimate_frf_blocks(parts, estimator, fs / length, 0.0, band, "boxcar") for parts in by_place]
    frf = join_references([replace(single, window_rate=rate) for single in frfs])
    if level > DECAYED or rate:
        end = f"{level:.0%} of the responses is left at the end of a block of {length / fs:.3g} s"
        windowed = f"an exponential window damps them by {rate:.4g} 1/s, which `modes` takes out again"
        notes.append(f"{end}: {windowed if rate else 'peaks are too low'}")
    return HammerTest(frf, tuple(hits), records, tuple(averaged), (*notes, *_sign_notes(frf, hits)))


def _place(record: Response) -> tuple[str, tuple[str, ...]]:
    return record.reference, record.responses


def _spectrum(blocks: Sequence[Response]) -> tuple[np.ndarray, np.ndarray]:
    power = np.mean([np.abs(scipy.fft.rfft(block.excitation)) ** 2 for block in blocks], axis=0)
    return scipy.fft.rfftfreq(blocks[0].excitation.size, 1 / blocks[0].fs), np.sqrt(power / power.max())


def _sign_notes(frf: FRF, hits: Sequence[Hit]) -> list[str]:
    """Return notes on forces and accelerometers of the other sign."""
    notes = []
    if negative := sum(hit.peak < 0 for hit in hits if not hit.fault):
        notes.append(f"the force of {negative} hits is negative: they push against the direction of the reference")
    for label in set(frf.responses) & set(frf.references):
        value = frf.value[frf.responses.index(label), frf.references.index(label)]
        if np.sum(value.imag * np.abs(value)) < 0:  # each mode's accelerance at its peak is j φ² / 2 ζ
            notes.append(f"the driving point {label} says a negative mass: force or accelerometer is of the other sign")
    return notes
