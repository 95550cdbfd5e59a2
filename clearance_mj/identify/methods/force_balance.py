"""Method "force-balance": constant contact and Bouc-Wen grease out of the restoring forces."""

from __future__ import annotations

import numpy as np

from ...clearance.law import ConstantLaw
from ...core.errors import RecordError
from ...io.dataset import Dataset
from ...model import Model
from ..forces.restoring import SETTLE, restoring_forces
from ..laws.contact_over_time import contact_parameters, fill_untouched, require_contact
from ..laws.grease import grease_parameters
from ..records.needs import probes
from ..registry import Identified, register

__all__ = ["force_balance_law"]


def force_balance_law(dataset: Dataset, progress: bool = False) -> ConstantLaw:
    """Return the constant contact stiffness and damping: the weighted means of `contact_parameters` over the records.

    A bushing that is never touched takes the others' mean.
    """
    forces = restoring_forces(dataset, progress)
    require_contact(forces)
    grease = grease_parameters(forces).grease
    contacts = [contact_parameters(f, grease) for f in forces if f.touched.any()]
    k, c = (np.concatenate([getattr(p, name) for p in contacts]) for name in ("k", "c"))
    weight = np.concatenate([p.contact for p in contacts]) * np.isfinite(k)
    k, c = (np.nansum(weight * v, axis=0) / np.maximum(weight.sum(axis=0), 1e-30) for v in (k, c))
    touched = weight.sum(axis=0) > 0
    if not touched.any():
        raise RecordError("contact is too short in every record to identify its stiffness")
    return ConstantLaw(fill_untouched(k, touched), fill_untouched(c, touched), grease=grease)


@register(
    "force-balance",
    "the rig file and the records to identify: constant contact and Bouc-Wen grease out of the restoring forces",
    shortest=lambda rig: 4 * SETTLE,
    needs=(probes,),
)
def _identify(dataset: Dataset, progress: bool = False) -> Identified:
    return Identified(model=Model(dataset.rig, force_balance_law(dataset, progress)))
