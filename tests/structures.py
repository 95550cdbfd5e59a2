"""Rigs that are no uniform cantilevers: a stepped shaft, two shafts, a lumped chain."""

import numpy as np

from clearance_mj.rig import Bushing, Contact, Grease, PointMass, Rig, Sensor
from clearance_mj.structure import Disc, Material, Matrices, Section, Shaft, Shafts, Spring, Support

STEEL = Material(210e9, 7850.0)
GREASE, CONTACT = Grease(3000.0, 4.0), Contact(8e3, 5.0)


def stepped(**changes) -> Rig:
    """A stepped shaft on two pins, with a disc, a spring and a dashpot under it, and two bushings."""
    shaft = Shaft(
        (Section(0.4, diameter=0.010), Section(0.2, diameter=(0.010, 0.012)), Section(0.5, diameter=0.012)),
        (Support(0.0, "pinned"), Support(0.5, translation=500.0, translation_damping=2.0), Support(1.1, "pinned")),
        (Disc(0.25, 0.3, 1e-4, "wheel"),),
        STEEL,
        (1.0, 2e-6),
    )
    bushings = Bushing(0.4, 3e-4, 0.012, GREASE, CONTACT), Bushing(0.75, 2e-4, 0.010, GREASE, CONTACT)
    sensors = (Sensor(1, 0.2), Sensor(2, 0.4), Sensor(3, 0.55), Sensor(4, 0.75), Sensor(5, 0.95))
    return Rig("stepped", None, bushings, sensors, (PointMass(0.6, 0.2, "boss"),), structure=shaft).replace(**changes)


def two_shafts(**changes) -> Rig:
    """A clamped shaft in a free tube that hangs on springs, with a bushing between them and one on the base."""
    inner = Shaft((Section(0.9, diameter=0.008),), (Support(0.0, "clamped"),), (), STEEL, (1.0, 2e-6), name="inner")
    tube = Section(0.7, diameter=0.030, inner_diameter=0.024)
    outer = Shaft(
        (tube,), (Support(0.3, translation=2e4, translation_damping=5.0), Support(0.9, translation=2e4)), (), STEEL,
        (1.0, 2e-6), start=0.25, name="outer",
    )  # fmt: skip
    structure = Shafts((inner, outer), (Spring("inner@0.4", 2e3, "outer@0.4", 1.0),))
    bushings = (
        Bushing("inner@0.8", 3e-4, 0.012, GREASE, CONTACT, to="outer@0.8"),
        Bushing("inner@0.55", 4e-4, 0.012, GREASE, CONTACT),
    )
    sensors = Sensor(1, "inner@0.55"), Sensor(2, "inner@0.8"), Sensor(3, "outer@0.8"), Sensor(4, "outer@0.3")
    return Rig("two shafts", None, bushings, sensors, structure=structure).replace(**changes)


MASS = np.diag([0.5, 0.4, 0.3])
STIFFNESS = np.array([[7000.0, -3000.0, 0.0], [-3000.0, 5000.0, -2000.0], [0.0, -2000.0, 2000.0]])
DAMPING = np.diag([1.0, 0.2, 0.8])


def chain(**changes) -> Rig:
    """Three masses in a row on the base, with dashpots to it; a clearance between two, and one of the last's."""
    dofs = tuple(f"{node}:Z" for node in (1, 2, 3))
    structure = Matrices("m-kg-s", mass=MASS, stiffness=STIFFNESS, damping=DAMPING, dofs=dofs)
    bushings = (
        Bushing("2:+Z", 3e-4, 0.0, GREASE, CONTACT, to="1:+Z"),
        Bushing("3:+Z", 5e-4, 0.0, GREASE, CONTACT),
    )
    sensors = tuple(Sensor(node, f"{node}:+Z") for node in (1, 2, 3))
    return Rig("chain", None, bushings, sensors, structure=structure).replace(**changes)
