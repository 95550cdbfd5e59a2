"""Tolerances of a rig's numbers: standard deviations with units, as a rig file states them."""

from __future__ import annotations

import re

from ..core.errors import RecordError, RigError
from ..core.units import UNITS, unit_factor
from ..core.validation import Text, checked

__all__ = ["Tolerance", "unit_of"]

LENGTHS = (
    "position", "to", "gap", "length", "offset", "diameter", "inner_diameter", "width", "height", "film_height",
    "start", "lever", "offset_y",
)  # fmt: skip
FIELDS = dict.fromkeys(LENGTHS, "m") | {
    "young_modulus": "Pa", "density": "kg/m³", "mass": "kg", "inertia": "kg m²", "polar_inertia": "kg m²",
    "stiffness": "N/m", "damping": "N s/m", "translation": "N/m", "rotation": "N m/rad", "gain": "",
    "damping_ratios": "", "poisson_ratio": "", "frequency": "Hz", "damping_ratio": "", "participation": "",
    "rocking": "rad/m", "about": "m", "difference": "", "angle": "rad", "rotation_damping": "N m s/rad",
    "translation_damping": "N s/m", "delay": "s", "probe_delay": "s", "direction": "", "probe_angle": "rad",
    "coefficient": "", "viscosity": "Pa s", "wear": "m²/N",
}  # fmt: skip
"""SI units of the fields that may be uncertain"""
_STD = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
CLAMP_COMPLIANCES = ("beam.clamp.rotation", "beam.clamp.translation")
"""Known as a length: the clamp gives as so much more shaft would."""


@checked(RigError)
class Tolerance:
    """Uncertainty of a number of the rig."""

    of: Text
    """path to a number of the rig, such as "bushings[0].position", or "sensors.gain" for that of every sensor"""
    std: Text
    """standard deviation with its unit: "2 mm", or "3 %" of the value (of an offset: of the gap); "0 %": exact; of what
    has no unit, such as a coefficient of friction, a number: "0.02" """

    def __post_init__(self) -> None:
        unit = unit_of(self.of)
        match = _STD.fullmatch(self.std)
        allowed = ["%", *next((units for units in UNITS.values() if unit in units), [unit] * bool(unit))]
        if self.of in CLAMP_COMPLIANCES:
            allowed.remove("%")
        use = f"a number and one of the units {', '.join(allowed)}" if unit else "a number, alone or with %"
        if not match:
            raise ValueError(f'std "{self.std}" is no standard deviation: {use}')
        if not match[2] and unit:
            raise ValueError(f'std "{self.std}" has no unit: {use}')
        if float(match[1]) < 0:
            raise ValueError(f'std "{self.std}" is negative; 0 stands for an exact value')
        try:
            if match[2] not in (*allowed, unit):
                unit_factor(match[2], unit)
        except RecordError:
            raise ValueError(f'std "{self.std}" has a unit that {self.of} has not: {use}') from None

    @property
    def relative(self) -> bool:
        """True if it is a fraction of the value."""
        return self.std.rstrip().endswith("%")

    @property
    def size(self) -> float:
        """Standard deviation in SI units, or as a fraction of the value."""
        match = _STD.fullmatch(self.std)
        assert match
        factor = unit_factor(match[2], unit_of(self.of)) if match[2].strip("%") else 1.0
        return float(match[1]) * (0.01 if self.relative else factor)


def unit_of(path: str) -> str:
    """Return the SI unit of the number that a path leads to; a ValueError for a field that is known exactly."""
    if path in CLAMP_COMPLIANCES:
        return "m"
    field = re.sub(r"\[\d+\]$", "", path).rpartition(".")[2]
    above = re.sub(r"\[\d+\]$", "", path.rpartition(".")[0]).rpartition(".")[2]
    field = above if above in FIELDS and field not in FIELDS else field  # one end of a tapered section
    if field not in FIELDS:
        raise ValueError(f'of "{path}" names no number with a tolerance; known: {", ".join(FIELDS)}')
    return FIELDS[field]
