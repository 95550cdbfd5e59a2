"""Parts that a bench has and its rig file lacks: classes, each with sizes drawn from a seed.

Every class is mechanics of the simulator's own: a housing is an oscillator that bushing forces drive; a fixture's mode
filters the base's acceleration before the rig feels it; springs and dashpots are forces at points of the shaft; a shaft
with two planes has its modes twice; a strip that is clamped to the shaft is finite elements. `written` says what a rig
file would say that knows them.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.signal

from clearance_mj import ClearanceError
from clearance_mj.rig import PointMass, Rig
from clearance_mj.structure import Spring
from clearance_mj.structure.attached import FixtureMode, Housing, Planes
from clearance_mj.structure.attached import Oscillator as RigOscillator
from clearance_mj.structure.beam import Clamp as RigClamp

from .shaft import Clamp, Modes, Shaft, Strip

RIGID = 1e6  # of the shaft's bending stiffness, N m/rad: a clamp that does not turn


@dataclass(frozen=True)
class Oscillator:
    """A mass on a spring and a damper, SI."""

    mass: float
    frequency: float  #: Hz
    ratio: float  #: of critical damping

    @property
    def stiffness(self) -> float:
        """N/m."""
        return self.mass * (2 * math.pi * self.frequency) ** 2

    @property
    def damping(self) -> float:
        """N s/m."""
        return 4 * math.pi * self.ratio * self.frequency * self.mass


@dataclass(frozen=True)
class BaseMode:
    """Motions of the rig's feet that the base's accelerometer does not read."""

    frequency: float  #: Hz
    ratio: float
    shift: float  #: of the feet, over the mode's motion
    tilt: float = 0.0  #: rad/m, the same of their rotation about the clamp

    def motion(self, base: np.ndarray, fs: float) -> np.ndarray:
        """Return η̈ (n_t,) of η̈ + 2ζωη̇ + ω²η = -a, a straight between samples."""
        omega = 2 * math.pi * self.frequency
        system = ([-1.0, 0.0, 0.0], [1.0, 2 * self.ratio * omega, omega**2])
        b, a, _ = scipy.signal.cont2discrete(system, 1 / fs, method="foh")
        return scipy.signal.lfilter(np.ravel(b), a, base)


@dataclass(frozen=True)
class Structure:
    """Parts that the rig file lacks; none by default."""

    housings: tuple[Oscillator, ...] = ()  #: of every bushing
    base: tuple[BaseMode, ...] = ()
    masses: tuple[tuple[float, float], ...] = ()  #: place in m, kg
    springs: tuple[tuple[float, float, float], ...] = ()  #: place in m, N/m, N s/m
    clamp: Oscillator | None = None  #: block of the clamp, on which the shaft's end is
    late: tuple[int, float] | None = None  #: number of an accelerometer, samples
    strips: tuple[Strip, ...] = ()
    planes: tuple[float, float] | None = None  #: difference of the bending stiffnesses, rad
    filtered: float = 0.0  #: of the sampling rate, where an anti-alias filter of all channels begins; 0: none
    probes_on_base: bool = False  #: whether probes read relative to the base, not to the housing

    def shaft(self, shaft: Shaft) -> Shaft:
        """Return the shaft with masses, strips and clamp."""
        masses = (*shaft.masses, *self.masses)
        shaft = shaft.replace(strips=self.strips)
        if self.clamp is None:
            return shaft.replace(masses=masses)
        turning = shaft.clamp.rotation if shaft.clamp else RIGID * shaft.bending_stiffness
        return shaft.replace(masses=(*masses, (0.0, self.clamp.mass)), clamp=Clamp(turning, self.clamp.stiffness))

    @property
    def dashpots(self) -> tuple[tuple[float, float, float], ...]:
        """Place, N/m and N s/m of linear forces on the shaft that are no part of its modes."""
        return (*self.springs, *([(0.0, 0.0, self.clamp.damping)] if self.clamp else ()))

    def modes(self, shaft: Shaft, nodes: Sequence[float]) -> list[tuple[Modes, float]]:
        """Return the modes of every plane, and how much of a motion along the direction of shaking each has."""
        if self.planes is None:
            return [(shaft.modes(nodes), 1.0)]
        difference, angle = self.planes
        both = [(1 + difference / 2, math.cos(angle)), (1 - difference / 2, math.sin(angle))]
        return [(shaft.replace(young_modulus=f * shaft.young_modulus).modes(nodes), cosine) for f, cosine in both]


Draw = Callable[[np.random.Generator, Rig], Structure]
CLASSES: dict[str, Draw] = {}
"""Functions that draw a structure of each class that a rig file can name"""
HARD: dict[str, Draw] = {}
"""The same of what it cannot, and of what records hardly tell"""


def structure_class(draw: Draw) -> Draw:
    """Register a class by its function's name; a decorator."""
    CLASSES[draw.__name__] = draw
    return draw


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _beam(rig: Rig) -> tuple[float, float]:
    assert rig.beam
    return rig.beam.length, rig.beam.total_mass


@structure_class
def housing(rng: np.random.Generator, rig: Rig) -> Structure:
    """Each bushing on a housing whose own mode lies in or above the band."""
    return Structure(
        housings=tuple(
            Oscillator(between(rng, 0.05, 0.3), between(rng, 80, 400), rng.uniform(0.01, 0.05)) for _ in rig.bushings
        )
    )


@structure_class
def fixture(rng: np.random.Generator, rig: Rig) -> Structure:
    """A mode between the base's accelerometer and the rig's feet."""
    return Structure(base=(BaseMode(between(rng, 60, 300), rng.uniform(0.01, 0.05), rng.uniform(0.2, 0.8)),))


