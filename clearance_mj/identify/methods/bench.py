"""Method "bench": the rig and the law of a bench of which nothing is known exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import scipy.linalg

from ...core.kinds import checks_kinds
from ...estimate.estimates import Estimates
from ...io.dataset import Dataset
from ...model import Model
from ...rig import Rig
from ..channels.check import check_places
from ..forces.restoring import SETTLE, possible_forces
from ..forces.turning_loads import TurningLoads, find_turning_loads
from ..laws.comparison import FamilyFit, compare_families, force_on, law_of
from ..laws.law_misfit import LawMisfit, law_misfit
from ..records.needs import more_sensors_than_clearances
from ..records.prepared import prepare, prepare_turning
from ..registry import Identified, register
from ..structure.examination import examine
from ..structure.priors import unsaid_words
from ..structure.rig_update import RigUpdate

__all__ = ["BenchFit", "fit_bench"]

WIDE_OFFSET = 0.1  # of a gap: standard deviation of an offset above which it is said to be hardly known


@dataclass(frozen=True, eq=False, kw_only=True)
class BenchFit(Identified):
    """Result of method "bench": the model of the likeliest families, and the steps that it comes from.

    ``estimates`` are those of the rig, then of gap, offset, contact and grease of each bushing; the latter are widened
    by the misfit of rig and law (`LawMisfit.widening`).
    """

    estimates: Estimates
    """of rig and clearances together"""
    update: RigUpdate
    """the linear rig"""
    families: tuple[tuple[FamilyFit, ...], ...]
    """(n_bushings,) compared at each clearance, likeliest first"""
    misfit: LawMisfit
    """misfit of rig and law in the records"""

    def to_dict(self) -> dict[str, Any]:
        """Return parameters with their priors, correlations, families, misfit and warnings as plain data."""
        misfit = {"widening": self.misfit.widening, "frf": self.misfit.rows(), "decays": self.misfit.decay_rows()}
        families = [family.to_dict() for of_one in self.families for family in of_one]
        misfit["rig"] = self.update.to_dict()["records"]
        return super().to_dict() | {"families": families, "misfit": misfit}


@checks_kinds
@register(
    "bench",
    "the rig file with its tolerances and the records to identify: rig, gaps, offsets, and the likeliest of the "
    "families of contact and grease",
    shortest=lambda rig: 4 * SETTLE,
    needs=(more_sensors_than_clearances,),
    finds_rig=True,
    in_space=True,
)
def fit_bench(dataset: Dataset, progress: bool = False) -> BenchFit:
    """Identify the rig and its law where the rig file is not exact.

    First the linear rig (`update_rig`), with a search for missing parts and gross faults, then the restoring forces on
    it, then gap, offset, contact and grease of each bushing along the measured motion, for one family of contact and
    grease after the other. Last, rig and law are simulated under the records' excitation for their misfit.

    Parameters
    ----------
    dataset : Dataset
        Rig and records; records with role "validate" are never opened.
    progress : bool
        Show progress bars.

    Returns
    -------
    BenchFit
        Rig and law of the likeliest family, how well they are known, and the other families.

    Raises
    ------
    RecordError
        If there are no more sensors than clearances, a channel cannot be used, channels surely are swapped, inverted
        or in other units than the records say, or records are of several rigs.
    """
    records = prepare(dataset)
    if not dataset.rig.moves_across:
        check_places(records)
    update, diagnosis = examine(dataset.rig, records, progress)
    rig, turning, turned_records = update.rig, None, records
    if rig.moves_across:
        turning = find_turning_loads(rig, prepare_turning(dataset), update.values, update.drawn)
        rig = turning.rig
        turned_records = tuple(turning.with_slow_roll_restored(record, update.values) for record in records)
    families = compare_families(turned_records, update, rig, progress)
    likeliest = [fits[0].fit for fits in families]
    identified_rig = rig.replace(bushings=tuple(fit.bushing for fit in likeliest))
    model = Model(identified_rig, law_of([fit.law for fit in likeliest]), partial(_draw, rig, update, families))
    misfit = law_misfit(update.records, model, progress)
    estimates = _join_estimates(update, turning, families, misfit.widening)
    of_law = [name for name in estimates.only_prior if name not in update.estimates.names]
    words: tuple[str, ...] = (unsaid_words(of_law, "of the rig file, or usual of its family"),) if of_law else ()
    words += _unknown_offsets(model.rig, update, estimates)
    pages: dict[str, Any] = {"update": update, "families": [f for fits in families for f in fits], "misfit": misfit}
    if not dataset.rig.moves_across:
        pages["forces"] = partial(possible_forces, records, partial(force_on, model.rig, update))
    return BenchFit(
        model=model, estimates=estimates, update=update, families=families, misfit=misfit,
        warnings=(*diagnosis.words, *update.warnings, *(turning.warnings if turning else ()), *words, *misfit.warnings),
        pages=pages,
    )  # fmt: skip


def _unknown_offsets(rig: Rig, update: RigUpdate, estimates: Estimates) -> tuple[str, ...]:
    """Say in words which offsets are hardly known, because no probe shows where the shaft is on average."""
    if update.probes or rig.is_loaded:
        return ()
    std = dict(zip(estimates.names, estimates.std))
    offsets = [(f"bushings[{j}].offset", bushing.gap) for j, bushing in enumerate(rig.bushings)]
    wide = [f"{name} ± {1e3 * std[name]:.2g} mm" for name, gap in offsets if std.get(name, 0.0) > WIDE_OFFSET * gap]
    words = f"accelerometers do not show where the shaft is on average, probes would: {', '.join(wide)}"
    return (words,) if wide else ()


def _draw(rig: Rig, update: RigUpdate, families: Sequence[Sequence[FamilyFit]], n: int, seed: int) -> list[Model]:
    """Draw models: of each clearance a family by its weight, numbers from the covariances of the fits.

    These are not widened by the misfit of rig and law: of FRFs, `LawMisfit.spread` says that.
    """
    rng = np.random.default_rng(seed)
    chosen = [rng.choice(len(fits_), size=n, p=[family.weight for family in fits_]) for fits_ in families]
    drawn = []
    for other, *each in zip(update.draw(n, seed), *chosen):
        fits = [fits_[i].fit for fits_, i in zip(families, each)]
        base = int(rng.integers(2**31))
        parts = [fit.drawn(bushing, base + j) for j, (fit, bushing) in enumerate(zip(fits, other.bushings))]
        drawn_rig = other.replace(bushings=tuple(b for b, _ in parts), unbalances=rig.unbalances, orders=rig.orders)
        drawn.append(Model(drawn_rig, law_of([law for _, law in parts])))
    return drawn


def _join_estimates(
    update: RigUpdate, turning: TurningLoads | None, families: Sequence[Sequence[FamilyFit]], widening: float
) -> Estimates:
    """Return estimates of the rig, turning loads and all bushings, hardly correlated; those of laws are widened.

    The rig's fit estimates its noise from its residuals, so its misfit is in its covariance already. Gaps, offsets and
    lengths, which all families have, vary with the family, too.
    """
    parts = [update.estimates, *([turning.estimates] if turning else ())]
    named = [p for e in parts for p in e.parameters]
    for j, (likeliest, *rivals) in enumerate(families):
        of_rivals = [(f.weight, {n: v for n, v in f.fit.values.items() if n.startswith("bushings[")}) for f in rivals]
        parts.append(likeliest.fit.estimates.widened(widening).with_rivals(of_rivals))
        named += [p if p.name.startswith("bushings[") else replace(p, name=f"{p.name}, bushings[{j}]")
                  for p in parts[-1].parameters]  # fmt: skip
    covariance = scipy.linalg.block_diag(*(e.covariance for e in parts))
    return Estimates.of(named, np.concatenate([e.value for e in parts]), covariance)
