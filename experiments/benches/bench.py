"""Benches: what the designer knows (the rig file) and what really stands there (the truth), drawn from a seed.

The priors are those with which an identification may reckon: Young's modulus 3 %, density 1 %, masses 5 %, places of
bushings and sensors 2 mm, gains 1 %, clamp as of 0 to 2 diameters more shaft, modal damping within a factor of 2, gaps
20 %, offsets 0.3 of the gap: all 1 σ, cut at 2 σ.
"""

import dataclasses
import functools
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from clearance_mj import ClearanceError
from clearance_mj.core.quantities import SensorQuantity
from clearance_mj.rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor
from clearance_mj.rig.sensing import sensor_points
from clearance_mj.structure.beam import Clamp as RigClamp
from experiments.testrig.records import FS

from . import physics
from .shaft import Clamp, Shaft
from .structure import Structure, draw_structure, written

IGNORANCES = ("gaps", "offsets", "sensors", "linear", "places")
"""What a rig file may get wrong: gaps; offsets of the shaft in them; sensors' gains and places; modulus, density,
masses, clamp and damping; the bushings' places"""
CONTACTS = ("linear", "power", "cubic")
GREASES = ("linear", "bouc-wen", "maxwell-slip")
"""Families that a bench can be made with, alike those of the package in form; without one the physics are foreign"""
FAR = 1e6  # m, a gap that no shaft crosses
GAP_FACTORS, OFFSETS = (1.22, 0.85, 1.1), (0.3, -0.2, 0.25)
"""of the named benches: gaps over nominal, offsets over the true gap"""


@dataclass(frozen=True)
class Hole:
    """A bushing as it really is, SI; the numbers are those of `physics.Bushings`."""

    position: float
    length: float
    gap: float
    offset: float  #: of the unloaded shaft's centre: contact at displacements gap - offset and -gap - offset
    contact: tuple[float, float, float, float, float]
    film: tuple[float, float, float, float]
    elastic: float
    bouc_wen: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 2.0)
    slip: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    stribeck: tuple[float, float] = (0.0, 1.0)

    @property
    def small_motion(self) -> float:
        """Stiffness of the grease before anything slides, N/m."""
        return self.elastic + self.bouc_wen[0] + sum(self.slip[0])


@dataclass(frozen=True)
class Instrument:
    """A sensor or a probe as it really is."""

    position: float
    gain: float


@dataclass(frozen=True)
class Bench:
    """A bench and its rig file."""

    name: str
    seed: int
    rig: Rig  #: what the designer knows
    shaft: Shaft
    holes: tuple[Hole, ...]
    accelerometers: tuple[Instrument, ...]
    """in the order of the rig's sensors; the base's is exact, so gains are relative to it"""
    probes: tuple[Instrument, ...]  #: one for each bushing, or none; zero where the shaft rests
    structure: Structure = dataclasses.field(default_factory=Structure)  #: what the drawing does not have

    def bushings(self) -> physics.Bushings:
        """The same as arrays, with the shaft at rest in its unloaded place."""
        holes = self.forces
        slip = np.zeros((len(holes), 2, max((len(h.slip[0]) for h in holes), default=0)))
        for row, hole in zip(slip, holes):
            row[:, : len(hole.slip[0])] = hole.slip

        def column(name: str) -> np.ndarray:
            return np.array([getattr(h, name) for h in holes], dtype=float)

        return physics.Bushings(
            column("gap"), column("offset"), np.zeros(len(holes)), column("contact"), column("film"),
            column("elastic"), column("bouc_wen"), slip, column("stribeck"),
        )  # fmt: skip

    @property
    def forces(self) -> tuple[Hole, ...]:
        """The bushings, then springs and dashpots: holes so wide that nothing ever touches."""
        return (*self.holes, *[_dashpot(*each) for each in self.structure.dashpots])

    def truth(self) -> dict:
        """Nested plain data for truth.toml."""
        springs = [(h.position, h.small_motion) for h in self.holes]
        shaft = asdict(self.shaft)
        shaft |= {"clamp": shaft["clamp"] or "rigid", "tip_mass": sum(m for _, m in self.shaft.masses)}
        shaft["frequencies_without_grease"] = self.shaft.frequencies(5).tolist()
        shaft["frequencies_in_gap"] = self.shaft.frequencies(5, springs).tolist()
        parts = ("holes", "accelerometers", "probes")
        lists = {name: [asdict(item) for item in getattr(self, name)] for name in parts}
        lists["bushings"] = lists.pop("holes")
        structure = {name: value for name, value in asdict(self.structure).items() if value}
        return {"name": self.name, "seed": self.seed, "shaft": shaft, "structure": structure, **lists}


