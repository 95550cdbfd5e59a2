"""Benches in space: what the designer knows (the rig file) and what really stands there (the truth), from a seed.

Drawn, 1 σ and cut at 2 σ: Young's modulus 3 %, density 1 %, masses 5 %, clamp as of 0 to 2 diameters more shaft or
elastic supports, modal damping within a factor of 2, gaps 20 % and out of round by 5 %, offsets 0.3 of the gap along y
and z, gains 1 %, cross-axis sensitivity 2 %, places 2 mm, probes turned by 2 degrees, viscosity and friction within a
factor of 1.5, contact and unbalance within one of 2.
"""

import cmath
import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from clearance_mj import ClearanceError
from clearance_mj.rig import Bushing, Rig

from ..shaft import Clamp
from . import motion, physics, rigs
from .hidden import Structure, draw_structure
from .holes import Hole, as_arrays, dashpot
from .shaft import Disc, Rotor, Support

IGNORANCES = ("gaps", "offsets", "sensors", "linear", "places", "physics", "unbalance")
"""What a rig file may get wrong: gaps and their roundness; offsets; sensors and probes; modulus, density, masses,
supports and damping; the bushings' places; contact, friction, grease and viscosity; unbalance"""
ATTEMPTS = 200
BEARING = 4e7  # N/m of supports that the designer takes to be rigid
EDGE = 0.97  # of the narrowest gap, within which the unloaded shaft lies


@dataclass(frozen=True)
class Station:
    """Two accelerometers as they really are, along y and z."""

    position: float
    gains: tuple[float, float]
    cross: tuple[float, float]  #: what each reads of the other's direction


@dataclass(frozen=True)
class ProbePair:
    """Two displacement probes of a bushing as they really are, and the shaft's surface that they see."""

    position: float
    angle: float  #: rad, by which both are turned from y and z
    gains: tuple[float, float]
    runout: tuple[tuple[float, float], ...]  #: m and rad of once and twice per turn


@dataclass(frozen=True)
class Unbalance:
    """Unbalance of a disc as it really is."""

    position: float
    moment: float  #: kg m
    phase: float  #: rad from the keyphasor's mark


@dataclass(frozen=True)
class Bench:
    """A bench and its rig file."""

    name: str
    kind: str
    seed: int
    rig: Rig  #: what the designer knows
    rotor: Rotor
    holes: tuple[Hole, ...]
    stations: tuple[Station, ...]
    """of the rig's sensors, two by two"""
    probes: tuple[ProbePair, ...]
    unbalances: tuple[Unbalance, ...]
    structure: Structure = dataclasses.field(default_factory=Structure)  #: what the drawing does not have

    @property
    def top_speed(self) -> float:
        """Fastest spin, rad/s."""
        return rigs.TOP_SPEED[self.kind]

    @property
    def load(self) -> motion.Load:
        """Loads on the shaft, but for the base's acceleration."""
        y, z = (self.rig.gravity or (0.0, 0.0, 0.0))[1:]
        unbalances = tuple((u.position, cmath.rect(u.moment, u.phase)) for u in self.unbalances)
        at = self.rig.shaker.position
        hidden = self.structure.bends, self.structure.couplings
        return motion.Load((y, z), at if isinstance(at, float) else 0.0, unbalances, *hidden)

    def scheme(self, step: float, least_damping: float = 0.0) -> motion.Scheme:
        """Return the shaft prepared for a step, s, with at least a damping ratio of every mode."""
        stations, probes = ([i.position for i in part] for part in (self.stations, self.probes))
        return motion.scheme(
            self.shaft, self.ends, self.load, stations, probes, step, least_damping, self.structure.housings
        )  # fmt: skip

    @property
    def shaft(self) -> Rotor:
        """The shaft with what the drawing does not have."""
        return self.structure.shaft(self.rotor)

    @property
    def forces(self) -> tuple[Hole, ...]:
        """The bushings, then dashpots: holes so wide that nothing ever touches."""
        mu, dashpots = self.structure.friction, (dashpot(s.position, s.damping) for s in self.structure.springs)
        return (*(replace(h, friction=mu or h.friction) for h in self.holes), *dashpots)

    @property
    def ends(self) -> np.ndarray:
        """(n_forces, 2) m."""
        return np.array([(h.position - h.length / 2, h.position + h.length / 2) for h in self.forces]).reshape(-1, 2)

    def bushings(self) -> physics.Bushings:
        """The forces as arrays."""
        return as_arrays(self.forces)

    def truth(self) -> dict:
        """Nested plain data for truth.toml."""
        parts = ("holes", "stations", "probes", "unbalances")
        lists = {name: [asdict(item) for item in getattr(self, name)] for name in parts}
        lists["bushings"] = lists.pop("holes")
        shaft = asdict(self.rotor) | {"frequencies": self.shaft.frequencies(5).tolist()}
        for bushing, down in zip(lists["bushings"], self.shaft.sag([h.position for h in self.holes]).tolist()):
            bushing["sag_without_bushings"] = down
            bushing["friction"] = self.structure.friction or bushing["friction"]
        hidden = {"structure": hidden_parts} if (hidden_parts := self.structure.truth()) else {}
        return {"name": self.name, "kind": self.kind, "seed": self.seed, "shaft": shaft, **hidden, **lists}


