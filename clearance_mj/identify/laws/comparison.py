"""Families of contact and filling compared: each fitted to the restoring forces, weighed by its evidence."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar

import numpy as np
from tqdm import tqdm

from ...clearance import ContactLaw
from ...clearance.family import CONTACT_FAMILIES, FILLING_FAMILIES, ContactFamily, Family, FillingFamily
from ...core.errors import LawError
from ...estimate import rival_weights
from ...rig import Rig
from ...structure.base import is_rotation, parse_place
from ..forces.restoring import NO_PROBES_BAND, RestoringForce, restoring_force
from ..records.prepared import PreparedRecord
from ..structure.rig_update import RigUpdate
from .force_fit import ForceFit, fit_force
from .measured_motion import MeasuredMotion, RoundMotion
from .slow_motion import SlowMotion, fit_with_slow_motion

__all__ = ["WORKERS", "FamilyFit", "compare_families", "fit_families", "fit_from_rival", "force_on", "weighted"]

WORKERS = 2  # threads
RESAMPLED = 1000  # bootstraps of the records' blocks
SLOW_FITS, SLOW_REFITS = 6, 4  # in turn with the slow motion: of the first family, of the likeliest
LEVER = 0.01  # of a shaft's length: where a point bushing's slope is taken
SHORTEST_CORRELATION = 0.03  # s, a cycle in the middle of 5 to 220 Hz: rig and sensors are a little wrong, too

Values = Mapping[str, float]
AnyFamily = TypeVar("AnyFamily", bound=Family)
AnyMotion: TypeAlias = MeasuredMotion | RoundMotion


@dataclass(frozen=True, eq=False)
class FamilyFit:
    """One family of contacts and greases, fitted at every bushing."""

    contact: str
    """name"""
    grease: str
    """name"""
    fits: tuple[ForceFit, ...]
    """(n_bushings,)"""
    log_evidence: float
    """logarithm of the probability of the records given the family, but for a constant of the dataset"""
    weight: float
    """probability of the family among those that were compared"""

    @property
    def name(self) -> str:
        """Contact and grease in words."""
        return f"contact {self.contact}, grease {self.grease}"

    @property
    def misfit(self) -> float:
        """Of the forces that were fitted, over what is expected of a law; mean of the bushings."""
        return float(np.mean([f.misfit for f in self.fits]))

    @property
    def held_out(self) -> float:
        """The same of the piece that no fit saw."""
        return float(np.mean([f.held_out for f in self.fits]))

    def to_dict(self) -> dict[str, Any]:
        """Return names, weight, evidence and misfits as plain data."""
        names = ("contact", "grease", "weight", "log_evidence", "misfit", "held_out")
        return {name: getattr(self, name) for name in names}

    @property
    def law(self) -> ContactLaw:
        """Of all bushings."""
        return _law([f.law for f in self.fits])

    def rig(self, rig: Rig) -> Rig:
        """Return a rig with the gaps and offsets found.

        Parameters
        ----------
        rig : Rig
            The updated rig.
        """
        return rig.replace(bushings=tuple(f.bushing for f in self.fits))

    def drawn(self, rig: Rig, seed: int) -> tuple[Rig, ContactLaw]:
        """Draw gaps, offsets and law from the covariances of the fits.

        Parameters
        ----------
        rig : Rig
            Everything else is its own.
        seed : int
            Seed of the random numbers.
        """
        parts = [f.drawn(b, seed + j) for j, (f, b) in enumerate(zip(self.fits, rig.bushings))]
        return rig.replace(bushings=tuple(b for b, _ in parts)), _law([law for _, law in parts])


def _law(laws: Sequence[ContactLaw]) -> ContactLaw:
    return ContactLaw([law.contact[0] for law in laws], [law.grease[0] for law in laws])


def compare_families(
    records: Sequence[PreparedRecord], update: RigUpdate, progress: bool = False
) -> tuple[FamilyFit, ...]:
    """Fit every family of contact and grease to the restoring forces on an updated rig; likeliest first.

    Parameters
    ----------
    records : sequence of PreparedRecord
        Those that the rig was updated to, with the probes that they have.
    update : RigUpdate
        The rig, and the priors of gaps and offsets.
    progress : bool
        Show progress bars.
    """
    apart = _ends_apart(update.rig)
    forces = [force_on(apart, update, record) for record in tqdm(records, desc="forces", disable=not progress)]
    gaps = [p for p in update.clearance_priors if p.name.endswith((".gap", ".offset", ".length"))]
    motions = [
        MeasuredMotion(forces, update.rig, j, [p for p in gaps if p.name.startswith(f"bushings[{j}]")])
        for j in range(len(update.rig.bushings))
    ]
    if update.probes:
        return fit_families(motions, progress)
    # No probe shows the slow part of the motion: it follows from the laws.
    slow = SlowMotion(motions, update.records, update.rig)
    contact, filling = _generations(CONTACT_FAMILIES)[0][0], _generations(FILLING_FAMILIES)[0][0]
    first = [fit_force(motion, contact, filling) for motion in motions]
    fit_with_slow_motion(slow, contact, filling, first, SLOW_FITS)
    families = fit_families(motions, progress)
    best = families[0].fits
    refined = fit_with_slow_motion(slow, best[0].contact, best[0].filling, best, SLOW_REFITS)
    return (dataclasses.replace(families[0], fits=tuple(refined)), *families[1:])


def _ends_apart(rig: Rig) -> Rig:
    """Return a rig whose bushings along shafts are not points, so that the shaft's slope in them is known."""
    bushings = list(rig.bushings)
    for j, bushing in enumerate(bushings):
        if not bushing.length and not is_rotation(bushing.position) and (place := parse_place(bushing.position)):
            shaft = {shaft.name: shaft for shaft in rig.linear.shafts}[place[0]]
            inside = min(place[1] - shaft.start, shaft.end - place[1])
            bushings[j] = dataclasses.replace(bushing, length=min(LEVER * shaft.length, inside))
    return rig.replace(bushings=tuple(bushings))