# Rig files.


def _rig(name: str, beam: Beam, tip_mass: float, bushings: Iterable[Bushing], sensors: Iterable[float]) -> Rig:
    bushings = tuple(bushings)
    places = [*sensors, *(b.position for b in bushings), beam.length]
    accelerometers = tuple(Sensor(node, x) for node, x in enumerate(places, 1))
    words = "Virtual bench: the rig file is what its designer knows"
    return Rig(name, beam, bushings, accelerometers, (PointMass(beam.length, tip_mass, "lever"),), description=words)


def table1_rig(name: str, positions: tuple[float, ...] = (0.5484, 0.7918)) -> Rig:
    beam = Beam(1.0, 210e9, 7850.0, 0.0086166, rayleigh=(0.5, 1e-5))
    bushings = [Bushing(x, 3e-4, 0.012, Grease(4369.0, 3.0), Contact(1e4, 4.0)) for x in positions]
    return _rig(name, beam, 0.434, bushings, (0.15, 0.3, 0.4, 0.65, 0.9))


def sensed_rig(name: str, quantity: SensorQuantity) -> Rig:
    """Return the rig of Table 1 with sensors of another quantity; of forces, in both bushings beside accelerometers."""
    rig = table1_rig(name)
    if quantity == "force":
        cells = (Sensor(20 + j, f"bushings[{j}]", quantity="force") for j in range(len(rig.bushings)))
        return rig.replace(sensors=(*rig.sensors, *cells))
    return rig.replace(sensors=tuple(replace(s, quantity=quantity) for s in rig.sensors))


def other_rig(name: str) -> Rig:
    beam = Beam(0.8, 70e9, 2700.0, 0.012, rayleigh=(0.5, 1e-5))
    bushings = [Bushing(x, 2.5e-4, 0.01, Grease(4000.0, 3.0), Contact(1e4, 4.0)) for x in (0.36, 0.66)]
    return _rig(name, beam, 0.2, bushings, (0.12, 0.24, 0.5, 0.58))


# Draws.


