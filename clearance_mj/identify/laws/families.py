"""Families of laws that identification compares: what is free in a contact or a grease, and the model of its values.

Contacts: linear (spring and damper), power law (Hunt and Crossley 1975), linear + cubic. Greases: linear, Bouc-Wen,
Maxwell-slip elements (Iwan 1966) with or without the Stribeck effect; all with a squeeze film. What is known before is
wide, within decades; springs and forces begin where the rig file puts them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ...clearance import ContactLaw, Cubic, HuntCrossley1975, KelvinVoigt, MaxwellSlip
from ...estimate.parameter import Parameter
from ...rig import Bushing, Grease

__all__ = ["CONTACTS", "GREASES", "Family", "power_law_start"]

DECADE = math.log(10.0)
FAR = 5.0
"""standard deviations, from the start to a parameter's bounds"""
ELEMENTS = 4
"""Maxwell-slip elements"""
APART = 3.0
"""ratio of their slip displacements, to begin with"""


@dataclass(frozen=True)
class Family:
    """Contacts or greases of one kind, by their free numbers."""

    name: str
    """in words"""
    parameters: Callable[[Bushing], list[Parameter]]
    """of a bushing as the rig file has it, with what is known of them before"""
    make: Callable[..., Any]
    """the bushing and a value for each parameter; returns the contact or grease"""


def _free(name: str, unit: str, start: float, std: float, low: float = 0.0, high: float = math.inf) -> Parameter:
    far = math.exp(FAR * std)
    return Parameter(name, unit, start, max(low, start / far), min(high, start * far), std)


def _contact_spring(bushing: Bushing) -> list[Parameter]:
    contact = bushing.contact
    return [
        _free("contact stiffness", "N/m", contact.stiffness, DECADE),
        _free("contact damping", "N s/m", contact.damping or 1e-4 * contact.stiffness, DECADE),
    ]


def _power_law(bushing: Bushing) -> list[Parameter]:
    return [
        _free("contact force at one gap", "N", bushing.contact.stiffness * bushing.gap, DECADE),
        _loss(),
        _free("contact exponent", "1", 1.5, 0.3, 1.0, 3.0),
    ]


def _make_power_law(bushing: Bushing, force: float, loss: float, exponent: float) -> HuntCrossley1975:
    """K δⁿ (1 + α δ̇)."""
    stiffness = force / bushing.gap**exponent
    return HuntCrossley1975(stiffness, loss * stiffness, exponent)


def power_law_start(law: ContactLaw, bushing: Bushing) -> dict[str, float]:
    """Values of a power law that comes near to another contact."""
    half, whole = (law.contact[0].force(share * bushing.gap, 0.0) for share in (0.5, 1.0))
    return {"contact force at one gap": whole, "contact exponent": math.log2(whole / half)}


def _cubic(bushing: Bushing) -> list[Parameter]:
    k3 = bushing.contact.stiffness / bushing.gap**2
    return [*_contact_spring(bushing), _free("contact cubic stiffness", "N/m³", k3, DECADE), _loss()]


def _loss() -> Parameter:
    return _free("contact loss", "s/m", 2.0, 0.5 * DECADE)


CONTACTS = (
    Family("linear", _contact_spring, lambda bushing, k, c: KelvinVoigt(k, c)),
    Family("power law", _power_law, _make_power_law),
    Family("linear + cubic", _cubic, lambda bushing, k, c, k3, loss: Cubic(k, k3, c, loss)),
)
"""what can happen beyond the gap"""


def _grease_spring(bushing: Bushing) -> list[Parameter]:
    grease = bushing.grease
    stiffness = grease.stiffness or 0.1 * bushing.contact.stiffness
    return [
        _free("grease stiffness", "N/m", stiffness, DECADE),
        _free("grease damping", "N s/m", grease.damping or 1e-3 * stiffness, DECADE),
        _free("grease film height", "m", 3 * bushing.gap, 0.7, 0.5 * bushing.gap),
    ]


def _bouc_wen(bushing: Bushing) -> list[Parameter]:
    return [
        *_grease_spring(bushing),
        _free("grease elastic ratio", "1", 0.8, 0.5, high=1.0),
        _free("grease yield displacement", "m", 0.5 * bushing.gap, 1.0),
        _free("grease exponent", "1", 1.5, 0.3, 1.0, 3.0),
        _free("grease beta / (beta + gamma)", "1", 0.7, 0.3, 0.5, 3.0),
    ]


def _make_bouc_wen(
    bushing: Bushing, k: float, c: float, height: float, ratio: float, yield_: float, exponent: float, share: float
) -> Grease:
    """Bouc-Wen with A = 1: k, λ and z_ult = (β+γ)^(-1/n) give the loop's size, n and β/(β+γ) its shape."""
    total = yield_**-exponent
    beta = max(share, 0.5) * total
    shape = {"beta": beta, "gamma": total - beta, "exponent": exponent, "film_height": height}
    return Grease(stiffness=k, damping=c, elastic_ratio=ratio, **shape)


def _maxwell_slip(bushing: Bushing) -> list[Parameter]:
    spring = _grease_spring(bushing)[0].start
    first, numbers = bushing.gap / 20, range(ELEMENTS)
    slips = [_free(f"grease slip displacement {i + 1}", "m", first * APART**i, 0.5) for i in numbers]
    springs = [_free(f"grease slipping stiffness {i + 1}", "N/m", 0.1 * spring, 1.5) for i in numbers]
    return [*_grease_spring(bushing), *slips, *springs]


def _make_maxwell_slip(
    bushing: Bushing, k: float, c: float, height: float, *elements: float, **stribeck: float
) -> MaxwellSlip:
    slips, springs = elements[:ELEMENTS], elements[ELEMENTS:]
    forces = tuple(slip * spring for slip, spring in zip(slips, springs))
    return MaxwellSlip(springs, forces, k, c, height, **stribeck)


def _stribeck(bushing: Bushing) -> list[Parameter]:
    excess = _free("grease static friction over sliding, less 1", "1", 0.3, 1.0)
    return [excess, _free("grease Stribeck speed", "m/s", 0.01, 1.5), *_maxwell_slip(bushing)]


def _make_stribeck(bushing: Bushing, excess: float, speed: float, *values: float) -> MaxwellSlip:
    return _make_maxwell_slip(bushing, *values, static_ratio=1 + excess, stribeck_speed=speed)


GREASES = (
    Family("linear", _grease_spring, lambda bushing, k, c, height: Grease(k, c, film_height=height)),
    Family("Bouc-Wen", _bouc_wen, _make_bouc_wen),
    Family("Maxwell-slip", _maxwell_slip, _make_maxwell_slip),
    Family("Maxwell-slip, Stribeck", _stribeck, _make_stribeck),
)
"""what can fill the gap"""


def split(values: Sequence[float], bushing: Bushing, contact: Family, grease: Family) -> tuple[Any, Any]:
    """Contact and grease of the values of both families' parameters, one after the other."""
    n = len(contact.parameters(bushing))
    return contact.make(bushing, *values[:n]), grease.make(bushing, *values[n:])
