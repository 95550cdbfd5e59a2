"""Method "nominal": the datasheet, before any test."""

from __future__ import annotations

from ...clearance.law import ConstantLaw
from ...io.dataset import Dataset
from ...rig import Rig
from ..registry import Identified, register

__all__ = ["nominal"]


def nominal(rig: Rig) -> ConstantLaw:
    """Return the law of a designer before any test: the datasheet contact of the rig file, and its grease.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    if not rig.bushings:
        return ConstantLaw(0.0, 0.0)
    contacts = [b.contact for b in rig.bushings]
    return ConstantLaw([c.stiffness for c in contacts], [c.damping for c in contacts])


@register("nominal", "the rig file only: datasheet contact, fresh grease as a linear spring and damper")
def _find(dataset: Dataset, progress: str | None = None) -> Identified:
    return Identified(nominal(dataset.rig))