# Draws.


def make_bench(
    seed: int, kind: str = "steering", ignorance: Iterable[str] = IGNORANCES, name: str = "",
    structure: Sequence[str] = (),
) -> Bench:  # fmt: skip
    """Draw a bench of a kind, "steering", "rotor" or "pump".

    ``ignorance``: some of `IGNORANCES`; what is drawn for one does not depend on the others. ``structure``: classes of
    `hidden.CLASSES` that the rig file does not draw; all else is as without them.
    """
    known = set(ignorance)
    if unknown := known - set(IGNORANCES):
        raise ClearanceError(f"ignorance {', '.join(sorted(unknown))} is unknown; known: {', '.join(IGNORANCES)}")
    if kind not in rigs.KINDS:
        raise ClearanceError(f'kind "{kind}" is unknown; known: {", ".join(rigs.KINDS)}')
    rig = rigs.designed(kind, name or f"{kind} {seed}")
    number = list(rigs.KINDS).index(kind)
    draw = {
        word: Draw(np.random.default_rng((seed, number, i)), word in known) for i, word in enumerate(IGNORANCES)
    }  # fmt: skip
    rotor = _rotor(rig, draw["linear"])
    holes = tuple(_hole(b, rotor, draw) for b in rig.bushings)
    sensors = draw["sensors"]
    # Shafts end at supports, which hold no sensor.
    places = list(dict.fromkeys(float(s.position) for s in rig.sensors))
    stations = tuple(_station(min(x + 2e-3 * sensors.normal(), rotor.length), sensors) for x in places)
    probes = tuple(_probes(b, sensors) for b in rig.bushings)
    chance = draw["unbalance"]
    unbalances = tuple(
        Unbalance(float(u.position), u.moment * 2.0 ** chance.normal(0.5), u.phase + chance.uniform(2 * math.pi))
        for u in rig.unbalances
    )  # fmt: skip
    hidden = draw_structure(structure, seed, number, nominal(rig), len(holes))
    return Bench(
        " ".join((rig.name, *structure)), kind, seed, rig, rotor, holes, stations, probes, unbalances, hidden
    )  # fmt: skip


@dataclass(frozen=True)
class Draw:
    """Random numbers of one ignorance: zeros where all is known."""

    rng: np.random.Generator
    unknown: bool

    def normal(self, sigma: float = 1.0) -> float:
        """Normal, cut at 2 σ."""
        return float(np.clip(self.rng.standard_normal(), -2, 2)) * sigma * self.unknown

    def uniform(self, largest: float) -> float:
        """Between 0 and ``largest``."""
        return float(self.rng.uniform(0, largest)) * self.unknown

    def factor(self, by: float) -> float:
        """Within a factor of ``by``, at 2 σ."""
        return by ** self.normal(0.5)


def nominal(rig: Rig) -> Rotor:
    """Return the rig file's shaft, its Rayleigh damping as ratios of the modes."""
    shaft = rig.linear.shafts[0]
    section, material = shaft.sections[0], shaft.material or shaft.sections[0].material
    assert section.diameter and material
    discs = [Disc(d.position, d.mass, d.inertia, d.polar_inertia or 0.0) for d in shaft.discs]
    discs += [Disc(float(m.position), m.mass) for m in rig.point_masses]
    held = [Support(s.position, math.inf, math.inf if s.kind == "clamped" else 0.0) for s in shaft.supports]
    made = Rotor(
        shaft.length, section.diameter[0], material.young_modulus, material.density, tuple(discs), tuple(held), (0.0,)
    )  # fmt: skip
    omega = made.modes().omega
    mass, stiffness = shaft.rayleigh
    return made.replace(damping=tuple((mass / (2 * omega) + stiffness * omega / 2).tolist()))


