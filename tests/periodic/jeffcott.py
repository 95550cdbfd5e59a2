"""A Jeffcott rotor of unit mass, frequency and gap, and a rigid rotor in two oil films, as rigs in space."""

import dataclasses

import numpy as np

from clearance_mj.rig import Bushing, Contact, Friction, Grease, OilFilm, Rig, Sensor, Shaker, Spin, Unbalance
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

FREQUENCY, MASS, GAP = 60.0, 3.0, 1e-4  # rad/s, kg, m
STIFFNESS = MASS * FREQUENCY**2


def jeffcott(damping: float = 0.1, contact: float = 20.0, friction: float = 0.0, **changes) -> Rig:
    """m = k = δ = 1 in units of mass, frequency and gap; a light shaft with its disc in the bushing."""
    diameter = (64 * STIFFNESS / (48 * 2.1e11 * np.pi)) ** 0.25
    shaft = Shaft(
        (Section(1.0, (diameter, diameter)),), (Support(0.0, "pinned"), Support(1.0, "pinned")), (Disc(0.5, MASS),),
        Material(2.1e11, 1e-3), (damping * FREQUENCY, 0.0), theory="euler",
    )  # fmt: skip
    rubs = Friction(friction) if friction else None
    bushing = Bushing(0.5, GAP, 0.0, Grease(0.0), Contact(contact * STIFFNESS), friction=rubs, shape="round")
    shaker, sensors = Shaker("force", 0.5), (Sensor(1, 0.5),)
    return Rig("jeffcott", None, (bushing,), sensors, structure=shaft, shaker=shaker).replace(**changes)


def unbalanced(rig: Rig, eccentricity: float = 0.2) -> Rig:
    """The rig with a mass off its axis by a share of the gap."""
    return rig.replace(spin=Spin(FREQUENCY), unbalances=(Unbalance(0.5, MASS * eccentricity * GAP),))


CLEARANCE, GRAVITY, LENGTH, SURFACE = 5e-5, 9.81, 0.01, 0.015  # m, m/s²


def rigid_in_oil(viscosity: float, speed: float) -> Rig:
    """A rigid rotor in two short bearings that carry half of it each, without any other support."""
    shaft = Shaft((Section(0.2, (0.03, 0.03)),), (), (), Material(2.1e11, 7850.0), theory="euler")
    oil = {"grease": Grease(0.0), "contact": Contact(1e7), "film": OilFilm(viscosity), "shape": "round"}
    bushings = tuple(Bushing(x, CLEARANCE, LENGTH, **oil) for x in (0.02, 0.18))
    return Rig(
        "rigid", None, bushings, (Sensor(1, 0.1),), structure=shaft, gravity=(0.0, 0.0, -GRAVITY),
        spin=Spin(speed), shaker=Shaker("force", 0.1),
    )  # fmt: skip


def viscosity_at(ratio: float, speed: float) -> float:
    """The viscosity at which that rotor rests at an eccentricity ratio: S (L/D)² of Ocvirk's locus."""
    number = (1 - ratio**2) ** 2 / (np.pi * ratio * np.sqrt(np.pi**2 * (1 - ratio**2) + 16 * ratio**2))
    number /= (LENGTH / (2 * SURFACE)) ** 2
    load = np.pi * SURFACE**2 * 0.2 * 7850.0 * GRAVITY / 2
    return number * load / (speed / (2 * np.pi) * LENGTH * 2 * SURFACE * (SURFACE / CLEARANCE) ** 2)


def replaced(rig: Rig, **changes) -> Rig:
    """The rig with other values of every bushing."""
    return rig.replace(bushings=tuple(dataclasses.replace(b, **changes) for b in rig.bushings))