def force_on(rig: Rig, update: RigUpdate, record: PreparedRecord) -> RestoringForce:
    """Restoring forces of a record on a rig, with probes as an update found them; without probes, of quick motion."""
    return restoring_force(record, low=0.0 if update.probes else NO_PROBES_BAND, rig=rig, probes=update.values)


def fit_families(motions: Sequence[MeasuredMotion], progress: bool = False) -> tuple[FamilyFit, ...]:
    """Fit every family of contact with every family of filling; likeliest first.

    Fillings one after the other with the contacts that begin from no other, then each with the other contacts from
    there. Where one of the former then misses more than one of the latter, it ended in a local optimum, and is fitted
    again from there.
    """
    contacts, fillings = _generations(CONTACT_FAMILIES), _generations(FILLING_FAMILIES)
    total = len(CONTACT_FAMILIES) * len(FILLING_FAMILIES) * len(motions)
    bar = tqdm(desc="families", total=total, unit="fit", disable=not progress)
    with bar, ThreadPoolExecutor(WORKERS) as pool:

        def fitted(motion: MeasuredMotion, contact: ContactFamily, filling: FillingFamily, *starts: Values) -> ForceFit:
            result = fit_force(motion, contact, filling, starts)
            bar.update()
            return result

        def with_first(motion: MeasuredMotion, contact: ContactFamily) -> list[ForceFit]:
            """Of one contact all fillings, each from the one before."""
            found: dict[str, ForceFit] = {}
            for filling in itertools.chain(*fillings):
                before = found.get(filling.begins_from or "")
                starts = [before.values | filling.start(before, motion)] if before else []
                found[filling.name] = fitted(motion, contact, filling, *starts)
            return list(found.values())

        def with_other(motion: MeasuredMotion, contact: ContactFamily, before: ForceFit) -> ForceFit:
            return fitted(motion, contact, before.filling, before.values | contact.start(before, motion))

        found: dict[tuple[str, str], list[ForceFit]] = {}
        for contact in contacts[0]:
            by_motion = pool.map(with_first, motions, itertools.repeat(contact))
            found |= {(contact.name, fits[0].filling.name): list(fits) for fits in zip(*by_motion)}
        first = list(found)
        for generation in contacts[1:]:
            tasks = {
                (contact.name, filling): [
                    pool.submit(with_other, motion, contact, before)
                    for motion, before in zip(motions, found[str(contact.begins_from), filling])
                ]
                for contact in generation
                for filling in FILLING_FAMILIES
            }
            found |= {pair: [task.result() for task in of_motions] for pair, of_motions in tasks.items()}
        for pair in first:
            others = [fits for other, fits in found.items() if other[1] == pair[1] and other not in first]
            if others:
                rivals = [min(fits, key=lambda f: f.misfit) for fits in zip(*others)]
                found[pair] = list(pool.map(fit_from_rival, motions, found[pair], rivals))
    return weighted(motions, list(found.values()))