def _rotor(rig: Rig, draw: Draw) -> Rotor:
    shaft = nominal(rig)
    if not draw.unknown:
        return shaft
    modulus = shaft.young_modulus * (1 + draw.normal(0.03))
    density = shaft.density * (1 + draw.normal(0.01))
    discs = []
    for disc in shaft.discs:
        heavier = 1 + draw.normal(0.05)
        inertias = disc.inertia * (1 + draw.normal(0.05)), disc.polar_inertia * (1 + draw.normal(0.05))
        discs.append(Disc(disc.position, heavier * disc.mass, inertias[0], min(inertias[1], 2 * inertias[0])))
    supports = []
    for support in shaft.supports:
        if support.rotation:
            more = shaft.diameter * np.clip([draw.uniform(2.0), draw.uniform(2.0)], 0.05, None)
            bent, sheared = (Clamp.longer(shaft.bending_stiffness, float(by)) for by in more)
            supports.append(Support(support.position, sheared.translation, bent.rotation))
        else:
            supports.append(Support(support.position, BEARING * draw.factor(4.0)))
    common = draw.normal(0.5)  # 1 σ: a factor of 1.4; with each mode's own up to 2
    ratios = [r * 2 ** (common + draw.normal(0.35)) for r in shaft.damping[:8]]
    return shaft.replace(
        young_modulus=modulus, density=density, discs=tuple(discs), supports=tuple(supports),
        damping=(*ratios, max(ratios[-1], 0.01)),
    )  # fmt: skip


def _hole(bushing: Bushing, rotor: Rotor, draw: dict[str, Draw]) -> Hole:
    gaps, chance = draw["gaps"], draw["physics"]
    gap = bushing.gap * (1 + gaps.normal(0.2))
    oval, axis = gaps.normal(0.05), gaps.uniform(math.pi)
    scale = [chance.factor(2.0) for _ in range(6)]
    stiff = bushing.contact.stiffness
    contact = (stiff * scale[0], 0.5 * scale[1] * stiff / bushing.gap**2, 1.5 * scale[2], 0.0)
    mu = (bushing.friction.coefficient if bushing.friction else 0.0) * chance.factor(1.5)
    viscosity = (bushing.film.viscosity if bushing.film else 0.0) * chance.factor(1.5)
    small = bushing.grease.stiffness * scale[3] ** 0.3  # the datasheet's is near
    # Elements' yields spread over a decade, as an Iwan distribution has them.
    spread = bushing.gap * scale[4] * np.array([0.1, 0.3, 0.7, 1.4])
    slip = (tuple([0.4 * small / spread.size] * spread.size), tuple(spread.tolist())) if small else ((), ())
    squeeze = (0.0, 1.0) if bushing.film else (bushing.grease.damping * scale[5], 1.5 * gap)
    position = float(bushing.position) + draw["places"].normal(2e-3)
    offset = _offset(bushing, gap, gap * (1 - abs(oval)), float(rotor.sag([position])[0]), draw["offsets"])
    return Hole(
        position, bushing.length, gap, oval, axis, *offset, rotor.diameter / 2, contact, mu, 0.7 * stiff * scale[0],
        0.6 * small, slip, squeeze, viscosity,
    )  # fmt: skip


def _offset(bushing: Bushing, gap: float, narrowest: float, sag: float, draw: Draw) -> tuple[float, float]:
    """Draw until the unloaded shaft lies in the gap and the shaft that hangs in it, or rests on its wall a little."""
    for _ in range(ATTEMPTS):
        y, z = bushing.offset_y + draw.normal(0.3) * gap, bushing.offset + draw.normal(0.3) * gap
        if math.hypot(y, z) < EDGE * narrowest and math.hypot(y, z - sag) < 1.2 * narrowest:
            return y, z
        if not draw.unknown:
            y, z = y * EDGE * narrowest / math.hypot(y, z), z * EDGE * narrowest / math.hypot(y, z)
            return y, z
    raise ClearanceError("no offset leaves the shaft within its bushing")


def _station(position: float, draw: Draw) -> Station:
    return Station(
        position, (1 + draw.normal(0.01), 1 + draw.normal(0.01)), (draw.normal(0.02), draw.normal(0.02))
    )  # fmt: skip


def _probes(bushing: Bushing, draw: Draw) -> ProbePair:
    """Run-out is 5 % of the gap, two thirds of it once per turn."""
    runout = tuple(
        (fraction * 0.05 * bushing.gap * 2.0 ** draw.normal(0.5) * draw.unknown, draw.uniform(2 * math.pi))
        for fraction in (0.67, 0.33)
    )  # fmt: skip
    return ProbePair(
        float(bushing.position) + draw.normal(2e-3), math.radians(draw.normal(2.0)),
        (1 + draw.normal(0.01), 1 + draw.normal(0.01)), runout,
    )  # fmt: skip
