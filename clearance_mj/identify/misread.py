"""Signs, places and units of instruments that explain channels which an updated rig misses."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.optimize

from ..io.channels import Channel
from ..io.dataset import Dataset, Record
from ..rig import Rig
from .priors import rig_with
from .quiet import Piece, motion, quiet_pieces
from .quiet_update import linear_reading
from .trial import MISFIT, Fault, Trial, channel_of, weight, with_records

__all__ = ["Correction", "corrections", "gain_of", "words_of"]

ALONE = 0.7
"""of what is left of a channel by its own instrument at most: another's explains it only if it leaves less"""
LIKE_ONE = 0.05
"""from 1, within which a gain is none"""
SNAP = 1.2
"""factor within which a gain is that of a unit or a sign"""
LARGE = 1e3
"""times what is left, that stands for no explanation"""
COMMON = 1.5
"""factor within which gains of many channels are the same"""
UNITS = {
    "accelerometer": {1e3: "mm/s²", 1 / 9.80665: "g", 100 / 2.54: "in/s²", 1e6: "µm/s²"},
    "probe": {1e3: "mm", 1e6: "µm", 100 / 2.54: "inches", 1e5 / 2.54: "thousandths of an inch", 100.0: "cm"},
    "force": {1e-3: "kN", 1e3: "mN", 1 / 9.80665: "kgf", 1 / 4.4482216: "lbf"},
}
"""what an instrument reads over the value in SI units, and the unit in which it does"""
EXPLAINED = "what noise and grease explain"
Key = tuple[int, str, str]


@dataclass(frozen=True)
class Correction:
    """Readings put right."""

    channels: Mapping[int, tuple[int, float]] = field(default_factory=dict)
    """of each channel concerned, the one that holds its samples, and their factor"""
    excitation: float = 1.0
    """its factor"""

    def applied(self, dataset: Dataset) -> Dataset:
        """The dataset as it would be."""
        rig = dataset.rig
        keys = [_key(label, "acceleration") for label in rig.sensor_labels]
        keys += [_key(label, "displacement") for label in rig.probe_labels]
        return with_records(dataset, lambda record: self._record(record, keys))

    def _record(self, record: Record, keys: Sequence[Key]) -> Record:
        held = {_key(c.label, c.quantity): c for c in record.channels}
        new: dict[Key, Channel] = {}
        for i, (source, factor) in self.channels.items():
            here, there = held[keys[i]], held[keys[source]]
            turned = -1.0 if here.direction[0] != there.direction[0] else 1.0
            new[keys[i]] = dataclasses.replace(here, value=turned * factor * there.value)
        if self.excitation != 1.0:
            kind = record.excitation_kind
            key = _key(record.rig.shaker.label(kind), "acceleration" if kind == "base" else "force")
            new[key] = dataclasses.replace(held[key], value=self.excitation * held[key].value)
        return dataclasses.replace(record, channels=tuple((held | new).values()))


def _key(label: str, quantity: str) -> Key:
    """Node, axis and quantity."""
    node, _, direction = label.partition(":")
    return int(node), direction.lstrip("+-"), quantity


def corrections(trial: Trial) -> list[Correction]:
    """What would explain the suspects, by the spectra of the updated rig and by those of the rig file, units first."""
    rig, update = trial.dataset.rig, trial.update
    values = dict(zip(update.estimates.names, update.estimates.value.tolist()))
    kept = {name: v for name, v in values.items() if channel_of(name, rig) not in trial.suspects}
    reading = linear_reading(rig, rig_with(rig, values), update.probes, values)
    pieces = quiet_pieces(trial.dataset.records, reading)
    measured = np.hstack([p.measured for p in pieces])
    weights = np.hstack([weight(p.measured) for p in pieces])
    found: list[Correction] = []
    for given in (kept, {p.name: p.start for p in update.estimates.parameters}):
        predicted = spectra(rig, pieces, update.probes, given)
        for one in (*_common(measured, predicted, weights, trial), _assigned(measured, predicted, weights, trial)):
            if one != Correction() and one not in found:
                found.append(one)
    return found


def spectra(rig: Rig, pieces: Sequence[Piece], probes: bool, values: Mapping[str, float]) -> np.ndarray:
    """(n_channels, n_f) of all pieces side by side, of the rig with other values of its open parameters."""
    reading = linear_reading(rig, rig_with(rig, values), probes, dict(values))
    return np.hstack([p.predicted(reading, motion(reading, p.kind, p.omega)) for p in pieces])


def gain_of(measured: np.ndarray, predicted: np.ndarray) -> float:
    """Factor between spectra, by least squares of the real number."""
    return float(np.vdot(predicted, measured).real / np.vdot(predicted, predicted).real)


def _common(measured: np.ndarray, predicted: np.ndarray, weights: np.ndarray, trial: Trial) -> list[Correction]:
    """One factor of all accelerometers, of all probes, or of all channels, which then is the excitation's."""
    gains = np.array([gain_of(m * w, y * w) for m, y, w in zip(measured, predicted, weights)])
    own, count = len(trial.dataset.rig.sensors), len(gains)
    driven = driven_by(trial)
    found = []
    for first, last, kind in ((0, count, driven), (0, own, "accelerometer"), (own, count, "probe")):
        group = gains[first:last]
        middle = float(np.median(group)) if last - first > 1 else 1.0
        if np.any(group / middle < 1 / COMMON) or np.any(group / middle > COMMON):
            continue
        whole = (first, last) == (0, count) and kind == driven
        read = snapped(1 / middle if whole else middle, kind)
        if read != 1.0:
            found.append(
                Correction(excitation=1 / read) if whole else Correction({i: (i, 1 / read) for i in range(first, last)})
            )
    return found


