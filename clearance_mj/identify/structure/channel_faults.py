"""Signs, places and units of instruments that explain channels which an updated rig misses."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.optimize

from ...io.channels import Channel
from ...io.dataset import Dataset, Record
from .hypothesis import MISFIT, Fault, Trial, channel_of, distance, projected, with_records
from .updating import EXCITATION

__all__ = ["Correction", "corrections", "words_of"]

ALONE = 0.7
"""of what is left of a channel by its own instrument at most: another's explains it only if it leaves less"""
LIKE_ONE = 0.05
"""from 1, within which a gain is none"""
SNAP = 1.2
"""factor within which a gain is that of a unit or a sign"""
LARGE = 1e3
"""times what is left, that stands for no explanation"""
BETTER = 1.0
"""by which the distance must fall for a correction to be tried"""
UNITS = {
    "accelerometer": {1e3: "mm/s²", 1 / 9.80665: "g", 100 / 2.54: "in/s²", 1e6: "µm/s²"},
    "probe": {1e3: "mm", 1e6: "µm", 100 / 2.54: "inches", 1e5 / 2.54: "thousandths of an inch", 100.0: "cm"},
    "force": {1e-3: "kN", 1e3: "mN", 1 / 9.80665: "kgf", 1 / 4.4482216: "lbf"},
}
"""what an instrument reads over the value in SI units, and the unit in which it does"""
Key = tuple[int, str, str]


