"""Families of contact and filling of a given law, with its values of their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

from ...clearance import ConstantLaw, ContactLaw, KelvinVoigt, Law
from ...clearance.contact import ContactModel
from ...clearance.family import CONTACT_FAMILIES, FILLING_FAMILIES, ContactFamily, Family, FillingFamily
from ...clearance.record import fillings_of
from ...core.errors import LawError
from ...rig import Rig

__all__ = ["FamilyValues", "families_of"]

AnyFamily = TypeVar("AnyFamily", bound=Family)


class FamilyValues(NamedTuple):
    """The law of one bushing as values of its families."""

    contact: ContactFamily  #: family of the contact
    filling: FillingFamily  #: family of the filling
    values: dict[str, float]  #: of the parameters of both by name, SI


def families_of(law: Law, rig: Rig) -> list[FamilyValues]:
    """Return the families of contact and filling of each bushing, with a law's values there.

    Parameters
    ----------
    law : Law
        Constant, or with a contact model.
    rig : Rig
        Whose gaps and fillings the law leaves as they are.

    Raises
    ------
    LawError
        If the law changes by itself, or has a model without a family.
    """
    n = len(rig.bushings)
    if isinstance(law, ConstantLaw):
        k, c = law.table(n).parameters[0].T
        contacts: list[ContactModel] = [KelvinVoigt(*each) for each in zip(k.tolist(), c.tolist())]
    elif isinstance(law, ContactLaw):
        contacts = list(law.contact) * (n if len(law.contact) == 1 else 1)
    else:
        raise LawError(f'a law of kind "{law.kind}" changes by itself; needs a constant one or a contact model')
    if len(contacts) != n:
        raise LawError(f"the law holds contacts for {len(contacts)} bushings, the rig has {n}; give one or {n}")
    families = []
    for bushing, contact, grease in zip(rig.bushings, contacts, fillings_of(rig, law)):
        of_contact = _family(CONTACT_FAMILIES, contact, "contact")
        of_filling = _family(FILLING_FAMILIES, grease, "grease")
        values = of_contact.values(bushing, contact) | of_filling.values(bushing, grease)
        families.append(FamilyValues(of_contact, of_filling, values))
    return families


def _family(families: Mapping[str, AnyFamily], model: Any, kind: str) -> AnyFamily:
    if family := next((each for each in families.values() if each.holds(model)), None):
        return family
    raise LawError(
        f'a {kind} of kind "{getattr(model, "name", type(model).__name__)}" is of no family whose values can be '
        f"tracked; use one such as identify finds: {', '.join(families)}"
    )
