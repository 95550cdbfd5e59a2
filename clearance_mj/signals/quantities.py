"""Quantities of FRFs that their files do not say."""

from __future__ import annotations

from dataclasses import replace

from ..core.checks import UNKNOWN
from ..core.errors import RecordError
from ..core.quantities import QUANTITIES
from ..core.units import ratio_factor
from .frf import FRF

__all__ = ["require_quantity", "two_quantities", "with_quantity"]


def with_quantity(frf: FRF, quantity: str, unit: str = "") -> FRF:
    """Return FRFs of unknown quantity with the quantity given, in SI units.

    Parameters
    ----------
    frf : FRF
        The functions, in the unit of their file.
    quantity : str
        Such as "acceleration/force".
    unit : str
        Such as "g/N"; empty: the label of their file or, without one, SI.

    Raises
    ------
    RecordError
        If the quantity is known already, or the unit is none of the quantity.
    """
    above, below = two_quantities(quantity)
    if UNKNOWN not in frf.quantity:
        raise RecordError(f"the FRFs are {frf.quantity}, as their file says")
    label = unit or frf.unit_label
    scale = ratio_factor(label, above, below) if label else 1.0
    return replace(frf, value=scale * frf.value, quantity=quantity, unit_label="")


def two_quantities(quantity: str, *others: str) -> tuple[str, str]:
    """Return both quantities of a ratio; refuses one that is none of `QUANTITIES` and none of the others."""
    above, _, below = quantity.partition("/")
    if not {above, below} <= {*QUANTITIES, *others}:
        raise RecordError(f'quantity "{quantity}" is unknown; needs two of {", ".join(QUANTITIES)} as a/b')
    return above, below


def require_quantity(frf: FRF) -> None:
    """Refuse FRFs of unknown quantity, and say how to give it."""
    if UNKNOWN in frf.quantity:
        unit = f" (unit {frf.unit_label})" if frf.unit_label else ""
        raise RecordError(
            f"the quantity of the FRFs is {frf.quantity}{unit}; say what they are: clearance-mj convert FILE NEW "
            '--quantity "acceleration/force [g/N]", or signals.with_quantity(frf, "acceleration/force", "g/N")'
        )