def make_bench(
    seed: int, ignorance: Iterable[str] = IGNORANCES, rig: Rig | None = None, contact: str | None = None,
    grease: str | None = None, probes: bool = True, name: str = "", structure: Sequence[str] = (),
    bushing_length: float | None = None, filtered: float = 0.0,
) -> Bench:  # fmt: skip
    """Draw a bench.

    ``ignorance``: some of `IGNORANCES`. ``rig``: the designer's; default: that of the article's Table 1. ``contact``
    and ``grease``: families of `CONTACTS` and `GREASES`; default: foreign ones. What is drawn for one ignorance does
    not depend on the others. ``structure``: classes of `structure.CLASSES` and `HARD` that no rig file draws.
    ``bushing_length``: m, of the bushings as they are, whatever the rig file says. ``filtered``: of the sampling rate,
    where an anti-alias filter of all channels begins.
    """
    ignorance = set(ignorance)
    if unknown := ignorance - set(IGNORANCES):
        raise ClearanceError(f"ignorance {', '.join(sorted(unknown))} is unknown; known: {', '.join(IGNORANCES)}")
    rig = rig or table1_rig(name or f"bench {seed}")
    draw = {word: np.random.default_rng((seed, i)) for i, word in enumerate((*IGNORANCES, "physics"))}
    one = {word: float(word in ignorance) for word in IGNORANCES}
    count = len(rig.bushings)
    gaps = [b.gap * (1 + 0.2 * one["gaps"] * _normal(draw["gaps"])) for b in rig.bushings]
    offsets = [0.3 * one["offsets"] * _normal(draw["offsets"]) for _ in range(count)]
    places = [b.position + 2e-3 * one["places"] * _normal(draw["places"]) for b in rig.bushings]
    holes = [
        _hole(bushing, place, gap, gap * offset, contact, grease, draw["physics"])
        for bushing, place, gap, offset in zip(rig.bushings, places, gaps, offsets)
    ]
    shaft = _drawn_shaft(rig, draw["linear"]) if "linear" in ignorance else _nominal_shaft(rig)
    errors = one["sensors"] * np.array([(_normal(draw["sensors"]), _normal(draw["sensors"])) for _ in range(40)])
    if bushing_length is not None:
        holes = [replace(hole, length=bushing_length) for hole in holes]
    drawn = replace(draw_structure(structure, seed, rig), filtered=filtered)
    made = _bench(rig, seed, shaft, holes, 0.01 * errors[:, 0], 2e-3 * errors[:, 1], probes)
    return replace(made, structure=drawn)


def _bench(
    rig: Rig, seed: int, shaft: Shaft, holes: list[Hole], gains: np.ndarray, shifts: np.ndarray, probes: bool
) -> Bench:
    """Put a bench together; ``gains`` and ``shifts``: errors of the accelerometers, then of the probes."""
    wrong = iter(zip(gains.tolist(), shifts.tolist()))
    sensors = tuple(_instrument(x, shaft, next(wrong)) for x in sensor_points(rig))
    watching = tuple(_instrument(b.position, shaft, next(wrong)) for b in rig.bushings) if probes else ()
    return Bench(rig.name, seed, rig, shaft, tuple(holes), sensors, watching)


def _instrument(position: float, shaft: Shaft, wrong: tuple[float, float]) -> Instrument:
    return Instrument(min(position + wrong[1], shaft.length), 1 + wrong[0])


def _normal(rng: np.random.Generator) -> float:
    """Standard normal, cut at 2."""
    return float(np.clip(rng.standard_normal(), -2, 2))


@functools.lru_cache(maxsize=16)
def _nominal_shaft(rig: Rig) -> Shaft:
    """The rig file's, with its Rayleigh damping as ratios of the modes."""
    beam = rig.beam
    masses = tuple((m.position, m.mass) for m in rig.point_masses)
    shaft = Shaft(beam.length, beam.diameter, beam.young_modulus, beam.density, masses, None, (0.0,))
    omega = shaft.modes().omega
    return shaft.replace(damping=tuple((beam.rayleigh[0] / (2 * omega) + beam.rayleigh[1] * omega / 2).tolist()))


def _drawn_shaft(rig: Rig, rng: np.random.Generator) -> Shaft:
    shaft = _nominal_shaft(rig)
    modulus = shaft.young_modulus * (1 + 0.03 * _normal(rng))
    density = shaft.density * (1 + 0.01 * _normal(rng))
    masses = tuple((x, m * (1 + 0.05 * _normal(rng))) for x, m in shaft.masses)
    more = shaft.diameter * np.clip(rng.uniform(0, 2, 2), 0.05, None)
    bent, sheared = (Clamp.longer(shaft.bending_stiffness, by) for by in more)
    common = 0.5 * _normal(rng)  # 1 σ: a factor of 1.4; with each mode's own up to 2
    ratios = [r * 2 ** (common + 0.35 * _normal(rng)) for r in shaft.damping[:8]]
    return shaft.replace(
        young_modulus=modulus, density=density, masses=masses, clamp=Clamp(bent.rotation, sheared.translation),
        damping=(*ratios, max(ratios[-1], 0.01)),
    )  # fmt: skip


