"""Method "bench": the rig and the law of a bench of which nothing is known exactly."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
from tqdm import tqdm

from ...clearance import ContactLaw
from ...estimate.estimates import Estimates
from ...io.dataset import Dataset, Record
from ...rig import Rig
from ..forces.restoring import NO_PROBES_BAND, SETTLE, RestoringForce, restoring_force
from ..laws.families import CONTACTS, GREASES, Family, power_law_start
from ..laws.force_fit import CYCLE, ForceFit, Motion, fit
from ..laws.law_misfit import LawMisfit, law_misfit
from ..laws.slip_start import slip_start
from ..registry import Identified, register
from ..structure.diagnosis import Diagnosis, diagnose
from ..structure.priors import priors
from ..structure.rig_update import RigUpdate
from ..structure.updating import update_rig

__all__ = ["BenchFit", "FamilyFit", "fit_bench"]

WORKERS = 2
"""threads"""


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


def _law(laws: Sequence[ContactLaw]) -> ContactLaw:
    return ContactLaw([law.contact[0] for law in laws], [law.grease[0] for law in laws])


@dataclass(frozen=True, eq=False, kw_only=True)
class BenchFit(Identified):
    """A rig and its law: ``rig``, ``law`` and ``estimates`` are of the likeliest family.

    ``estimates`` are those of the rig and of all bushings together, these widened by what rig and law miss.
    """

    rig: Rig
    """as found"""
    estimates: Estimates
    """of the rig, then of gap, offset, contact and grease of each bushing; `LawMisfit.widening` is in the latter"""

    update: RigUpdate
    """the linear rig"""
    families: tuple[FamilyFit, ...]
    """compared, likeliest first"""
    misfit: LawMisfit
    """what rig and law miss of the records"""
    diagnosis: Diagnosis
    """what is grossly wrong with the dataset"""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plain words on what not to rely on."""
        of_rig = set(self.update.estimates.names)
        of_law = [name for name in self.estimates.only_prior if name not in of_rig]
        held = (f"only the prior holds, of the law, {', '.join(of_law)}",) if of_law else ()
        return (*self.diagnosis.words, *self.update.warnings, *held, *self.misfit.warnings)

    def to_dict(self) -> dict[str, Any]:
        """Return parameters with what was known before, correlations, families, misfit and warnings as plain data."""
        return {
            "parameters": self.estimates.beside_priors(),
            "correlation": self.estimates.correlation.tolist(),
            "only_prior": list(self.estimates.only_prior),
            "families": [
                {"contact": f.contact, "grease": f.grease, "weight": f.weight, "log_evidence": f.log_evidence,
                 "misfit": f.misfit, "held_out": f.held_out}
                for f in self.families
            ],
            "misfit": {
                "widening": self.misfit.widening,
                "frf": self.misfit.rows(),
                "decays": self.misfit.decay_rows(),
                "rig": self.update.to_dict()["records"],
            },
            "warnings": list(self.warnings),
        }  # fmt: skip

    def draw(self, n: int, seed: int = 0) -> list[tuple[Rig, ContactLaw]]:
        """Draw rigs with laws: families by their weights, numbers from the covariances of the fits.

        These are not widened by what rig and law miss: of FRFs, `LawMisfit.spread` says that.

        Parameters
        ----------
        n : int
            How many.
        seed : int
            Of the random numbers.
        """
        rng = np.random.default_rng(seed)
        chosen = rng.choice(len(self.families), size=n, p=[f.weight for f in self.families])
        rigs = self.update.draw(n, seed)
        return [_drawn(self.families[i], rig, int(rng.integers(2**31))) for i, rig in zip(chosen, rigs)]


def _drawn(family: FamilyFit, rig: Rig, seed: int) -> tuple[Rig, ContactLaw]:
    parts = [f.drawn(b, seed + j) for j, (f, b) in enumerate(zip(family.fits, rig.bushings))]
    return rig.replace(bushings=tuple(b for b, _ in parts)), _law([law for _, law in parts])


@register(
    "bench",
    "the rig file with its tolerances and the records to identify: rig, gaps, offsets, and the likeliest of the "
    "families of contact and grease",
    shortest=lambda rig: 4 * SETTLE,
    rig_exact=False,
)
def fit_bench(dataset: Dataset, progress: str | None = None) -> BenchFit:
    """Identify the rig and its law where the rig file is not exact.

    First the linear rig (`update_rig`), with a look for gross faults, then the restoring forces on it, then gap,
    offset, contact and grease of each bushing along the measured motion, for one family of contact and grease after the
    other. Last, rig and law are simulated under the records' excitation, to see what they miss.

    Parameters
    ----------
    dataset : Dataset
        Rig and records; records with role "validate" are never opened.
    progress : str, optional
        Show progress bars with this name.

    Returns
    -------
    BenchFit
        Rig and law of the likeliest family, how well they are known, and the other families.

    Raises
    ------
    RecordError
        If there are no more sensors than clearances, or a channel cannot be used.
    """
    update = update_rig(dataset)
    diagnosis = diagnose(update)
    found = compare_families(dataset, update, progress)
    best, rig = found[0], found[0].rig(update.rig)
    misfit = law_misfit(dataset.to_identify(), rig, best.law, progress and f"{progress} (misfit)")
    estimates = _together(update, best, misfit.widening)
    return BenchFit(
        law=best.law, rig=rig, estimates=estimates, update=update, families=found, misfit=misfit, diagnosis=diagnosis
    )


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


def _together(update: RigUpdate, family: FamilyFit, widening: float) -> Estimates:
    """Of the rig and of all bushings, which do not depend on each other; what was found with the law is widened.

    The rig's fit finds its noise in what it leaves, so what the rig misses is in its covariance already.
    """
    own = [
        dataclasses.replace(p, name=p.name if p.name.startswith("bushings[") else f"{p.name}, bushings[{j}]")
        for j, f in enumerate(family.fits)
        for p in f.estimates.parameters
    ]
    parts = [update.estimates, *(f.estimates.widened(widening) for f in family.fits)]
    covariance = scipy.linalg.block_diag(*(e.covariance for e in parts))
    return Estimates.of([*update.estimates.parameters, *own], np.concatenate([e.value for e in parts]), covariance)
