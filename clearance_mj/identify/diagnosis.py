"""Gross faults of a dataset, told from what its updated rig misses: the likeliest cause, in words.

The misfit of a channel is the RMS of what the updated rig misses of the quiet part, over 1 % of the channel and 5 % of
each line's level, which stand for noise and grease. A bench is suspicious where a channel's misfit is above 7 (of sound
benches: 1 to 6.3), or a parameter ends more than 4 prior standard deviations from the rig file (of sound benches: up
to 3.3). Only then hypotheses are put right, instruments first, then gaps, then the structure, and the rig is updated
anew with each. One is named if

- it lowers Σ n ln(misfit²) + Σ z² by 30 or more, a likelihood ratio of e¹⁵: n counts the independent lines
  of a channel, z are the parameters' distances from their priors, so that what priors allow is never named;
- what it puts right is then no longer suspicious: the channels in question, or most channels and the rig itself;
- no other one lowers that sum as far.

Gaps show in the loud part: the restoring force of each bushing bends where the shaft meets its walls.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import RecordError
from ..io.dataset import Dataset, Record
from ..rig import Rig
from .forces import RestoringForce, restoring_force
from .misbuilt import Change, changes, longer
from .misread import EXPLAINED, Correction, corrections, gain_of, snapped, spectra, words_of
from .quiet import Piece
from .quiet_update import QuietError, RigUpdate, update_rig
from .trial import Fault, Trial, trial_of, weight, with_records, with_rig

__all__ = ["Diagnosis", "Fault", "diagnose", "diagnosed_update"]

NAMED = 30.0
"""by which a hypothesis must lower the cost"""
BESIDE = 4
"""faults that may stand beside each other"""
TRIED = 4
"""changes of the structure with which the rig is updated"""
GAPS = (0.6, 2.1)
"""gap of the loud part over the one told, beyond which it is a fault; of sound benches 0.73 to 1.5"""
BENT = 0.9
"""of the square of what a straight line leaves of a restoring force, below which it bends"""
REFINED = 3
"""lengths beside that of the grid"""
PEAKED = 9.0
"""kurtosis of a motion, above which it is in contact too seldom to tell the wall, as after hits"""
HIGH = 440.0
"""Hz, up to which restoring forces are taken"""
STRIDE = 8
"""samples of a restoring force, of which one counts"""
FACTOR = 2.0
"""from which on a probe reads in other units, if only accelerometers say where the shaft is"""
WIDER = (1.0, 2.0, 4.0, 8.0, 16.0)
"""times the gap, with which a quiet piece is looked for if there is none"""
NARROWER = (1.0, 0.5, 0.25, 0.1)
"""times the gap, up to which the rig may be linear where nothing else explains what it misses without probes"""
LINEAR = 1.5
"""times the least misfit, below which the rig is linear"""


Found = tuple[list[Fault], Trial] | None
"""faults in words, and the dataset with them put right"""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What is grossly wrong with a dataset."""

    faults: tuple[Fault, ...]
    """the likeliest causes, in the order in which they were put right; none of a sound bench"""
    unexplained: str
    """what no hypothesis explains, in words; "" of a sound bench"""
    update: RigUpdate | None
    """of the dataset with the faults put right; None if it has no quiet part whatever is put right"""

    @property
    def words(self) -> tuple[str, ...]:
        """One sentence for each fault, and one on what none of them explains; none of a sound bench."""
        return (*map(str, self.faults), *filter(None, [self.unexplained]))


def diagnose(dataset: Dataset, update: RigUpdate | None = None) -> Diagnosis:
    """Find instruments, units, gaps or dimensions that are grossly wrong, where records do not fit their rig.

    Parameters
    ----------
    dataset : Dataset
        Rig and records; records with role "validate" are never opened.
    update : RigUpdate, optional
        What `update_rig` found of it, if that is there already.

    Returns
    -------
    Diagnosis
        Without faults where the updated rig misses no more than noise and grease explain.

    Raises
    ------
    RecordError
        If a channel cannot be used.
    """
    dataset = dataclasses.replace(dataset, records=dataset.to_identify())
    faults: list[Fault] = []
    try:
        trial: Trial | None = Trial(dataset, update or update_rig(dataset))
    except QuietError:
        faults, trial = _quiet(dataset)
    if trial is None:
        return Diagnosis((), "no record has a quiet part, whatever is assumed of probes and gaps", None)
    for _ in range(BESIDE):
        found = _next_fault(trial)
        if found is None:
            break
        faults += found[0]
        trial = found[1]
    missed = trial.missed()
    unexplained = f"no single cause explains what the updated rig misses: {missed}" if missed else ""
    return Diagnosis(tuple(faults), unexplained, trial.update)


