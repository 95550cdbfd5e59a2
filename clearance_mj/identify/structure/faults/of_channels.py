"""Signs, places and units of instruments that explain the misfit of channels on an updated rig."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.optimize

from ...records.prepared import EXCITATION, PreparedRecord
from .assessment import SUSPECT_MISFIT, Assessment, Fault, channel_of, distance, predicted_spectra

__all__ = ["ChannelCorrection", "channel_corrections", "correction_faults"]

OTHER_INSTRUMENT = 0.7  # of the residual by a channel's own instrument: another one explains it only if it leaves less
UNIT_GAIN = 0.05  # from 1, within which a gain counts as 1
SNAP = 1.2  # factor within which a gain is that of a unit or a sign
EXCLUDED = 1e3  # times the residual, that stands for no explanation
MIN_GAIN = 1.0  # by which the distance must fall for a correction to be tried
UNITS = {
    "accelerometer": {1e3: "mm/s²", 1 / 9.80665: "g", 100 / 2.54: "in/s²", 1e6: "µm/s²"},
    "probe": {1e3: "mm", 1e6: "µm", 100 / 2.54: "inches", 1e5 / 2.54: "thousandths of an inch", 100.0: "cm"},
    "force": {1e-3: "kN", 1e3: "mN", 1 / 9.80665: "kgf", 1 / 4.4482216: "lbf"},
}  # What an instrument reads over the value in SI units, and the unit in which it does.


@dataclass(frozen=True)
class ChannelCorrection:
    """Samples exchanged between channels, and multiplied, so that a fault of instruments or wiring is put right."""

    channels: Mapping[int, tuple[int, float]] = field(default_factory=dict)
    """of each channel concerned, the one that holds its samples, and their factor; the excitation is the last"""

    def applied(self, records: Sequence[PreparedRecord]) -> list[PreparedRecord]:
        """Return the records as they would be."""
        corrected = []
        for r in records:
            from_where = np.arange(len(r.channels))
            from_where[list(self.channels)] = [source for source, _ in self.channels.values()]
            absent = tuple(r.channels[i] for i in np.flatnonzero(~r.present[from_where]))
            corrected.append(dataclasses.replace(r, signals=self.of([r.signals])[0], absent=absent))
        return corrected

    def of(self, measured: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return samples or spectra (n, n_channels) as they would be."""
        corrected = [m.copy() for m in measured]
        for new, m in zip(corrected, measured):
            for i, (source, factor) in self.channels.items():
                new[:, i] = factor * m[:, source]
        return corrected


def channel_corrections(assessment: Assessment) -> list[ChannelCorrection]:
    """Return corrections by which channels contradict each other less, on updated rig and rig file, best first."""
    rig, update, measured = assessment.rig, assessment.update, assessment.measured
    trusted = {name: v for name, v in update.values.items() if channel_of(name, rig) not in assessment.suspects}
    candidates: list[tuple[float, ChannelCorrection]] = []
    if not measured:
        return []
    for values in (trusted, {}):
        gains = assessment.gains(rig, values)
        now = distance(gains, measured)
        for out in _suspect_sets(assessment):
            for one in _corrections(gains, assessment, out):
                if one.channels and (corrected := distance(gains, one.of(measured))) < now - MIN_GAIN:
                    candidates.append((corrected, one))
    ranked = [one for _, one in sorted(candidates, key=lambda pair: pair[0])]
    return [one for i, one in enumerate(ranked) if one not in ranked[:i]]


def kinds_of(assessment: Assessment) -> list[str]:
    """Return the kind of instrument of every channel."""
    driven = "force" if assessment.update.records[0].kind == "force" else "accelerometer"
    return [driven if name == EXCITATION else name.split()[0] for name in assessment.update.channels]


def _suspect_sets(assessment: Assessment) -> Iterator[tuple[int, ...]]:
    """Yield channels that may be wrong together: each, two of a kind, all of a kind, those that stand out."""
    kinds = kinds_of(assessment)[:-1]
    count, forces = len(kinds) + 1, len(assessment.rig.bushings) + 1
    groups = [tuple(i for i, k in enumerate(kinds) if k == kind) for kind in dict.fromkeys(kinds)]
    pairs = [pair for group in groups for pair in itertools.combinations(group, 2)]
    sets: list[tuple[int, ...]] = [*((i,) for i in range(count)), *pairs, *groups, assessment.suspects]
    yield from (one for one in dict.fromkeys(sets) if one and count - len(one) >= forces)


def _corrections(gains: list[np.ndarray], assessment: Assessment, out: tuple[int, ...]) -> Iterator[ChannelCorrection]:
    """Yield instruments and signs, or factors, that best explain channels which the others outvote."""
    weights, predicted = predicted_spectra(gains, assessment.measured, out)
    measured, kinds = np.vstack(assessment.measured) * weights, kinds_of(assessment)
    *sensors, last = range(len(kinds))
    if len(out) > 1 and out == tuple(i for i in sensors if kinds[i] == kinds[out[0]]):  # all of a kind, one factor
        factor = np.median([_gain_of(measured[:, i], predicted[:, i] * weights[:, i]) for i in out])
        yield ChannelCorrection({i: (i, 1 / nearest_unit_gain(float(factor), kinds[i])) for i in out})
    channels: dict[int, tuple[int, float]] = {}
    for group in (*([i for i in sensors if kinds[i] == k and i in out] for k in dict.fromkeys(kinds)), [last]):
        if set(group) <= set(out):
            channels |= _assign_instruments(group, measured, weights, predicted, kinds)
    yield ChannelCorrection(channels)