def driven_by(trial: Trial) -> str:
    """What measures the excitation."""
    return "force" if trial.dataset.records[0].excitation_kind == "force" else "accelerometer"


def snapped(gain: float, kind: str) -> float:
    """What an instrument reads: a gain as found, or that of a unit or a sign near it."""
    size, sign = abs(gain), float(np.sign(gain))
    if abs(gain - 1) < LIKE_ONE:
        return 1.0
    known = [*UNITS[kind], *([1.0] if sign < 0 else [])]
    near = [u for u in known if 1 / SNAP < size / u < SNAP]
    return sign * (near[0] if near else float(f"{size:.3g}"))


def _assigned(measured: np.ndarray, predicted: np.ndarray, weights: np.ndarray, trial: Trial) -> Correction:
    """Of each suspect the instrument and the sign, or the factor, that explain it best."""
    own = len(trial.dataset.rig.sensors)
    found: dict[int, tuple[int, float]] = {}
    for kind, low, high in (("accelerometer", 0, own), ("probe", own, len(measured))):
        group = np.array([i for i in trial.suspects if low <= i < high], dtype=int)
        m, w, y = measured[group], weights[group], predicted[group]
        gains = np.array([snapped(gain_of(a * b, c * b), kind) for a, b, c in zip(m, w, y)])
        # (n, n) what is left of each channel by each instrument, right way round and turned.
        turned = np.array([np.linalg.norm((m - s * y[:, None]) * w, axis=2).T for s in (1, -1)])
        left, signs = turned.min(axis=0), np.where(turned[1] < turned[0], -1.0, 1.0)
        alone = np.linalg.norm((m - gains[:, None] * y) * w, axis=1)
        left = np.where(left < ALONE * alone[:, None], left, LARGE * alone[:, None])
        left[range(group.size), range(group.size)] = alone
        for a, b in zip(*scipy.optimize.linear_sum_assignment(np.log(left))):
            if a != b:  # the samples of channel a are those of instrument b
                found[int(group[b])] = int(group[a]), float(signs[a, b])
            elif gains[a] != 1.0:
                found[int(group[a])] = int(group[a]), 1 / float(gains[a])
    return Correction(found)


def words_of(correction: Correction, before: Trial | None, after: Trial) -> list[Fault]:
    """One fault for each cycle of swapped channels, and for each factor."""
    names, own = after.update.channels, len(after.dataset.rig.sensors)
    if correction.excitation != 1.0:
        who = "the excitation" if len(names) > own else "the excitation (or every accelerometer the other way round)"
        words = f"{who} reads {_read(1 / correction.excitation, driven_by(after))}"
        return [_fault(words, correction.excitation, range(len(names)), before, after)]
    faults, alike, done = [], dict[tuple[str, float], list[int]](), set[int]()
    for i, (source, factor) in sorted(correction.channels.items()):
        if i == source:
            alike.setdefault(("probe" if i >= own else "accelerometer", factor), []).append(i)
        elif i not in done:
            cycle = [i]
            while (source := correction.channels[cycle[-1]][0]) != i:
                cycle.append(source)
            done.update(cycle)
            words = f"{_named(cycle, names)} are {'swapped' if len(cycle) == 2 else 'permuted'}"
            turned = [correction.channels[k][0] for k in cycle if correction.channels[k][1] < 0]
            words += f" and {_named(turned, names)} wired with the wrong sign" if turned else ""
            faults.append(_fault(words, None, cycle, before, after))
    for (kind, factor), group in alike.items():
        every = len(group) == (len(names) - own if kind == "probe" else own) > 1
        who = f"every {kind} reads" if every else f"{_named(group, names)} {'read' if len(group) > 1 else 'reads'}"
        faults.append(_fault(f"{who} {_read(1 / factor, kind)}", factor, group, before, after))
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


def _fault(words: str, factor: float | None, group: Sequence[int], before: Trial | None, after: Trial) -> Fault:
    put, channels = "exchanged" if factor is None else f"times {factor:.4g}", list(group)
    now = float(np.sqrt(np.mean(after.misfit[channels] ** 2)))
    if before is None:
        quiet = max(m.duration for m in after.update.misfit)
        return Fault(
            words, f"{put}, records are quiet for {quiet:.1f} s and missed by {now:.1f} times {EXPLAINED}", factor
        )
    was = float(np.sqrt(np.mean(before.misfit[channels] ** 2)))
    if was > MISFIT:
        return Fault(words, f"{put}, the misfit there falls from {was:.1f} to {now:.1f} times {EXPLAINED}", factor)
    far, near = (_farthest(trial, channels) for trial in (before, after))
    return Fault(words, f"{put}, gain and place come from {far:.1f} to {near:.1f} prior standard deviations", factor)


def _farthest(trial: Trial, channels: Sequence[int]) -> float:
    return max(abs(z) for name, z in trial.far.items() if channel_of(name, trial.dataset.rig) in channels)
