"""The linear bench: a shaft on an elastic clamp as Hermite finite elements, reduced to its modes.

Cubic Euler-Bernoulli elements with consistent mass (Przemieniecki, Theory of Matrix Structural Analysis, 1968, sections
5.6 and 11.3). Modes up to `HIGHEST` are kept; the flexibility of the rest is below 1e-3 of that of any contact here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy.linalg

HIGHEST = 1e4  # Hz
ELEMENTS = 60  # at least so many, of about equal length, between the points that are nodes
STRIP_ELEMENTS = 8


@dataclass(frozen=True)
class Clamp:
    """Springs between the shaft's end and the base; see `Clamp.longer` for a scale."""

    rotation: float  #: N m/rad
    translation: float  #: N/m

    @classmethod
    def longer(cls, bending_stiffness: float, by: float) -> Clamp:
        """Each gives as the free end of ``by`` m more shaft does, under a moment and under a force alone."""
        return cls(bending_stiffness / by, 3 * bending_stiffness / by**3)


@dataclass(frozen=True)
class Strip:
    """A uniform elastic strip that is clamped to the shaft at one end, lies along it and bends in the same plane."""

    place: float  #: m, of its clamped end
    length: float  #: m, negative towards the shaft's beginning
    mass: float  #: kg
    frequency: float  #: Hz, of its first mode where the shaft is held

    def elements(self) -> tuple[np.ndarray, np.ndarray]:
        """Mass and stiffness (n, n) of deflections and slopes at its nodes, the clamped one first."""
        h, size = abs(self.length) / STRIP_ELEMENTS, 2 * STRIP_ELEMENTS + 2
        density = self.mass / abs(self.length)
        bending = (2 * math.pi * self.frequency) ** 2 * density * (abs(self.length) / 1.87510407) ** 4  # Blevins, 8-1
        mass, stiffness, turned = np.zeros((size, size)), np.zeros((size, size)), np.sign(self.length)
        signs = np.outer([1, turned, 1, turned], [1, turned, 1, turned])  # slopes, seen along the shaft
        for e in range(STRIP_ELEMENTS):
            at = slice(2 * e, 2 * e + 4)
            mass[at, at] += density * signs * element_mass(h)
            stiffness[at, at] += bending * signs * element_stiffness(h)
        return mass, stiffness


class Round:
    """A round shaft."""

    diameter: float
    young_modulus: float
    density: float

    @property
    def bending_stiffness(self) -> float:
        """E I in N m²."""
        return self.young_modulus * math.pi * self.diameter**4 / 64

    @property
    def mass_per_length(self) -> float:
        """ρ A in kg/m."""
        return self.density * math.pi * self.diameter**2 / 4

    def replace(self, **changes: object) -> Self:
        """Return a copy with other values."""
        return replace(self, **changes)