# Physics of a bushing.


def _hole(
    bushing: Bushing, position: float, gap: float, offset: float, contact: str | None, grease: str | None,
    rng: np.random.Generator | None,
) -> Hole:  # fmt: skip
    """Draw contact and grease about typical values; without ``rng`` they are these."""
    scale = [1.0] * 8 if rng is None else [2.0 ** (0.5 * _normal(rng)) for _ in range(8)]
    d, k = bushing.gap, bushing.grease.stiffness
    stiff = bushing.contact.stiffness * scale[0]
    contacts = {
        None: (stiff, 1.0, 0.6 * scale[1] * stiff / d**2, 1.5 * scale[2], 0.0),
        "linear": (2 * stiff, 1.0, 0.0, 0.0, 5.0 * scale[2]),
        "power": (1.5 * stiff / d**0.8 * scale[1] ** 0.5, 1.8, 0.0, 1.5 * scale[2], 0.0),
        "cubic": (0.6 * stiff, 1.0, 1.5 * scale[1] * stiff / d**2, 0.0, 5.0 * scale[2]),
    }
    small = k * scale[3] ** 0.3  # the datasheet's is near
    elastic = 0.6 * scale[4] ** 0.3
    yields = d * scale[5]
    # Two thirds of the rest in equal elements with yields that spread over a decade, as an Iwan distribution has them.
    spread = np.array([0.1, 0.3, 0.7, 1.4]) * yields
    maxwell = (tuple([(1 - elastic) * small / spread.size] * spread.size), tuple(spread.tolist()))
    shape = 0.5 / yields**2
    thinning = (physics.THINNING, 4.0 * scale[6], 2.5 * gap, 0.2)
    greases: dict = {
        None: {"slip": maxwell, "stribeck": (0.3, 0.01), "film": (physics.JOURNAL, 3.5 * scale[6], 2.2 * gap, 0.0)},
        "linear": {"film": thinning},
        "bouc-wen": {"bouc_wen": ((1 - elastic) * small, shape, shape, 2.0), "film": thinning},
        "maxwell-slip": {"slip": maxwell, "film": thinning},
    }
    linear = grease == "linear"
    return Hole(
        position, bushing.length, gap, offset, contacts[contact], elastic=small if linear else elastic * small,
        **greases[grease],
    )  # fmt: skip


def _dashpot(position: float, stiffness: float, damping: float) -> Hole:
    """A linear spring and dashpot."""
    film = (physics.THINNING, damping, FAR, 1.0)
    return Hole(position, 0.0, FAR, 0.0, (1.0, 1.0, 0.0, 0.0, 0.0), film, stiffness)


# Named benches.


def _named(rig: Rig, ignorance: Iterable[str], probes: bool = True, seed: int = 1) -> Bench:
    """A bench with errors of fixed sizes, their signs and the physics' small spread from the seed."""
    known = set(ignorance)
    rng = np.random.default_rng(seed)
    holes = []
    for j, b in enumerate(rig.bushings):
        gap = b.gap * (GAP_FACTORS[j] if "gaps" in known else 1.0)
        holes.append(_hole(b, b.position, gap, OFFSETS[j] * gap * ("offsets" in known), None, None, None))
    shaft = _nominal_shaft(rig)
    if "linear" in known:
        shaft = shaft.replace(
            young_modulus=0.97 * shaft.young_modulus, masses=tuple((x, 1.04 * m) for x, m in shaft.masses),
            clamp=Clamp.longer(shaft.bending_stiffness, 0.006), damping=(0.006,),
        )  # fmt: skip
    wrong = rng.uniform(-1, 1, (2, 40)) * ("sensors" in known)
    return _bench(rig, seed, shaft, holes, 0.015 * wrong[0], 3e-3 * wrong[1], probes)


