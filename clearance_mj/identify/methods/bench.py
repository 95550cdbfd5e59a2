"""Method "bench": the rig and the law of a bench of which nothing is known exactly."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from ...clearance import ContactLaw
from ...estimate.estimates import Estimates
from ...io.dataset import Dataset
from ...rig import Rig
from ..forces.restoring import SETTLE
from ..laws.comparison import FamilyFit, compare_families
from ..laws.law_misfit import LawMisfit, law_misfit
from ..registry import Identified, register
from ..structure.faults.diagnosis import Diagnosis, diagnose
from ..structure.rig_update import RigUpdate
from ..structure.updating import update_rig

__all__ = ["BenchFit", "fit_bench"]


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
        return [self.families[i].drawn(rig, int(rng.integers(2**31))) for i, rig in zip(chosen, rigs)]


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
