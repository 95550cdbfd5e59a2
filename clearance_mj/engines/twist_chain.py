"""The twist of a shaft as a chain of rigid links that turn about its axis; see `chain`.

Twist at the ends of elements is exact where torques act there. Within an element the torque is the polynomial through
its values at the hinges. The kinetic energy of the links, each of which twists as a whole, differs from the shaft's in
second order: (kL/n)²/22 of a natural frequency with wave number k, of n links on the length L.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from ..structure import Shaft, Support
from ..structure.shaft import OF_TWIST
from .chain import Chain, Hold

__all__ = ["TwistChain"]


@dataclass(frozen=True, eq=False)
class TwistChain(Chain):
    """Chain of a twisting shaft with polar inertias, without mass; its left end may turn."""

    axes: ClassVar[dict[str, tuple[int, float]]] = {axis: (order, 1.0) for axis, order in OF_TWIST.items()}
    first_joints: ClassVar[tuple[str, ...]] = ("turn",)
    derivative: ClassVar[int] = 1

    def holds(self, support: Support) -> tuple[Hold, ...]:
        """Return a support's constraint of the twist."""
        rigid = support.holds_twist
        return (Hold(0, rigid, 0.0 if rigid else float(support.twist or 0.0), support.twist_damping),)

    @functools.cached_property
    def inertias(self) -> np.ndarray:
        """(n_links,) polar inertia of the moving links with the inertias on them, kg m²."""
        inertias = []
        for start, end in pairwise((*self.starts, self.shaft.end)):
            _, weight, rigidity = self.shaft.integration(start, end)
            last = end == self.shaft.end
            parts = [own for x, _, own in self.masses if start <= x < end or (last and x >= end)]
            inertias.append(weight @ rigidity.polar + sum(parts))
        return np.array(inertias)

    @staticmethod
    def discs(shaft: Shaft) -> list[tuple[float, float, float]]:
        """Return position, m, no mass, and inertia about the axis, kg m², of a shaft's discs."""
        return [(disc.position, 0.0, disc.about_axis) for disc in shaft.discs]

    @functools.cached_property
    def mass(self) -> np.ndarray:
        """(nv, nv) matrix of the links' polar inertias."""
        middles = [(start + end) / 2 for start, end in pairwise((*self.starts, self.shaft.end))]
        turns = self.motion(middles, straight=True)
        return (turns.T * self.inertias) @ turns