def _assign_instruments(
    group: Sequence[int], measured: np.ndarray, weights: np.ndarray, predicted: np.ndarray, kinds: Sequence[str]
) -> dict[int, tuple[int, float]]:
    """Return the instrument of a group that each of its channels holds, and its factor."""
    channels: dict[int, tuple[int, float]] = {}
    alone, misfit, signs, gain = np.zeros(len(group)), *np.zeros((2, len(group), len(group))), np.ones(len(group))
    for a, i in enumerate(group):
        scaled = predicted[:, group] * weights[:, [i]]
        gain[a] = nearest_unit_gain(_gain_of(measured[:, i], scaled[:, a]), kinds[i])
        alone[a] = np.median(np.abs(measured[:, i] - gain[a] * scaled[:, a]))
        by_sign = [np.median(np.abs(measured[:, [i]] - sign * scaled), axis=0) for sign in (1, -1)]
        misfit[a], signs[a] = np.minimum(*by_sign), np.where(by_sign[1] < by_sign[0], -1.0, 1.0)
        misfit[a] = np.where(misfit[a] < OTHER_INSTRUMENT * alone[a], misfit[a], EXCLUDED * alone[a])
        misfit[a, a] = alone[a]
    for a, b in zip(*scipy.optimize.linear_sum_assignment(np.log(misfit))):
        if a != b:  # the samples of channel a are those of instrument b
            channels[group[b]] = group[a], float(signs[a, b])
        elif gain[a] != 1.0:
            channels[group[a]] = group[a], 1 / float(gain[a])
    return channels


def _gain_of(measured: np.ndarray, predicted: np.ndarray) -> float:
    """Factor between spectra: the median over the lines, some of which few channels predict badly."""
    return float(np.median((measured / predicted).real))


def nearest_unit_gain(gain: float, kind: str) -> float:
    """Return the gain of an instrument: as estimated, or that of a unit or a sign near it."""
    size, sign = abs(gain), float(np.sign(gain))
    if abs(gain - 1) < UNIT_GAIN:
        return 1.0
    known = [*UNITS.get(kind, ()), *([1.0] if sign < 0 else [])]
    near = [u for u in known if 1 / SNAP < size / u < SNAP]
    return sign * (near[0] if near else float(f"{size:.3g}"))


def correction_faults(correction: ChannelCorrection, before: Assessment, after: Assessment) -> list[Fault]:
    """One fault for each cycle of swapped channels, and for each factor."""
    names, kinds = after.update.channels, kinds_of(after)
    faults, alike, done = [], dict[tuple[str, float, bool], list[int]](), set[int]()
    for i, (source, factor) in sorted(correction.channels.items()):
        if i == source:
            alike.setdefault((kinds[i], factor, names[i] == EXCITATION), []).append(i)
        elif i not in done:
            cycle = [i]
            while (source := correction.channels[cycle[-1]][0]) != i:
                cycle.append(source)
            done.update(cycle)
            words = f"{_names_of(cycle, names)} are {'swapped' if len(cycle) == 2 else 'permuted'}"
            inverted = [correction.channels[k][0] for k in cycle if correction.channels[k][1] < 0]
            words += f" and {_names_of(inverted, names)} wired with the wrong sign" if inverted else ""
            faults.append(_fault(words, None, cycle, before, after))
    for (kind, factor, driven), group in alike.items():
        every = len(group) == kinds[:-1].count(kind) > 1
        who = f"every {kind} reads" if every else f"{_names_of(group, names)} {'read' if len(group) > 1 else 'reads'}"
        if driven:
            other = "" if after.update.probes else " (or every accelerometer the other way round)"
            who = f"the excitation{other} reads"
        channels_concerned = range(len(names)) if driven else group
        faults.append(_fault(f"{who} {_reading_words(1 / factor, kind)}", factor, channels_concerned, before, after))
    return faults


def _names_of(group: Sequence[int], names: Sequence[str]) -> str:
    """Return words such as "accelerometers 2:+Z and 5:+Z"; all are of one kind."""
    kind = names[group[0]].split()[0]
    labels = [names[i].removeprefix(f"{kind} ") for i in sorted(group)]
    return f"{kind}{'s' if len(labels) > 1 else ''} {' and '.join(filter(None, [', '.join(labels[:-1]), labels[-1]]))}"


def _reading_words(read: float, kind: str) -> str:
    """Return a reading over the true value in words."""
    unit = [name for size, name in UNITS.get(kind, {}).items() if np.isclose(size, abs(read))]
    size = f"in {unit[0]} instead of SI units" if unit else f"{abs(read):.3g} times the true value"
    return " and ".join([size] * (abs(read) != 1.0) + ["with the wrong sign"] * (read < 0))


def _fault(words: str, factor: float | None, group: Sequence[int], before: Assessment, after: Assessment) -> Fault:
    put, channels = "exchanged" if factor is None else f"times {factor:.4g}", list(group)
    was, now = (float(np.sqrt(np.mean(assessment.misfit[channels] ** 2))) for assessment in (before, after))
    if was > SUSPECT_MISFIT:
        return Fault(words, f"{put}, the misfit there falls from {was:.0f} to {now:.1f} % of the level", factor)
    far, near = (_largest_shift(assessment, channels) for assessment in (before, after))
    return Fault(words, f"{put}, gain and place come from {far:.1f} to {near:.1f} prior standard deviations", factor)


def _largest_shift(assessment: Assessment, channels: Sequence[int]) -> float:
    far = (abs(z) for name, z in assessment.shift.items() if channel_of(name, assessment.rig) in channels)
    return max(far, default=0.0)
