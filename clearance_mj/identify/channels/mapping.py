"""Find which channel of a logger's files is which sensor of a rig."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from tqdm import tqdm

from ...core.errors import RecordError
from ...io.channel_map import UNDECIDED, ChannelMap
from ...io.channels import UNKNOWN, Channel, channel_faults
from ...io.columns import SKIP, channel_name
from ...io.formats import read_channels
from ...rig import Rig
from ...signals.stepped_sines import is_stepped_sine
from .assignment import Assignment, Search
from .names import agreement_of_name
from .raw_signals import gather
from .rivals import CandidateAssignment, Judge
from .units import ChannelUnits, decide_units, nearest_unit

__all__ = ["FITS", "judged", "map_channels", "shows_impacts"]

SURE = 3.0  # margin over every rival from which on an assignment is sure
SURE_OF_ANOTHER = 12.0
"""The same where the rig fits badly, as one whose structure is not as drawn; of benches whose excitation was left out,
so that some sensor stood for it, up to 9."""
FITS = 0.07  # misfit over the channels' level, up to which the rig fits; of drawn benches up to 0.05
LIKE, SOUND = 0.25, 0.7
"""Likeness of the transfer functions below which records are not of this rig, and above which nothing else is tried."""
CONTRADICTS = 0.5  # misfit of a channel over its level, from which on it is asked for
FOREIGN = 0.4  # fraction of channels that are contradicted, from which on none is believed
IMPACTS, LEAST_DURATION = 0.85, 10.0
"""Mean coherence with the excitation below which records show impacts, and seconds of records that tell it."""
REFINEMENTS = 3  # of gains that are those of no unit
FARTHEST, FINEST, TIMELY = 20.0, 0.1, 0.15
"""Samples: by which a channel may be late, steps in which that is looked for, and up to which it counts as in time."""
CLOSE = 2.5  # factor within which a unit is tried instead
STRETCHES = {0.5: "half", 2.0: "twice", 1e3: "a thousand times", 1e-3: "a thousandth of"}  # of a wrong sampling rate
SINES = "the records are under a stepped sine alone"
BETTER = 0.1  # more likeness by which another sampling rate is named
_TURNED = str.maketrans("+-", "-+")

Files = Sequence[str | PathLike[str]] | Sequence[Sequence[Channel]] | Mapping[str, Sequence[Channel]]


def map_channels(
    files: Files, rig: Rig, kind: str | None = None, band: tuple[float, float] | None = None, progress: bool = False
) -> ChannelMap:
    """Find which channel of a logger's files is which accelerometer, probe or excitation of a rig, its sign and unit.

    Transfer functions between the channels are compared with those of the rig, whose uncertain numbers are drawn from
    its tolerances. The assignment is sure if the channels contradict each other much more under any other one; names
    decide only between assignments that the records do not distinguish. Records under stepped sines decide only where
    there are no others.

    Parameters
    ----------
    files : sequence of path, sequence of sequence of Channel, or mapping of str to sequence of Channel
        Records of one set-up, perhaps by name: channels have the same names in all of them.
    rig : Rig
        The measured rig. Its numbers may be as wrong as their tolerances say.
    kind : str, optional
        Kind of excitation: "base" or "force"; by default as the rig's shaker.
    band : (float, float), optional
        Hz, of the excitation; by default where the channels' power is.
    progress : bool
        Show a progress bar.

    Returns
    -------
    ChannelMap
        Place of each channel, "?" where that is not sure, with the reasons. A bench and its mirror image have the same
        transfer functions: signs are relative to the excitation, whose sign is taken for right.

    Raises
    ------
    RecordError
        If a file cannot be read or is too short, channels differ between files, nothing in them moves as the rig, or
        that has round clearances.
    RigError
        If a force drives the rig and its file does not say where.
    """
    if rig.moves_across and rig.bushings:
        raise RecordError(
            f"rig “{rig.name}” moves in space, where maps are not found: say of each channel what it is, such as "
            '--column "A1=acc:1:+Y [g]"'
        )
    with tqdm(total=4, desc="map", disable=not progress) as bar:
        named = [*files.items()] if isinstance(files, Mapping) else [_channels(f, n) for n, f in enumerate(files, 1)]
        stepped = {name: [c.name for c in channels if is_stepped_sine(c.value, c.fs)] for name, channels in named}
        sines = {name: steps for name, steps in stepped.items() if steps}
        deciding = [(name, channels) for name, channels in named if name not in sines]
        notes = [f"{name}: is a stepped sine, the other records decide" for name in sines if deciding]
        signals = gather(deciding or named)
        bar.update()
        band = band or signals.band()
        excited = set[str]() if deciding else set[str]().union(*sines.values())
        signals = signals.without({n: why for n, why in signals.unrelated(band).items() if n not in excited})
        search = Search(rig, signals, kind or rig.shaker.kind, band)
        assignments = search.closest_assignments()
        bar.update()
        if not assignments:
            raise RecordError(
                f"no channel can be the excitation of rig “{rig.name}”, {search.places[-1].quantity} of the "
                f"{'base' if search.kind == 'base' else 'shaker'}: was it recorded?"
            )
        best, doubts = assignments[0], list[str]()
        if not excited and (words := _wrong_rate(search, best)):
            doubts.append(words)
        judge, units = judged(search, best)
        if excited and judge.misfit > FITS:
            doubts.append(f"{SINES}, which does not tell the channels apart: give one under noise or hits, too")
        elif judge.misfit > FITS and judge.enough and (late := _with_delays(search, judge.misfit)):
            search, judge, units, doubts = late
        bar.update()
        rivals = judge.rivals() if judge.enough else []
        bar.update()
    answer = _MapWriter(search, judge, units, rivals, doubts, bool(excited)).written()
    used = {name for name, given in answer.channels.items() if given != SKIP}
    faults = [(name, channel_faults([c for c in channels if c.name in used], False)) for name, channels in named]
    fault_notes = (f"{name}: {fault}" for name, of_file in faults for fault in of_file)
    return dataclasses.replace(answer, notes=(*notes, *answer.notes, *fault_notes))


def _channels(file: str | PathLike[str] | Sequence[Channel], number: int) -> tuple[str, Sequence[Channel]]:
    if isinstance(file, str | PathLike):
        return Path(file).name, read_channels(file)
    return f"record {number}", file


def _with_delays(search: Search, misfit: float) -> tuple[Search, Judge, ChannelUnits, list[str]] | None:
    """Return search and results with late channels brought forward, and words; None if that explains nothing."""
    signals, fs = search.signals, search.signals.fs
    tried = np.arange(-FARTHEST, FARTHEST + FINEST / 2, FINEST) / fs
    best = search.closest_assignments(delays=tried)[0]
    late = {best.channel[place]: best.delay[place] for place in best.places}
    for _ in range(REFINEMENTS):
        middle = float(np.median([*late.values()]))  # most channels are in time
        late = {channel: delay - middle for channel, delay in late.items()}
        shifted = signals.earlier({signals.names[channel]: delay for channel, delay in late.items()})
        search = Search(search.rig, shifted, search.kind, search.band)
        best = search.closest_assignments()[0]
        judge, units = judged(search, best)
        more = judge.delays(tried)
        late = {best.channel[p]: late.get(best.channel[p], 0.0) + more[p] for p in best.places}
    late_channels = {channel: delay for channel, delay in late.items() if abs(delay) * fs > TIMELY}
    if not late_channels or judge.misfit > max(FITS, misfit / 3):
        return None
    words = [
        f"{signals.names[channel]} is {1e3 * abs(delay):.2g} ms ({abs(delay) * fs:.1f} samples) "
        f"{'late' if delay > 0 else 'early'} against the others: say it in the rig file (delay), or shift its samples"
        for channel, delay in late_channels.items()
    ]
    return search, judge, units, words


def _wrong_rate(search: Search, best: Assignment) -> str:
    """Return in words if the rig fits the records better at another sampling rate; "" if not."""
    if best.likeness > SOUND:
        return ""
    others = {factor: max(a.likeness for a in search.closest_assignments(factor)) for factor in STRETCHES}
    factor = max(others, key=lambda f: others[f])
    if others[factor] < best.likeness + BETTER:
        return ""
    rate = search.signals.fs
    return (
        f"the records fit the rig at {STRETCHES[factor]} the frequencies, a sampling rate of {factor * rate:.6g} Hz "
        f"instead of {rate:.6g} Hz: is the rate in the file, or a length in the rig file, right?"
    )


def shows_impacts(search: Search, assignment: Assignment) -> bool:
    """Return True if the records show impacts, by their incoherence with the excitation, and are long enough to."""
    return search.signals.duration >= LEAST_DURATION and search.coherence(assignment) < IMPACTS


def judged(search: Search, best: Assignment) -> tuple[Judge, ChannelUnits]:
    """Return the judge of an assignment in the units that explain it best, and these units."""
    signals, places = search.signals, best.places
    index, gains = [best.channel[i] for i in places], [best.gain[i] for i in places]
    said = [signals.quantities[channel] != UNKNOWN for channel in index]
    quantities = [search.places[i].quantity for i in places]
    impacts, factor = shows_impacts(search, best), np.ones(len(signals.names))
    factor[index] = 1 / np.array(gains)
    judge = Judge(search, best, factor)
    motion = judge.motion_over_gap() if search.kind == "base" else 0.0
    for _ in range(REFINEMENTS):
        units = decide_units(quantities, said, gains, motion, impacts)
        ratio = [f / units.factor[-1] if known else 1 / g for f, known, g in zip(units.factor, units.exists, gains)]
        factor[index] = ratio
        judge = Judge(search, best, factor)
        if all(units.exists):
            break
        # The gain to one drawn rig is rough; what the other channels say of a channel is better known, and where they
        # say little, a unit that contradicts them as little as the gain does is likelier.
        gains[:-1] = [read / r for read, r in zip(judge.gains(), ratio)]
        for k, known in enumerate(units.exists[:-1]):
            near = nearest_unit(quantities[k], said[k], units.factor[-1] / gains[k]).factor / units.factor[-1]
            if not known and 1 / CLOSE < near * gains[k] < CLOSE:
                trial = factor.copy()
                trial[index[k]] = near
                if Judge(search, best, trial).distance < judge.distance + SURE:
                    gains[k] = 1 / near
    return judge, units


class _MapWriter:
    """A map in words, with a question wherever it is not sure."""

    def __init__(
        self, search: Search, judge: Judge, units: ChannelUnits, rivals: list[CandidateAssignment], notes: list[str],
        of_sines: bool,
    ) -> None:  # fmt: skip
        self.search, self.best, self.units, self.judge, self.rivals = search, judge.assignment, units, judge, rivals
        self.names, self.notes, self.of_sines = search.signals.names, notes, of_sines
        self.contradiction = judge.contradiction()
        self.sure = SURE if judge.misfit <= FITS else SURE_OF_ANOTHER

    def written(self) -> ChannelMap:
        """Return the map."""
        signals, best = self.search.signals, self.best
        reasons = dict.fromkeys(self.names, "no place of the rig is left") | signals.unusable
        channels = dict.fromkeys(reasons, SKIP)
        wrong, misfits = np.mean([e > CONTRADICTS for e in self.contradiction.values()]), self.judge.misfit > FITS
        foreign = (bool(self.notes) and misfits) or best.likeness < LIKE or wrong >= FOREIGN
        if misfits and not self.notes:
            self.notes.append(
                f"rig “{self.search.rig.name}” misses {100 * self.judge.misfit:.0f} % of what the channels show: is it "
                "the rig of these records, was its excitation recorded, is its structure as drawn?"
            )
        why = SINES if self.of_sines and misfits else "the records are not of this rig"
        common = why if foreign else ""
        if not common and self._rival_words(best.places[-1]):
            common = "which channel is the excitation is not sure"
        for number, place in enumerate(best.places):
            known = self.units.exists[number] or not self.units.contradicts[number]  # else a number, which is no unit
            name, answer = self.names[best.channel[place]], self._place_name(place, self.units.label[number] * known)
            doubt = common or self._doubt(number, place)
            channels[name] = UNDECIDED if doubt else answer
            reasons[name] = f"{doubt}; likeliest {answer}" if doubt else self._evidence(place)
        for place, where in enumerate(self.search.places):
            if best.channel[place] < 0 and where.quantity != "displacement":
                self.notes.append(f"{channel_name(where.label, where.quantity)} of the rig has no channel")
        return ChannelMap(channels, reasons, tuple(self.notes))

    def _place_name(self, place: int, unit: str) -> str:
        """Return the name of a place in a map, with its sign and unit."""
        where = self.search.places[place]
        label = where.label.translate(_TURNED) if self.best.sign[place] < 0 else where.label
        name = channel_name(label, where.quantity)
        return f"{name} [{unit}]" if unit else name

    def _doubt(self, number: int, place: int) -> str:
        """Return in words why a channel at a place is not sure; "" if it is."""
        if not self.judge.enough:
            return (
                f"{len(self.best.places)} channels cannot contradict each other beside the unknown forces in "
                f"{len(self.search.rig.bushings)} clearances"
            )
        if self.contradiction[place] > CONTRADICTS:
            return f"the rig and the other channels miss {100 * self.contradiction[place]:.0f} % of it"
        unit, signals = self.units.label[number], self.search.signals
        if label := signals.units[self.best.channel[place]]:
            return f'its unit "{label}" is none of {self.search.places[place].quantity}: give its sensitivity as a unit'
        if self.units.contradicts[number]:
            return f"its numbers are as if they were in {unit}, which the file does not say"
        if not self.units.exists[number]:
            return f"one of its units is {unit}, which is no unit"
        if unit and not self.units.sure:
            return "nothing tells its unit"
        return self._rival_words(place)

    def _rival_words(self, place: int) -> str:
        """Return in words a rival that is not much worse and that names do not exclude; "" if there is none."""
        channel = self.best.channel[place]
        for rival in self.rivals:
            if rival.margin >= self.sure:
                break
            if channel in rival.channels and self._name_preference(rival) <= 0:
                others = [self.names[c] for c in rival.channels if c != channel]
                words = f'"{others[0]}" may be there instead' if others else "its sign is not sure"
                return f"{words} (margin {rival.margin:.1f})"
        return ""

    def _name_preference(self, rival: CandidateAssignment) -> int:
        """Return how much more the names agree with the assignment than with a rival."""
        last = len(self.search.places) - 1

        def agreement(channel: int, place: int) -> int:
            where = self.search.places[place]
            return agreement_of_name(self.names[channel], where.label, where.quantity, place == last)

        here, there = (zip(rival.channels, places) for places in (rival.places, reversed(rival.places)))
        return sum(agreement(*pair) for pair in here) - sum(agreement(*pair) for pair in there)

    def _evidence(self, place: int) -> str:
        channel = self.best.channel[place]
        margins = [rival.margin for rival in self.rivals if channel in rival.channels]
        words = f"fits within {100 * self.contradiction[place]:.1f} %, anything else is worse by {min(margins):.0f}"
        labels = self.search.signals.labels[channel], self.search.places[place].label
        said, node = (label.partition(":")[0] for label in labels)
        return words if said in ("", node) else f"{words}; the file says node {said}"
