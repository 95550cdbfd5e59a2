"""Method "bench": the rig and the law of a bench of which nothing is known exactly."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from tqdm import tqdm

from ...clearance import ContactLaw
from ...io.dataset import Dataset
from ...parameters import Estimates
from ...rig import Rig
from ..families import CONTACTS, GREASES, Family
from ..force_fit import ForceFit, Motion, fit
from ..forces import SETTLE, restoring_force
from ..priors import priors
from ..registry import Identified, register
from ..updating import RigUpdate, update_rig

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
    weight: float
    """probability of the family among those that were compared"""

    @property
    def name(self) -> str:
        """Contact and grease in words."""
        return f"contact {self.contact}, grease {self.grease}"

    @property
    def log_evidence(self) -> float:
        """Of all bushings."""
        return sum(f.log_evidence for f in self.fits)

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
        """The rig with the gaps and offsets found."""
        return rig.replace(bushings=tuple(f.bushing for f in self.fits))


def _law(laws: Sequence[ContactLaw]) -> ContactLaw:
    return ContactLaw([law.contact[0] for law in laws], [law.grease[0] for law in laws])


@dataclass(frozen=True, eq=False, kw_only=True)
class BenchFit(Identified):
    """A rig and its law: ``rig``, ``law`` and ``estimates`` are of the likeliest family."""

    update: RigUpdate
    """the linear rig"""
    families: tuple[FamilyFit, ...]
    """compared, likeliest first"""

    def draw(self, n: int, seed: int = 0) -> list[tuple[Rig, ContactLaw]]:
        """Draw rigs with laws: families by their weights, numbers from their covariances.

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
)
def fit_bench(dataset: Dataset, progress: str | None = None) -> BenchFit:
    """Identify the rig and its law where the rig file is not exact.

    First the linear rig (`update_rig`), then the restoring forces on it, then gap, offset, contact and grease of each
    bushing along the measured motion, for one family of contact and grease after the other.
    """
    update = update_rig(dataset)
    forces = [
        restoring_force(dataclasses.replace(record, rig=update.rig))
        for record in tqdm(dataset.to_identify(), desc=progress and f"{progress} (forces)", disable=progress is None)
    ]
    gaps = {p.name: p for p in priors(dataset.rig) if p.name.endswith((".gap", ".offset"))}
    motions = [
        Motion(forces, update.rig, j, [p for name, p in gaps.items() if name.startswith(f"bushings[{j}]")])
        for j in range(len(update.rig.bushings))
    ]
    found = _compared(motions, progress)
    best = found[0]
    return BenchFit(
        law=best.law, rig=best.rig(update.rig), estimates=_together(update, best), update=update, families=found
    )


def _compared(motions: Sequence[Motion], progress: str | None) -> tuple[FamilyFit, ...]:
    """Fit every grease with the last contact, then every other contact with the likeliest grease; likeliest first."""
    bar = tqdm(desc=progress and f"{progress} (families)", unit="fit", disable=progress is None)
    with bar, ThreadPoolExecutor(WORKERS) as pool:

        def fitted(pairs: Sequence[tuple[Family, Family]], starts: Sequence[ForceFit | None]) -> list[list[ForceFit]]:
            tasks = [(pair, m, start) for pair in pairs for m, start in zip(motions, starts)]

            def one(task: tuple[tuple[Family, Family], Motion, ForceFit | None]) -> ForceFit:
                result = fit(task[1], *task[0], task[2])
                bar.update()
                return result

            results = list(pool.map(one, tasks))
            return [results[i : i + len(motions)] for i in range(0, len(results), len(motions))]

        *others, contact = CONTACTS
        found = fitted([(contact, grease) for grease in GREASES], [None] * len(motions))
        best = max(found, key=lambda fits: sum(f.log_evidence for f in fits))
        found += fitted([(other, best[0].grease) for other in others], best)
    evidence = np.array([sum(f.log_evidence for f in fits) for fits in found])
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    return tuple(
        FamilyFit(found[i][0].contact.name, found[i][0].grease.name, tuple(found[i]), float(weight[i]))
        for i in np.argsort(-evidence)
    )


def _together(update: RigUpdate, family: FamilyFit) -> Estimates:
    """Of the rig and of all bushings, which do not depend on each other."""
    own = [
        dataclasses.replace(p, name=p.name if p.name.startswith("bushings[") else f"{p.name}, bushings[{j}]")
        for j, f in enumerate(family.fits)
        for p in f.estimates.parameters
    ]
    parts = [update.estimates, *(f.estimates for f in family.fits)]
    covariance = scipy.linalg.block_diag(*(e.covariance for e in parts))
    return Estimates.of([*update.estimates.parameters, *own], np.concatenate([e.value for e in parts]), covariance)
