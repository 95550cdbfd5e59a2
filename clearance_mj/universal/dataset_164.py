"""Data set 164, the units of a file, and those of a function, whose labels may say others."""

from __future__ import annotations

from typing import NamedTuple

from ..core.checks import UNKNOWN
from ..core.errors import RecordError
from ..core.units import UNITS, ratio_factor, unit_factor
from .dataset_58 import Function
from .fields import SI, Block, FileUnits, quantity_of, read_real, text_set

_NO_LABEL = ("", "NONE", "UNKNOWN", "-")
_TOLERANCE = 1e-6  # relative, between a label's factor and the file's, which is written with few digits
_ONE, _ICE_POINT = (f"{value:25.16e}".replace("e", "D") for value in (1, 273.15))
UNIT_SET = text_set(164, (f"{1:10d}{'SI: Meter (newton)':>20}{1:10d}", 3 * _ONE, _ICE_POINT))
"""The data set for SI units"""


class FunctionQuantity(NamedTuple):
    """Quantity, unit and scale of a function's numbers."""

    quantity: str
    """such as "acceleration" or "acceleration/force"; a part that no calculation uses is "unknown" """
    unit: str
    """label in the file where the quantity is unknown, otherwise empty"""
    scale: float
    """SI units in one of the file's; 1 where the quantity is unknown"""


def parse_units(text: str) -> FileUnits:
    """Return the units of a file that a user names: "SI", or length and force, such as "mm,N".

    Parameters
    ----------
    text : str
        The names.
    """
    length, _, force = ("m,N" if text.strip().upper() == "SI" else text).partition(",")
    try:
        return FileUnits(1 / unit_factor(length, "displacement"), 1 / unit_factor(force, "force"))
    except RecordError:
        raise RecordError(
            f'units "{text}" are unknown; use SI, or a length of {", ".join(UNITS["displacement"])} and a force of '
            f'{", ".join(UNITS["force"])}, such as "mm,N"'
        ) from None


def read_units(block: Block, notes: list[str]) -> FileUnits:
    """Read the factors of length and force; factors of zero say nothing, so that SI is taken and noted."""
    values = " ".join(block.lines[1:]).split()
    if len(values) < 2:
        raise RecordError(
            'units need two factors, of length and of force, on their second record; units="SI" (convert '
            "--units SI) does without"
        )
    length, force = (read_real(v, f"factor of {name}") for v, name in zip(values, ("length", "force")))
    if min(length, force) <= 0:
        notes.append(
            f"data set {block.number} (164, units) has factors {length:g} and {force:g} of length and force, which are "
            'no units; taken for SI (another: units="mm,N", convert --units mm,N)'
        )
        return SI
    return FileUnits(length, force)


def time_measure(function: Function, notes: list[str]) -> FunctionQuantity:
    """Return quantity, unit and scale of a time function."""
    quantity, label = quantity_of(function.numerator, function.unit), function.unit
    if quantity == UNKNOWN:
        return _unknown(UNKNOWN, label)
    scale = _scale(function, label, quantity)
    return _unknown_unit(function, quantity, label, notes) if scale is None else FunctionQuantity(quantity, "", scale)


def frf_measure(function: Function, notes: list[str]) -> FunctionQuantity:
    """Return quantity, unit and scale of an FRF, a ratio of two quantities.

    The label of the ordinate is the numerator's by the format; many writers put the whole ratio there.
    """
    label, label_below = function.unit, function.unit_below
    above, below = quantity_of(function.numerator, label), quantity_of(function.denominator, label_below)
    full_label = label if "/" in label or not _is_label(label_below) else f"{label}/{label_below}"
    if UNKNOWN in (above, below):
        return _unknown(f"{above}/{below}", full_label)
    if (scale := _scale(function, label, above)) is None:
        try:
            scale = ratio_factor(label, above, below)
        except RecordError:
            return _unknown_unit(function, f"{above}/{below}", full_label, notes)
        file_scale = function.units.factor(above) / function.units.factor(below)
        return FunctionQuantity(f"{above}/{below}", "", _agreed(function, label, scale, file_scale))
    scale_below = _scale(function, label_below, below)
    is_half_labelled = above == below and _is_label(label) != _is_label(label_below)
    if scale_below is None or (is_half_labelled and scale != scale_below):  # of g over what?
        return _unknown_unit(function, f"{above}/{below}", full_label, notes)
    return FunctionQuantity(f"{above}/{below}", "", scale / scale_below)


def label_of(text: str) -> str:
    """Return a label of a unit, empty where a program wrote that there is none."""
    return text if _is_label(text) else ""


def _unknown(quantity: str, label: str) -> FunctionQuantity:
    return FunctionQuantity(quantity, label_of(label), 1.0)


def _unknown_unit(function: Function, quantity: str, label: str, notes: list[str]) -> FunctionQuantity:
    """Return an unknown quantity, and note that its label is not among its units: numbers are taken as they are."""
    notes.append(
        f'data set {function.number}: unit "{label}" of {quantity} is not known, so its quantity is not; values are as '
        "in the file"
    )
    return _unknown("/".join(UNKNOWN for _ in quantity.split("/")), label)


def _agreed(function: Function, label: str, scale: float, file_scale: float) -> float:
    """Return a label's scale; refuses one that contradicts units of the file that are not SI: either may be wrong."""
    if function.units != SI and abs(scale / file_scale - 1) > _TOLERANCE:
        raise RecordError(
            f'unit "{label}" contradicts the units of the file (data set 164), which are not SI; units="SI" '
            "(convert --units SI) follows the labels"
        )
    return scale


def _scale(function: Function, label: str, quantity: str) -> float | None:
    """Return the SI units in one of a function's numbers, by their label or the file; None of an unknown label."""
    file_scale = function.units.factor(quantity)
    if not _is_label(label):
        return file_scale
    scale = known_factor(label, quantity)
    return None if scale is None else _agreed(function, label, scale, file_scale)


def known_factor(label: str, quantity: str) -> float | None:
    """Return the SI units in one unit of a quantity; None of a label that is none of its units."""
    try:
        return unit_factor(label, quantity)
    except RecordError:
        return None


def _is_label(label: str) -> bool:
    return label.upper() not in _NO_LABEL
