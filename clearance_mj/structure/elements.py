"""Beam elements of any order: the end moves relative to the start, bubble functions add the interior.

Cubic Hermite functions for the end and twice integrated Legendre polynomials inside, whose curvatures are orthogonal
(Babuška & Szabó, Finite Element Analysis, 1991, section 3; Bardell, J. Sound Vib. 151, 1991): with the order,
frequencies converge faster than any power. A Timoshenko element interpolates deflection and section rotation each by
a hat and once integrated Legendre polynomials (Timoshenko, Phil. Mag. 41, 1921; no locking at this order).

Torsion elements form a chain as well: (G J θ')' = ρ I_p θ̈ of Saint-Venant's torsion, whose sections warp freely
(Timoshenko, Young & Weaver, Vibration Problems in Engineering, 1974, section 5.4).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

__all__ = ["BeamElement", "Mesh", "Rigidity", "TorsionMesh"]


class Rigidity(NamedTuple):
    """Properties of cross-sections at an element's points of integration."""

    bending: np.ndarray  #: E I, N m²
    shear: np.ndarray  #: κ G A, N
    mass: np.ndarray  #: ρ A, kg/m
    rotary: np.ndarray  #: ρ I, kg m
    torsion: np.ndarray  #: G J, N m²
    polar: np.ndarray  #: ρ times the polar moment of area, kg m


class BeamElement(NamedTuple):
    """A piece of a shaft without steps, supports or loads inside."""

    start: float  #: m
    end: float  #: m
    bubbles: int  #: number of bubble functions of deflection
    rigidity: Callable[[np.ndarray], Rigidity]  #: at positions x, m


class _ElementChain:
    """Nodes of elements in order along a shaft, and their coordinates after ``rigid`` ones of the shaft's start."""

    _motion: np.ndarray  # of the nodes, per unit of each coordinate

    def __init__(self, elements: Sequence[BeamElement], shapes: list[np.ndarray], rigid: int) -> None:
        self.elements, self._shapes = elements, shapes
        self.nodes = np.array([elements[0].start, *(e.end for e in elements)])
        first = rigid + np.cumsum([0, *(each.shape[1] for each in shapes)])
        self._columns, self._size = [slice(a, b) for a, b in pairwise(first)], int(first[-1])

    def motion(self, x: float) -> np.ndarray:
        """Return the motion of the node nearest to a position, m, per unit of each coordinate.

        Of bending deflection and rotation, (2, n), of torsion the twist, rad, (n,).
        """
        return np.asarray(self._motion[self._node(x)])

    def _node(self, x: float) -> int:
        return int(np.argmin(np.abs(self.nodes - x)))

    def _element_of(self, x: np.ndarray) -> np.ndarray:
        return np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, len(self.elements) - 1)


