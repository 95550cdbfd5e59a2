"""Beam elements of any order: the ends carry deflection and rotation, bubble functions what lies between.

Cubic Hermite functions at the ends and twice integrated Legendre polynomials inside, whose curvatures are orthogonal
(Babuška & Szabó, Finite Element Analysis, 1991, section 3; Bardell, J. Sound Vib. 151, 1991): with the order,
frequencies converge faster than any power. A Timoshenko element interpolates deflection and section rotation each by
hats and once integrated Legendre polynomials (Timoshenko, Phil. Mag. 41, 1921; no locking at this order).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

__all__ = ["Element", "Mesh", "Rigidity"]


class Rigidity(NamedTuple):
    """What an element asks of its cross-sections, at its points of integration."""

    bending: np.ndarray
    """E I, N m²"""
    shear: np.ndarray
    """κ G A, N"""
    mass: np.ndarray
    """ρ A, kg/m"""
    rotary: np.ndarray
    """ρ I, kg m"""


class Element(NamedTuple):
    """A piece of a shaft without steps, supports or loads inside."""

    start: float
    """m"""
    end: float
    """m"""
    bubbles: int
    """functions of its own, of deflection"""
    rigidity: Callable[[np.ndarray], Rigidity]
    """at positions x, m"""


class Mesh:
    """Elements in a row, with the deflections and rotations of their ends and their bubbles as coordinates.

    Coordinate 2i is the deflection of node i, 2i + 1 its rotation; the elements' own follow.

    Parameters
    ----------
    elements : sequence of Element
        One after the other.
    shear : bool
        Whether they are Timoshenko's, with shear deformation and rotary inertia.
    """

    def __init__(self, elements: Sequence[Element], shear: bool) -> None:
        self.elements = elements
        self.shear = shear
        self.nodes = np.array([elements[0].start, *(e.end for e in elements)])
        inner = [2 * (e.bubbles + 2) if shear else e.bubbles for e in elements]
        first = 2 * len(self.nodes) + np.cumsum([0, *inner])
        self.size = int(first[-1])
        self._places = [np.r_[2 * i : 2 * i + 4, first[i] : first[i + 1]] for i in range(len(elements))]

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return mass and stiffness, each (n, n), and the inertia forces (n,) of a unit acceleration of the base."""
        mass, stiffness, influence = (
            np.zeros((self.size, self.size)),
            np.zeros((self.size, self.size)),
            np.zeros(self.size),
        )
        for element, place in zip(self.elements, self._places):
            at = np.ix_(place, place)
            own = _element_matrices(element, self.shear)
            mass[at] += own[0]
            stiffness[at] += own[1]
            influence[place] += own[2]
        return mass, stiffness, influence

    def deflections(self, x: np.ndarray) -> np.ndarray:
        """Return the deflections (n_x, n) at positions (n_x,), m, per unit of each coordinate."""
        rows = np.zeros((x.size, self.size))
        which = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, len(self.elements) - 1)
        for i in np.unique(which):
            element, here = self.elements[i], np.nonzero(which == i)[0]
            length = element.end - element.start
            xi = 2 * (x[here] - element.start) / length - 1
            functions = _timoshenko(xi, element.bubbles + 2) if self.shear else _euler(xi, element.bubbles)
            rows[np.ix_(here, self._places[i])] = functions[0] * _lengths(element, self.shear)
        return rows

    def node(self, x: float) -> int:
        """Return the number of the node nearest to a position, m."""
        return int(np.argmin(np.abs(self.nodes - x)))


def _element_matrices(element: Element, shear: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    node, weight, (value, slope, rotation, curvature) = _integration(element.bubbles, shear)
    half = (element.end - element.start) / 2
    weight = weight * half
    section = element.rigidity(element.start + (node + 1) * half)
    size = _lengths(element, shear)
    value, slope = value * size, slope * size / half
    if not shear:
        curvature = curvature * size / half**2
        stiffness = (curvature.T * (weight * section.bending)) @ curvature
        mass = (value.T * (weight * section.mass)) @ value
        return mass, stiffness, (weight * section.mass) @ value
    curvature = curvature / half
    angle = slope - rotation
    stiffness = (curvature.T * (weight * section.bending)) @ curvature
    stiffness += (angle.T * (weight * section.shear)) @ angle
    mass = (value.T * (weight * section.mass)) @ value + (rotation.T * (weight * section.rotary)) @ rotation
    return mass, stiffness, (weight * section.mass) @ value


def _lengths(element: Element, shear: bool) -> np.ndarray:
    """Factors of the functions of an element from those of one that reaches from -1 to 1."""
    half = (element.end - element.start) / 2
    return (
        np.ones(4 + 2 * (element.bubbles + 2)) if shear else np.r_[1.0, half, 1.0, half, np.full(element.bubbles, half)]
    )


@functools.cache
def _integration(bubbles: int, shear: bool) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, ...]]:
    """Gauss points and weights, exact for tapers of four powers more than a constant section has, and functions."""
    node, weight = leggauss(bubbles + 8)
    return node, weight, _timoshenko(node, bubbles + 2) if shear else _euler(node, bubbles)


def _euler(xi: np.ndarray, bubbles: int) -> tuple[np.ndarray, ...]:
    """Deflection, slope, rotation and curvature (n_xi, 4 + bubbles) of an element from -1 to 1."""
    k = np.arange(2, bubbles + 2)
    legendre, size = legvander(xi, bubbles + 3), np.sqrt(2 * k + 1)
    once = (legendre[:, k + 1] - legendre[:, k - 1]) / (2 * k + 1)
    upper, lower = legendre[:, k + 2] - legendre[:, k], legendre[:, k] - legendre[:, k - 2]
    twice = (upper / (2 * k + 3) - lower / (2 * k - 1)) / (2 * k + 1)
    x2, x3 = xi**2, xi**3
    value = np.stack([2 - 3 * xi + x3, 1 - xi - x2 + x3, 2 + 3 * xi - x3, -1 - xi + x2 + x3], -1) / 4
    slope = np.stack([3 * x2 - 3, 3 * x2 - 2 * xi - 1, 3 - 3 * x2, 3 * x2 + 2 * xi - 1], -1) / 4
    curvature = np.stack([6 * xi, 6 * xi - 2, -6 * xi, 6 * xi + 2], -1) / 4
    slope = np.hstack((slope, once * size))
    return np.hstack((value, twice * size)), slope, slope, np.hstack((curvature, legendre[:, k] * size))


def _timoshenko(xi: np.ndarray, bubbles: int) -> tuple[np.ndarray, ...]:
    """The same (n_xi, 4 + 2 bubbles): deflection, its slope, section rotation, its slope."""
    k = np.arange(1, bubbles + 1)
    legendre, size = legvander(xi, bubbles + 1), np.sqrt(2 * k + 1)
    bubble, rate = (legendre[:, k + 1] - legendre[:, k - 1]) / (2 * k + 1) * size, legendre[:, k] * size
    value, slope, rotation, curvature = np.zeros((4, xi.size, 4 + 2 * bubbles))
    hats = np.stack(((1 - xi) / 2, (1 + xi) / 2), -1)
    value[:, [0, 2]], slope[:, [0, 2]] = hats, [-0.5, 0.5]
    rotation[:, [1, 3]], curvature[:, [1, 3]] = hats, [-0.5, 0.5]
    value[:, 4 : 4 + bubbles], slope[:, 4 : 4 + bubbles] = bubble, rate
    rotation[:, 4 + bubbles :], curvature[:, 4 + bubbles :] = bubble, rate
    return value, slope, rotation, curvature
