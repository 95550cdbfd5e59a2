"""Families of contact and filling compared: each fitted to the restoring forces, weighed by its evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from ...clearance import ContactLaw
from ...io.dataset import Dataset, Record
from ...rig import Rig
from ..forces.restoring import NO_PROBES_BAND, RestoringForce, restoring_force
from ..structure.priors import priors
from ..structure.rig_update import RigUpdate
from .families import CONTACTS, GREASES, Family, power_law_start
from .force_fit import CYCLE, ForceFit, Motion, fit
from .slip_start import slip_start

__all__ = ["FamilyFit", "compare_families", "compared", "force_on"]

WORKERS = 2  # threads


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
            Of the random numbers.
        """
        parts = [f.drawn(b, seed + j) for j, (f, b) in enumerate(zip(self.fits, rig.bushings))]
        return rig.replace(bushings=tuple(b for b, _ in parts)), _law([law for _, law in parts])


def _law(laws: Sequence[ContactLaw]) -> ContactLaw:
    return ContactLaw([law.contact[0] for law in laws], [law.grease[0] for law in laws])


def compare_families(dataset: Dataset, update: RigUpdate, progress: str | None = None) -> tuple[FamilyFit, ...]:
    """Fit every family of contact and grease to the restoring forces on an updated rig; likeliest first."""
    forces = [
        force_on(update.rig, update, record)
        for record in tqdm(dataset.to_identify(), desc=progress and f"{progress} (forces)", disable=progress is None)
    ]
    gaps = {p.name: p for p in priors(dataset.rig) if p.name.endswith((".gap", ".offset"))}
    motions = [
        Motion(forces, update.rig, j, [p for name, p in gaps.items() if name.startswith(f"bushings[{j}]")])
        for j in range(len(update.rig.bushings))
    ]
    return compared(motions, progress)


def force_on(rig: Rig, update: RigUpdate, record: Record) -> RestoringForce:
    """Restoring forces of a record on a rig, with probes as an update found them; without probes, of quick motion."""
    return restoring_force(record, low=0.0 if update.probes else NO_PROBES_BAND, rig=rig, probes=update.values)


def compared(motions: Sequence[Motion], progress: str | None = None) -> tuple[FamilyFit, ...]:
    """Fit every contact with every grease; likeliest first.

    Greases one after the other with the last contact, then each with the other contacts from there. Where the last one
    then misses more than another, it ended in a local optimum, and begins again from there.
    """
    total = len(CONTACTS) * len(GREASES) * len(motions)
    *others, first = CONTACTS
    bar = tqdm(desc=progress and f"{progress} (families)", total=total, unit="fit", disable=progress is None)
    with bar, ThreadPoolExecutor(WORKERS) as pool:

        def fitted(motion: Motion, contact: Family, grease: Family, *starts: Mapping[str, float]) -> ForceFit:
            result = fit(motion, contact, grease, starts)
            bar.update()
            return result

        def with_first(motion: Motion) -> list[ForceFit]:
            linear, bouc_wen, slip, stribeck = GREASES
            begun = fitted(motion, first, linear)
            sliding = fitted(motion, first, slip, begun.values | slip_start(motion, begun))
            more = fitted(motion, first, stribeck, sliding.values)
            return [begun, fitted(motion, first, bouc_wen, begun.values), sliding, more]

        def with_other(motion: Motion, contact: Family, start: ForceFit) -> ForceFit:
            return fitted(motion, contact, start.grease, start.values | power_law_start(start.law, motion.told))

        of_first = list(pool.map(with_first, motions))
        tasks = [
            [pool.submit(with_other, m, other, fits[i]) for m, fits in zip(motions, of_first)]
            for other in others
            for i in range(len(GREASES))
        ]
        found = [tuple(task.result() for task in of_family) for of_family in tasks]
        rivals = [
            [min(fits, key=lambda f: f.misfit) for fits in zip(*found[i :: len(GREASES)])] for i in range(len(GREASES))
        ]
        again = [list(pool.map(_again, motions, fits, of_grease)) for fits, of_grease in zip(zip(*of_first), rivals)]
        found += [tuple(fits) for fits in again]
    # What hangs together in time is what the best family misses, and what rig and sensors miss.
    least = [min(fits, key=lambda f: f.misfit).alike for fits in zip(*found)]
    alike = [max(CYCLE * motion.rate, one) for motion, one in zip(motions, least)]
    evidence = np.array([sum(f.log_evidence(a) for f, a in zip(fits, alike)) for fits in found])
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    return tuple(
        FamilyFit(found[i][0].contact.name, found[i][0].grease.name, found[i], float(evidence[i]), float(weight[i]))
        for i in np.argsort(-evidence)
    )


def _again(motion: Motion, old: ForceFit, rival: ForceFit) -> ForceFit:
    """Fit that begins where one with the same grease and another contact ended, if that misses less."""
    if old.misfit <= rival.misfit:
        return old
    contacts = {p.name for family in (old.contact, rival.contact) for p in family.parameters(motion.told)}
    others = {name: value for name, value in rival.values.items() if name not in contacts}
    own = {name: value for name, value in old.values.items() if name in contacts}
    return min(old, fit(motion, old.contact, old.grease, [others, others | own]), key=lambda f: f.misfit)