class Mesh(_ElementChain):
    """A chain of elements: rigid motion of a shaft with its start, and the strains that each element adds.

    The coordinates of elements are strained shapes of unit energy: the large stiffness of a short element does not hide
    the small one of the whole (the natural approach of Argyris, 1966).

    Parameters
    ----------
    elements : sequence of Element
        Elements in order along the shaft.
    shear : bool
        True for Timoshenko elements, with shear deformation and rotary inertia.
    held : sequence of (float, int)
        Positions, m, of nodes without deflection (0) or rotation (1).

    Attributes
    ----------
    mass, stiffness : ndarray, shape (n, n)
        Matrices in coordinates that fix the held nodes.
    influence : ndarray, shape (n,)
        Inertia forces per unit acceleration of the base.
    rocking : ndarray, shape (n,)
        The same per unit angular acceleration of the base about x = 0.
    """

    def __init__(self, elements: Sequence[BeamElement], shear: bool, held: Sequence[tuple[float, int]] = ()) -> None:
        parts = [_strain_shapes(element, shear) for element in elements]
        super().__init__(elements, [part.shapes for part in parts], 2)
        self._shear, motion = shear, self._node_motion()
        zero = sorted({(self._node(x), which) for x, which in held})
        self._free = null_space([motion[node, which] for node, which in zero], self._size)
        self._motion = motion @ self._free
        self.stiffness = self._free[2:].T @ self._free[2:]
        self.mass = np.zeros_like(self.stiffness)
        self.influence, self.rocking = np.zeros((2, len(self.mass)))
        for element, start, columns, part in zip(elements, self._motion, self._columns, parts):
            moves = np.vstack((start, self._free[columns]))
            self.mass += moves.T @ part.mass @ moves
            self.influence += part.influence @ moves
            self.rocking += part.mass[1] @ moves + element.start * (part.influence @ moves)

    def _node_motion(self) -> np.ndarray:
        """Return deflection and rotation (n_nodes, 2, size); first two rigid motions, as large as those by strains."""
        motion = np.zeros((len(self.nodes), 2, self._size))
        motion[0, :, :2] = np.eye(2)
        for i, (length, columns, shapes) in enumerate(zip(np.diff(self.nodes), self._columns, self._shapes)):
            motion[i + 1] = motion[i]
            motion[i + 1, 0] += length * motion[i, 1]
            motion[i + 1, :, columns] += shapes[:2]
        bending = np.linalg.norm(motion[-1, 0, 2:])
        motion[:, :, :2] *= bending * np.array([1.0, 1 / (self.nodes[-1] - self.nodes[0])])
        return motion

    def deflections(self, x: np.ndarray, order: int = 0) -> np.ndarray:
        """Return deflections, or rotations (order 1) or curvatures (2), (n_x, n) at positions (n_x,), m.

        With shear deformation the rotation is that of the section, and the curvature its slope.
        """
        rows, element_of = np.zeros((x.size, len(self.mass))), self._element_of(x)
        for i in np.unique(element_of):
            element, points = self.elements[i], np.nonzero(element_of == i)[0]
            length = element.end - element.start
            distance = x[points] - element.start
            if order:
                functions = _functions(2 * distance / length - 1, element.bubbles, self._shear)
                value = _scale_to_element(functions, element, self._shear)[order + 1]
                rows[points] = self._motion[i, 1] * (order == 1)
            else:
                series = _deflection_series(element.bubbles, self._shear)
                value = legvander(2 * distance / length - 1, len(series) - 1) @ series
                if not self._shear:
                    value[:, 1:] *= length / 2
                rows[points] = self._motion[i, 0] + np.outer(distance, self._motion[i, 1])
            rows[points] += value @ self._shapes[i] @ self._free[self._columns[i]]
        return rows

    @property
    def strain(self) -> np.ndarray:
        """(n_strains, n) strains of unit energy per unit of each coordinate."""
        return np.asarray(self._free[2:])

    def polar(self) -> np.ndarray:
        """Return slopes at the points of integration (n_points, n), times the root of the polar inertia of each.

        The polar inertia of a section with two equal second moments is twice its rotary inertia, also where Euler's
        theory leaves that one out of the mass.
        """
        rows = []
        for element, start, at, shapes in zip(self.elements, self._motion, self._columns, self._shapes):
            node, weight = integration(element.bubbles)
            half = (element.end - element.start) / 2
            rotation = _scale_to_element(_functions_at_gauss(element.bubbles, self._shear), element, self._shear)[2]
            rotary = element.rigidity(element.start + (node + 1) * half).rotary
            rows.append(np.sqrt(2 * weight * half * rotary)[:, None] * (start[1] + rotation @ shapes @ self._free[at]))
        return np.vstack(rows)


class _Strained(NamedTuple):
    """An element in coordinates of its start's motion and strained shapes of unit energy."""

    shapes: np.ndarray  # (2 + bubbles, n): end relative to the start, bubbles
    mass: np.ndarray  # (2 + n, 2 + n)
    influence: np.ndarray  # (2 + n,)