@structure_class
def rocking(rng: np.random.Generator, rig: Rig) -> Structure:
    """A base that turns as it is shaken."""
    length, _ = _beam(rig)
    frequency = between(rng, 40, 300)
    tilt = rng.choice([-1, 1]) * rng.uniform(0.05, 0.25) / length * min(1.0, (frequency / 100) ** 2)
    return Structure(base=(BaseMode(frequency, rng.uniform(0.02, 0.3), 0.0, float(tilt)),))


@structure_class
def mass(rng: np.random.Generator, rig: Rig) -> Structure:
    """A mass of 5 to 12 % of the shaft's."""
    length, whole = _beam(rig)
    return Structure(masses=((rng.uniform(0.2, 0.95) * length, rng.uniform(0.05, 0.12) * whole),))


@structure_class
def spring(rng: np.random.Generator, rig: Rig) -> Structure:
    """A cable or a seal: a spring and a dashpot from the shaft to the base."""
    length, _ = _beam(rig)
    return Structure(springs=((rng.uniform(0.3, 0.95) * length, between(rng, 300, 3000), rng.uniform(0.2, 3)),))


@structure_class
def clamp(rng: np.random.Generator, rig: Rig) -> Structure:
    """A clamp whose block has a mode of its own."""
    return Structure(clamp=Oscillator(between(rng, 0.1, 1.0), rng.uniform(90, 400), rng.uniform(0.01, 0.03)))


@structure_class
def time(rng: np.random.Generator, rig: Rig) -> Structure:
    """A channel that is late."""
    return Structure(late=(int(rng.integers(len(rig.sensors))), float(rng.uniform(0.2, 3.0))))


@structure_class
def plane(rng: np.random.Generator, rig: Rig) -> Structure:
    """Two bending planes that differ by 2 to 6 %, turned by 15 to 45 degrees."""
    return Structure(planes=(rng.uniform(0.02, 0.06), float(np.radians(rng.uniform(15, 45)))))


def strip(rng: np.random.Generator, rig: Rig) -> Structure:
    """A cover or a bracket that is clamped to the shaft, lies along it, towards the clamp, and resonates."""
    length, whole = _beam(rig)
    strip = Strip(
        rng.uniform(0.35, 0.95) * length, -0.2 * length, rng.uniform(0.03, 0.1) * whole, between(rng, 60, 250)
    )
    return Structure(strips=(strip,))


def near_spring(rng: np.random.Generator, rig: Rig) -> Structure:
    """A cable 3 to 5 cm from a bushing, whose unknown force does nearly the same."""
    bushing = rig.bushings[int(rng.integers(len(rig.bushings)))]
    place = float(bushing.position) + float(rng.choice([-1, 1])) * rng.uniform(0.03, 0.05)
    return Structure(springs=((place, between(rng, 300, 3000), rng.uniform(0.2, 3)),))


HARD |= {"strip": strip, "near_spring": near_spring}


def draw_structure(names: Sequence[str], seed: int, rig: Rig) -> Structure:
    """Draw the structure of all classes named; a ClearanceError for an unknown one."""
    structure, known = Structure(), CLASSES | HARD
    for name in names:
        if name not in known:
            raise ClearanceError(f"structure {name} is unknown; known: {', '.join(known)}")
        drawn = known[name](np.random.default_rng((seed, 31, list(known).index(name))), rig)
        drawn_fields = {f.name: value for f in dataclasses.fields(drawn) if (value := getattr(drawn, f.name))}
        structure = replace(structure, **drawn_fields | {"base": (*structure.base, *drawn.base)})
    return structure


def written(structure: Structure, rig: Rig, fs: float) -> Rig:
    """Return a rig file in which the structure is written as it is; ``rig`` has the shaft's own numbers.

    Of a strip it can hold the first mode alone: 0.613 of its mass, which moves as at 0.726 of its length, and the rest
    where the strip is in balance (moments of the mode of a cantilever).
    """
    assert rig.beam
    rests = [(s.place + 0.142 * s.length, 0.387 * s.mass) for s in structure.strips]
    ratio = rig.beam.damping_ratios[-1] if rig.beam.damping_ratios else 0.01
    fields: dict[str, object] = {
        "masses": (*rig.masses, *(PointMass(x, m) for x, m in (*structure.masses, *rests))),
        "oscillators": tuple(
            RigOscillator(s.place, 0.613 * s.mass, s.frequency, ratio, 0.726 * s.length) for s in structure.strips
        ),
        "springs": tuple(Spring(x, k, damping=c) for x, k, c in structure.springs),
        "fixture": tuple(FixtureMode(m.frequency, m.ratio, m.shift, m.tilt, 0.0) for m in structure.base),
        "planes": Planes(*structure.planes) if structure.planes else None,
    }
    if structure.housings:
        probe = "base" if structure.probes_on_base else "housing"
        housings = [Housing(h.stiffness, h.mass, h.damping, probe) for h in structure.housings]
        fields["bushings"] = tuple(replace(b, housing=h) for b, h in zip(rig.bushings, housings))
    if block := structure.clamp:
        turning = rig.beam.clamp.rotation if rig.beam.clamp else None
        stand = RigClamp(turning, block.stiffness, mass=block.mass, translation_damping=block.damping)
        fields["beam"] = replace(rig.beam, clamp=stand)
    if structure.late:
        number, samples = structure.late
        sensors = list(rig.sensors)
        sensors[number] = replace(sensors[number], delay=samples / fs)
        fields["sensors"] = tuple(sensors)
    return rig.replace(**fields)
