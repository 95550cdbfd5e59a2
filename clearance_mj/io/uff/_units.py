"""Units of a function: those of the file (data set 164), unless labels of its own say others."""

from __future__ import annotations

from ...errors import RecordError
from ...units import ratio_factor, unit_factor
from ._dataset_58 import Function

_NO_LABEL = ("", "NONE", "UNKNOWN", "-")
_TOLERANCE = 1e-6
"""relative, between a label's factor and the file's, which is written with few digits"""


def time_scale(function: Function, quantity: str) -> float:
    """SI units in one unit of a time function."""
    return _labelled(function, function.unit, quantity)


def frf_scale(function: Function, above: str, below: str) -> float:
    """SI units in one unit of an FRF.

    The label of the ordinate is the numerator's by the format; many writers put the whole ratio there.
    """
    label = function.unit
    if _is_label(label) and not _is_unit(label, above):
        scale = ratio_factor(label, above, below)
        return _agreed(function, label, scale, function.factor(above) / function.factor(below))
    numerator, denominator = _labelled(function, label, above), _labelled(function, function.unit_below, below)
    if above == below and _is_label(label) != _is_label(function.unit_below) and numerator != denominator:
        raise RecordError(f'unit "{label}" of the ordinate needs one of the denominator beside it, such as "{label}"')
    return numerator / denominator


def _labelled(function, label, quantity) -> float:
    own = function.factor(quantity)
    return _agreed(function, label, unit_factor(label, quantity), own) if _is_label(label) else own


def _agreed(function, label, scale, own) -> float:
    """Refuse a label that contradicts units that the file states and that are not SI: either may be the wrong one."""
    if function.factors != (1.0, 1.0) and abs(scale / own - 1) > _TOLERANCE:
        raise RecordError(f'unit "{label}" contradicts the units of the file (data set 164), which are not SI')
    return scale


def _is_label(label) -> bool:
    return label.upper() not in _NO_LABEL


def _is_unit(label, quantity) -> bool:
    try:
        unit_factor(label, quantity)
    except RecordError:
        return False
    return True