def diagnosed_update(dataset: Dataset) -> tuple[RigUpdate, Diagnosis]:
    """Update a rig to its records and diagnose what it misses.

    Parameters
    ----------
    dataset : Dataset
        Rig and records; records with role "validate" are never opened.

    Returns
    -------
    update : RigUpdate
        Of the dataset as it is.
    diagnosis : Diagnosis
        What is grossly wrong with it.

    Raises
    ------
    RecordError
        If no record has a quiet piece, with the likeliest cause, or a channel cannot be used.
    """
    try:
        update = update_rig(dataset)
    except QuietError as error:
        faults = diagnose(dataset).faults
        if not faults:
            raise
        raise QuietError(f"{error}; likeliest cause: {'; '.join(map(str, faults))}") from None
    return update, diagnose(dataset, update)


def _next_fault(trial: Trial) -> Found:
    """The likeliest fault, in words, and the dataset with it put right."""
    misread = _misread(trial) if trial.suspects else None
    if misread and not misread[1].missed():
        return misread
    gap = _gap_fault(trial, trial.dataset.rig)
    if trial.sound or (gap and not gap[1].missed()):
        return misread or gap
    found = [one for one in (misread, gap, _misbuilt(trial), _mislabelled(trial)) if one]
    return min(found, key=lambda one: one[1].cost, default=None)


def _misread(trial: Trial) -> Found:
    """Signs, swaps or units of instruments."""
    good: list[tuple[Correction, Trial]] = []
    for correction in corrections(trial):
        after = trial_of(correction.applied(trial.dataset))
        if after is None or after.cost > trial.cost - NAMED or set(correction.channels) & set(after.suspects):
            continue
        if correction.excitation == 1.0 or after.sound:
            good.append((correction, after))
        if good and not after.missed():
            break
    if not good:
        return None
    correction, after = min(good, key=lambda pair: pair[1].cost)
    return words_of(correction, trial, after), after


def _misbuilt(trial: Trial) -> Found:
    """Dimensions, material or masses of the rig file."""
    found: list[tuple[Change, Trial]] = []
    for change in changes(trial)[:TRIED]:
        after = trial_of(with_rig(trial.dataset, change.rig))
        if after and change.number[2] == "length":
            change, after = _finer(trial, change, after)
        if after:
            found.append((change, after))
    good = [(c, after) for c, after in found if after.sound and after.cost < trial.cost - NAMED]
    if not good:
        return None
    change, after = min(good, key=lambda pair: pair[1].cost)
    return [change.fault(trial, after)], after


def _finer(trial: Trial, change: Change, after: Trial) -> tuple[Change, Trial]:
    """A length between the grid's: what the modulus takes up, the length does by its inverse fourth power."""
    rig = trial.dataset.rig
    for _ in range(REFINED):
        beam, told = after.update.rig.beam, change.rig.beam
        assert rig.beam and beam and told
        factor = told.length / rig.beam.length * (told.young_modulus / beam.young_modulus) ** 0.25
        better = longer(rig, factor, change.kind)
        finer = trial_of(with_rig(trial.dataset, better)) if better else None
        if better is None or finer is None or finer.cost > after.cost:
            break
        change, after = dataclasses.replace(change, rig=better), finer
    return change, after


def _mislabelled(trial: Trial) -> Found:
    """A record that does not fit the rig of the others."""
    pieces = trial.update.misfit
    if len(pieces) < 2:
        return None
    worst = max(
        pieces, key=lambda m: float(np.sqrt(np.mean(np.abs((m.fitted - m.measured) * weight(m.measured)) ** 2)))
    )
    rest = dataclasses.replace(trial.dataset, records=tuple(r for r in trial.dataset.records if r.name != worst.record))
    after = trial_of(rest)
    if after is None or after.missed():
        return None
    far = float(np.sqrt(np.mean(trial.misfit**2)))
    now = float(np.sqrt(np.mean(after.misfit**2)))
    words = f'record "{worst.record}" is not of the rig, the level or the set-up that the others are of'
    return [Fault(words, f"without it, the misfit falls from {far:.1f} to {now:.1f} times {EXPLAINED}")], after


# Gaps.


def _gap_fault(trial: Trial, file: Rig) -> Found:
    """Gaps far from those at which the restoring force bends."""
    update = trial.update
    if not update.probes:
        return None if trial.sound else _linear_gap(trial.dataset, NARROWER, trial)
    told = np.array([b.gap for b in file.bushings])
    bends = np.min([_bends(r, update.rig) for r in trial.dataset.records], axis=0)
    wrong = [j for j, bend in enumerate(bends) if not GAPS[0] * told[j] <= bend <= GAPS[1] * told[j] and bend < np.inf]
    if not wrong:
        return None
    factors = [bends[j] / told[j] if j in wrong else 1.0 for j in range(told.size)]
    after = trial_of(with_rig(trial.dataset, _wider(file, factors)))
    if after is None or not after.sound:
        return None
    faults = []
    for j in wrong:
        small = "small" if bends[j] > told[j] else "large"
        words = f"bushings[{j}].gap is told {max(bends[j] / told[j], told[j] / bends[j]):.1f} times too {small}"
        where = f"its restoring force bends at about {1e3 * bends[j]:.2g} mm, the rig file says {1e3 * told[j]:.3g} mm"
        faults.append(Fault(words, where, float(bends[j] / told[j])))
    return faults, after


