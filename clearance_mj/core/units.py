"""Units of files, options and rigs: one table, from which labels such as "lbf in/rad" are composed.

A label may be written in many ways ("in/s^2", "inch/sec²", "lbf-in", "(m/s²)/N"). One with several meanings, such as g
(an acceleration or a mass), lb (a force or a mass) or Hz (a frequency or a spin), has the one that fits the quantity.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Sequence

from .errors import ClearanceError, RecordError
from .quantities import FOOT, INCH, POUND, POUND_FORCE, QUANTITIES, Dimension

__all__ = ["UNITS", "is_angular", "quantity_of", "ratio_factor", "si_value", "unit_factor"]

UNITS = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    **{name: known.units for name, known in QUANTITIES.items()},
    "mass": {"kg": 1.0, "g": 1e-3, "t": 1e3, "lb": POUND, "lbm": POUND, "oz": POUND / 16,
             "slug": POUND_FORCE / FOOT},
    "pressure": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9, "kPa": 1e3, "mPa": 1e-3, "bar": 1e5, "psi": POUND_FORCE / INCH**2,
                 "ksi": 1e3 * POUND_FORCE / INCH**2},
    "spin": {"rad/s": 1.0, "rpm": math.pi / 30, "rev/min": math.pi / 30, "Hz": 2 * math.pi},
    "torque": {"N m": 1.0, "lbf in": POUND_FORCE * INCH, "lbf ft": POUND_FORCE * FOOT},
}  # fmt: skip
"""Units in SI units, the first of each quantity; products, quotients and powers of them are units, too"""
_DIMENSIONS: dict[str, Dimension] = {
    "time": (0, 0, 1, 0), "frequency": (0, 0, -1, 0), "mass": (0, 1, 0, 0), "pressure": (-1, 1, -2, 0),
    "spin": (0, 0, -1, 1), "torque": (2, 1, -2, 0), **{name: known.dimension for name, known in QUANTITIES.items()},
}  # fmt: skip
_NONE: Dimension = (0, 0, 0, 0)
_SPELLINGS = {
    "s": "sec secs second seconds sekunden", "ms": "msec millis milliseconds", "us": "usec micros microseconds",
    "ns": "nsec nanos nanoseconds", "Hz": "hertz",
    "N": "newton newtons", "um": "micron microns", "g": "g's gs gn", "m s-2": "ms-2",
    "N m": "Nm", "kN m": "kNm", "mN m": "mNm", "N mm": "Nmm", "N cm": "Ncm", "uN m": "uNm",
    "kgf cm": "kgcm kgfcm kpcm", "kgf m": "kgm kgfm", "gf cm": "gcm gfcm",
    "in": "in inch inches", "ft": "ft foot feet", "mil": "mil mils thou", "in/s": "ips", "psi": "psi", "ksi": "ksi",
    "lbf": "lbf lbsf pound-force", "lb": "lb lbs pound pounds", "lbm": "lbm", "oz": "oz ounce ounces", "ozf": "ozf",
    "kip": "kip kips klbf", "slug": "slug slugs", "lbf in": "inlb inlbf lbin lbfin", "lbf ft": "ftlb ftlbf lbft lbfft",
    "ozf in": "ozin ozfin inoz inozf", "rpm": "rpm", "deg": "° º degree degrees", "rad": "rad radian radians",
    "rev": "rev revs revolution revolutions", "turn": "turns", "deg/s": "dps", "rev/s": "rps",
    "ustrain": "microstrain µstrain µε με ue",
}  # fmt: skip
"""Other ways of writing a unit, in lower case"""
_SAME = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()}
_TOKEN = re.compile(
    r"(?P<name>[A-Za-z°º]+(?:'s)?)\.?(?:\^?(?P<power>-?\d))?|(?P<mark>[/()])|1(?=/)|(?P<blank>[\s.-]+)|(?P<bad>.)"
)
_WRITTEN = str.maketrans("²³µμ−·⋅×*[]", "23uu-    ()")
_LONGEST = 40  # characters of a label
_COUNT, _NUMBER_OF = r"(?:tick|count|ct|step|pulse|increment|inc)s?", r"([0-9]+\.?[0-9]*)"
_COUNTS = re.compile(rf"{_COUNT}(?:/{_NUMBER_OF})?|{_NUMBER_OF}(?:[cp]pr|{_COUNT}/(?:turn|rev))", re.IGNORECASE)
"""Units of an encoder, so many of which make a turn: "ticks/4096", "4096 counts/rev", "4096 cpr" """
_MULTIPLE = re.compile(r"(?=[0-9.]*[1-9])([0-9]+\.?[0-9]*(?:[eE][+-]?[0-9]{1,2})?)\s+(\S.*)")  # "9.81 m/s2", "0.5 g"
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")


def si_value(text: str, quantity: str) -> float:
    """Return a number with a unit, such as "620 mm" or "5mil", in SI units; one without a unit is in these already.

    Raises
    ------
    ClearanceError
        If it is no number, or the unit is none of the quantity, see `unit_factor`.
    """
    if not (match := _NUMBER.fullmatch(text.strip())):
        known = ", ".join(UNITS.get(quantity, [quantity]))
        raise ClearanceError(f'"{text}" is no number, alone or with a unit: {known}')
    # Fifteen digits: 24 in are 0.6096 m, not 0.6095999999999999 m.
    return float(f"{float(match[1]) * unit_factor(match[2], quantity):.15g}" if match[2] else match[1])


def quantity_of(label: str, among: Sequence[str] = (*QUANTITIES,)) -> tuple[str, float] | None:
    """Return quantity and SI units in one unit, such as "mm/s²" or "mils"; None of a label of no quantity ``among``.

    Times and frequencies are no quantities that a channel measures. Capitals count: "G" and "M" are other units.
    """
    meanings = _meanings(label)
    if _DIMENSIONS["frequency"] in meanings:
        return None
    return next(((q, meanings[_DIMENSIONS[q]]) for q in among if _DIMENSIONS[q] in meanings), None)


def is_angular(label: str) -> bool:
    """Return whether a label is that of a unit of angle, torque or spin, or so many of one, such as "0.088 deg"."""
    multiple = _MULTIPLE.fullmatch(label.strip())
    known = quantity_of(multiple[2] if multiple else label, ["angle", "torque", "spin"])
    return bool(known) or bool(_COUNTS.fullmatch(re.sub(r"\s", "", label)))


def unit_factor(label: str, quantity: str) -> float:
    """Return the SI units in one unit, such as "g", "(in/s^2)" or "9.9 m/s²", of a quantity or an SI unit."""
    if quantity == "angle" and _COUNTS.fullmatch(re.sub(r"\s", "", label)) and not _meanings(label):
        raise RecordError(f'unit "{label}" of angle needs the number that makes a turn, such as "ticks/4096"')
    dimension = _DIMENSIONS[quantity] if quantity in UNITS else next(iter(_meanings(quantity)), _NONE)
    return _factor(label, dimension, quantity, [*UNITS.get(quantity, [quantity])])


def ratio_factor(label: str, above: str, below: str) -> float:
    """Return the SI units in one unit of a ratio, such as "g/lbf" or "(m/s^2)/N"; "1" for two like quantities."""
    if above == below and label.strip("[( )]") == "1":
        return 1.0
    dimension = _product(_DIMENSIONS[above], _DIMENSIONS[below], -1)
    shown = ["1"] * (above == below) + [f"{a}/{b}" for a in UNITS[above] for b in UNITS[below]]
    return _factor(label, dimension, f"{above}/{below}", shown)


def _factor(label: str, dimension: Dimension, quantity: str, shown: list[str]) -> float:
    if dimension not in _meanings(label) and (multiple := _MULTIPLE.fullmatch(label.strip())):
        return float(multiple[1]) * _factor(multiple[2], dimension, quantity, shown)
    # Some writers have capitals only; "mN" and "MN" both stand in the table, so neither is taken for the other.
    factor = _meanings(label).get(dimension) or _meanings(label, any_case=True).get(dimension)
    if factor is None:
        raise RecordError(f'unit "{label}" of {quantity} is unknown; use {", ".join(shown[:6])}')
    return factor


@functools.lru_cache(1000)
def _meanings(label: str, any_case: bool = False) -> dict[Dimension, float]:
    """Return SI units in one unit by dimension, for each that the label can have; none if it is no unit."""
    if (spelled := _SAME.get(label.lower(), label)) != label:
        return _meanings(spelled, any_case)
    joined = re.sub(r"[\s.·⋅×*-]", "", label.strip(" []()"))
    if counts := _COUNTS.fullmatch(joined):
        turn = float(counts[1] or counts[2] or 0)
        return {_DIMENSIONS["angle"]: 2 * math.pi / turn} if turn else {}
    meanings, spelled = _parse_composed(label, any_case), _SAME.get(joined.lower(), label)
    synonyms = {} if spelled == label else _meanings(spelled, any_case)  # "kg cm" of servos is a torque, too
    return meanings | {dimension: factor for dimension, factor in synonyms.items() if dimension not in meanings}


def _parse_composed(label: str, any_case: bool) -> dict[Dimension, float]:
    """Return what `_meanings` does of products, quotients and powers."""
    factors, sign, outer, within, named = {_NONE: 1.0}, 1, 1, list[int](), False
    for token in _TOKEN.finditer(label.strip().replace("**", "").translate(_WRITTEN)):
        if token["bad"] or token.end() > _LONGEST or (token["mark"] == ")" and not within):
            return {}
        if token["name"]:
            power, named = sign * int(token["power"] or 1), True
            several = _parse_name(token["name"], any_case).items()
            factors = {_product(d, e, power): f * g**power for d, f in factors.items() for e, g in several}
        elif token["mark"] == "(":
            within.append(outer)
            outer = sign
        elif token["mark"] == ")":
            outer = within.pop()
        if not token["blank"]:
            sign = -outer if token["mark"] == "/" else outer
    return factors if named else {}


def _parse_name(name: str, any_case: bool) -> dict[Dimension, float]:
    """Return the SI units in a unit that has a name, by dimension."""
    if quantities := {_DIMENSIONS[q]: units[name] for q, units in UNITS.items() if name in units}:
        return quantities
    if spelled := _SAME.get(name) or _SAME.get(name.lower()):
        return _meanings(spelled)
    lower = name.lower() if any_case else ""
    return {_DIMENSIONS[q]: f for q, units in UNITS.items() for unit, f in units.items() if unit.lower() == lower}


def _product(first: Dimension, other: Dimension, power: int) -> Dimension:
    m, kg, s, rad = (a + power * b for a, b in zip(first, other))
    return m, kg, s, rad
