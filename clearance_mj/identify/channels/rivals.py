"""How sure an assignment of channels is: by how much worse the channels contradict each other under every other one.

The forces in the clearances are unknown: line by line, those forces and the excitation are found that meet all channels
best, as in the updating of rigs, and what the channels then contradict each other in counts.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..structure.faults.assessment import distance, predicted_spectra
from ..structure.force_gains import Lines, force_gains
from ..structure.rig_fit import channel_deviation
from ..structure.spectra import complex_frequency, complex_spectra, rms
from .assignment import Assignment, Search

__all__ = ["Judge", "Rival"]

LINES = 300  # of each record
JUDGED = 4  # draws with which an assignment is judged: those that fit it best


@dataclass(frozen=True)
class Rival:
    """Another assignment, in which some channels are something else."""

    margin: float
    """by which it is worse; each unit is a factor e in the mean squared contradiction of a channel"""
    channels: tuple[int, ...]
    """that are something else"""
    places: tuple[int, ...]
    """where: of two that are exchanged, of one that is turned round, or of one that another channel takes"""


class Judge:
    """Contradictions between channels under an assignment and its rivals.

    Parameters
    ----------
    search : Search
        The search that found it.
    assignment : Assignment
        The assignment.
    factor : ndarray, shape (n,)
        By which each channel's numbers are to be multiplied, without signs.
    """

    def __init__(self, search: Search, assignment: Assignment, factor: np.ndarray) -> None:
        self._search, self.assignment = search, assignment
        signals = search.signals
        found = [complex_spectra(record * factor, signals.fs, search.band, LINES) for record in signals.records]
        self._frequency, self._measured = zip(*found)
        lines = [
            Lines(search.kind, complex_frequency(frequency, len(record) / signals.fs), search.rig)
            for (frequency, _), record in zip(found, signals.records)
        ]
        drawn = [force_gains(search.rig, search.drawn[i].values, True, lines) for i in assignment.draws]
        self._own = assignment.channel, assignment.sign
        self._gains = sorted(drawn, key=lambda gains: self._distance(gains, *self._own))[:JUDGED]
        self.distance = self._least(*self._own)
        """Of the assignment itself."""

    @property
    def enough(self) -> bool:
        """Whether there are more channels than unknown forces, so that channels can contradict each other."""
        return len(self.assignment.places) > len(self._search.rig.bushings) + 1

    def contradiction(self) -> dict[int, float]:
        """Return by place what the other channels and the rig miss of a channel, over its level."""
        places, gains, measured = self._assigned()
        _, predicted = predicted_spectra(gains, measured)
        missed = np.vstack(measured) - predicted
        share = np.sqrt(np.mean(np.abs(missed) ** 2, axis=0) / np.mean(np.abs(np.vstack(measured)) ** 2, axis=0))
        return dict(zip(places, share.tolist()))

    @property
    def misfit(self) -> float:
        """What the other channels and the rig miss of a channel over its level, RMS over the channels."""
        return float(np.sqrt(np.mean(np.square(list(self.contradiction().values())))))

    def gains(self) -> list[float]:
        """Return by place, but for the excitation, a channel's reading over what the rig and the others say it is."""
        (places, gains, measured), found = self._assigned(), []
        for i in range(len(places) - 1):
            weights, predicted = predicted_spectra(gains, measured, (i,))
            own, expected = (np.vstack(measured) * weights)[:, i], (predicted * weights)[:, i]
            found.append(float(np.median(np.abs(own)) / np.median(np.abs(expected))))
        return found

    def delays(self, tried: np.ndarray) -> dict[int, float]:
        """Return by place after which of the delays tried (n,), s, a channel shows what the rig and the others say."""
        (places, gains, measured), found = self._assigned(), {}
        turned = np.exp(2j * np.pi * np.outer(tried, np.concatenate(self._frequency)))
        for i, place in enumerate(places):
            _, predicted = predicted_spectra(gains, measured, (i,))
            own, expected = np.vstack(measured)[:, i], predicted[:, i]
            product = own * expected.conj() / np.maximum(np.abs(own), np.abs(expected)) ** 2
            found[place] = float(tried[np.argmax((turned @ product).real)])
        return found

    def _assigned(self) -> tuple[list[int], list[np.ndarray], list[np.ndarray]]:
        """Places with a channel, their gains on the likeliest drawn rig, and the channels' spectra, of each record."""
        places = list(self.assignment.places)
        return places, [one[:, places] for one in self._gains[0]], self._of(*self._own)

    def motion_over_gap(self) -> float:
        """Return the largest RMS displacement in a clearance over its gap, of any record.

        From the channels that measure no displacement, as if the excitation's numbers were in SI units.
        """
        search = self._search
        places = [i for i in self.assignment.places if search.places[i].quantity != "displacement"]
        probes = slice(len(search.rig.sensors), len(search.places) - 1)
        measured = self._of(*self._own)
        column, found = self.assignment.places.index(places[-1]), [0.0]
        for gains, spectra, record in zip(self._gains[0], measured, search.signals.records):
            own = spectra[:, [self.assignment.places.index(i) for i in places]]
            weights = 1 / channel_deviation(rms(own), own)
            forces = [
                np.linalg.lstsq(g * w[:, None], y * w, rcond=None)[0] for g, w, y in zip(gains[:, places], weights, own)
            ]
            moved = rms((gains[:, probes] @ np.array(forces)[:, :, None])[:, :, 0])
            level = record[:, self.assignment.channel[-1]].std() / rms(spectra[:, [column]])[0]
            found += [m * level / b.gap for m, b in zip(moved, search.rig.bushings)]
        return float(max(found))

    def rivals(self) -> list[Rival]:
        """Return every rival with one channel turned round, two exchanged, or one replaced by an unassigned one."""
        found = [
            Rival(min(self._least(channel, sign) for channel, sign in ways) - self.distance, channels, places)
            for channels, places, ways in self._others()
        ]
        return sorted(found, key=lambda rival: rival.margin)

    def _others(self) -> Iterator[tuple[tuple[int, ...], tuple[int, ...], list[tuple[list[int], list[float]]]]]:
        """Channels and places concerned, and the ways in which they can be."""
        channel, sign, search = list(self.assignment.channel), list(self.assignment.sign), self._search
        places = self.assignment.places
        for place in places:
            yield (channel[place],), (place,), [(channel, _with(sign, {place: -sign[place]}))]
        for a, b in itertools.combinations(places, 2):
            if search.may_be(channel[a], b) and search.may_be(channel[b], a):
                exchanged = _with(channel, {a: channel[b], b: channel[a]})
                signs = [_with(sign, {a: s, b: t}) for s in (1.0, -1.0) for t in (1.0, -1.0)]
                yield (channel[a], channel[b]), (a, b), [(exchanged, way) for way in signs]
        free = sorted(set(range(len(search.signals.names))) - set(channel))
        for other, place in itertools.product(free, places):
            if search.may_be(other, place):
                replaced = _with(channel, {place: other})
                yield (channel[place], other), (place,), [(replaced, _with(sign, {place: s})) for s in (1.0, -1.0)]

    def _least(self, channel: Sequence[int], sign: Sequence[float]) -> float:
        return min(self._distance(gains, channel, sign) for gains in self._gains)

    def _distance(self, gains: list[np.ndarray], channel: Sequence[int], sign: Sequence[float]) -> float:
        places = [i for i, c in enumerate(channel) if c >= 0]
        return distance([one[:, places] for one in gains], self._of(channel, sign))

    def _of(self, channel: Sequence[int], sign: Sequence[float]) -> list[np.ndarray]:
        """Spectra (n_f, n_assigned) of each record, in the order of the places."""
        places = [i for i, c in enumerate(channel) if c >= 0]
        return [m[:, [channel[i] for i in places]] * [sign[i] for i in places] for m in self._measured]


def _with(values: Sequence[Any], changed: dict[int, Any]) -> list[Any]:
    return [changed.get(i, value) for i, value in enumerate(values)]
