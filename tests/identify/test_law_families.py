"""Laws as families: making a law of a family's values and taking it apart gives the values back."""

import numpy as np
import pytest

from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, Flores
from clearance_mj.clearance.family import CONTACT_FAMILIES, FILLING_FAMILIES
from clearance_mj.core.errors import LawError
from clearance_mj.identify.laws.families import families_of
from clearance_mj.rig import Grease


@pytest.mark.parametrize("contact", CONTACT_FAMILIES.values(), ids=lambda f: f.name)
@pytest.mark.parametrize("grease", FILLING_FAMILIES.values(), ids=lambda f: f.name)
def test_values_come_back(rig, contact, grease):
    bushing = rig.bushings[0]
    parameters = [*contact.parameters(bushing), *grease.parameters(bushing)]
    values = {p.name: p.start * (1 + 0.01 * i) for i, p in enumerate(parameters)}
    split = len(contact.parameters(bushing))
    numbers = list(values.values())
    law = ContactLaw(contact.make(bushing, *numbers[:split]), grease.make(bushing, *numbers[split:]))
    families = families_of(law, rig)
    assert [(c.name, g.name) for c, g, _ in families] == [(contact.name, grease.name)] * 2
    assert families[1][2] == pytest.approx(values, rel=1e-12)


def test_a_constant_law_is_a_spring_and_damper(rig):
    (contact, grease, values), _ = families_of(ConstantLaw(5e3, 2.0, grease=Grease(4e3, 5.0)), rig)
    assert (contact.name, grease.name) == ("linear", "linear")
    assert values == {
        "contact stiffness": 5e3, "contact damping": 2.0, "grease stiffness": 4e3, "grease damping": 5.0,
    }  # fmt: skip


def test_laws_that_cannot_be_tracked_say_which_can(rig):
    with pytest.raises(LawError, match='a law of kind "amplitude" changes by itself; needs a constant one'):
        families_of(AmplitudeLaw(np.array([0.0, 1e-3]), np.full((2, 1), 5e3), np.full((2, 1), 2.0)), rig)
    with pytest.raises(LawError, match=r'kind "flores" is of no family .*: power law, linear, linear \+ cubic$'):
        families_of(ContactLaw(Flores(3e5, 0.5)), rig)
