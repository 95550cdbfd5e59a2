"""Units of channels whose places on the rig are known.

Transfer functions show the ratio of every channel's unit to that of the excitation. The excitation's unit follows from
the files, or from channels whose unit is stated, such as probes; or from the shaft's motion in its clearances.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ...core.units import UNITS

__all__ = ["ChannelUnits", "Unit", "decide_units", "nearest_unit"]

NEAR = 1.35  # factor within which a gain is that of a unit
SAID_WRONGLY = 4.0  # ln of the odds against a unit that files say being wrong, for all channels of one quantity
ALSO = 1.5  # more, by the share of such channels
NO_UNIT = 6.0  # ln of the odds against a gain that is that of no unit
GUESSED = ("m/s2", "mm/s2", "g", "m/s", "mm/s", "m", "mm", "um", "cm", "N", "mN", "kN", "MN", "m/m", "um/m", "rad",
           "mrad", "deg")  # fmt: skip
"""Units that a channel is guessed to be in: with many more, some unit would be near to any gain"""
UNUSUAL = {"mm/s2": 2.0, "um": 0.5, "kN": 1.0, "mN": 3.0, "MN": 4.0, "cm": math.inf}
"""ln of the odds against a unit where files say none; inf: it is not guessed"""
USUAL_MOTION, MOTION_SPREAD = 0.8, 0.5
"""RMS motion in a clearance over its gap, of benches that touch their walls, and the standard deviation of its
logarithm; of drawn benches 0.3 to 1.6"""
SURE = 3.0  # by which the best units must be better than others


class Unit(NamedTuple):
    """A unit that a channel may be in."""

    factor: float  #: SI units in one unit of the numbers as they are read
    label: str  #: "" where the file says the right one
    exists: bool = True  #: True of a unit, False of a mere number


@dataclass(frozen=True)
class ChannelUnits:
    """Units of the assigned channels."""

    factor: tuple[float, ...]  #: SI units in one unit of each channel as it is read
    label: tuple[str, ...]  #: the unit, such as "g" or "0.51 m/s2"; "" where it is that of the file
    contradicts: tuple[bool, ...]  #: True where the file says another unit
    exists: tuple[bool, ...]  #: True where it is a unit at all
    sure: bool  #: True if no other units of the excitation explain the channels nearly as well


def decide_units(
    quantities: Sequence[str], said: Sequence[bool], gains: Sequence[float], motion: float, impacts: bool
) -> ChannelUnits:
    """Return the units of channels, the last of which is the excitation.

    Parameters
    ----------
    quantities : sequence of str
        Of each channel, by its place.
    said : sequence of bool
        True where the file says the unit, so that the channel's numbers are in SI units if it is right.
    gains : sequence of float
        Reading of each channel over that of the rig, for one reading of the excitation.
    motion : float
        RMS motion in a clearance over its gap, if the excitation's numbers are in SI units.
    impacts : bool
        True if the records show impacts.
    """
    tried = []
    for driven in _candidates(quantities[-1], said[-1]):
        units = [_nearest(q, s, driven.factor / gain) for q, s, gain in zip(quantities[:-1], said[:-1], gains[:-1])]
        units.append(driven)
        cost = sum(UNUSUAL.get(unit.label, 0.0) for unit, s in zip(units, said) if not s)
        cost += sum(NO_UNIT for unit in units if not unit.exists)
        wrong = [(q, unit.factor) for unit, q, s in zip(units, quantities, said) if s and unit.label and unit.exists]
        cost += SAID_WRONGLY * len(set(wrong)) + ALSO * len(wrong) / len(said)
        cost += _odds_against_motion(motion * driven.factor, impacts)
        tried.append((cost, units))
    (least, best), *others = sorted(tried, key=lambda candidate: candidate[0])
    factor, label, exists = zip(*best)
    contradicts = tuple(bool(unit) and s for unit, s in zip(label, said))
    return ChannelUnits(factor, label, contradicts, exists, not others or others[0][0] - least >= SURE)


def _candidates(quantity: str, said: bool) -> list[Unit]:
    """Return the units that a channel's numbers may have."""
    known = UNITS[quantity]
    units = {unit: factor for unit, factor in known.items() if unit in GUESSED} or {next(iter(known)): 1.0}
    if not said:
        return [Unit(factor, unit) for unit, factor in units.items() if UNUSUAL.get(unit) != math.inf]
    # Numbers in one unit that are read as if they were in another; SI units of a file are what is meant most often.
    first = next(iter(units))
    units_by_factor = {_rounded_log(factor): Unit(factor, unit) for unit, factor in units.items()}
    for a, b in itertools.permutations(units.values(), 2):
        units_by_factor.setdefault(_rounded_log(a / b), Unit(a / b, f"{a / b:.5g} {first}"))
    return [*(units_by_factor | {0.0: Unit(1.0, "")}).values()]


def _odds_against_motion(motion: float, impacts: bool) -> float:
    """Ln of the odds against a motion in the clearances: small ones are usual where there are no impacts."""
    if motion <= 0 or (motion < USUAL_MOTION and not impacts):
        return 0.0
    return 0.5 * (math.log(motion / USUAL_MOTION) / MOTION_SPREAD) ** 2


def _rounded_log(factor: float) -> float:
    return round(math.log(factor), 4) + 0.0


def nearest_unit(quantity: str, said: bool, factor: float) -> Unit:
    """Return the unit whose factor to SI units is nearest to a given one.

    Parameters
    ----------
    quantity : str
        Measured quantity.
    said : bool
        True if the file says a unit, so that the right one has the factor 1.
    factor : float
        SI units in one unit of the numbers as they are read.
    """
    return min(_candidates(quantity, said), key=lambda unit: abs(math.log(unit.factor / factor)))


def _nearest(quantity: str, said: bool, factor: float) -> Unit:
    """Return the unit nearest to a factor, or the factor itself if it is that of no unit."""
    near = nearest_unit(quantity, said, factor)
    if abs(math.log(near.factor / factor)) <= math.log(NEAR):
        return near
    return Unit(factor, f"{factor:.3g} {next(iter(UNITS[quantity]))}", exists=False)
