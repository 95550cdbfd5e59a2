"""Arguments of all calculations: an object with a rig and a law, or the two of them."""

from __future__ import annotations

import dataclasses
from typing import Protocol, runtime_checkable

from ..core.errors import LawError
from ..core.kinds import checks_kinds
from ..rig import Grease, Rig
from .law import ConstantLaw, Law
from .record import fillings_of

__all__ = ["Modelled", "nominal_law", "rig_and_law", "rig_in_gap"]


@runtime_checkable
class Modelled(Protocol):
    """Something with a rig and a law, such as `clearance_mj.Model`."""

    @property
    def rig(self) -> Rig:
        """Linear structure, gaps and offsets, sensors."""

    @property
    def law(self) -> Law:
        """Contact and filling of every clearance."""


def nominal_law(rig: Rig) -> ConstantLaw:
    """Return the law of the rig file's datasheet values.

    Parameters
    ----------
    rig : Rig
        Its bushings hold contact stiffness and damping; the filling is the rig's.
    """
    if not rig.bushings:
        return ConstantLaw(0.0, 0.0)
    contacts = [bushing.contact for bushing in rig.bushings]
    return ConstantLaw([c.stiffness for c in contacts], [c.damping for c in contacts])


@checks_kinds
def rig_and_law(model: Rig | Modelled, law: Law | None = None) -> tuple[Rig, Law]:
    """Return rig and law of a calculation's arguments.

    Parameters
    ----------
    model : Rig or Modelled
        A model, or a rig.
    law : Law, optional
        Of a rig; by default the nominal law. A model has its law.

    Raises
    ------
    LawError
        If a law is given in addition to a model, or something that is no law.
    """
    if isinstance(model, Rig):
        return model, nominal_law(model) if law is None else law
    if law is not None:
        raise LawError("a model brings its own law; give a rig to simulate another one")
    return model.rig, model.law


def rig_in_gap(rig: Rig, law: Law) -> Rig:
    """Return the rig with the law's filling, as linear springs and dampers of small motions in the gaps.

    Parameters
    ----------
    rig : Rig
        The rig.
    law : Law
        Its law; without a filling in the law the rig is returned unchanged.
    """
    if law.grease is None:
        return rig
    linear_greases = (Grease(*model.small_motion()) for model in fillings_of(rig, law))
    return rig.replace(bushings=tuple(dataclasses.replace(b, grease=g) for b, g in zip(rig.bushings, linear_greases)))
