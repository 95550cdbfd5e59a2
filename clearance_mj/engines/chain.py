"""A shaft as a chain of rigid links: where its hinges are, how they bend, and what moves with them.

The shaft is cut into elements, supports and the bushings' middles among their ends, and each element bends at the
points of Gauss's quadrature with the shaft's flexibility 1/(EI) as weight function: two hinges, or three where a number
of links is odd, each as compliant as its weight. In a uniform element these are Legendre's points; steps and tapers
move them. Chain and shaft then meet, in place and slope, at every end of an element; in between the shaft lies above
the chain by the double integral of a curvature whose moment is a straight line (a parabola with three hinges) within
the element. Deflection and strain energy are those of cubic Hermite elements; the kinetic energy of rigid links differs
from theirs in fourth order.

A chain begins at the shaft's left end, where its first link can slide or turn unless a support there forbids it.
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..structure import Shaft, Support

__all__ = ["Chain", "Link", "chain_of", "of_discs"]


class Link(NamedTuple):
    """A rigid piece of a shaft."""

    start: float  #: m
    end: float  #: m
    mass: float  #: kg
    centre: float  #: m, of mass
    inertia: float  #: kg m², about the centre of mass


@dataclass(frozen=True, eq=False)
class _Element:
    """A piece of a shaft whose bending moment is the polynomial through its values at the hinges."""

    shaft: Shaft
    start: float
    end: float
    hinges: np.ndarray
    compliance: np.ndarray  # rad/(N m)

    def bent(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the deflection and slope, each (n_x, n), of the shaft at x per angle of the element's hinges."""
        slope = np.repeat((x >= self.end)[:, None], self.hinges.size, axis=1).astype(float)
        deflection = slope * (x[:, None] - self.hinges)
        for i in np.flatnonzero((x > self.start) & (x < self.end)):
            at, weight, rigidity = self.shaft.integration(self.start, x[i])
            curvature = self._moments(at) * (weight / rigidity.bending)[:, None]
            slope[i], deflection[i] = curvature.sum(axis=0), (x[i] - at) @ curvature
        return deflection, slope

    def curvature(self, x: np.ndarray) -> np.ndarray:
        """Return the curvature (n_x, n), 1/m, of the shaft at x per angle of the element's hinges; 0 elsewhere."""
        last = self.end == self.shaft.end
        inside, near = (x >= self.start) & ((x < self.end) | last), 1e-6 * (self.end - self.start)
        found = np.zeros((x.size, self.hinges.size))
        for i in np.flatnonzero(inside):
            at = min(x[i], self.end - near)
            found[i] = self._moments(x[i : i + 1])[0] / self.shaft.integration(at, at + near)[2].bending.mean()
        return found

    def _moments(self, x: np.ndarray) -> np.ndarray:
        """Bending moment (n_x, n) per angle of the hinges: Lagrange's polynomials over the hinges' compliance."""
        found = np.empty((x.size, self.hinges.size))
        for i, hinge in enumerate(self.hinges):
            others = np.delete(self.hinges, i)
            found[:, i] = np.prod((x[:, None] - others) / (hinge - others), axis=1) / self.compliance[i]
        return found