def _linear_gap(dataset: Dataset, factors: Sequence[float], before: Trial | None = None) -> Found:
    """Without probes: the part of the gaps, or the multiple, up to which the rig is linear."""
    tried = {f: found for f in factors if (found := trial_of(_all_wider(dataset, f)))}
    if not tried:
        return None
    misfit = {f: float(np.sqrt(np.mean(found.misfit**2))) for f, found in tried.items()}
    factor = max(f for f, missed in misfit.items() if missed < LINEAR * min(misfit.values()))
    after = tried[factor]
    if not after.sound or (before and after.cost > before.cost - NAMED):
        return None
    small = "small" if factor > 1 else "large"
    words = f"the gaps are told about {max(factor, 1 / factor):.2g} times too {small}, or one of them is"
    where = (
        f"the rig is linear while its shaft moves by {factor:g} of the gaps told, missed by {misfit[factor]:.1f} times"
    )
    return [Fault(words, f"{where} {EXPLAINED}", factor)], after


def _wider(rig: Rig, factors: Sequence[float]) -> Rig:
    """The rig with the gap and offset of each bushing times a factor."""
    bushings = [
        dataclasses.replace(b, gap=float(f * b.gap), offset=float(f * b.offset)) for b, f in zip(rig.bushings, factors)
    ]
    return rig.replace(bushings=tuple(bushings))


def _all_wider(dataset: Dataset, factor: float) -> Dataset:
    return with_rig(dataset, _wider(dataset.rig, [factor] * len(dataset.rig.bushings)))


def _bends(record: Record, rig: Rig) -> np.ndarray:
    """(n_bushings,) displacement at which the restoring force bends, m; infinite where it does not."""
    if rig.probe_labels != record.rig.probe_labels:  # a sensor has moved out of its bushing, or into one
        rig = rig.replace(sensors=record.rig.sensors, bushings=record.rig.bushings)
    try:
        force = restoring_force(dataclasses.replace(record, rig=rig), min(HIGH, 0.4 * record.fs))
    except RecordError:  # too short, or too few sensors
        return np.full(len(rig.bushings), np.inf)
    return np.array([_bend(force, j) for j in range(len(rig.bushings))])


def _bend(force: RestoringForce, bushing: int) -> float:
    """Wall at which a spring leaves least of the force, beside a spring, a dashpot and friction of the grease."""
    x, v, f = (part[bushing, force.valid][::STRIDE] for part in (force.displacement, force.velocity, force.force))
    if np.mean((x - x.mean()) ** 4) > PEAKED * np.var(x) ** 2:
        return np.inf
    grease = np.column_stack((x, v, np.clip(v / np.std(v), -0.1, 0.1)))
    most = float(np.abs(x).max())
    walls = most * np.geomspace(0.03, 0.95, 30)
    left = [_left(np.column_stack((grease, np.sign(x) * np.maximum(np.abs(x) - w, 0.0))), f) for w in walls]
    return float(walls[np.argmin(left)]) if min(left) < BENT * _left(grease, f) else np.inf


def _left(columns: np.ndarray, target: np.ndarray) -> float:
    columns = columns / np.linalg.norm(columns, axis=0)
    return float(np.sum((target - columns @ np.linalg.lstsq(columns, target)[0]) ** 2))


# Datasets without a quiet part.


def _quiet(dataset: Dataset) -> tuple[list[Fault], Trial | None]:
    """Probes put right, and gaps, so that a dataset has a quiet part: accelerometers alone say where it is."""
    if any(record.response().displacement is None for record in dataset.records):
        return _linear_gap(dataset, WIDER) or ([], None)
    for wider in WIDER:
        whole = _all_wider(dataset, wider)
        blind = trial_of(with_records(whole, _without_probes))
        if blind is None:
            continue
        correction = _probes(whole, blind)
        if wider == 1.0 and not correction.channels:
            continue
        after = trial_of(correction.applied(whole))
        if after is None:
            continue
        faults = words_of(correction, None, after)
        if wider > 1.0:
            found = _gap_fault(after, dataset.rig)
            if found is None:  # gaps are as told: it was loud from the start
                break
            faults, after = faults + found[0], found[1]
        return faults, after
    return [], None


def _without_probes(record: Record) -> Record:
    return dataclasses.replace(record, channels=tuple(c for c in record.channels if c.quantity != "displacement"))


def _probes(dataset: Dataset, blind: Trial) -> Correction:
    """Factors of the probes, by the displacements of a rig that was updated without them."""
    rig, update = dataset.rig, blind.update
    values = dict(zip(update.estimates.names, update.estimates.value.tolist()))
    quiet = {m.record: m.duration for m in update.misfit}
    pieces = [Piece(r.name, r.response(), round(quiet[r.name] * r.fs)) for r in dataset.records if r.name in quiet]
    measured = np.hstack([p.measured for p in pieces])
    predicted, own = spectra(rig, pieces, True, values), len(rig.sensors)
    found = {}
    for i in range(own, len(measured)):
        read = snapped(gain_of(measured[i], predicted[i]), "probe")
        if not 1 / FACTOR < read < FACTOR:
            found[i] = i, 1 / read
    return Correction(found)