def _generations(families: Mapping[str, AnyFamily]) -> list[list[AnyFamily]]:
    """Families that begin from no other, then those that begin from these, and so on."""
    found: list[list[AnyFamily]] = []
    names: set[str | None] = {None}
    while rest := [family for family in families.values() if family.name not in names]:
        if not (ready := [family for family in rest if family.begins_from in names]):
            raise LawError(
                f'family "{rest[0].name}" begins from "{rest[0].begins_from}", of which no fit is known; '
                f"known: {', '.join(families)}"
            )
        found.append(ready)
        names |= {family.name for family in ready}
    return found


def fit_from_rival(motion: MeasuredMotion, old: ForceFit, rival: ForceFit) -> ForceFit:
    """Fit that begins where one with the same filling and another contact ended, if that misses less."""
    if old.misfit <= rival.misfit:
        return old
    contacts = {p.name for family in (old.contact, rival.contact) for p in family.parameters(motion.nominal)}
    others = {name: value for name, value in rival.values.items() if name not in contacts}
    own = {name: value for name, value in old.values.items() if name in contacts}
    return min(old, fit_force(motion, old.contact, old.filling, [others, others | own]), key=lambda f: f.misfit)


def weighted(motions: Sequence[AnyMotion], found: Sequence[Sequence[ForceFit]]) -> tuple[FamilyFit, ...]:
    """Return families with their probabilities, likeliest first.

    All families miss the records by more than noise, so that pieces of a record do not agree which one is nearest:
    probabilities are means over Bayesian bootstraps of the blocks (pseudo-BMA+; Yao, Vehtari, Simpson and Gelman,
    Using stacking to average Bayesian predictive distributions, Bayesian Analysis 13, 2018).
    """
    # Errors of the best family are those of rig and sensors: they say how many samples are one observation, for all.
    lengths = [min(fits, key=lambda f: f.misfit).correlation_length for fits in zip(*found)]
    lengths = [max(SHORTEST_CORRELATION * motion.rate, length) for motion, length in zip(motions, lengths)]
    counts = np.random.default_rng(0).dirichlet(np.ones(motions[0].blocks.size), RESAMPLED) * motions[0].blocks.size
    evidence = np.array([sum(f.log_evidence(length) for f, length in zip(fits, lengths)) for fits in found])
    resampled = [np.sum([f.log_evidence(length, counts) for f, length in zip(fits, lengths)], axis=0) for fits in found]
    weight = np.mean([rival_weights(each) for each in np.transpose(resampled)], axis=0)
    return tuple(
        FamilyFit(
            found[i][0].contact.name, found[i][0].filling.name, tuple(found[i]), float(evidence[i]), float(weight[i])
        )
        for i in np.lexsort((-evidence, -weight))
    )