@dataclass(frozen=True, eq=False)
class Chain:
    """A shaft as a chain of rigid links; coordinates are the left end's slide and turn, if any, then the hinges'."""

    shaft: Shaft
    elements: tuple[_Element, ...]  # from left to right
    masses: tuple[tuple[float, float, float], ...]  # what sits on it: position m, mass kg, inertia kg m²

    @functools.cached_property
    def hinges(self) -> np.ndarray:
        """(n,) their positions, m."""
        return np.concatenate([e.hinges for e in self.elements])

    @functools.cached_property
    def slides(self) -> bool:
        """Whether the left end moves up and down."""
        return not self._held("clamped", "pinned")

    @functools.cached_property
    def turns(self) -> bool:
        """Whether the left end turns."""
        return not self._held("clamped", "guided")

    def _held(self, *kinds: str) -> bool:
        return any(s.kind in kinds for s in self.shaft.supports if self.at_start(s))

    def at_start(self, support: Support) -> bool:
        """Return whether a support is at the left end, where joints do what it does."""
        return support.position <= self.elements[0].start + 1e-9 * self.shaft.length

    @functools.cached_property
    def stiffness(self) -> np.ndarray:
        """(nv,) of the joints, N/m of the slide and N m/rad of the others."""
        own = [s for s in self.shaft.supports if self.at_start(s)]
        root = [sum(s.translation for s in own)] * self.slides + [sum(s.rotation for s in own)] * self.turns
        return np.concatenate((root, *(1 / e.compliance for e in self.elements)))

    @functools.cached_property
    def dashpots(self) -> np.ndarray:
        """(nv,) of the joints, N s/m of the slide and N m s/rad of the turn."""
        own = [s for s in self.shaft.supports if self.at_start(s)]
        slide, turn = sum(s.translation_damping for s in own), sum(s.rotation_damping for s in own)
        return np.concatenate(([slide] * self.slides + [turn] * self.turns, np.zeros(self.hinges.size)))

    @functools.cached_property
    def starts(self) -> np.ndarray:
        """Where its moving links begin, m; each reaches to the next, the last one to the right end."""
        return np.concatenate(([self.shaft.start] if self.slides or self.turns else [], self.hinges))

    def lever(self, x: ArrayLike) -> np.ndarray:
        """Return (n_x, nv) deflection of points x, m, on the straight links per coordinate."""
        x = _column(x)
        return np.hstack((*self._root(x), np.maximum(x - self.hinges, 0.0)))

    def tilt(self, x: ArrayLike) -> np.ndarray:
        """Return (n_x, nv) slope of the straight links at x, m, per coordinate."""
        x = _column(x)
        return np.hstack((*self._root(x, 0.0), x > self.hinges))

    def deflection(self, x: ArrayLike) -> np.ndarray:
        """Return (n_x, nv) deflection of the curved shaft per coordinate; the links' own at every end of an element."""
        x = _column(x)
        return np.hstack((*self._root(x), *(e.bent(x[:, 0])[0] for e in self.elements)))

    def slope(self, x: ArrayLike) -> np.ndarray:
        """Return (n_x, nv) slope of the curved shaft per coordinate; the links' own at every end of an element."""
        x = _column(x)
        return np.hstack((*self._root(x, 0.0), *(e.bent(x[:, 0])[1] for e in self.elements)))

    def curvature(self, x: ArrayLike) -> np.ndarray:
        """Return (n_x, nv) curvature of the curved shaft per coordinate, 1/m."""
        x = _column(x)
        return np.hstack((*(0 * part for part in self._root(x)), *(e.curvature(x[:, 0]) for e in self.elements)))

    def _root(self, x: np.ndarray, slide: float = 1.0) -> list[np.ndarray]:
        """Columns of the left end's joints: the deflection, or the slope for slide = 0."""
        turn = x - self.shaft.start if slide else np.ones_like(x)
        return [np.full_like(x, slide)] * self.slides + [turn] * self.turns

    @functools.cached_property
    def links(self) -> tuple[Link, ...]:
        """The moving links, from left to right, with what sits on them."""
        return tuple(self.link(start, end) for start, end in pairwise((*self.starts, self.shaft.end)))

    def link(self, start: float, end: float) -> Link:
        """Return a piece of the shaft, with what sits on it."""
        at, weight, rigidity = self.shaft.integration(start, end)
        mass, last = weight * rigidity.mass, end == self.shaft.end
        parts = [(m, x, own) for x, m, own in self.masses if start <= x < end or (last and x >= end)]
        total = mass.sum() + sum(m for m, _, _ in parts)
        centre = (mass @ at + sum(m * x for m, x, _ in parts)) / total
        inertia = mass @ (at - centre) ** 2 + sum(own + m * (x - centre) ** 2 for m, x, own in parts)
        return Link(start, end, float(total), float(centre), float(inertia))

    @property
    def without_load(self) -> Chain:
        """The same with nothing but the shaft's own discs on it."""
        return dataclasses.replace(self, masses=of_discs(self.shaft))

    @functools.cached_property
    def mass(self) -> np.ndarray:
        """(nv, nv) mass matrix of the straight chain, with what sits on it."""
        at = self.lever([link.centre for link in self.links])
        turn = self.tilt([(link.start + link.end) / 2 for link in self.links])
        masses, inertias = (np.array([getattr(link, name) for link in self.links]) for name in ("mass", "inertia"))
        return (at.T * masses) @ at + (turn.T * inertias) @ turn


def _column(x: ArrayLike) -> np.ndarray:
    return np.reshape(np.asarray(x, dtype=float), (-1, 1))


def of_discs(shaft: Shaft) -> tuple[tuple[float, float, float], ...]:
    """Return the position, m, mass, kg, and inertia, kg m², of a shaft's discs."""
    return tuple((disc.position, disc.mass, disc.inertia) for disc in shaft.discs)


def chain_of(shaft: Shaft, links: int, wanted: list[float], masses: list[tuple[float, float, float]]) -> Chain:
    """Cut a shaft into so many links (a first one that only slides or turns not counted).

    Parameters
    ----------
    shaft : Shaft
        The shaft.
    links : int
        Number of hinges.
    wanted : list of float
        Positions at which elements should end, m, in order of importance.
    masses : list of tuple
        Position, m, mass, kg, and inertia, kg m², of what sits on the shaft.
    """
    edges = _edges(shaft, links, wanted)
    lengths = np.diff(edges)
    counts = np.full(lengths.size, 2)
    while counts.sum() < links:
        counts[np.argmax(lengths / counts)] += 1
    elements = []
    for start, length, count in zip(edges, lengths, counts):
        sizes = [2 + count % 2, *[2] * (count // 2 - 1)]
        ends = start + length * np.cumsum([0, *sizes]) / count
        elements += [_element(shaft, *piece) for piece in zip(ends, ends[1:], sizes)]
    return Chain(shaft, tuple(elements), tuple(masses))


def _element(shaft: Shaft, start: float, end: float, size: int) -> _Element:
    """Points and weights of Gauss's quadrature with weight function 1/(EI) (Golub & Welsch, Math. Comp. 23, 1969)."""
    at, weight, rigidity = shaft.integration(start, end)
    flexibility, half = weight / rigidity.bending, (end - start) / 2
    xi = (at - start) / half - 1
    basis = np.linalg.qr(np.sqrt(flexibility)[:, None] * np.vander(xi, size, increasing=True))[0]
    nodes, vectors = np.linalg.eigh(basis.T @ (xi[:, None] * basis))
    return _Element(shaft, start, end, start + half * (1 + nodes), flexibility.sum() * vectors[0] ** 2)


def _edges(shaft: Shaft, links: int, wanted: list[float]) -> np.ndarray:
    """Ends of elements that things on the shaft ask for, in order of their importance as far as there is room.

    At a bushing or a mass that is no end of an element the links are a little beside the shaft; two ends close together
    would make short links, which are fast and shorten the step.
    """
    edges, room = [shaft.start, shaft.end], 1.5 * shaft.length / links
    for x in wanted:
        if len(edges) <= links // 2 and min(abs(x - edge) for edge in edges) >= room:
            edges.append(x)
    return np.sort(edges)
