"""What a bench in space has and its rig file does not draw: classes, each with sizes drawn from a seed.

Alike along y and z. A housing is an oscillator that a bushing's forces drive; a mass and a spring belong to the shaft,
whose modes they change; a spring's dashpot is a force at a point of the shaft.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

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
class Structure:
    """What stands there beside the drawing; nothing by default."""

    housings: tuple[Oscillator, ...] = ()  #: of every bushing
    masses: tuple[Disc, ...] = ()  #: points
    springs: tuple[Spring, ...] = ()

    def shaft(self, rotor: Rotor) -> Rotor:
        """Return the shaft with masses and springs."""
        springs = tuple(Support(s.position, s.stiffness) for s in self.springs)
        return rotor.replace(discs=(*rotor.discs, *self.masses), supports=(*rotor.supports, *springs))

    def truth(self) -> dict:
        """Plain data of what is there."""
        found = {
            "housings": [
                dataclasses.asdict(h) | {"stiffness": h.stiffness, "damping": h.damping} for h in self.housings
            ],
            "masses": [{"position": m.position, "mass": m.mass} for m in self.masses],
            "springs": [dataclasses.asdict(s) for s in self.springs],
        }
        return {name: items for name, items in found.items() if items}


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
    own = 1 / float(np.sum((modes.at([place])[0] / modes.omega) ** 2))
    stiffness = between(rng, 0.05, 0.3) * own
    return Structure(springs=(Spring(place, stiffness, between(rng, 1e-4, 1e-3) * stiffness),))


CLASSES: dict[str, Draw] = {"housing": housing, "mass": mass, "spring": spring}
"""What draws a structure of each class"""


def draw_structure(names: Sequence[str], seed: int, kind: int, shaft: Rotor, bushings: int) -> Structure:
    """Draw the structure of all classes named, on a kind of bench by its number; a ValueError for an unknown class."""
    found = Structure()
    for name in names:
        if name not in CLASSES:
            raise ValueError(f'structure "{name}" is unknown; known: {", ".join(CLASSES)}')
        rng = np.random.default_rng((seed, STREAM, kind, list(CLASSES).index(name)))
        drawn = CLASSES[name](rng, shaft, bushings)
        own = {f.name: value for f in dataclasses.fields(drawn) if (value := getattr(drawn, f.name))}
        found = dataclasses.replace(found, **own)
    return found


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
