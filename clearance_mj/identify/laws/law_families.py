"""The family of contact and grease that a law belongs to, and its values there."""

from __future__ import annotations

from ...clearance import ContactLaw, Cubic, HuntCrossley1975, KelvinVoigt, MaxwellSlip
from ...clearance.contact import ContactModel
from ...clearance.grease import GreaseModel
from ...clearance.greases.bouc_wen import BoucWen
from ...clearance.kernel import greases_of
from ...clearance.law import ConstantLaw, Law
from ...core.errors import LawError
from ...rig import Bushing, Grease, Rig
from .families import CONTACTS, ELEMENTS, GREASES, Family

__all__ = ["families_of"]

_CONTACT = {family.name: family for family in CONTACTS}
_GREASE = {family.name: family for family in GREASES}


def families_of(law: Law, rig: Rig) -> list[tuple[Family, Family, dict[str, float]]]:
    """Contact and grease of each bushing as families, with values by name; a LawError if a law is of none."""
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
    found = []
    for bushing, contact, grease in zip(rig.bushings, contacts, greases_of(rig, law)):
        (of_contact, values), (of_grease, more) = _contact(contact, bushing), _grease(grease)
        found.append((_CONTACT[of_contact], _GREASE[of_grease], values | more))
    return found


def _contact(contact: ContactModel, bushing: Bushing) -> tuple[str, dict[str, float]]:
    if isinstance(contact, KelvinVoigt):
        return "linear", {"contact stiffness": contact.stiffness, "contact damping": contact.damping}
    if isinstance(contact, HuntCrossley1975):
        force = contact.stiffness * bushing.gap**contact.exponent
        loss = contact.damping / contact.stiffness
        return "power law", {
            "contact force at one gap": force, "contact loss": loss, "contact exponent": contact.exponent,
        }  # fmt: skip
    if isinstance(contact, Cubic):
        return "linear + cubic", {
            "contact stiffness": contact.stiffness, "contact damping": contact.damping,
            "contact cubic stiffness": contact.cubic, "contact loss": contact.loss,
        }  # fmt: skip
    raise LawError(
        f'a contact of kind "{contact.name}" cannot be followed; can be: {", ".join(_CONTACT)} (kelvin-voigt, '
        "hunt-crossley-1975, cubic), such as identify finds"
    )


def _grease(grease: GreaseModel) -> tuple[str, dict[str, float]]:
    if isinstance(grease, BoucWen):
        g: Grease = grease.grease
        values = {"grease stiffness": g.stiffness, "grease damping": g.damping}
        values |= {"grease film height": g.film_height} if g.film_height else {}
        if g.elastic_ratio == 1:
            return "linear", values
        return "Bouc-Wen", values | {
            "grease elastic ratio": g.elastic_ratio, "grease yield displacement": g.yield_displacement,
            "grease exponent": g.exponent, "grease beta / (beta + gamma)": g.beta / (g.beta + g.gamma),
        }  # fmt: skip
    if isinstance(grease, MaxwellSlip) and len(grease.springs) == ELEMENTS:
        values = {"grease stiffness": grease.elastic, "grease damping": grease.damping}
        values |= {"grease film height": grease.film_height} if grease.film_height else {}
        for i, (spring, force) in enumerate(zip(grease.springs, grease.forces), 1):
            values |= {f"grease slip displacement {i}": force / spring, f"grease slipping stiffness {i}": spring}
        if grease.stribeck_speed is None:
            return "Maxwell-slip", values
        excess = {"grease static friction over sliding, less 1": grease.static_ratio - 1}
        return "Maxwell-slip, Stribeck", values | excess | {"grease Stribeck speed": grease.stribeck_speed}
    raise LawError(f"a grease of this kind cannot be followed; can be: {', '.join(_GREASE)}, such as identify finds")
