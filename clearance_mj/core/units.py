"""Units that files may be in."""

from __future__ import annotations

import math
import re

from .checks import QUANTITIES
from .errors import ClearanceError, RecordError

__all__ = ["UNITS", "is_angular", "quantity_of", "ratio_factor", "si_value", "unit_factor"]

UNITS = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "acceleration": {"m/s2": 1.0, "mm/s2": 1e-3, "g": 9.80665, "m/s/s": 1.0},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3},
    "displacement": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "cm": 1e-2},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6},
    "mass": {"kg": 1.0, "g": 1e-3, "t": 1e3},
    "pressure": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
    "spin": {
        "rad/s": 1.0, "rpm": math.pi / 30, "rev/min": math.pi / 30, "Hz": 2 * math.pi, "deg/s": math.pi / 180,
        "mrad/s": 1e-3, "rev/s": 2 * math.pi, "turn/s": 2 * math.pi,
    },
    "angle": {
        "rad": 1.0, "deg": math.pi / 180, "turn": 2 * math.pi, "rev": 2 * math.pi, "mrad": 1e-3, "urad": 1e-6,
        "arcmin": math.pi / 10800, "arcsec": math.pi / 648000, "gon": math.pi / 200,
    },
    "torque": {
        "Nm": 1.0, "MNm": 1e6, "mNm": 1e-3, "Nmm": 1e-3, "Ncm": 1e-2, "uNm": 1e-6, "kNm": 1e3, "kgcm": 9.80665e-2,
        "kgm": 9.80665, "gcm": 9.80665e-5, "ozin": 7.0615518e-3, "lbin": 0.11298483, "lbft": 1.3558179,
    },
}  # fmt: skip
"""Units that are known, in SI units, by quantity"""
_MULTIPLE = re.compile(r"(?=[0-9.]*[1-9])([0-9]+\.?[0-9]*(?:[eE][+-]?[0-9]{1,2})?)\s+(\S.*)")  # "9.81 m/s2", "0.5 g"

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")


def si_value(text: str, quantity: str) -> float:
    """Return a number with a unit, such as "620 mm" or "0.09mm", in SI units; one without a unit is in these already.

    Raises
    ------
    ClearanceError
        If it is no number, or the unit is none of the quantity's in `UNITS`.
    """
    found = _NUMBER.fullmatch(text.strip())
    if not found:
        raise ClearanceError(f'"{text}" is no number, alone or with a unit: {", ".join(UNITS[quantity])}')
    return float(found[1]) * (unit_factor(found[2], quantity) if found[2] else 1.0)


_SAME = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "sekunden": "s", "msec": "ms", "milliseconds": "ms",
    "usec": "us", "microseconds": "us", "millis": "ms", "micros": "us", "nanos": "ns", "nsec": "ns",
    "nanoseconds": "ns", "°": "deg", "º": "deg", "degree": "deg", "degrees": "deg", "°/s": "deg/s", "dps": "deg/s",
    "radian": "rad", "radians": "rad", "turns": "turn", "revs": "rev", "revolution": "rev", "revolutions": "rev", "turns/s": "turn/s",
    "rps": "rev/s", "kgfcm": "kgcm", "kgfm": "kgm", "kpcm": "kgcm", "gfcm": "gcm", "ozfin": "ozin", "inoz": "ozin",
    "inozf": "ozin", "lbfin": "lbin", "inlb": "lbin", "inlbf": "lbin", "lbfft": "lbft", "ftlb": "lbft", "ftlbf": "lbft",
    "newton": "N", "newtons": "N", "hertz": "Hz", "micron": "um", "microns": "um",
    "g's": "g", "gn": "g", "m/sec2": "m/s2", "m.s-2": "m/s2", "ms-2": "m/s2", "m/sec": "m/s", "mm/sec": "mm/s",
}  # fmt: skip
"""Other ways of writing a unit, in lower case"""
_COUNT, _NUMBER_OF = r"(?:tick|count|ct|step|pulse|increment|inc)s?", r"([0-9]+\.?[0-9]*)"
_COUNTS = re.compile(rf"{_COUNT}(?:/{_NUMBER_OF})?|{_NUMBER_OF}(?:[cp]pr|{_COUNT}/(?:turn|rev))", re.IGNORECASE)
"""Units of an encoder, so many of which make a turn: "ticks/4096", "4096 counts/rev", "4096 cpr" """


def quantity_of(label: str) -> tuple[str, float] | None:
    """Return quantity and SI units in one unit that only one quantity has, such as "mm/s²"; None of any other label.

    Times and frequencies are no quantities that a channel measures. Capitals count: "G" and "M" are other units.
    """
    plain = _plain(label)
    for quantity in QUANTITIES:
        if plain in UNITS[quantity]:
            return quantity, UNITS[quantity][plain]
    return None


def is_angular(label: str) -> bool:
    """Whether a label is that of a unit of angle, torque or spin."""
    multiple = _MULTIPLE.fullmatch(label.strip())
    known = {*UNITS["angle"], *UNITS["torque"], *UNITS["spin"]}
    return _plain(multiple[2] if multiple else label) in known or bool(_COUNTS.fullmatch(_plain(label)))


def unit_factor(label: str, quantity: str) -> float:
    """Return the SI units in one unit, such as "g", "mm/s²", "(m/s^2)" or "9.9 m/s²", of a quantity of `UNITS`."""
    if quantity == "angle" and (counts := _COUNTS.fullmatch(_plain(label))):
        if not (turn := float(counts[1] or counts[2] or 0)):
            raise RecordError(f'unit "{label}" of angle needs the number that makes a turn, such as "ticks/4096"')
        return 2 * math.pi / turn
    return _look_up(label, UNITS[quantity], quantity)


def ratio_factor(label: str, above: str, below: str) -> float:
    """SI units in one unit of a ratio, such as "g/N" or "(m/s^2)/N"; "1" for the ratio of two like quantities."""
    known = {f"{a}/{b}": x / y for a, x in UNITS[above].items() for b, y in UNITS[below].items()}
    return _look_up(label, {"1": 1.0} | known if above == below else known, f"{above}/{below}")


def _look_up(label: str, known: dict[str, float], quantity: str) -> float:
    if multiple := _MULTIPLE.fullmatch(label.strip()):
        return float(multiple[1]) * _look_up(multiple[2], known, quantity)
    plain = _plain(label)
    # Some writers have capitals only; "mN" and "MN" both stand in the table, so neither is taken for the other.
    lower = {unit.lower(): factor for unit, factor in known.items()}
    if plain not in known and plain.lower() not in lower:
        shown = [*known][:6]
        raise RecordError(f'unit "{label}" of {quantity} is unknown; use {", ".join(shown)}')
    return known[plain] if plain in known else lower[plain.lower()]


def _plain(label: str) -> str:
    """A label without what writers of files set differently."""
    text = re.sub(r"[\s()\[\]^*·]", "", label.replace("²", "2").replace("µ", "u").replace("μ", "u").replace("−", "-"))
    text = re.sub(r"(?<=[A-Za-z])[.⋅×-](?=[A-Za-z])", "", text)  # "N.m", "oz-in"
    return _SAME.get(text.lower(), text)