def _strain_shapes(element: BeamElement, shear: bool) -> _Strained:
    node, weight = integration(element.bubbles)
    half = (element.end - element.start) / 2
    distance, weight = (node + 1) * half, weight * half
    section = element.rigidity(element.start + distance)
    value, slope, rotation, curvature = _scale_to_element(_functions_at_gauss(element.bubbles, shear), element, shear)
    stiffness = (curvature.T * (weight * section.bending)) @ curvature
    if shear:
        stiffness += ((slope - rotation).T * (weight * section.shear)) @ (slope - rotation)
    shapes = unit_energy(stiffness)
    moves = np.hstack((np.ones((distance.size, 1)), distance[:, None], value @ shapes))
    mass = (moves.T * (weight * section.mass)) @ moves
    if shear:
        turns = np.hstack((np.zeros((distance.size, 1)), np.ones((distance.size, 1)), rotation @ shapes))
        mass += (turns.T * (weight * section.rotary)) @ turns
    return _Strained(shapes, mass, (weight * section.mass) @ moves)


def unit_energy(stiffness: np.ndarray) -> np.ndarray:
    """Return the shapes (n, n) of an element that diagonalise its stiffness (n, n) to the unit matrix."""
    scale = np.sqrt(stiffness.diagonal())
    energy, vector = np.linalg.eigh(stiffness / np.outer(scale, scale))
    return np.asarray(vector / np.sqrt(energy) / scale[:, None])


def null_space(zero: Sequence[np.ndarray], n: int) -> np.ndarray:
    """Return orthonormal motions (n, n - n_zero) that satisfy independent rows of constraints."""
    if not zero:
        return np.eye(n)
    rows = np.array(zero)
    return np.linalg.qr((rows / np.linalg.norm(rows, axis=1)[:, None]).T, mode="complete").Q[:, len(rows) :]


@functools.cache
def integration(bubbles: int) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss points and weights, exact for eight powers more than a constant section has."""
    return leggauss(bubbles + 8)


@functools.cache
def _functions_at_gauss(bubbles: int, shear: bool) -> tuple[np.ndarray, ...]:
    """Return the functions of `_functions` at the points of integration."""
    return _functions(integration(bubbles)[0], bubbles, shear)


def _functions(xi: np.ndarray, bubbles: int, shear: bool) -> tuple[np.ndarray, ...]:
    """Return deflection, slope, rotation and curvature functions of an element from -1 to 1 at points (n_xi,)."""
    return _timoshenko(xi, bubbles + 1) if shear else _euler(xi, bubbles)


@functools.cache
def _deflection_series(bubbles: int, shear: bool) -> np.ndarray:
    """Return deflections of an element from -1 to 1 as Legendre series (n_degrees, n)."""
    xi = integration(bubbles)[0]
    return np.linalg.solve(legvander(xi, xi.size - 1), _functions_at_gauss(bubbles, shear)[0])[: bubbles + 4]


def _scale_to_element(functions: Sequence[np.ndarray], element: BeamElement, shear: bool) -> list[np.ndarray]:
    """Scale functions of an element from -1 to 1 to its length, with the end's rotation in rad."""
    half = (element.end - element.start) / 2
    value, slope, rotation, curvature = functions
    if shear:
        return [value, slope / half, rotation, curvature / half]
    size = np.array([1.0, half, *[half] * element.bubbles])
    return [value * size, slope * (size / half), rotation * (size / half), curvature * (size / half**2)]


def _euler(xi: np.ndarray, bubbles: int) -> tuple[np.ndarray, ...]:
    """Return Euler-Bernoulli deflection, slope, rotation and curvature (n_xi, 2 + bubbles), from -1 to 1."""
    k = np.arange(2, bubbles + 2)
    legendre, size = legvander(xi, bubbles + 3), np.sqrt(2 * k + 1)
    once = (legendre[:, k + 1] - legendre[:, k - 1]) / (2 * k + 1)
    upper, lower = legendre[:, k + 2] - legendre[:, k], legendre[:, k] - legendre[:, k - 2]
    twice = (upper / (2 * k + 3) - lower / (2 * k - 1)) / (2 * k + 1)
    x2, x3 = xi**2, xi**3
    value = np.stack((2 + 3 * xi - x3, -1 - xi + x2 + x3), -1) / 4
    slope = np.hstack((np.stack((3 - 3 * x2, 3 * x2 + 2 * xi - 1), -1) / 4, once * size))
    curvature = np.stack((-6 * xi, 6 * xi + 2), -1) / 4
    return np.hstack((value, twice * size)), slope, slope, np.hstack((curvature, legendre[:, k] * size))


