"""Rig files of the benches in space: what their designers know."""

import math

from clearance_mj import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker
from clearance_mj.rig import Friction, OilFilm, Spin, Unbalance
from clearance_mj.structure.section import Material, Section
from clearance_mj.structure.shaft import Disc, Shaft, Support

GRAVITY = (0.0, 0.0, -9.81)
RPM = math.pi / 30
TOP_SPEED = {"steering": 60 * RPM, "rotor": 3000 * RPM, "pump": 3000 * RPM}
"""rad/s"""
STEEL = Material(2.1e11, 7850.0)


def designed(kind: str, name: str) -> Rig:
    """Return the rig file of a kind of bench.

    Each offset is that of a straight shaft above the middle of its bushing, towards which its weight bends it.
    """
    return KINDS[kind](name)


def _sensors(places: tuple[float, ...]) -> tuple[Sensor, ...]:
    """Two accelerometers along y and z at each station."""
    axes = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return tuple(Sensor(node, x, direction=axis) for node, x in enumerate(places, 1) for axis in axes)


def _steering(name: str) -> Rig:
    filling, wall, friction = Grease(5e3, 3.0), Contact(2e5, 20.0), Friction(0.1)
    bushings = tuple(
        Bushing(x, 3e-4, 0.012, filling, wall, offset=offset, friction=friction, shape="round")
        for x, offset in ((0.33, 1.2e-4), (0.48, 1.8e-4))
    )
    return Rig(
        name, Beam(0.6, STEEL.young_modulus, STEEL.density, 0.02, rayleigh=(4.0, 1e-5)), bushings,
        _sensors((0.12, 0.24, 0.40, 0.54, 0.6)), (PointMass(0.6, 0.3, "lever"),),
        description="Virtual bench: the rig file is what its designer knows", gravity=GRAVITY,
        shaker=Shaker("base", 0.54), spin=Spin(30 * RPM),
    )  # fmt: skip


def _pinned(length: float, diameter: float, disc: Disc) -> Shaft:
    return Shaft(
        (Section(length, (diameter, diameter)),), (Support(0.0, "pinned"), Support(length, "pinned")), (disc,), STEEL,
        rayleigh=(6.0, 2e-6),
    )  # fmt: skip


def _rotor(name: str) -> Rig:
    bushing = Bushing(
        0.6, 2e-4, 0.02, Grease(0.0, 5.0), Contact(1e6, 50.0), offset=1.2e-4, friction=Friction(0.1), shape="round"
    )  # fmt: skip
    return Rig(
        name, None, (bushing,), _sensors((0.2, 0.35, 0.5, 0.75)), structure=_pinned(1.0, 0.028, DISC),
        description="Virtual bench: the rig file is what its designer knows", gravity=GRAVITY,
        shaker=Shaker("base", 0.5), spin=Spin(900 * RPM), unbalances=(Unbalance(0.35, 2e-4),),
    )  # fmt: skip


def _pump(name: str) -> Rig:
    seal = Bushing(
        0.56, 1.5e-4, 0.02, Grease(0.0), Contact(1e6, 50.0), offset=3e-5, friction=Friction(0.1),
        film=OilFilm(0.02, width="finite"), shape="round"
    )  # fmt: skip
    return Rig(
        name, None, (seal,), _sensors((0.15, 0.3, 0.45, 0.63)), structure=_pinned(0.7, 0.03, IMPELLER),
        description="Virtual bench: the rig file is what its designer knows", gravity=GRAVITY,
        shaker=Shaker("base", 0.3), spin=Spin(900 * RPM), unbalances=(Unbalance(0.45, 1.5e-4),),
    )  # fmt: skip


DISC = Disc(0.35, 3.0, 0.01, "disc", 0.02)
IMPELLER = Disc(0.45, 4.0, 0.008, "impeller", 0.014)
KINDS = {"steering": _steering, "rotor": _rotor, "pump": _pump}
