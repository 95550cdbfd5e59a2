"""The shaft as a chain of rigid links: where its hinges are, how they bend, and what moves with them.

The shaft is cut into elements, the bushings' middles among their ends, and each element bends at the points of Gauss's
quadrature: two hinges, or three where a number of links is odd. A hinge of weight w has the compliance w/(EI). Chain
and shaft then meet, in place and slope, at every end of an element; in between the shaft lies above the chain by the
double integral of a curvature that is a straight line (a parabola with three hinges) within the element. Deflection
and strain energy are those of cubic Hermite elements; the kinetic energy of rigid links differs from theirs in fourth
order.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike

from ..rig import Rig

__all__ = ["Chain", "chain"]


@dataclass(frozen=True, eq=False)
class _Element:
    """A piece of the shaft whose curvature is the polynomial through its values at the hinges."""

    start: float
    end: float
    hinges: np.ndarray
    weights: np.ndarray

    def deflection(self, x: np.ndarray) -> np.ndarray:
        """(n_x, n) deflection of the shaft at x per angle of the element's hinges."""
        inside, beyond = np.clip(x - self.start, 0, self.end - self.start), np.maximum(x - self.end, 0)
        columns = []
        for i, (hinge, weight) in enumerate(zip(self.hinges, self.weights)):
            curvature = Polynomial([1 / weight])
            for other in np.delete(self.hinges, i):
                curvature *= Polynomial([self.start - other, 1]) / (hinge - other)
            slope = curvature.integ()
            columns.append(slope.integ()(inside) + slope(inside) * beyond)
        return np.stack(columns, axis=1)


@dataclass(frozen=True, eq=False)
class Chain:
    """A rig's shaft as a chain of rigid links, clamped before its first hinge."""

    rig: Rig  # whose shaft it is
    elements: tuple[_Element, ...]  # from the clamp to the tip

    @functools.cached_property
    def hinges(self) -> np.ndarray:
        """(n,) their positions, m; each link reaches from its hinge to the next, the last one to the tip."""
        return np.concatenate([e.hinges for e in self.elements])

    @functools.cached_property
    def ends(self) -> np.ndarray:
        """(n,) where the links end, m."""
        return np.append(self.hinges[1:], self.rig.beam.length)

    @functools.cached_property
    def stiffness(self) -> np.ndarray:
        """(n,) of the hinges, N m/rad."""
        return self.rig.beam.bending_stiffness / np.concatenate([e.weights for e in self.elements])

    def lever(self, x: ArrayLike) -> np.ndarray:
        """(n_x, n) deflection of points x, m, on the links per hinge angle, m/rad."""
        return np.maximum(np.reshape(x, (-1, 1)) - self.hinges, 0.0)

    def deflection(self, x: ArrayLike) -> np.ndarray:
        """(n_x, n) deflection of the curved shaft per hinge angle, m/rad; the links' own at every end of an element."""
        x = np.reshape(np.asarray(x, dtype=float), -1)
        return np.concatenate([e.deflection(x) for e in self.elements], axis=1)

    @functools.cached_property
    def mass(self) -> np.ndarray:
        """(n, n) mass matrix of the straight chain in its hinge angles, from the rods' and point masses' motion."""
        length = self.ends - self.hinges
        rods = self.rig.beam.mass_per_length * length
        middle, turn = self.lever((self.hinges + self.ends) / 2), np.tril(np.ones((length.size, length.size)))
        matrix = (middle.T * rods) @ middle + (turn.T * (rods * length**2 / 12)) @ turn
        at = self.lever([p.position for p in self.rig.point_masses])
        return matrix + (at.T * np.array([p.mass for p in self.rig.point_masses])) @ at


@functools.lru_cache(maxsize=32)
def chain(rig: Rig, links: int) -> Chain:
    """Cut a rig's shaft into a chain of so many links."""
    edges = _edges(rig, links)
    lengths = np.diff(edges)
    counts = np.full(lengths.size, 2)
    while counts.sum() < links:
        counts[np.argmax(lengths / counts)] += 1
    elements = []
    for start, length, count in zip(edges, lengths, counts):
        sizes = [2 + count % 2, *[2] * (count // 2 - 1)]
        ends = start + length * np.cumsum([0, *sizes]) / count
        elements += [_gauss(*piece) for piece in zip(ends, ends[1:], sizes)]
    return Chain(rig, tuple(elements))


def _gauss(start: float, end: float, size: int) -> _Element:
    nodes, weights = leggauss(size)
    half = (end - start) / 2
    return _Element(start, end, start + half * (1 + nodes), half * weights)


def _edges(rig: Rig, links: int) -> np.ndarray:
    """Ends of elements that things on the shaft ask for, in order of their importance as far as there is room.

    At a bushing or a mass that is no end of an element the links are a little beside the shaft; two ends close together
    would make short links, which are fast and shorten the step.
    """
    length = rig.beam.length
    edges, room = [0.0, length], 1.5 * length / links
    wanted = [b.position for b in rig.bushings] + [end for b in rig.bushings for end in b.ends]
    wanted += [p.position for p in sorted(rig.point_masses, key=lambda p: -p.mass)]
    for x in wanted:
        if len(edges) <= links // 2 and min(abs(x - edge) for edge in edges) >= room:
            edges.append(x)
    return np.sort(edges)