@dataclass(frozen=True)
class Correction:
    """Readings put right."""

    channels: Mapping[int, tuple[int, float]] = field(default_factory=dict)
    """of each channel concerned, the one that holds its samples, and their factor; the excitation is the last"""

    def applied(self, dataset: Dataset) -> Dataset:
        """The dataset as it would be."""
        return with_records(dataset, self._record)

    def of(self, measured: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Spectra (n_f, n_channels) as they would be."""
        corrected = [m.copy() for m in measured]
        for new, m in zip(corrected, measured):
            for i, (source, factor) in self.channels.items():
                new[:, i] = factor * m[:, source]
        return corrected

    def _record(self, record: Record) -> Record:
        rig, kind = record.rig, record.excitation_kind
        held = {_key(c.label, c.quantity): c for c in record.channels}
        keys = [_key(label, "acceleration") for label in rig.sensor_labels]
        keys += [k for label in rig.probe_labels if (k := _key(label, "displacement")) in held]
        keys.append(_key(rig.shaker.label(kind), "acceleration" if kind == "base" else "force"))
        new: dict[Key, Channel] = {}
        for i, (source, factor) in self.channels.items():
            here, there = held[keys[i]], held[keys[source]]
            turned = -1.0 if here.direction[0] != there.direction[0] else 1.0
            new[keys[i]] = dataclasses.replace(here, value=turned * factor * there.value)
        return dataclasses.replace(record, channels=tuple((held | new).values()))


def _key(label: str, quantity: str) -> Key:
    """Node, axis and quantity."""
    node, _, direction = label.partition(":")
    return int(node), direction.lstrip("+-"), quantity


def corrections(trial: Trial) -> list[Correction]:
    """What makes the sensors contradict each other less, on the updated rig and on that of the rig file, best first."""
    rig, update, measured = trial.dataset.rig, trial.update, trial.measured
    kept = {name: v for name, v in update.values.items() if channel_of(name, rig) not in trial.suspects}
    found: list[tuple[float, Correction]] = []
    for given in (kept, {}):
        gains = trial.gains(rig, given)
        told = distance(gains, measured)
        for out in _outvoted(trial):
            for one in _explained(gains, trial, out):
                if one.channels and (far := distance(gains, one.of(measured))) < told - BETTER:
                    found.append((far, one))
    unique: list[Correction] = []
    for _, one in sorted(found, key=lambda pair: pair[0]):
        if one not in unique:
            unique.append(one)
    return unique


def kinds_of(trial: Trial) -> list[str]:
    """Of every channel, what measures it."""
    driven = "force" if trial.dataset.records[0].excitation_kind == "force" else "accelerometer"
    return [driven if name == EXCITATION else name.split()[0] for name in trial.update.channels]


def _outvoted(trial: Trial) -> Iterator[tuple[int, ...]]:
    """Channels that may be wrong together: each, two of a kind, all of a kind, those that stand out."""
    kinds = kinds_of(trial)[:-1]
    count, forces = len(kinds) + 1, len(trial.dataset.rig.bushings) + 1
    groups = [tuple(i for i, k in enumerate(kinds) if k == kind) for kind in dict.fromkeys(kinds)]
    pairs = [pair for group in groups for pair in itertools.combinations(group, 2)]
    sets: list[tuple[int, ...]] = [*((i,) for i in range(count)), *pairs, *groups, trial.suspects]
    yield from (one for one in dict.fromkeys(sets) if one and count - len(one) >= forces)


def _explained(gains: list[np.ndarray], trial: Trial, out: tuple[int, ...]) -> Iterator[Correction]:
    """Of channels that the others outvote, instruments and signs, or factors, that explain them best."""
    weights, predicted = projected(gains, trial.measured, out)
    measured, kinds = np.vstack(trial.measured) * weights, kinds_of(trial)
    *own, last = range(len(kinds))
    if len(out) > 1 and out == tuple(i for i in own if kinds[i] == kinds[out[0]]):  # all of a kind, one factor
        read = np.median([_gain_of(measured[:, i], predicted[:, i] * weights[:, i]) for i in out])
        yield Correction({i: (i, 1 / snapped(float(read), kinds[i])) for i in out})
    found: dict[int, tuple[int, float]] = {}
    for group in (*([i for i in own if kinds[i] == k and i in out] for k in dict.fromkeys(kinds)), [last]):
        if set(group) <= set(out):
            found |= _assigned(group, measured, weights, predicted, kinds)
    yield Correction(found)


def _assigned(
    group: Sequence[int], measured: np.ndarray, weights: np.ndarray, predicted: np.ndarray, kinds: Sequence[str]
) -> dict[int, tuple[int, float]]:
    """Which instrument of a group each of its channels holds, and with what factor."""
    found: dict[int, tuple[int, float]] = {}
    alone, left, signs, read = np.zeros(len(group)), *np.zeros((2, len(group), len(group))), np.ones(len(group))
    for a, i in enumerate(group):
        here = predicted[:, group] * weights[:, [i]]
        read[a] = snapped(_gain_of(measured[:, i], here[:, a]), kinds[i])
        alone[a] = np.median(np.abs(measured[:, i] - read[a] * here[:, a]))
        turned = [np.median(np.abs(measured[:, [i]] - sign * here), axis=0) for sign in (1, -1)]
        left[a], signs[a] = np.minimum(*turned), np.where(turned[1] < turned[0], -1.0, 1.0)
        left[a] = np.where(left[a] < ALONE * alone[a], left[a], LARGE * alone[a])
        left[a, a] = alone[a]
    for a, b in zip(*scipy.optimize.linear_sum_assignment(np.log(left))):
        if a != b:  # the samples of channel a are those of instrument b
            found[group[b]] = group[a], float(signs[a, b])
        elif read[a] != 1.0:
            found[group[a]] = group[a], 1 / float(read[a])
    return found


def _gain_of(measured: np.ndarray, predicted: np.ndarray) -> float:
    """Factor between spectra: the median over the lines, some of which few channels predict badly."""
    return float(np.median((measured / predicted).real))


def snapped(gain: float, kind: str) -> float:
    """What an instrument reads: a gain as found, or that of a unit or a sign near it."""
    size, sign = abs(gain), float(np.sign(gain))
    if abs(gain - 1) < LIKE_ONE:
        return 1.0
    known = [*UNITS[kind], *([1.0] if sign < 0 else [])]
    near = [u for u in known if 1 / SNAP < size / u < SNAP]
    return sign * (near[0] if near else float(f"{size:.3g}"))


def words_of(correction: Correction, before: Trial, after: Trial) -> list[Fault]:
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
            words = f"{_named(cycle, names)} are {'swapped' if len(cycle) == 2 else 'permuted'}"
            turned = [correction.channels[k][0] for k in cycle if correction.channels[k][1] < 0]
            words += f" and {_named(turned, names)} wired with the wrong sign" if turned else ""
            faults.append(_fault(words, None, cycle, before, after))
    for (kind, factor, driven), group in alike.items():
        every = len(group) == kinds[:-1].count(kind) > 1
        who = f"every {kind} reads" if every else f"{_named(group, names)} {'read' if len(group) > 1 else 'reads'}"
        if driven:
            other = "" if after.update.probes else " (or every accelerometer the other way round)"
            who = f"the excitation{other} reads"
        missed = range(len(names)) if driven else group
        faults.append(_fault(f"{who} {_read(1 / factor, kind)}", factor, missed, before, after))
    return faults


def _named(group: Sequence[int], names: Sequence[str]) -> str:
    """Such as "accelerometers 2:+Z and 5:+Z"; all are of one kind."""
    kind = names[group[0]].split()[0]
    labels = [names[i].removeprefix(f"{kind} ") for i in sorted(group)]
    return f"{kind}{'s' if len(labels) > 1 else ''} {' and '.join(filter(None, [', '.join(labels[:-1]), labels[-1]]))}"


def _read(read: float, kind: str) -> str:
    """In words, what is read over the true value."""
    unit = [name for size, name in UNITS[kind].items() if np.isclose(size, abs(read))]
    size = f"in {unit[0]} instead of SI units" if unit else f"{abs(read):.3g} times the true value"
    return " and ".join([size] * (abs(read) != 1.0) + ["with the wrong sign"] * (read < 0))


def _fault(words: str, factor: float | None, group: Sequence[int], before: Trial, after: Trial) -> Fault:
    put, channels = "exchanged" if factor is None else f"times {factor:.4g}", list(group)
    was, now = (float(np.sqrt(np.mean(trial.misfit[channels] ** 2))) for trial in (before, after))
    if was > MISFIT:
        return Fault(words, f"{put}, the misfit there falls from {was:.0f} to {now:.1f} % of the level", factor)
    far, near = (_farthest(trial, channels) for trial in (before, after))
    return Fault(words, f"{put}, gain and place come from {far:.1f} to {near:.1f} prior standard deviations", factor)


def _farthest(trial: Trial, channels: Sequence[int]) -> float:
    far = (abs(z) for name, z in trial.far.items() if channel_of(name, trial.dataset.rig) in channels)
    return max(far, default=0.0)