def _timoshenko(xi: np.ndarray, bubbles: int) -> tuple[np.ndarray, ...]:
    """Return Timoshenko deflection, its slope, section rotation, its slope (n_xi, 2 + 2 bubbles)."""
    hat_and_bubbles, rate = linear_and_bubbles(xi, bubbles)
    value, slope, rotation, curvature = np.zeros((4, xi.size, 2 + 2 * bubbles))
    deflected, rotated = np.r_[0, 2 : 2 + bubbles], np.r_[1, 2 + bubbles : 2 + 2 * bubbles]
    value[:, deflected], slope[:, deflected] = hat_and_bubbles, rate
    rotation[:, rotated], curvature[:, rotated] = hat_and_bubbles, rate
    return value, slope, rotation, curvature


def linear_and_bubbles(xi: np.ndarray, bubbles: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a line from 0 to 1 and once integrated Legendre polynomials at (n_xi,), and their slopes (n_xi, n)."""
    k = np.arange(1, bubbles + 1)
    legendre, size = legvander(xi, bubbles + 1), np.sqrt(2 * k + 1)
    bubble, rate = (legendre[:, k + 1] - legendre[:, k - 1]) / (2 * k + 1) * size, legendre[:, k] * size
    return np.column_stack(((1 + xi) / 2, bubble)), np.column_stack((np.full_like(xi, 0.5), rate))


class TorsionMesh(_ElementChain):
    """A chain of elements: the twist of a shaft's start, and the strains of unit energy that each element adds.

    Parameters
    ----------
    elements : sequence of Element
        Elements in order along the shaft.
    held : sequence of float
        Positions, m, of nodes that do not twist.

    Attributes
    ----------
    mass, stiffness : ndarray, shape (n, n)
        Matrices in coordinates that fix the held nodes.
    """

    def __init__(self, elements: Sequence[BeamElement], held: Sequence[float] = ()) -> None:
        parts = [_twist_shapes(element) for element in elements]
        super().__init__(elements, [shapes for shapes, _ in parts], 1)
        motion = np.zeros((len(self.nodes), self._size))
        for i, (columns, shapes) in enumerate(zip(self._columns, self._shapes)):
            motion[i + 1] = motion[i]
            motion[i + 1, columns] += shapes[0]
        motion[:, 0] = np.linalg.norm(motion[-1])  # the rigid twist, as large as that by strains
        self._free = null_space([motion[node] for node in sorted({self._node(x) for x in held})], self._size)
        self._motion = motion @ self._free
        self.stiffness = self._free[1:].T @ self._free[1:]
        self.mass = np.zeros_like(self.stiffness)
        for start, columns, (_, mass) in zip(self._motion, self._columns, parts):
            moves = np.vstack((start, self._free[columns]))
            self.mass += moves.T @ mass @ moves

    def twist(self, x: np.ndarray, order: int = 0) -> np.ndarray:
        """Return the twist, rad, or that per length (order 1), rad/m, (n_x, n) at positions (n_x,), m."""
        rows = np.zeros((x.size, len(self.mass)))
        for row, at, i in zip(rows, x, self._element_of(x)):
            element = self.elements[i]
            half = (element.end - element.start) / 2
            value = linear_and_bubbles(np.array([(at - element.start) / half - 1]), element.bubbles)[order][0]
            row += value / half**order @ self._shapes[i] @ self._free[self._columns[i]] + (order == 0) * self._motion[i]
        return rows


def _twist_shapes(element: BeamElement) -> tuple[np.ndarray, np.ndarray]:
    """Return shapes (1 + bubbles, n) of unit energy, and the mass (1 + n, 1 + n) of the start's twist and them."""
    node, weight = integration(element.bubbles)
    half = (element.end - element.start) / 2
    section = element.rigidity(element.start + (node + 1) * half)
    value, rate = linear_and_bubbles(node, element.bubbles)
    shapes = unit_energy((rate.T * (weight * section.torsion / half)) @ rate)
    moves = np.column_stack((np.ones(node.size), value @ shapes))
    return shapes, (moves.T * (weight * half * section.polar)) @ moves
