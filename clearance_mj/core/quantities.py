"""Quantities that channels and sensors measure: one table of units, codes of universal files, and names.

Files, figures, rig files and FRFs all read it: what stands here is known everywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

__all__ = ["FOOT", "INCH", "POUND", "POUND_FORCE", "QUANTITIES", "Dimension", "Quantity", "SensorQuantity"]

# m/s², m, m and kg, exact by definition: NIST SP 811, 2008, B.8
GRAVITY, INCH, FOOT, POUND = 9.80665, 0.0254, 0.3048, 0.45359237
POUND_FORCE = POUND * GRAVITY
Dimension: TypeAlias = tuple[int, int, int, int]
"""Exponents of m, kg, s and rad"""
SensorQuantity: TypeAlias = Literal[
    "acceleration", "velocity", "displacement", "angle", "angular velocity", "strain", "force"
]
"""Quantities that a sensor of a rig may measure: the names in `QUANTITIES`"""


@dataclass(frozen=True)
class Quantity:
    """Quantity that a channel measures."""

    unit: str
    """SI unit as pages and figures show it, such as "m/s²" """
    cf_unit: str
    """the same as UDUNITS writes it, such as "m s-2" """
    units: dict[str, float]
    """units in SI units, the first is that of the written files"""
    dimension: Dimension
    """exponents of m, kg, s and rad"""
    codes: tuple[int, ...]
    """specific data types in universal files (data set 58), the first is written"""
    prefix: str
    """of a column's name in tables, such as "acc" of "acc:3" """
    instrument: str
    """what measures it, one word"""
    words: tuple[str, ...]
    """parts of names, in lower case, that loggers give such channels"""
    in_figures: tuple[str, float]
    """unit of figures, and how many of it are one SI unit"""
    order: int = 0
    """of the time derivative of what the sensor's row gives"""
    motion: str = ""
    """what it is a time derivative of; "" of a quantity that is converted into no other"""

    def __post_init__(self) -> None:
        if self.order not in (0, 1, 2):  # what sensors of a rig compute from displacements and velocities
            raise ValueError(f"a quantity in {self.unit}: order is {self.order}, must be 0, 1 or 2")

    @property
    def ascii_unit(self) -> str:
        """Unit without other characters, such as "m/s^2"."""
        return self.unit.replace("²", "^2")

    @property
    def exponents(self) -> tuple[int, int]:
        """Exponents of length and force in its unit, as universal files have them."""
        m, kg, _, _ = self.dimension
        return m - kg, kg


QUANTITIES: dict[str, Quantity] = {
    "displacement": Quantity(
        "m", "m",
        {"m": 1.0, "mm": 1e-3, "um": 1e-6, "cm": 1e-2, "in": INCH, "mil": 1e-3 * INCH, "ft": FOOT, "dm": 0.1,
         "km": 1e3},
        (1, 0, 0, 0), (8,), "disp", "transducer", ("probe", "disp", "gap", "eddy", "prox", "lvdt", "laser"),
        ("mm", 1e3), 0, "displacement",
    ),
    "velocity": Quantity(
        "m/s", "m s-1", {"m/s": 1.0, "km/h": 1 / 3.6, "mm/s": 1e-3, "in/s": INCH, "ft/s": FOOT, "mph": 0.44704},
        (1, 0, -1, 0), (11,), "vel", "vibrometer", ("velo", "vibrometer", "ldv", "laser"), ("mm/s", 1e3), 1,
        "displacement",
    ),
    "acceleration": Quantity(
        "m/s²", "m s-2",
        {"m/s2": 1.0, "mm/s2": 1e-3, "g": GRAVITY, "in/s2": INCH, "ft/s2": FOOT, "mg": 1e-3 * GRAVITY},
        (1, 0, -2, 0), (12,), "acc", "accelerometer", ("acc", "vib"), ("m/s²", 1.0), 2, "displacement",
    ),
    "force": Quantity(
        "N", "N",
        {"N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "uN": 1e-6, "lbf": POUND_FORCE, "kip": 1e3 * POUND_FORCE,
         "ozf": POUND_FORCE / 16, "lb": POUND_FORCE, "oz": POUND_FORCE / 16, "kgf": GRAVITY, "gf": 1e-3 * GRAVITY},
        (1, 1, -2, 0), (13, 9), "force", "load-cell", ("force", "load"), ("N", 1.0),
    ),
    "strain": Quantity(
        "m/m", "1", {"m/m": 1.0, "um/m": 1e-6, "mm/m": 1e-3, "ustrain": 1e-6},
        (0, 0, 0, 0), (3,), "strain", "gauge", ("strain", "gauge", "dms"), ("µm/m", 1e6),
    ),
    "angle": Quantity(
        "rad", "rad",
        {"rad": 1.0, "deg": math.pi / 180, "turn": 2 * math.pi, "rev": 2 * math.pi, "mrad": 1e-3, "urad": 1e-6,
         "arcmin": math.pi / 10800, "arcsec": math.pi / 648000, "gon": math.pi / 200},
        (0, 0, 0, 1), (8,), "angle", "inclinometer", ("angle", "tilt", "inclin"), ("mrad", 1e3), 0, "angle",
    ),
    "angular velocity": Quantity(
        "rad/s", "rad s-1", {"rad/s": 1.0, "deg/s": math.pi / 180, "rpm": math.pi / 30, "mrad/s": 1e-3},
        (0, 0, -1, 1), (11,), "rate", "gyroscope", ("gyro", "rate of turn"), ("rad/s", 1.0), 1, "angle",
    ),
}  # fmt: skip
"""Quantities by their names. Those with one code are distinguished by the unit's label."""
