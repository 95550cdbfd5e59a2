"""Parts that a bench in space has and its rig file lacks: classes, each with sizes drawn from a seed.

Alike along y and z. A housing is an oscillator that a bushing's forces drive; a mass and a spring belong to the shaft,
whose modes they change; a spring's dashpot is a force at a point of the shaft. A bent shaft's elements are relaxed
where it is bent, K (q - b e^(iφ)), so that K b turns with it (Nicholas, Gunter & Allaire, J. Eng. Power 98, 1976). A
misaligned coupling is a moment of twice the shaft's angle on its end, not alike along y and z.
"""

import cmath
import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from clearance_mj import ClearanceError
from clearance_mj.rig import Spin

from ..structure import Oscillator, between
from .shaft import Disc, Modes, Rotor, Support

STREAM = 31  # second word of the seeds


@dataclass(frozen=True)
class Spring:
    """A spring and a dashpot from the shaft to the base."""

    position: float
    stiffness: float  #: N/m
    damping: float  #: N s/m


@dataclass(frozen=True)
class Bend:
    """A part of the shaft that is curved alike over a width, m, without load."""

    position: float
    width: float
    size: float  #: m, largest distance of the shaft from the straight line through its supports
    phase: float  #: rad from the mark

    def line(self, rotor: Rotor) -> np.ndarray:
        """Return deflections and slopes (2 n_nodes,) of the bent shaft that nothing loads."""
        x, _, _, free = rotor.matrices()
        start, end = self.position - self.width / 2, self.position + self.width / 2
        slope = np.clip(x, start, end) - start
        line = np.where(x < end, slope**2 / 2, self.width**2 / 2 + self.width * (x - end))
        if free[1]:  # it is not clamped at x = 0
            slope, line = slope - line[-1] / x[-1], line - line[-1] * x / x[-1]
        return np.column_stack((line, slope)).ravel() * self.size / line[np.argmax(np.abs(line))]

    def forces(self, rotor: Rotor) -> np.ndarray:
        """Return the modal forces (n,) that hold a straight shaft in this line."""
        return rotor.modes().shape.T @ rotor.replace(supports=()).matrices()[2] @ self.line(rotor)


@dataclass(frozen=True)
class Coupling:
    """A coupling that bends the shaft's end twice per turn: moments, N m, that turn with 2 φ and -2 φ."""

    forward: complex
    backward: complex

    def slopes(self, rotor: Rotor) -> np.ndarray:
        """Return the slopes of the modes (n,) at the driven end."""
        shape = rotor.modes().shape
        return shape[1] if shape[1].any() else shape[-1]