def exact_rig(bench: Bench) -> Rig:
    """Return the rig file of one who knows all but the sensors' gains and the physics of the bushings."""
    shaft, rig = bench.shaft, bench.rig
    clamp = shaft.clamp and RigClamp(shaft.clamp.rotation, shaft.clamp.translation)
    beam = replace(
        rig.beam, young_modulus=shaft.young_modulus, density=shaft.density, rayleigh=(0.0, 0.0),
        damping_ratios=shaft.damping, clamp=clamp,
    )  # fmt: skip
    bushings = [
        replace(b, position=h.position, gap=h.gap, offset=h.offset, length=h.length)
        for b, h in zip(rig.bushings, bench.holes)
    ]
    sensors = [
        s if s.quantity == "force" else replace(s, position=a.position)
        for s, a in zip(rig.sensors, bench.accelerometers)
    ]
    masses = tuple(PointMass(x, m) for x, m in shaft.masses)
    exact = rig.replace(beam=beam, bushings=tuple(bushings), sensors=tuple(sensors), masses=masses)
    return written(bench.structure, exact, FS)


def known(bench: Bench) -> Bench:
    """The same bench with an exact rig file and exact gains: what identification could reach."""
    gains = {part: tuple(replace(i, gain=1.0) for i in getattr(bench, part)) for part in ("accelerometers", "probes")}
    name = f"{bench.name}-known"
    return replace(bench, name=name, rig=exact_rig(bench).replace(name=name), **gains)


ALL = ("gaps", "offsets", "sensors", "linear")
"""Ignorances of the named benches together; bushings stand where the rig file says"""
NAMED = {
    "exact": lambda: _named(table1_rig("exact"), ()),
    "gaps": lambda: _named(table1_rig("gaps"), ("gaps",)),
    "offsets": lambda: _named(table1_rig("offsets"), ("offsets",)),
    "sensors": lambda: _named(table1_rig("sensors"), ("sensors",)),
    "linear": lambda: _named(table1_rig("linear"), ("linear",)),
    "all": lambda: _named(table1_rig("all"), ALL),
    "other-shaft": lambda: _named(other_rig("other-shaft"), ALL, seed=2),
    "no-probes": lambda: _named(table1_rig("no-probes"), ALL, probes=False, seed=3),
    "one-bushing": lambda: _named(table1_rig("one-bushing", (0.7,)), ALL, seed=4),
    "vibrometer": lambda: _named(sensed_rig("vibrometer", "velocity"), ALL, seed=6),
    "strain-gauges": lambda: _named(sensed_rig("strain-gauges", "strain"), ALL, seed=7),
    "probes-alone": lambda: _named(sensed_rig("probes-alone", "displacement"), ALL, probes=False, seed=8),
    "load-cell": lambda: _named(sensed_rig("load-cell", "force"), ALL, seed=9),
    "three-bushings": lambda: _named(table1_rig("three-bushings", (0.3684, 0.5484, 0.7918)), ALL, seed=5),
}  # What makes each named bench; all have the same foreign physics


def find_bench(name: str, ignorance: Iterable[str] | None = None) -> Bench:
    """A named bench; one drawn from a seed, such as "17"; or one of a family, such as "cubic+maxwell-slip+4".

    "-known" behind the name: the same bench with an exact rig file.
    ``ignorance`` of a drawn one: all by default, none for a family.
    """
    if name.endswith("-known"):
        return known(find_bench(name.removesuffix("-known"), ignorance))
    if name in NAMED and ignorance is None:
        return NAMED[name]()
    if name.isdecimal():
        return make_bench(int(name), IGNORANCES if ignorance is None else ignorance)
    contact, _, rest = name.partition("+")
    grease, _, seed = rest.partition("+")
    if contact in CONTACTS and grease in GREASES and seed.isdecimal():
        return make_bench(int(seed), ignorance or (), contact=contact, grease=grease, name=name)
    raise ClearanceError(
        f'bench "{name}" is unknown: give {", ".join(NAMED)}, a seed, or CONTACT+GREASE+SEED with '
        f"{', '.join(CONTACTS)} and {', '.join(GREASES)}; named benches have an ignorance of their own"
    )
