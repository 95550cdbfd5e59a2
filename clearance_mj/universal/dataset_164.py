"""Data set 164, the units of a file, and those of a function, whose own labels may say others."""

from __future__ import annotations

from ..core.errors import RecordError
from ..core.units import ratio_factor, unit_factor
from .dataset_58 import Function
from .fields import SI, Block, Units, read_real, text_set

_NO_LABEL = ("", "NONE", "UNKNOWN", "-")
_TOLERANCE = 1e-6  # relative, between a label's factor and the file's, which is written with few digits
UNIT_SET = text_set(
    164,
    (
        f"{1:10d}{'SI: Meter (newton)':>20}{1:10d}",
        "".join(f"{1:25.16e}" for _ in range(3)).replace("e", "D"),
        f"{273.15:25.16e}".replace("e", "D"),
    ),
)  # The data set for SI units


def read_units(block: Block) -> Units:
    """Read the factors of length and force."""
    values = " ".join(block.lines[1:]).split()
    if len(values) < 2:
        raise RecordError("units need two factors, of length and of force, on their second record")
    length, force = (read_real(v, f"factor of {name}") for v, name in zip(values, ("length", "force")))
    if min(length, force) <= 0:
        raise RecordError(f"factors of length and force must be > 0, got {length:g} and {force:g}")
    return Units(length, force)


def time_scale(function: Function, quantity: str) -> float:
    """Return the SI units in one unit of a time function."""
    return _labelled(function, function.unit, quantity)


def frf_scale(function: Function, above: str, below: str) -> float:
    """Return the SI units in one unit of an FRF.

    The label of the ordinate is the numerator's by the format; many writers put the whole ratio there.
    """
    label = function.unit
    if _is_label(label) and not _is_unit(label, above):
        own = function.units.factor(above) / function.units.factor(below)
        return _agreed(function, label, ratio_factor(label, above, below), own)
    numerator, denominator = _labelled(function, label, above), _labelled(function, function.unit_below, below)
    if above == below and _is_label(label) != _is_label(function.unit_below) and numerator != denominator:
        raise RecordError(f'unit "{label}" of the ordinate needs one of the denominator beside it, such as "{label}"')
    return numerator / denominator


def _labelled(function: Function, label: str, quantity: str) -> float:
    own = function.units.factor(quantity)
    return _agreed(function, label, unit_factor(label, quantity), own) if _is_label(label) else own


def _agreed(function: Function, label: str, scale: float, own: float) -> float:
    """Refuse a label that contradicts units that the file states and that are not SI: either may be the wrong one."""
    if function.units != SI and abs(scale / own - 1) > _TOLERANCE:
        raise RecordError(f'unit "{label}" contradicts the units of the file (data set 164), which are not SI')
    return scale


def _is_label(label: str) -> bool:
    return label.upper() not in _NO_LABEL


def _is_unit(label: str, quantity: str) -> bool:
    try:
        unit_factor(label, quantity)
    except RecordError:
        return False
    return True
