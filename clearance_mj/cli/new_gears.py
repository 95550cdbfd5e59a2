"""Pairs of gears that clearance-mj new makes of its options: a loose gear that a driven one takes along."""

from __future__ import annotations

import math
from typing import Any

from ..core.errors import ClearanceError
from ..rig import Load, Order, Shaker, Spin
from ..rig.clearance import Bushing, Contact, Grease
from ..structure import Gears, Inertia
from .command import Options, given, option
from .options import length, si_number_parser

__all__ = ["EXAMPLES", "GEARS", "ONLY_GEARS", "gear_fields"]

EXAMPLES: dict[str, tuple[Any, str]] = {
    "inertias": ((6e-3, 1.5e-3), "inertias.polar_inertia"), "base_radii": ((0.0411, 0.0482), "inertias.base_radius"),
    "backlash": (1.2e-4, "bushings.gap"), "contact": ((3.6e8, 2000.0), "contact.stiffness contact.damping"),
    "torque": (0.25, "loads.torque"), "ripple": (3.5, "orders.torque"), "teeth": (None, "orders.order"),
    "spin": (round(800 * math.pi / 30, 3), "spin.speed"),
}  # fmt: skip
"""Values of options that are not given, those of a fifth gear at idle, and the ends of the paths of these numbers"""
ENGINE = 2.0  # torque pulses in each turn of a four-stroke engine with four cylinders
ONLY_GEARS = ("inertias", "base_radii", "backlash", "torque", "ripple", "teeth")
NOT_OF_GEARS = ("bushings", "gap", "gravity", "unbalance", "friction", "oil", "bushing_material")


GEARS = (
    option("--inertias", "of the driving gear with all that turns with it, and of the loose one, kg m² (example: 6e-3 "
           "1.5e-3)", si_number_parser("kg m2"), nargs=2, metavar=("I1", "I2")),
    option("--base-radii", "pitch radius times the cosine of the pressure angle, m or such as 41.1mm (example: 0.0411 "
           "0.0482)", length, nargs=2, metavar=("R1", "R2")),
    option("--backlash", "from flank to flank along the line of action, m (example: 1.2e-4)", length),
    option("--torque", "mean torque on the driving gear, N m (example: 0.25)", si_number_parser("N m")),
    option("--ripple", "amplitude of its torque's ripple, N m (example: 3.5)", si_number_parser("N m")),
    option("--teeth", "of the driving gear: the ripple comes with each tooth (example: twice a turn, as from an "
           "engine)", int),
)  # fmt: skip
"""Options that describe a pair of gears"""


def gear_fields(options: Options) -> dict[str, Any]:
    """Return structure, mesh, loads, order, spin and shaker of a rig of two gears."""
    for name in given(options, *NOT_OF_GEARS):
        words = "give --backlash" if name in ("--bushings", "--gap") else "leave it out"
        raise ClearanceError(f"{name} is of shafts, and kind gears has one mesh: {words}")
    names, (r1, r2) = ("driving gear", "loose gear"), options.base_radii
    parts = zip((1, 2), options.inertias, options.base_radii, names)
    torques = options.torque, float(f"{-options.torque * r2 / r1:.6g}")
    grease = Grease(*options.grease) if options.grease else Grease(0.0)
    return {
        "structure": Gears(tuple(Inertia(node, inertia, radius, name=name) for node, inertia, radius, name in parts)),
        "bushings": (Bushing("1:X", options.backlash / 2, 0.0, grease, Contact(*options.contact), to="2:X"),),
        "loads": tuple(Load(f"{node}:RX", torque=torque) for node, torque in zip((1, 2), torques)),
        "orders": (Order("1:RX", float(options.teeth or ENGINE), torque=options.ripple),),
        "spin": Spin(options.spin),
        "shaker": Shaker("force", options.force_at or "1:RX"),
    }
