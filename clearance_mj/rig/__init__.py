"""The rig: a linear structure, point masses on it, bushings or other clearances, sensors and shaker.

Plain frozen data in SI units, read from and written to TOML. Every impossible value is refused by
`RigError` with a message that names the field.
"""

from ..structure import Beam
from .bearings import Bearing
from .clearance import Bushing, Contact, Friction, Grease, OilFilm
from .instruments import BASE_NODE, KEYPHASOR_NODE, PROBE_NODE, SHAKER_NODE, AppliedForce, Sensor, Shaker
from .loads import Load, Order
from .plate import Plate
from .rig import PointMass, Rig, rig_schema
from .spinning import Spin, Unbalance
from .tolerance import Tolerance

__all__ = [
    "BASE_NODE", "KEYPHASOR_NODE", "PROBE_NODE", "SHAKER_NODE", "AppliedForce", "Beam", "Bearing", "Bushing", "Contact",
    "Friction", "Grease", "Load", "OilFilm", "Order", "Plate", "PointMass", "Rig", "Sensor", "Shaker", "Spin",
    "Tolerance", "Unbalance", "rig_schema",
]  # fmt: skip
