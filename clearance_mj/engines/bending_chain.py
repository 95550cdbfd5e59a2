"""A bending shaft as a chain of rigid links in one plane; see `chain`.

In deflection and slope, chain and shaft coincide at every end of an element; in between the shaft lies above the chain
by the double integral of a curvature whose moment is a straight line (a parabola with three hinges) within the element.
Deflection and strain energy are those of cubic Hermite elements; the kinetic energy of rigid links differs from theirs
in fourth order.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, NamedTuple

import numpy as np

from ..structure import Shaft, Support
from ..structure.section import HELD
from ..structure.shaft import OF_BENDING
from .chain import Chain, Hold

__all__ = ["BendingChain", "Link"]


class Link(NamedTuple):
    """A rigid piece of a shaft."""

    start: float  #: m
    end: float  #: m
    mass: float  #: kg
    centre: float  #: m, of mass
    inertia: float  #: kg m², about the centre of mass


@dataclass(frozen=True, eq=False)
class BendingChain(Chain):
    """Chain of a bending shaft; at its left end it may slide and turn."""

    axes: ClassVar[dict[str, tuple[int, float]]] = OF_BENDING
    first_joints: ClassVar[tuple[str, ...]] = ("slide", "turn")
    derivative: ClassVar[int] = 0

    def holds(self, support: Support) -> tuple[Hold, ...]:
        """Return a support's constraints of deflection and slope."""
        slide = Hold(0, 0 in HELD[support.kind], support.translation, support.translation_damping)
        return slide, Hold(1, 1 in HELD[support.kind], support.rotation, support.rotation_damping)

    @functools.cached_property
    def links(self) -> tuple[Link, ...]:
        """The moving links, from left to right, with the masses on them."""
        return tuple(self.link(start, end) for start, end in pairwise((*self.starts, self.shaft.end)))

    def link(self, start: float, end: float) -> Link:
        """Return a piece of the shaft, with the masses on it."""
        at, weight, rigidity = self.shaft.integration(start, end)
        mass, last = weight * rigidity.mass, end == self.shaft.end
        parts = [(m, x, own) for x, m, own in self.masses if start <= x < end or (last and x >= end)]
        total = mass.sum() + sum(m for m, _, _ in parts)
        centre = (mass @ at + sum(m * x for m, x, _ in parts)) / total
        inertia = mass @ (at - centre) ** 2 + sum(own + m * (x - centre) ** 2 for m, x, own in parts)
        return Link(start, end, float(total), float(centre), float(inertia))

    @staticmethod
    def discs(shaft: Shaft) -> list[tuple[float, float, float]]:
        """Return position, m, mass, kg, and inertia about a diameter, kg m², of a shaft's discs."""
        return [(disc.position, disc.mass, disc.inertia) for disc in shaft.discs]

    @functools.cached_property
    def _shifts(self) -> np.ndarray:
        """Deflection (n_links, nv) of the links' centres of mass."""
        return self.motion([link.centre for link in self.links], straight=True)

    @functools.cached_property
    def mass(self) -> np.ndarray:
        """(nv, nv) mass matrix of the straight chain, with the masses on it."""
        at, turn = (self._shifts, self.motion([(link.start + link.end) / 2 for link in self.links], 1, straight=True))
        masses, inertias = (np.array([getattr(link, name) for link in self.links]) for name in ("mass", "inertia"))
        return (at.T * masses) @ at + (turn.T * inertias) @ turn

    @property
    def weight(self) -> np.ndarray:
        """(nv,) force of a unit gravity along the deflection."""
        return np.asarray(np.array([link.mass for link in self.links]) @ self._shifts)

    @property
    def polar(self) -> np.ndarray:
        """(n, nv) slopes times the root of the polar inertia: of discs, and of sections, twice the rotary one."""
        places, inertia = [d.position for d in self.shaft.discs], [d.about_axis for d in self.shaft.discs]
        for element in self.elements:
            at, weight, rigidity = self.shaft.integration(element.start, element.end)
            places.extend(at)
            inertia.extend(2 * weight * rigidity.rotary)
        return np.asarray(np.sqrt(inertia)[:, None] * self.motion(places, 1))

    @property
    def strain(self) -> np.ndarray:
        """(n_hinges, nv) strains of unit energy of the hinges."""
        return np.diag(np.sqrt(self.stiffness))[len(self.roots) :]
