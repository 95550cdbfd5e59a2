"""A shaft as a chain of rigid links: its joints, their constraints by supports, and the motion of points.

The shaft is cut into elements, supports and the bushings' middles among their ends, and each element has hinges at the
points of Gauss quadrature with the shaft's flexibility, 1/(EI) or 1/(GJ), as weight function: two, or three where a
number of links is odd, each as compliant as its weight. In a uniform element these are Legendre's points; steps and
tapers move them. Chain and shaft then coincide at every end of an element; see `bending_chain` and `twist_chain`.

A chain begins at the shaft's left end, where its first link can move unless a support there forbids it.
"""

from __future__ import annotations

import dataclasses
import functools
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from ..structure import Shaft, Support

__all__ = ["Chain", "HingeElement", "Hold", "cut", "elements_of"]


class Hold(NamedTuple):
    """A support's constraint of one motion of a shaft."""

    order: int  #: of the motion, as in `Chain.motion`
    rigid: bool  #: True if it fixes the motion
    stiffness: float  #: N/m or N m/rad
    damping: float  #: N s/m or N m s/rad


@dataclass(frozen=True, eq=False)
class HingeElement:
    """A piece of a shaft whose moment is the polynomial through its values at the hinges."""

    shaft: Shaft
    kind: Literal["bending", "torsion"]
    start: float
    end: float
    hinges: np.ndarray
    compliance: np.ndarray  # rad/(N m)

    def motion(self, x: np.ndarray, order: int) -> np.ndarray:
        """Return the deflection, or its derivative of order 1 or 2, (n_x, n) of the shaft at x per angle of the hinges.

        The first derivative is the slope in bending and the twist in torsion.
        """
        return self._curvature(x) if order == 2 else self._deflection_and_slope(x)[order]

    def _deflection_and_slope(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        slope = np.repeat((x >= self.end)[:, None], self.hinges.size, axis=1).astype(float)
        deflection = slope * (x[:, None] - self.hinges)
        for i in np.flatnonzero((x > self.start) & (x < self.end)):
            at, weight, rigidity = self.shaft.integration(self.start, x[i])
            curvature = self._moments(at) * (weight / getattr(rigidity, self.kind))[:, None]
            slope[i], deflection[i] = curvature.sum(axis=0), (x[i] - at) @ curvature
        return deflection, slope

    def _curvature(self, x: np.ndarray) -> np.ndarray:
        last = self.end == self.shaft.end
        inside, near = (x >= self.start) & ((x < self.end) | last), 1e-6 * (self.end - self.start)
        curvature = np.zeros((x.size, self.hinges.size))
        for i in np.flatnonzero(inside):
            at = min(x[i], self.end - near)
            rigidity = self.shaft.integration(at, at + near)[2]
            curvature[i] = self._moments(x[i : i + 1])[0] / getattr(rigidity, self.kind).mean()
        return curvature

    def _moments(self, x: np.ndarray) -> np.ndarray:
        """Return the moment (n_x, n) per angle of the hinges: Lagrange polynomials over the hinges' compliance."""
        moment = np.empty((x.size, self.hinges.size))
        for i, hinge in enumerate(self.hinges):
            others = np.delete(self.hinges, i)
            moment[:, i] = np.prod((x[:, None] - others) / (hinge - others), axis=1) / self.compliance[i]
        return moment


@dataclass(frozen=True, eq=False)
class Chain(ABC):
    """Rigid links of a shaft; coordinates are those of joints at its left end, if any, then the hinges' angles."""

    shaft: Shaft
    elements: tuple[HingeElement, ...]  # from left to right
    masses: tuple[tuple[float, float, float], ...]  # on it: position m, mass kg, inertia kg m²

    axes: ClassVar[dict[str, tuple[int, float]]]
    """axes of its points' motions: order of the motion, and its sign"""
    first_joints: ClassVar[tuple[str, ...]]
    """names of the joints at the left end, of motions of order 0, 1, ..."""
    derivative: ClassVar[int]
    """derivative of an element's deflection that is the motion of order 0"""

    @abstractmethod
    def holds(self, support: Support) -> tuple[Hold, ...]:
        """Return a support's constraints of the chain's motions."""

    @property
    @abstractmethod
    def mass(self) -> np.ndarray:
        """(nv, nv) mass matrix of the straight chain, with the masses on it."""

    @staticmethod
    @abstractmethod
    def discs(shaft: Shaft) -> list[tuple[float, float, float]]:
        """Return a shaft's discs, as `masses`."""

    @property
    def without_load(self) -> Self:
        """The same with the shaft's discs alone on it."""
        return dataclasses.replace(self, masses=tuple(self.discs(self.shaft)))

    @functools.cached_property
    def hinges(self) -> np.ndarray:
        """(n,) their positions, m."""
        return np.concatenate([e.hinges for e in self.elements])

    @functools.cached_property
    def _supports(self) -> tuple[list[Hold], list[tuple[float, Hold]]]:
        """Constraints of supports at the left end, made by joints, and elsewhere, with the position, m."""
        start = self.elements[0].start + 1e-9 * self.shaft.length
        constraints = [(s.position, hold) for s in self.shaft.supports for hold in self.holds(s)]
        return [hold for x, hold in constraints if x <= start], [(x, hold) for x, hold in constraints if x > start]

    @functools.cached_property
    def roots(self) -> tuple[int, ...]:
        """Orders of the free motions of the left end, each with a joint."""
        fixed = {hold.order for hold in self._supports[0] if hold.rigid}
        return tuple(order for order in range(len(self.first_joints)) if order not in fixed)

    @property
    def joints(self) -> list[str]:
        """Names of the joints, in the order of the coordinates."""
        return [self.first_joints[r] for r in self.roots] + [f"hinge{n}" for n in range(self.hinges.size)]

    @functools.cached_property
    def places(self) -> np.ndarray:
        """(nv,) positions of the joints, m."""
        return np.concatenate(([self.shaft.start] * len(self.roots), self.hinges))

    @functools.cached_property
    def starts(self) -> np.ndarray:
        """Left ends of its moving links, m; each reaches to the next, the last one to the right end."""
        return np.concatenate(([self.shaft.start] if self.roots else [], self.hinges))

    @functools.cached_property
    def stiffness(self) -> np.ndarray:
        """(nv,) of the joints, N/m for a slide and N m/rad for the others."""
        root = [sum(h.stiffness for h in self._supports[0] if h.order == r) for r in self.roots]
        return np.concatenate((root, *(1 / e.compliance for e in self.elements)))

    @functools.cached_property
    def dashpots(self) -> np.ndarray:
        """(nv,) of the joints, N s/m for a slide and N m s/rad for the others."""
        root = [sum(h.damping for h in self._supports[0] if h.order == r) for r in self.roots]
        return np.concatenate((root, np.zeros(self.hinges.size)))

    @functools.cached_property
    def held(self) -> np.ndarray:
        """(n, nv) motions that rigid supports beyond the left end fix."""
        rows = {(x, h.order): self.motion(x, h.order)[0] for x, h in self._supports[1] if h.rigid}
        return np.array(list(rows.values())).reshape(-1, self.stiffness.size)

    @property
    def springs(self) -> list[tuple[np.ndarray, float, float]]:
        """Rows (nv,), stiffness and damping of elastic supports beyond the left end."""
        elastic = [(x, h) for x, h in self._supports[1] if not h.rigid and (h.stiffness or h.damping)]
        return [(self.motion(x, h.order)[0], h.stiffness, h.damping) for x, h in elastic]

    @property
    def stiff_roots(self) -> np.ndarray:
        """(nv,) True for a spring joint at the left end that is stiffer than the first hinge."""
        reach = self.hinges[0] - self.elements[0].start
        first = [self.stiffness[len(self.roots)] / reach ** (2 - 2 * r - 2 * self.derivative) for r in self.roots]
        return self.stiffness > np.concatenate((first, np.full(self.hinges.size, np.inf)))

    def motion(self, x: ArrayLike, order: int = 0, straight: bool = False) -> np.ndarray:
        """Return the motion of the shaft per coordinate.

        Parameters
        ----------
        x : array_like, shape (n_x,)
            Positions, m.
        order : int
            0 deflection, 1 slope and 2 curvature in bending; 0 twist and 1 twist per length in torsion.
        straight : bool
            True for the straight links, False for the curved shaft, equal to them at every end of an element; up to
            slope or twist.

        Returns
        -------
        ndarray, shape (n_x, nv)
        """
        x = np.reshape(np.asarray(x, dtype=float), (-1, 1))
        root = [(x - self.shaft.start) ** (r - order) if r >= order else 0 * x for r in self.roots]
        order += self.derivative
        if straight:
            return np.hstack((*root, x > self.hinges if order else np.maximum(x - self.hinges, 0.0)))
        return np.hstack((*root, *(e.motion(x[:, 0], order) for e in self.elements)))


def cut(shaft: Shaft, links: int, wanted: list[float]) -> list[tuple[float, float, int]]:
    """Cut a shaft into elements: start, end, m, and number of hinges of each.

    Parameters
    ----------
    shaft : Shaft
        The shaft.
    links : int
        Number of all hinges.
    wanted : list of float
        Positions at which elements should end, m, in order of importance.
    """
    edges = _element_ends(shaft, links, wanted)
    lengths = np.diff(edges)
    counts = np.full(lengths.size, 2)
    while counts.sum() < links:
        counts[np.argmax(lengths / counts)] += 1
    pieces = list[tuple[float, float, int]]()
    for start, length, count in zip(edges, lengths, counts):
        sizes = [2 + count % 2, *[2] * (count // 2 - 1)]
        ends = start + length * np.cumsum([0, *sizes]) / count
        pieces += zip(ends, ends[1:], sizes)
    return pieces


def elements_of(
    shaft: Shaft, pieces: list[tuple[float, float, int]], kind: Literal["bending", "torsion"]
) -> tuple[HingeElement, ...]:
    """Return the pieces of a shaft with their hinges.

    These are the points and weights of Gauss quadrature with the flexibility as weight function (Golub and Welsch,
    Math. Comp. 23, 1969).
    """
    elements = []
    for start, end, size in pieces:
        at, weight, rigidity = shaft.integration(start, end)
        flexibility, half = weight / getattr(rigidity, kind), (end - start) / 2
        xi = (at - start) / half - 1
        basis = np.linalg.qr(np.sqrt(flexibility)[:, None] * np.vander(xi, size, increasing=True))[0]
        nodes, vectors = np.linalg.eigh(basis.T @ (xi[:, None] * basis))
        hinges, compliance = start + half * (1 + nodes), flexibility.sum() * vectors[0] ** 2
        elements.append(HingeElement(shaft, kind, start, end, hinges, compliance))
    return tuple(elements)


def _element_ends(shaft: Shaft, links: int, wanted: list[float]) -> np.ndarray:
    """Return ends of elements at bushings, masses and supports, by importance, as far as they are far enough apart.

    At a bushing or a mass that is no end of an element the links are a little off the shaft; two ends close together
    would make short links, which are fast and shorten the step.
    """
    edges, spacing = [shaft.start, shaft.end], 1.5 * shaft.length / links
    for x in wanted:
        if len(edges) <= links // 2 and min(abs(x - edge) for edge in edges) >= spacing:
            edges.append(x)
    return np.sort(edges)
