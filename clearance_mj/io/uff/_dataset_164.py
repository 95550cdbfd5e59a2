"""Data set 164: units."""

from __future__ import annotations

from ...errors import RecordError
from ._fields import read_real


def unit_factors(text: bytes) -> tuple[float, float]:
    """Units of length and of force in the file's system that make one SI unit (data set 164)."""
    lines = text.decode("ascii", "replace").splitlines()
    values = " ".join(lines[2:]).split()
    if len(values) < 2:
        raise RecordError("units need two factors, of length and of force, on their second record")
    length, force = (read_real(v, f"factor of {name}") for v, name in zip(values, ("length", "force")))
    if min(length, force) <= 0:
        raise RecordError(f"factors of length and force must be > 0, got {length:g} and {force:g}")
    return length, force


def unit_set() -> dict:
    """SI units, as pyuff writes them."""
    return {
        "type": 164,
        "units_code": 1,
        "units_description": "SI: Meter (newton)",
        "temp_mode": 1,
        "length": 1.0,
        "force": 1.0,
        "temp": 1.0,
        "temp_offset": 273.15,
    }
