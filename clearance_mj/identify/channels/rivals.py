"""Certainty of an assignment of channels: how much more the channels contradict each other under every rival.

The forces in the clearances are unknown: line by line, those forces and the excitation are fitted that meet all
channels best, as in the updating of rigs, and the remaining contradiction between the channels counts.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..structure.faults.assessment import distance, predicted_spectra
from ..structure.faults.of_signals import likeness_over_delays
from ..structure.force_gains import SpectralLines, force_gains
from ..structure.rig_fit import channel_deviation
from ..structure.spectra import complex_frequency, complex_spectra, rms
from .assignment import Assignment, Search

__all__ = ["CandidateAssignment", "Judge"]

LINES = 300  # of each record
JUDGED = 4  # draws with which an assignment is judged: those that fit it best


@dataclass(frozen=True)
class CandidateAssignment:
    """Another assignment, in which some channels are at other places or have other signs."""

    margin: float
    """by which it is worse; each unit is a factor e in the mean squared contradiction of a channel"""
    channels: tuple[int, ...]
    """that differ"""
    places: tuple[int, ...]
    """where: of two that are exchanged, of one that is turned round, or of one that another channel takes"""


class Judge:
    """Contradictions between channels under an assignment and its rivals.

    Parameters
    ----------
    search : Search
        Search that the assignment comes from.
    assignment : Assignment
        The assignment.
    factor : ndarray, shape (n,)
        By which each channel's numbers are to be multiplied, without signs.
    """

    def __init__(self, search: Search, assignment: Assignment, factor: np.ndarray) -> None:
        self._search, self.assignment = search, assignment
        signals = search.signals
        spectra = [complex_spectra(record * factor, signals.fs, search.band, LINES) for record in signals.records]
        self._frequency, self._measured = zip(*spectra)
        durations = [len(record) / signals.fs for record in signals.records]
        omegas = map(complex_frequency, self._frequency, durations)
        lines = [SpectralLines(search.kind, omega, search.rig) for omega in omegas]
        drawn = [force_gains(search.rig, search.drawn[i].values, True, lines) for i in assignment.draws]
        self._stated = assignment.channel, assignment.sign
        self._gains = sorted(drawn, key=lambda gains: self._distance(gains, *self._stated))[:JUDGED]
        self.distance = self._closest(*self._stated)
        """Of the assignment itself."""

    @property
    def enough(self) -> bool:
        """True if there are more channels than unknown forces, so that channels can contradict each other."""
        return len(self.assignment.places) > len(self._search.rig.bushings) + 1

    def contradiction(self) -> dict[int, float]:
        """Return by place the error with which the other channels and the rig predict a channel, over its level."""
        places, gains, measured = self._assigned_spectra()
        _, predicted = predicted_spectra(gains, measured)
        error = np.vstack(measured) - predicted
        relative = np.sqrt(np.mean(np.abs(error) ** 2, axis=0) / np.mean(np.abs(np.vstack(measured)) ** 2, axis=0))
        return dict(zip(places, relative.tolist()))

    @property
    def misfit(self) -> float:
        """RMS over the channels of their contradiction."""
        return float(np.sqrt(np.mean(np.square(list(self.contradiction().values())))))

    def gains(self) -> list[float]:
        """Return by place, without the excitation's, a channel's reading over its prediction from rig and others."""
        lines = itertools.islice(self._against_others(), len(self.assignment.places) - 1)
        return [float(np.median(np.abs(y * w)) / np.median(np.abs(x * w))) for _, y, x, w in lines]

    def delays(self, tried: np.ndarray) -> dict[int, float]:
        """Return by place the likeliest of the delays tried (n,), s, of a channel against its prediction."""
        phases = np.exp(2j * np.pi * np.outer(tried, np.concatenate(self._frequency)))
        alike = {place: likeness_over_delays(y, x, phases) for place, y, x, _ in self._against_others()}
        return {place: float(tried[np.argmax(likeness)]) for place, likeness in alike.items()}

    def _against_others(self) -> Iterator[tuple[int, np.ndarray, np.ndarray, np.ndarray]]:
        """Yield each place, its channel's lines y (n,), their prediction x from rig and others, and their weights."""
        places, gains, measured = self._assigned_spectra()
        for i, place in enumerate(places):
            weights, predicted = predicted_spectra(gains, measured, (i,))
            yield place, np.vstack(measured)[:, i], predicted[:, i], weights[:, i]

    def _assigned_spectra(self) -> tuple[list[int], list[np.ndarray], list[np.ndarray]]:
        """Return places with a channel, their gains on the likeliest drawn rig, and the spectra, by record."""
        places = list(self.assignment.places)
        return places, [gains[:, places] for gains in self._gains[0]], self._spectra_of(*self._stated)

    def motion_over_gap(self) -> float:
        """Return the largest RMS displacement in a clearance over its gap, of any record.

        From the channels that measure no displacement, as if the excitation's numbers were in SI units.
        """
        search = self._search
        places = [i for i in self.assignment.places if search.places[i].quantity != "displacement"]
        probes = slice(len(search.rig.sensors), len(search.places) - 1)
        measured = self._spectra_of(*self._stated)
        column, motions = self.assignment.places.index(places[-1]), [0.0]
        for gains, spectra, record in zip(self._gains[0], measured, search.signals.records):
            rows = spectra[:, [self.assignment.places.index(i) for i in places]]
            scale = 1 / channel_deviation(rms(rows), rows)
            lines = zip(gains[:, places], scale, rows)
            forces = [np.linalg.lstsq(g * w[:, None], y * w, rcond=None)[0] for g, w, y in lines]
            displacement = rms((gains[:, probes] @ np.array(forces)[:, :, None])[:, :, 0])
            level = record[:, self.assignment.channel[-1]].std() / rms(spectra[:, [column]])[0]
            motions += [m * level / b.gap for m, b in zip(displacement, search.rig.bushings)]
        return float(max(motions))

    def rivals(self) -> list[CandidateAssignment]:
        """Return every rival with one channel turned round, two exchanged, or one replaced by an unassigned one."""
        rivals = []
        for channels, places, variants in self._alternatives():
            closest = min(self._closest(channel, sign) for channel, sign in variants)
            rivals.append(CandidateAssignment(closest - self.distance, channels, places))
        return sorted(rivals, key=lambda rival: rival.margin)

    def _alternatives(self) -> Iterator[tuple[tuple[int, ...], tuple[int, ...], list[tuple[list[int], list[float]]]]]:
        """Yield the channels and places concerned, and the channels and signs of all places in each rival."""
        channel, sign, search = list(self.assignment.channel), list(self.assignment.sign), self._search
        places = self.assignment.places
        for place in places:
            yield (channel[place],), (place,), [(channel, _changed(sign, {place: -sign[place]}))]
        for a, b in itertools.combinations(places, 2):
            if search.may_be(channel[a], b) and search.may_be(channel[b], a):
                exchanged = _changed(channel, {a: channel[b], b: channel[a]})
                signs = [_changed(sign, {a: s, b: t}) for s in (1.0, -1.0) for t in (1.0, -1.0)]
                yield (channel[a], channel[b]), (a, b), [(exchanged, flipped) for flipped in signs]
        free = sorted(set(range(len(search.signals.names))) - set(channel))
        for other, place in itertools.product(free, places):
            if search.may_be(other, place):
                replaced = _changed(channel, {place: other})
                yield (channel[place], other), (place,), [(replaced, _changed(sign, {place: s})) for s in (1.0, -1.0)]

    def _closest(self, channel: Sequence[int], sign: Sequence[float]) -> float:
        return min(self._distance(gains, channel, sign) for gains in self._gains)

    def _distance(self, gains: list[np.ndarray], channel: Sequence[int], sign: Sequence[float]) -> float:
        places = [i for i, c in enumerate(channel) if c >= 0]
        return distance([gain[:, places] for gain in gains], self._spectra_of(channel, sign))

    def _spectra_of(self, channel: Sequence[int], sign: Sequence[float]) -> list[np.ndarray]:
        """Spectra (n_f, n_assigned) of each record, in the order of the places."""
        places = [i for i, c in enumerate(channel) if c >= 0]
        return [m[:, [channel[i] for i in places]] * [sign[i] for i in places] for m in self._measured]


def _changed(values: Sequence[Any], changed: dict[int, Any]) -> list[Any]:
    return [changed.get(i, value) for i, value in enumerate(values)]