@dataclass(frozen=True)
class Shaft(Round):
    """A round shaft as it really is, SI."""

    length: float
    diameter: float
    young_modulus: float
    density: float
    masses: tuple[tuple[float, float], ...]  #: (position, kg)
    clamp: Clamp | None  #: None: rigid
    damping: tuple[float, ...]  #: ratios of the modes without grease, the last for all that follow
    strips: tuple[Strip, ...] = ()

    def modes(self, nodes: Iterable[float] = (), springs: Iterable[tuple[float, float]] = ()) -> Modes:
        """Modes of the shaft with springs (position, N/m) to the base; forces act exactly at ``nodes``, m."""
        springs = tuple(springs)
        x = mesh_of(
            self.length,
            [*nodes, *(p for p, _ in self.masses), *(p for p, _ in springs), *(s.place for s in self.strips)],
        )
        size = 2 * x.size + 2 * STRIP_ELEMENTS * len(self.strips)
        mass, stiffness = np.zeros((2, size, size))
        for e, h in enumerate(np.diff(x)):
            at = slice(2 * e, 2 * e + 4)
            mass[at, at] += self.mass_per_length * element_mass(h)
            stiffness[at, at] += self.bending_stiffness * element_stiffness(h)
        for place, value in self.masses:
            row = shape_rows(x, [place])[0]
            mass[: row.size, : row.size] += value * np.outer(row, row)
        for place, value in springs:
            row = shape_rows(x, [place])[0]
            stiffness[: row.size, : row.size] += value * np.outer(row, row)
        places = [x]
        for i, strip in enumerate(self.strips):
            root, first = 2 * int(np.argmin(np.abs(x - strip.place))), 2 * x.size + 2 * STRIP_ELEMENTS * i
            at = np.array([root, root + 1, *range(first, first + 2 * STRIP_ELEMENTS)])
            for whole, of_element in zip((mass, stiffness), strip.elements()):
                whole[np.ix_(at, at)] += of_element
            places.append(strip.place + strip.length * np.arange(1, STRIP_ELEMENTS + 1) / STRIP_ELEMENTS)
        if self.clamp:
            stiffness[0, 0] += self.clamp.translation
            stiffness[1, 1] += self.clamp.rotation
        free = slice(0 if self.clamp else 2, None)
        squares, vectors = scipy.linalg.eigh(stiffness[free, free], mass[free, free])
        omega = np.sqrt(squares)
        keep = omega < 2 * np.pi * HIGHEST
        shape = np.zeros((size, int(keep.sum())))
        shape[free] = vectors[:, keep]
        translation = np.tile([1.0, 0.0], size // 2)
        ratios = np.full(omega[keep].size, self.damping[-1])
        given = self.damping[: ratios.size]
        ratios[: len(given)] = given
        rotation = np.column_stack((np.concatenate(places), np.ones(size // 2))).ravel()
        along, turning = shape.T @ mass @ translation, shape.T @ mass @ rotation
        return Modes(x, shape[: 2 * x.size], omega[keep], ratios, along, turning)

    def frequencies(self, count: int, springs: Iterable[tuple[float, float]] = ()) -> np.ndarray:
        """(count,) Hz."""
        return self.modes(springs=springs).omega[:count] / (2 * np.pi)


@dataclass(frozen=True)
class Modes:
    """Modes of unit modal mass, relative to the base."""

    mesh: np.ndarray  # (n_nodes,) m
    shape: np.ndarray  # (2 n_nodes, n) deflection and slope at each node
    omega: np.ndarray  # (n,) rad/s
    damping: np.ndarray  # (n,) ratios
    participation: np.ndarray  # (n,) Φᵀ M r: the modal force per acceleration of the base is its negative
    turning: np.ndarray  # (n,) the same per angular acceleration of the base about the clamp

    def at(self, positions: Sequence[float], curved: bool = False) -> np.ndarray:
        """(n_positions, n) deflections of the modes, or their curvatures, 1/m."""
        return shape_rows(self.mesh, positions, curved) @ self.shape


def mesh_of(length: float, nodes: Sequence[float]) -> np.ndarray:
    """Nodes at the ends and at the given points, and enough between them."""
    fixed = np.unique(np.round([0.0, length, *nodes], 9))
    parts = [
        np.linspace(a, b, 1 + math.ceil((b - a) * ELEMENTS / length), endpoint=False)
        if math.ceil((b - a) * ELEMENTS / length) > 1
        else np.array([a])
        for a, b in zip(fixed[:-1], fixed[1:])
    ]
    return np.concatenate((*parts, [length]))


def element_stiffness(h: float) -> np.ndarray:
    matrix = np.array([[12.0, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    return matrix * np.outer([1, h, 1, h], [1, h, 1, h]) / h**3


def element_mass(h: float) -> np.ndarray:
    matrix = np.array([[156.0, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    return matrix * np.outer([1, h, 1, h], [1, h, 1, h]) * h / 420


def shape_rows(mesh: np.ndarray, positions: Sequence[float], curved: bool = False) -> np.ndarray:
    """(n_positions, 2 n_nodes) cubic shape functions, or their second derivatives."""
    rows = np.zeros((len(positions), 2 * mesh.size))
    for row, x in zip(rows, positions):
        e = min(int(np.searchsorted(mesh, x, side="right")) - 1, mesh.size - 2)
        h = mesh[e + 1] - mesh[e]
        s = (x - mesh[e]) / h
        values = (1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2))
        if curved:
            values = ((12 * s - 6) / h**2, (6 * s - 4) / h, (6 - 12 * s) / h**2, (6 * s - 2) / h)
        row[2 * e : 2 * e + 4] = values
    return rows
