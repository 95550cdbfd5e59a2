"""Torsion of a shaft: elements of any order in a row, as those of bending in `elements`.

(G J θ')' = ρ I_p θ̈ of Saint-Venant's torsion, whose sections warp freely (Timoshenko, Young & Weaver, Vibration
Problems in Engineering, 1974, section 5.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from .elements import Element, integration, linear_and_bubbles, null_space, unit_energy

__all__ = ["TorsionMesh"]


class TorsionMesh:
    """Elements in a row: the twist of a shaft's start, and what each element adds by its strains of unit energy.

    Parameters
    ----------
    elements : sequence of Element
        Elements in the order in which they follow each other.
    held : sequence of float
        Positions, m, of nodes that do not twist.

    Attributes
    ----------
    mass, stiffness : ndarray, shape (n, n)
        Matrices in coordinates that leave the held nodes where they are.
    """

    def __init__(self, elements: Sequence[Element], held: Sequence[float] = ()) -> None:
        self.elements = elements
        self.nodes = np.array([elements[0].start, *(e.end for e in elements)])
        parts = [_strained(element) for element in elements]
        self._shapes = [shapes for shapes, _ in parts]
        first = 1 + np.cumsum([0, *(len(shapes) for shapes in self._shapes)])
        self._own = [slice(a, b) for a, b in pairwise(first)]
        motion = np.zeros((len(self.nodes), int(first[-1])))
        for i, (own, shapes) in enumerate(zip(self._own, self._shapes)):
            motion[i + 1] = motion[i]
            motion[i + 1, own] += shapes[0]
        motion[:, 0] = np.linalg.norm(motion[-1])  # the rigid twist, as large as what the strains add
        self._free = null_space([motion[node] for node in sorted({self._node(x) for x in held})], motion.shape[1])
        self._motion = motion @ self._free
        self.stiffness = self._free[1:].T @ self._free[1:]
        self.mass = np.zeros_like(self.stiffness)
        for start, own, (_, mass) in zip(self._motion, self._own, parts):
            moves = np.vstack((start, self._free[own]))
            self.mass += moves.T @ mass @ moves

    def motion(self, x: float) -> np.ndarray:
        """Return the twist (n,), rad, of the node nearest to a position, m, per unit of each coordinate."""
        return np.asarray(self._motion[self._node(x)])

    def twist(self, x: np.ndarray, order: int = 0) -> np.ndarray:
        """Return the twist, rad, or that per length (order 1), rad/m, (n_x, n) at positions (n_x,), m."""
        rows = np.zeros((x.size, len(self.mass)))
        which = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, len(self.elements) - 1)
        for row, at, i in zip(rows, x, which):
            element = self.elements[i]
            half = (element.end - element.start) / 2
            value = linear_and_bubbles(np.array([(at - element.start) / half - 1]), element.bubbles)[order][0]
            row += value / half**order @ self._shapes[i] @ self._free[self._own[i]] + (order == 0) * self._motion[i]
        return rows

    def _node(self, x: float) -> int:
        return int(np.argmin(np.abs(self.nodes - x)))


def _strained(element: Element) -> tuple[np.ndarray, np.ndarray]:
    """Shapes (1 + bubbles, n) of unit energy, and the mass (1 + n, 1 + n) of them and the start's twist before them."""
    node, weight = integration(element.bubbles)
    half = (element.end - element.start) / 2
    section = element.rigidity(element.start + (node + 1) * half)
    value, rate = linear_and_bubbles(node, element.bubbles)
    shapes = unit_energy((rate.T * (weight * section.torsion / half)) @ rate)
    moves = np.column_stack((np.ones(node.size), value @ shapes))
    return shapes, (moves.T * (weight * half * section.polar)) @ moves
