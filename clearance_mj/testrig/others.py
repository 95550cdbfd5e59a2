"""Three more rigs, of other geometry, gaps, contact and grease physics than the rig of the article's Table 1.

They were made up after the identification was finished, to see what it is worth where it was not developed. Their
datasheets (what a dataset tells) are wrong in the way datasheets are: fresh grease as a spring and damper, Hertz
contact linearised at one gap of penetration.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor
from .truth import Iwan, LuGre, Truth

__all__ = ["RIGS", "VirtualRig"]

RIG_FILE = Path(__file__).parents[2] / "models" / "table1_rig.toml"
"""The datasheet rig of the article's Table 1, in the source tree"""


@dataclass(frozen=True)
class VirtualRig:
    """What a rig's datasheet says, and what its bushings really are."""

    rig: Rig
    """the datasheet"""
    truth: tuple[Truth, ...]
    """of each bushing"""


def _rig(name, description, length, diameter, tip_mass, bushings, sensors):
    beam = Beam(length, young_modulus=210e9, density=7850.0, diameter=diameter, rayleigh=(0.5, 1e-5))
    places = [*sensors, *(b.position for b in bushings), length]
    accelerometers = tuple(Sensor(node, x) for node, x in enumerate(places, 1))
    return Rig(
        name, beam, bushings, accelerometers, (PointMass(length, tip_mass, "lever boss"),), description=description
    )


def _iwan() -> VirtualRig:
    grease, contact = Grease(4600.0, 4.0), Contact(2.1e4, 6.0)
    bushings = (Bushing(0.42, 2e-4, 0.01, grease, contact), Bushing(0.71, 2e-4, 0.01, grease, contact))
    rig = _rig("iwan", "Short shaft, Iwan grease", 0.9, 0.008, 0.25, bushings, (0.12, 0.25, 0.34, 0.56, 0.82))
    truth = Truth(
        contact_stiffness=1e6,
        grease_stiffness=5200.0,
        elastic_ratio=0.6,
        hysteresis=Iwan(3e-4),
        film_damping=3.0,
        film_height=6e-4,
    )
    return VirtualRig(rig, (truth, truth))


def _lugre() -> VirtualRig:
    grease, contact = Grease(7200.0, 4.0), Contact(2.8e4, 6.0)
    bushings = (Bushing(0.55, 3.5e-4, 0.015, grease, contact), Bushing(0.95, 3.5e-4, 0.015, grease, contact))
    rig = _rig("lugre", "Long shaft, LuGre grease", 1.2, 0.011, 0.6, bushings, (0.18, 0.32, 0.45, 0.75, 1.1))
    truth = Truth(
        contact_stiffness=1e6,
        grease_stiffness=8000.0,
        elastic_ratio=0.55,
        hysteresis=LuGre(coulomb=1.2e-4, static=1.8e-4, stribeck_speed=0.02, damping=0.5),
        film_damping=5.0,
        film_height=9e-4,
    )
    return VirtualRig(rig, (truth, truth))


def _mixed() -> VirtualRig:
    bushings = (
        Bushing(0.6, 2.5e-4, 0.012, Grease(4500.0, 3.0), Contact(1.2e4, 4.0)),
        Bushing(0.88, 4e-4, 0.012, Grease(4500.0, 3.0), Contact(3e4, 4.0)),
    )
    words = "Iwan grease in the first bushing, LuGre in the second, unlike gaps and contacts"
    rig = _rig("mixed", words, 1.05, 0.009, 0.4, bushings, (0.16, 0.32, 0.45, 0.72, 0.97))
    first = Truth(
        contact_stiffness=5e5,
        grease_stiffness=4000.0,
        elastic_ratio=0.7,
        hysteresis=Iwan(5e-4),
        film_damping=3.5,
        film_height=7e-4,
    )
    second = Truth(
        contact_stiffness=1e6,
        grease_stiffness=5500.0,
        elastic_ratio=0.5,
        hysteresis=LuGre(coulomb=1.5e-4, static=2.5e-4, stribeck_speed=0.015, damping=0.3),
        film_damping=6.0,
        film_height=1.1e-3,
    )
    return VirtualRig(rig, (first, second))


def _table1() -> VirtualRig:
    return VirtualRig(Rig.load(RIG_FILE), (Truth(), Truth()))


RIGS = {"table1": _table1, "iwan": _iwan, "lugre": _lugre, "mixed": _mixed}
"""What makes each virtual rig, by name"""
