"""Gross faults of a dataset, told from what its updated rig misses: the likeliest cause, in words.

The misfit of a channel is what the updated rig misses of it under the forces in the clearances that meet all sensors
best, in % of its level. A bench is suspicious where a channel's misfit is above 4 (of sound benches: 0.6 to 1.5), or a
parameter ends more than 4 prior standard deviations from the rig file (of sound benches: up to 2.1). Only then
hypotheses are put right, instruments first, then the structure, and the rig is updated anew with those by which the
sensors contradict each other least. One is named if

- it lowers Σ n ln(1 + misfit²) + Σ z² by 30 or more, a likelihood ratio of e¹⁵: n counts the independent lines
  of a channel, z are the parameters' distances from their priors, so that what priors allow is never named;
- what it puts right is then no longer suspicious: the channels in question, or most channels and the rig itself;
- no other one lowers that sum as far.

The restoring force of each bushing bends where the shaft meets its walls: gaps told otherwise are named.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from ...core.errors import RecordError
from ...io.dataset import Dataset, Record
from ..forces.restoring import RestoringForce, restoring_force
from .channel_faults import Correction, corrections, words_of
from .hypothesis import Fault, Trial, trial_of, with_rig
from .rig_faults import Change, changes, longer
from .timing_faults import likeliest
from .updating import RigUpdate, update_rig

__all__ = ["Diagnosis", "Fault", "diagnose"]

NAMED = 30.0
"""by which a hypothesis must lower the cost"""
BESIDE = 4
"""faults that may stand beside each other"""
TRIED = 4
"""corrections, or changes of the structure, with which the rig is updated"""
GAPS = (0.6, 2.1)
"""gap found over the one told, beyond which it is a fault; of sound benches 0.73 to 1.9"""
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
SLOWEST = 4.0
"""Hz: without probes, slower motion is not known"""

Found = tuple[list[Fault], Trial] | None
"""faults in words, and the dataset with them put right"""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What is grossly wrong with a dataset."""

    faults: tuple[Fault, ...]
    """the likeliest causes, in the order in which they were put right, then gaps; none of a sound bench"""
    unexplained: str
    """what no hypothesis explains, in words; "" of a sound bench"""
    update: RigUpdate
    """with instruments and structure put right"""

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
        Without faults where the updated rig misses no more than noise and priors explain.

    Raises
    ------
    RecordError
        If a channel cannot be used.
    """
    dataset = dataclasses.replace(dataset, records=dataset.to_identify())
    trial, faults = Trial(dataset, update or update_rig(dataset)), list[Fault]()
    for _ in range(BESIDE):
        found = _next_fault(trial)
        if found is None:
            break
        faults += found[0]
        trial = found[1]
    if trial.sound:
        faults += _gap_faults(trial)
    missed = trial.missed()
    unexplained = f"no single cause explains what the updated rig misses: {missed}" if missed else ""
    unexplained += f"; likeliest: {cause}" if missed and (cause := likeliest(trial)) else ""
    return Diagnosis(tuple(faults), unexplained, trial.update)


def _next_fault(trial: Trial) -> Found:
    """The likeliest fault, in words, and the dataset with it put right."""
    misread = _misread(trial) if trial.missed() else None
    if trial.sound or (misread and not misread[1].missed()):
        return misread
    found = [one for one in (misread, _misbuilt(trial), _mislabelled(trial)) if one]
    return min(found, key=lambda one: one[1].cost, default=None)


def _misread(trial: Trial) -> Found:
    """Signs, swaps or units of instruments."""
    good: list[tuple[Correction, Trial]] = []
    for correction in corrections(trial)[:TRIED]:
        after = trial_of(correction.applied(trial.dataset))
        if after is None or after.cost > trial.cost - NAMED or set(correction.channels) & set(after.suspects):
            continue
        good.append((correction, after))
        if not after.missed():
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
    if len(trial.update.misfit) < 2:
        return None
    worst = max(trial.update.misfit, key=lambda m: float(np.mean(m.share**2)))
    rest = dataclasses.replace(trial.dataset, records=tuple(r for r in trial.dataset.records if r.name != worst.record))
    after = trial_of(rest)
    if after is None or after.missed():
        return None
    far = float(np.sqrt(np.mean(trial.misfit**2)))
    now = float(np.sqrt(np.mean(after.misfit**2)))
    words = f'record "{worst.record}" is not of the rig, the level or the set-up that the others are of'
    return [Fault(words, f"without it, the misfit falls from {far:.1f} to {now:.1f} % of the level")], after


def _gap_faults(trial: Trial) -> list[Fault]:
    """Gaps far from those at which the restoring force bends."""
    told = np.array([b.gap for b in trial.dataset.rig.bushings])
    bends = np.min([_bends(r, trial.update) for r in trial.dataset.records], axis=0)
    faults = []
    for j, (bend, gap) in enumerate(zip(bends.tolist(), told.tolist())):
        if GAPS[0] * gap <= bend <= GAPS[1] * gap or bend == np.inf:
            continue
        far, which = (bend / gap, "small") if bend > gap else (gap / bend, "large")
        words = f"bushings[{j}].gap is told {far:.1f} times too {which}"
        where = f"its restoring force bends at about {1e3 * bend:.2g} mm, the rig file says {1e3 * gap:.3g} mm"
        faults.append(Fault(words, where, bend / gap))
    return faults


def _bends(record: Record, update: RigUpdate) -> np.ndarray:
    """(n_bushings,) displacement at which the restoring force bends, m; infinite where it does not."""
    rig, low = update.rig, 0.0 if update.probes else SLOWEST
    if rig.probe_labels != record.rig.probe_labels:  # a sensor has moved out of its bushing, or into one
        rig = rig.replace(sensors=record.rig.sensors, bushings=record.rig.bushings)
    try:
        force = restoring_force(record, min(HIGH, 0.4 * record.fs), low, rig, update.values)
    except RecordError:  # too short
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
    found = [_left(np.column_stack((grease, np.sign(x) * np.maximum(np.abs(x) - w, 0.0))), f) for w in walls]
    left = [squares if stiffer > 0 else np.inf for squares, stiffer in found]  # grease that slides bends the other way
    return float(walls[np.argmin(left)]) if min(left) < BENT * _left(grease, f)[0] else np.inf


def _left(columns: np.ndarray, target: np.ndarray) -> tuple[float, float]:
    """Sum of squares that columns leave of a target, and the sign of the last one's part."""
    columns = columns / np.linalg.norm(columns, axis=0)
    factors = np.linalg.lstsq(columns, target)[0]
    return float(np.sum((target - columns @ factors) ** 2)), float(factors[-1])
