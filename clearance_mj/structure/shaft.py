"""Shafts of sections, with supports, springs and discs."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
import scipy.linalg
from numpy.polynomial.legendre import leggauss
from pydantic import Field

from ..core.errors import RigError
from ..core.validation import NotNegative, Number, Share, Text, checked
from .base import Assembly, PlaneCoupling, Structure, parse_direction, parse_place, register
from .elements import BeamElement, Mesh, Rigidity, TorsionMesh
from .section import HELD, Disc, Material, Section, Support

__all__ = ["Disc", "Material", "Section", "Shaft", "Support", "rows_at"]

SHEAR_EFFECT = 0.01  # relative effect of shear and rotary inertia on the third frequency above which "auto" counts them
PLACE_TOLERANCE = 1e-6  # of a shaft's length: closer positions of supports, discs and sections' ends are the same
NODE_TOLERANCE = 1e-3  # of a shaft's length: a load this close to a node needs no further one
MAX_PHASE = 4.0  # rad, phase of a bending wave over an element, at the highest requested mode
MAX_PIECES = 100  # divisions of a shaft for short waves: its matrices are dense
MIN_BUBBLES = 2  # bubble functions of an element
MIN_TWIST_BUBBLES = 8  # bubble functions of an element's twist, enough for tapers too
OF_BENDING = {"Z": (0, 1.0), "RY": (1, -1.0), "KZ": (2, 1.0)}
"""Axis of a point on a shaft: order of the derivative of its deflection along z, and its sign."""
OF_TWIST = {"RX": 0, "KX": 1}


@register
@checked(RigError)
class Shaft(Structure):
    """A straight shaft of one or more sections, free except at its supports."""

    sections: Annotated[tuple[Section, ...], Field(min_length=1)]
    """one after the other, from ``start`` on"""
    supports: tuple[Support, ...] = ()
    """anywhere on the shaft"""
    discs: tuple[Disc, ...] = ()
    """anywhere on the shaft"""
    material: Material | None = None
    """of every section without one"""
    rayleigh: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    """(η1 in 1/s, η2 in s): damping η1 M + η2 K"""
    damping_ratios: tuple[Share, ...] = ()
    """of the modes, in addition; the last one holds for all that follow"""
    theory: Literal["auto", "euler", "timoshenko"] = "auto"
    """of bending; auto: Timoshenko's where a shaft is short for its depth"""
    start: Number = 0.0
    """m, position of the shaft's left end"""
    name: Text = ""
    """of one of several shafts"""
    kind: Literal["shaft"] = "shaft"
    """of structure"""

    def __post_init__(self) -> None:
        for i, section in enumerate(self.sections):
            if section.material is None and self.material is None:
                raise ValueError(f"sections[{i}].material is missing, and the shaft has no material for all sections")
        for kind in ("supports", "discs"):
            for i, item in enumerate(getattr(self, kind)):
                if not self._contains(item.position):
                    raise ValueError(f"{kind}[{i}].position {self._describe_outside(item.position)}")

    @property
    def end(self) -> float:
        """Position of the shaft's right end, m."""
        return self.start + self.length

    @property
    def length(self) -> float:
        """Length in m."""
        return math.fsum(section.length for section in self.sections)

    @property
    def shafts(self) -> tuple[Shaft, ...]:
        """Itself; see `Structure.shafts`."""
        return (self,)

    @property
    def edges(self) -> tuple[float, ...]:
        """Positions of the sections' ends, m: one more than sections."""
        return tuple(self.start + math.fsum(s.length for s in self.sections[:i]) for i in range(len(self.sections) + 1))

    @property
    def total_mass(self) -> float:
        """Mass in kg, with the discs."""
        _, weight, rigidity = self._integration
        return float(weight @ rigidity.mass) + sum(disc.mass for disc in self.discs)

    @property
    def slenderness(self) -> float:
        """Longest stretch without a rigid support, over the mean radius of gyration of its sections."""
        supported = [s.position for s in self.supports if s.kind in ("clamped", "pinned")]
        stops = sorted({self.start, *supported, self.end})
        _, weight, rigidity = self._integration
        radius = weight @ np.sqrt(rigidity.rotary / rigidity.mass) / self.length
        return max(b - a for a, b in pairwise(stops)) / float(radius)

    @property
    def bending_theory(self) -> Literal["euler", "timoshenko"]:
        """The theory in use: ``theory``, or the choice of "auto".

        Shear and rotary inertia lower frequency n of a pinned span of slenderness s by the fraction
        (1 + E/κG)(nπ/s)²/2 (Timoshenko, Phil. Mag. 43, 1922; Weaver, Timoshenko & Young, 1990, section 5.12).
        Timoshenko's theory is chosen where that is over 1 % of the third frequency.
        """
        if self.theory != "auto":
            return self.theory
        _, weight, rigidity = self._integration
        second_moment_ratio = rigidity.bending * rigidity.mass / (rigidity.rotary * rigidity.shear)  # E / κG
        ratio = weight @ second_moment_ratio / self.length
        reduction = (1 + ratio) * (3 * math.pi / self.slenderness) ** 2 / 2
        return "timoshenko" if reduction > SHEAR_EFFECT else "euler"

    def check(self, point: float | str) -> None:
        """Raise a ValueError for a point that is not on the shaft; see `Structure.check`."""
        place, (axis, _) = parse_place(point), parse_direction(point) or ("Z", 1)
        if place is None or place[0] not in ("", self.name):
            raise ValueError(f'"{point}" is no position on the shaft, a number of m')
        if not self._contains(place[1]):
            raise ValueError(self._describe_outside(place[1]))
        if axis == "X":
            raise ValueError(f'"{point}": a shaft does not move along X; give Y, Z, RX (twist), RY or RZ')
        if axis == "RX" and any(s.holds_twist and abs(s.position - place[1]) <= self._tolerance for s in self.supports):
            raise ValueError(f'"{point}" cannot twist: the support there holds it; give its twist, N m/rad')

    @property
    def _tolerance(self) -> float:
        return PLACE_TOLERANCE * self.length

    def _contains(self, x: float) -> bool:
        return self.start - self._tolerance <= x <= self.end + self._tolerance

    def _describe_outside(self, x: float) -> str:
        name = f' "{self.name}"' if self.name else ""
        return f"{x:g} m lies outside the shaft{name} ({self.start:g} <= x <= {self.end:g} m)"

    def assemble(self, points: tuple[float | str, ...], modes: int) -> Assembly:
        """Return mass and stiffness of beam elements, fine enough for the requested modes.

        Coordinates of twist follow those of bending if one of the points is RX or KX.
        """
        fixed = [(s.position, i) for s in self.supports for i in HELD[s.kind]]
        elements = self._elements(_positions(points), modes)
        mesh = Mesh(elements, self.bending_theory == "timoshenko", fixed)
        mass, stiffness, influence, viscous = mesh.mass, mesh.stiffness, mesh.influence, np.zeros_like(mesh.mass)
        rocking = mesh.rocking.copy()
        for disc in self.discs:
            motion = mesh.motion(disc.position)
            mass += (motion.T * [disc.mass, disc.inertia]) @ motion
            influence += disc.mass * motion[0]
            rocking += disc.mass * disc.position * motion[0] + disc.inertia * motion[1]
        for support in self.supports:
            motion = mesh.motion(support.position)
            stiffness += (motion.T * [support.translation, support.rotation]) @ motion
            viscous += (motion.T * [support.translation_damping, support.rotation_damping]) @ motion
        torsion = None
        if any((parse_direction(point) or "Z")[0] in OF_TWIST for point in points):
            torsion = TorsionMesh(self._torsion(elements, modes), [s.position for s in self.supports if s.holds_twist])
            of_twist = self._twist_matrices(torsion)
            mass, stiffness, viscous = map(scipy.linalg.block_diag, (mass, stiffness, viscous), of_twist)
            influence, rocking = (np.pad(forces, (0, len(torsion.mass))) for forces in (influence, rocking))
        along_z = influence[:, None] * [0.0, 0.0, 1.0]
        damping = self.rayleigh, self.damping_ratios, viscous if viscous.any() else None
        return Assembly(
            mass, stiffness, along_z, lambda at: rows_at(at, len(mesh.mass), mesh.deflections, torsion), *damping,
            rocking, lambda: self._plane_coupling(mesh, len(mass)),
        )  # fmt: skip

    def _plane_coupling(self, mesh: Mesh, size: int) -> PlaneCoupling:
        """Return the coupling of the planes of the turning shaft, in the coordinates of bending."""
        discs = [math.sqrt(disc.about_axis) * mesh.motion(disc.position)[1] for disc in self.discs]
        polar, strain = np.vstack((mesh.polar(), *discs)), mesh.strain
        if twist := size - len(mesh.mass):
            polar, strain = (np.pad(part, ((0, 0), (0, twist))) for part in (polar, strain))
        return PlaneCoupling(polar, strain)

    def _twist_matrices(self, mesh: TorsionMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return mass, stiffness and damping of twist, with discs and supports."""
        mass, stiffness, viscous = mesh.mass.copy(), mesh.stiffness.copy(), np.zeros_like(mesh.mass)
        for disc in self.discs:
            turns = mesh.motion(disc.position)
            mass += disc.about_axis * np.outer(turns, turns)
        for support in self.supports:
            turns = mesh.motion(support.position)
            if support.twist and not support.holds_twist:
                stiffness += support.twist * np.outer(turns, turns)
            viscous += support.twist_damping * np.outer(turns, turns)
        return mass, stiffness, viscous

    @property
    def in_other_plane(self) -> Shaft:
        """The shaft as it bends along y: with supports and rectangles of that plane."""
        sections = tuple(dataclasses.replace(s, width=s.height, height=s.width) for s in self.sections)
        supports = tuple(support.in_other_plane for support in self.supports)
        return dataclasses.replace(self, sections=sections, supports=supports)

    def check_turning(self) -> None:
        """Raise a ValueError if a section is stiffer in one direction than in another."""
        for i, section in enumerate(self.sections):
            if section.diameter is None and section.width != section.height:
                raise ValueError(
                    f"sections[{i}] is {section.width} by {section.height} m: a shaft that turns needs sections that "
                    "are as stiff in every direction, or its stiffness would change as it turns"
                )

    def half_depth(self, x: float) -> float:
        """Return half the depth at x, m, in the direction of vibration; at a step that of the following section.

        Parameters
        ----------
        x : float
            Position, m.
        """
        edges = self.edges
        i = int(np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(self.sections) - 1))
        section = self.sections[i]
        return float(np.interp(x, edges[i : i + 2], section.diameter or section.height or (0.0, 0.0))) / 2

    def _elements(self, points: np.ndarray, modes: int) -> list[BeamElement]:
        """Return elements between steps, supports, discs and loads, short enough for waves of the highest mode."""
        wave, edges, pieces = self._highest_wave(modes), np.array(self.edges), list[BeamElement]()
        divided = 0
        for start, end in pairwise(self._nodes(points)):
            i = int(np.clip(np.searchsorted(edges, (start + end) / 2) - 1, 0, len(self.sections) - 1))
            rigidity = functools.partial(self._rigidity, i)
            ends = rigidity(np.array([start, end]))
            tapered = not math.isclose(*ends.bending)
            phase = wave * (end - start) * float(np.max(ends.mass / ends.bending)) ** 0.25
            n = math.ceil(phase / MAX_PHASE)
            divided += n - 1
            if divided > MAX_PIECES:
                raise ValueError(f"a shaft would be divided more than {MAX_PIECES} times: its sections differ too much")
            bubbles = MIN_BUBBLES + math.ceil(phase / n) + (4 if tapered else 0)
            pieces += [BeamElement(a, b, bubbles, rigidity) for a, b in pairwise(np.linspace(start, end, n + 1))]
        return pieces

    def _torsion(self, elements: Sequence[BeamElement], modes: int) -> list[BeamElement]:
        """Return the elements with enough functions for waves of twist of the highest mode."""
        _, weight, rigidity = self._integration
        slowness = np.sqrt(rigidity.polar / rigidity.torsion)  # s/m
        springs = sum(s.holds_twist or bool(s.twist) for s in self.supports)  # each raises a frequency to the next one
        wave = (modes + springs + 1) * math.pi / float(weight @ slowness) * float(slowness.max())
        return [e._replace(bubbles=MIN_TWIST_BUBBLES + math.ceil(wave * (e.end - e.start))) for e in elements]

    def _nodes(self, points: np.ndarray) -> list[float]:
        """Return positions of sections' ends and cuts, supports and discs, and of loads that are not at one of them."""
        cuts = (edge + s.length * cut for edge, s in zip(self.edges, self.sections) for cut in s.cuts)
        required = [*self.edges, *cuts, *(s.position for s in self.supports), *(disc.position for disc in self.discs)]
        nodes: list[float] = []
        for x, tolerance in [*((x, PLACE_TOLERANCE) for x in required), *((x, NODE_TOLERANCE) for x in points)]:
            if all(abs(x - other) > tolerance * self.length for other in nodes):
                nodes.append(float(x))
        return sorted(nodes)

    def _highest_wave(self, modes: int) -> float:
        """Return an upper bound of sqrt(ω) of the highest mode: each support raises it by one mode at most."""
        restraints = sum(len(HELD[s.kind]) + (s.translation > 0) + (s.rotation > 0) for s in self.supports)
        _, weight, rigidity = self._integration
        return max(modes + restraints, 3) * math.pi / float(weight @ (rigidity.mass / rigidity.bending) ** 0.25)

    def _rigidity(self, i: int, x: np.ndarray) -> Rigidity:
        """Return the rigidities of section i at positions x, m."""
        section = self.sections[i]
        material = section.material or self.material
        assert material is not None
        across = section.across((x - self.edges[i]) / section.length, material.poisson_ratio)
        shear_modulus = material.young_modulus / (2 * (1 + material.poisson_ratio))
        shear = across.shear_coefficient * shear_modulus * across.area
        inertia = material.density * across.area, material.density * across.second_moment
        twist = shear_modulus * across.torsion_constant, material.density * across.polar_moment
        return Rigidity(material.young_modulus * across.second_moment, shear, *inertia, *twist)

    def integration(self, start: float, end: float) -> tuple[np.ndarray, np.ndarray, Rigidity]:
        """Return Gauss points between two positions, their weights, m, and rigidities there.

        There are eight in every section, or in every piece between its cuts.

        Parameters
        ----------
        start, end : float
            Ends of the interval, m.
        """
        node, weight = leggauss(8)
        at, weights, parts = [], [], []
        for i, section in enumerate(self.sections):
            ends = self.edges[i] + section.length * np.array([0.0, *section.cuts, 1.0])
            for first, last in pairwise(np.clip(ends, start, end)):
                if first < last:
                    at.append(first + (node + 1) * (last - first) / 2)
                    weights.append(weight * (last - first) / 2)
                    parts.append(self._rigidity(i, at[-1]))
        return np.concatenate(at), np.concatenate(weights), Rigidity(*map(np.concatenate, zip(*parts)))

    @functools.cached_property
    def _integration(self) -> tuple[np.ndarray, np.ndarray, Rigidity]:
        """Gauss points of all sections, m, their weights, m, and rigidities."""
        return self.integration(self.start, self.end)


def rows_at(
    points: Sequence[float | str], n: int, bending: Callable[[np.ndarray, int], np.ndarray],
    torsion: TorsionMesh | None = None,
) -> np.ndarray:  # fmt: skip
    """Return motions of points on a shaft per unit of each coordinate, along their own axes.

    Motions of the other plane are 0, and twist without a torsion mesh.

    Parameters
    ----------
    points : sequence of Point, length n_points
        The points.
    n : int
        Number of coordinates of bending.
    bending : callable
        Deflections (n_x, n) at positions (n_x,), m, or their derivatives of order 1 or 2.
    torsion : TorsionMesh, optional
        Twist, in the coordinates that follow those of bending.
    """
    if torsion is None and not any(isinstance(point, str) for point in points):
        return bending(np.array(points, dtype=float), 0)
    x, axes = _positions(points), [parse_direction(point) or ("Z", 1) for point in points]
    motions = np.zeros((len(points), n + (0 if torsion is None else len(torsion.mass))))
    for axis in {axis for axis, _ in axes}:
        selected = [i for i, (other, _) in enumerate(axes) if other == axis]
        sign = np.array([[axes[i][1]] for i in selected])
        if axis in OF_BENDING:
            order, factor = OF_BENDING[axis]
            motions[selected, :n] = factor * sign * bending(x[selected], order)
        elif axis in OF_TWIST and torsion is not None:
            motions[selected, n:] = sign * torsion.twist(x[selected], OF_TWIST[axis])
    return motions


def _positions(points: Sequence[float | str]) -> np.ndarray:
    """Return positions (n,), m."""
    return np.array([place[1] for place in map(parse_place, points) if place])