@dataclass(frozen=True)
class Structure:
    """Parts that the rig file lacks; none by default."""

    housings: tuple[Oscillator, ...] = ()  #: of every bushing
    masses: tuple[Disc, ...] = ()  #: points
    springs: tuple[Spring, ...] = ()
    bends: tuple[Bend, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    creep: float = 0.0  #: share by which a speed that is said to be steady grows from the start of a record to its end
    friction: float = 0.0  #: in all bushings, instead of theirs; 0: theirs

    def spin(self, said: Spin, seconds: float) -> Spin:
        """Return how the shaft turns where a record of a length, s, says how it does."""
        if said.rate or not self.creep * said.speed:
            return said
        first, last = ((1 + by * self.creep / 2) * said.speed for by in (-1, 1))
        return Spin(first, (last - first) / seconds)

    def shaft(self, rotor: Rotor) -> Rotor:
        """Return the shaft with masses and springs."""
        springs = tuple(Support(s.position, s.stiffness) for s in self.springs)
        return rotor.replace(discs=(*rotor.discs, *self.masses), supports=(*rotor.supports, *springs))

    def truth(self) -> dict:
        """Plain data of what is there."""
        parts = {
            "housings": [asdict(h) | {"stiffness": h.stiffness, "damping": h.damping} for h in self.housings],
            "masses": [{"position": m.position, "mass": m.mass} for m in self.masses],
            "springs": [asdict(s) for s in self.springs], "bends": [asdict(b) for b in self.bends],
            "couplings": [{name: [abs(m), cmath.phase(m)] for name, m in asdict(c).items()} for c in self.couplings],
            "creep": self.creep, "friction": self.friction,
        }  # fmt: skip
        return {name: items for name, items in parts.items() if items}


Draw = Callable[[np.random.Generator, Rotor, int], Structure]
"""From a stream, the designer's shaft and the number of bushings"""


def housing(rng: np.random.Generator, shaft: Rotor, bushings: int) -> Structure:
    """Each bushing on a housing whose own mode lies in or above the band, as on the planar benches."""
    return Structure(
        housings=tuple(
            Oscillator(
                between(rng, 0.1, 0.2) * between(rng, 1 / 1.3, 1.3), between(rng, 80, 400), rng.uniform(0.01, 0.05)
            )
            for _ in range(bushings)
        )
    )


def mass(rng: np.random.Generator, shaft: Rotor, bushings: int) -> Structure:
    """A point mass of 5 to 10 % of the bare shaft's."""
    whole = shaft.mass_per_length * shaft.length
    return Structure(masses=(Disc(_place(rng, shaft), rng.uniform(0.05, 0.1) * whole),))


def spring(rng: np.random.Generator, shaft: Rotor, bushings: int) -> Structure:
    """A cable or a seal: 5 to 30 % of the shaft's own stiffness at its place, and a dashpot.

    The 300 to 3000 N/m of the planar benches are 1.5 to 30 % of what holds their shaft there; these shafts are stiffer.
    """
    place, modes = _place(rng, shaft), shaft.modes()
    stiffness = between(rng, 0.05, 0.3) * (1 / float(np.sum((modes.at([place])[0] / modes.omega) ** 2)))
    return Structure(springs=(Spring(place, stiffness, between(rng, 1e-4, 1e-3) * stiffness),))


def bend(rng: np.random.Generator, shaft: Rotor, bushings: int) -> Structure:
    """A bend of 6 to 24 µm, over a twentieth to a third of the length."""
    place, width = rng.uniform(0.3, 0.7) * shaft.length, rng.uniform(0.05, 0.33) * shaft.length
    return Structure(bends=(Bend(place, width, between(rng, 6e-6, 2.4e-5), rng.uniform(0, 2 * math.pi)),))


def coupling(rng: np.random.Generator, shaft: Rotor, bushings: int) -> Structure:
    """A moment that at rest would bend the shaft by 2 to 8 µm, up to half as large a one turns backwards."""
    modes, driven = shaft.modes(), Coupling(1.0, 0.0).slopes(shaft)
    forward = between(rng, 2e-6, 8e-6) / np.abs(modes.shape[::2] @ (driven / modes.omega**2)).max()
    phases = rng.uniform(0, 2 * math.pi, 2)
    ahead, back = cmath.rect(forward, phases[0]), cmath.rect(forward * rng.uniform(0, 0.5), phases[1])
    return Structure(couplings=(Coupling(ahead, back),))


def creep(rng: np.random.Generator, shaft: Rotor, bushings: int) -> Structure:
    """A speed that changes by 1 to 1.8 % within a record, up or down."""
    return Structure(creep=float(rng.choice((-1, 1)) * between(rng, 0.01, 0.018)))


def dry_whirl(rng: np.random.Generator, shaft: Rotor, bushings: int) -> Structure:
    """Walls so rough that the shaft may roll in them backwards."""
    return Structure(friction=between(rng, 0.3, 0.6))


CLASSES: dict[str, Draw] = {
    "housing": housing, "mass": mass, "spring": spring, "bend": bend, "coupling": coupling, "creep": creep,
    "whirl": dry_whirl,
}  # fmt: skip
"""Functions that draw a structure of each class"""


def draw_structure(names: Sequence[str], seed: int, kind: int, shaft: Rotor, bushings: int) -> Structure:
    """Draw the structure of all classes named, on a kind of bench by its number; ClearanceError for an unknown one."""
    structure = Structure()
    for name in names:
        if name not in CLASSES:
            raise ClearanceError(f'structure "{name}" is unknown; known: {", ".join(CLASSES)}')
        rng = np.random.default_rng((seed, STREAM, kind, list(CLASSES).index(name)))
        drawn = CLASSES[name](rng, shaft, bushings)
        drawn_fields = {f.name: value for f in dataclasses.fields(drawn) if (value := getattr(drawn, f.name))}
        structure = replace(structure, **drawn_fields)
    return structure


def with_housings(modes: Modes, housings: Sequence[Oscillator]) -> tuple[Modes, np.ndarray]:
    """Return the shaft's modes and one of each housing behind them, and the housings' displacements (n_housings, n).

    A housing is a mode of unit modal mass in which the shaft is at rest, until a bushing's forces act on both.
    """
    if not housings:
        return modes, np.zeros((0, modes.omega.size))
    root = np.sqrt([h.mass for h in housings])
    extended = Modes(
        modes.mesh, modes.sheared, _widened(modes.shape, root.size),
        np.concatenate((modes.omega, [2 * math.pi * h.frequency for h in housings])),
        np.concatenate((modes.damping, [h.ratio for h in housings])), np.concatenate((modes.participation, root)),
        _widened(modes.slopes, root.size),
    )  # fmt: skip
    return extended, np.hstack((np.zeros((root.size, modes.omega.size)), np.diag(1 / root)))


def _widened(rows: np.ndarray, by: int) -> np.ndarray:
    return np.hstack((rows, np.zeros((len(rows), by))))


def _place(rng: np.random.Generator, shaft: Rotor) -> float:
    """Not near a support, where nothing moves."""
    free = max(s.position for s in shaft.supports) < 0.5 * shaft.length
    return float(rng.uniform(*((0.3, 0.95) if free else (0.2, 0.8)))) * shaft.length
