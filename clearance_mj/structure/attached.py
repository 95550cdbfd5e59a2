"""Attachments of a structure: fixture modes, housings, springs, oscillators, a second bending plane.

A fixture moves the rig and is not moved by it. Its modes therefore are coordinates with a mass very much larger than
the rig's, so that every engine treats them as further linear degrees of freedom.
"""

from __future__ import annotations

import ast
import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Annotated, Literal, NamedTuple

import numpy as np
import scipy.linalg
from pydantic import Field

from ..core.errors import RigError
from ..core.plain_numbers import number_in, with_number
from ..core.validation import NotNegative, Number, Positive, Text, checked
from .base import Assembly, PlaneCoupling, Point, Rows, Structure, dof_vector, in_other_plane, rocked
from .beam import Beam
from .reduction import MassNormalisedModes, modal_damping, reduced
from .section import Material
from .shaft import Shaft
from .shafts import Spring

__all__ = [
    "LARGEST_DIFFERENCE", "MAX_DAMPING", "Attached", "FixtureMode", "Housing", "Oscillator", "Planes", "PointMass",
    "assemble", "foot", "housing_of", "with_masses",
]  # fmt: skip

ARM_FOOT = 1e-3  # of a position: length of an arm's foot, over which it follows the slope
HEAVY = 1e8  # mass of a fixture's mode over that of the rig
FOOT = "foot of "
HOUSING = "housing of bushings"
MAX_DAMPING = 3.0  # of critical, of a fixture's mode
LARGEST_DIFFERENCE = 0.5  # of the mean stiffness, between a shaft's two planes


@checked(RigError)
class PointMass:
    """A mass fixed to the structure at one point; at a degree of freedom it acts in that direction alone."""

    position: Point
    """m along the shaft, or a degree of freedom such as "12:+Z" """
    mass: Positive
    """kg; a point without inertia"""
    name: Text = ""
    """for people"""


@checked(RigError)
class Housing:
    """Flexible housing of a bushing: a mass on a spring and a damper to the base."""

    stiffness: Positive
    """N/m"""
    mass: Positive
    """kg, with the bushing's"""
    damping: NotNegative = 0.0
    """N s/m"""
    probe: Literal["housing", "base"] = "housing"
    """carrier of the bushing's displacement probe"""


@checked(RigError)
class Oscillator:
    """An oscillator on the structure: a mass on a spring and a damper, at a point or at the end of an arm."""

    position: Point
    """m along the shaft, or a degree of freedom such as "12:+Z" """
    mass: Positive
    """kg"""
    frequency: Positive
    """Hz, of the mass on its spring with the structure fixed"""
    damping_ratio: Annotated[Number, Field(ge=0, le=MAX_DAMPING)] = 0.01
    """of critical damping, likewise"""
    lever: Number = 0.0
    """m, along the shaft from ``position`` to the mass, which then is at the end of a rigid arm"""

    def __post_init__(self) -> None:
        if self.lever and number_in(self.position) is None:
            raise ValueError(f'lever {self.lever:g} m needs a position along a shaft, not "{self.position}"')

    @property
    def foot(self) -> tuple[tuple[Point, float], ...]:
        """Points of the structure whose motions, with these factors, add up to that of the spring's foot."""
        if not self.lever:
            return ((self.position, 1.0),)
        x = number_in(self.position) or 0.0
        before = x * (1 - ARM_FOOT) or ARM_FOOT
        ratio = self.lever / (x - before)
        return (self.position, 1.0 + ratio), (with_number(self.position, before), -ratio)


@checked(RigError)
class FixtureMode:
    """A mode of the fixture that carries the rig, between the base's accelerometer and the feet of clamp and bushings.

    η̈ + 2ζω η̇ + ω² η = -a under the base's acceleration a; the foot at x moves by
    (participation + rocking (x - about)) η more than the base's accelerometer.
    """

    frequency: Positive
    """Hz"""
    damping_ratio: Annotated[Number, Field(ge=0, le=MAX_DAMPING)] = 0.01
    """ζ, of critical damping"""
    participation: Number = 1.0
    """motion of the feet over that of the mode; 1: a rigid rig on one spring"""
    rocking: Number = 0.0
    """rad/m, rotation of the base over the mode's motion"""
    about: Number = 0.0
    """m along the shaft, of the foot that rocking does not move"""

    def __post_init__(self) -> None:
        if not self.participation and not self.rocking:
            raise ValueError("participation and rocking are both 0: the mode moves no foot; give one of them")


@checked(RigError)
class Planes:
    """Two bending planes of a shaft that differ in stiffness and are turned against the direction of vibration."""

    difference: Annotated[Number, Field(gt=0, le=LARGEST_DIFFERENCE)]
    """of the bending stiffnesses of both planes, over their mean"""
    angle: Annotated[Number, Field(gt=0, lt=math.pi / 2)]
    """rad, between the stiffer plane and the direction of vibration"""


def foot(point: float | str) -> str:
    """Return the name of the point of the base below a point of the structure."""
    return f"{FOOT}{point!r}"


def housing_of(number: int) -> str:
    """Return the name of the housing of a bushing, as a point."""
    return f"{HOUSING}[{number}]"


class Attached(NamedTuple):
    """Attachments of a structure."""

    housings: tuple[Housing | None, ...] = ()  # of each clearance
    places: tuple[Point, ...] = ()  # of the clearances
    fixture: tuple[FixtureMode, ...] = ()
    springs: tuple[Spring, ...] = ()
    planes: Planes | None = None
    oscillators: tuple[Oscillator, ...] = ()
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)  # unit vector, along which the base moves

    def __bool__(self) -> bool:
        """Return True if there is any attachment."""
        return any((*self.housings, self.fixture, self.springs, self.planes, self.oscillators))

    def foot_motion(self, point: float | str) -> np.ndarray:
        """Return the base's motion below a point, along the point's direction, per fixture mode (n_fixture_modes,)."""
        along = float(dof_vector(point) @ self.direction)
        return np.array([m.participation * along + m.rocking * rocked(point, m.about) for m in self.fixture])

    @property
    def in_other_plane(self) -> Attached:
        """The attachments of a shaft that bends along y; see `Structure.in_other_plane`."""
        oscillators = [dataclasses.replace(o, position=in_other_plane(o.position)) for o in self.oscillators]
        springs = tuple(spring.in_other_plane for spring in self.springs)
        places = tuple(map(in_other_plane, self.places))
        return self._replace(springs=springs, oscillators=tuple(oscillators), places=places)


class AttachedMatrices(NamedTuple):
    """Matrices of a structure with its attachments, in few coordinates."""

    mass: np.ndarray
    stiffness: np.ndarray
    viscous: np.ndarray
    cross: np.ndarray  # (n, n) skew part of the stiffness
    influence: np.ndarray  # (n, 3)
    rows: Rows
    turning: Callable[[], PlaneCoupling] | None  # of one bending plane of a shaft, as of `Assembly`


class _Plane(NamedTuple):
    """A structure in one bending plane, reduced to modes and static shapes."""

    basis: MassNormalisedModes
    damping: np.ndarray  # (n, n) of the modes
    cross: np.ndarray  # (n, n) skew stiffness of the modes
    influence: np.ndarray  # (n, 3) of the modes
    rocking: np.ndarray | None  # (n,) of the modes
    rows: Rows
    component: float  # in this plane of a motion along Z
    turning: Callable[[], PlaneCoupling] | None  # in the coordinates before the reduction


def assemble(
    structure: Structure, attached: Attached, masses: Sequence[tuple[float | str, float]],
    loads: Sequence[tuple[tuple[float | str, float], ...]], modes: int,
) -> AttachedMatrices:  # fmt: skip
    """Return the matrices of a structure with point masses and attachments.

    Parameters
    ----------
    structure : Structure
        The structure.
    attached : Attached
        Its attachments.
    masses : sequence of (Point, float)
        Point masses, kg.
    loads : sequence of tuple of (Point, float)
        Points at which forces act together, with factors: the static shapes.
    modes : int
        Number of modes of the structure in each plane.
    """
    legs = [tuple((p, s) for p, s in zip(spring.joined, (1.0, -1.0))) for spring in attached.springs]
    legs += [each.foot for each in attached.oscillators]
    planes = [_reduce(s, c, masses, [*loads, *legs], modes) for s, c in _planes(structure, attached.planes)]
    sizes = [plane.basis.omega.size for plane in planes]
    n, housed = sum(sizes), [j for j, housing in enumerate(attached.housings) if housing]
    first_oscillator = n + len(housed)  # index of the first oscillator; the fixture's modes follow
    first = first_oscillator + len(attached.oscillators)
    size = first + len(attached.fixture)
    mass, stiffness, viscous, cross = np.zeros((4, size, size))
    influence = np.zeros((size, 3))
    mass[:n, :n] = np.eye(n)
    stiffness[:n, :n] = np.diag(np.concatenate([plane.basis.omega**2 for plane in planes]))
    viscous[:n, :n] = scipy.linalg.block_diag(*(plane.damping for plane in planes))
    cross[:n, :n] = scipy.linalg.block_diag(*(plane.cross for plane in planes))
    influence[:n] = np.vstack([plane.component * plane.influence for plane in planes])
    for i, j in enumerate(housed, n):
        housing = attached.housings[j]
        assert housing
        mass[i, i], stiffness[i, i], viscous[i, i] = housing.mass, housing.stiffness, housing.damping
    for i, oscillator in enumerate(attached.oscillators, first_oscillator):
        mass[i, i] = oscillator.mass
    below = [((attached.places[j], 1.0),) for j in housed] + [each.foot for each in attached.oscillators]
    for i, feet in enumerate(below, n):
        influence[i] = mass[i, i] * dof_vector(feet[0][0])
        mass[i, first:] = mass[i, i] * sum(factor * attached.foot_motion(point) for point, factor in feet)
    heavy = HEAVY * float(structure.total_mass or np.sum(influence[:n] ** 2) or 1.0)
    for i, mode in enumerate(attached.fixture, first):
        omega = 2 * np.pi * mode.frequency
        mass[i, i], stiffness[i, i], viscous[i, i] = heavy, heavy * omega**2, 2 * heavy * mode.damping_ratio * omega
        influence[i] = heavy * np.array(attached.direction)
        mass[:n, i] = mode.participation * influence[:n] @ attached.direction
        if mode.rocking:
            mass[:n, i] += mode.rocking * _rocking_forces(planes, structure, mode.about)
    mass[first:, :first] = mass[:first, first:].T

    def rows(at: Sequence[float | str]) -> np.ndarray:
        motion, on_structure = np.zeros((len(at), size)), []
        for i, point in enumerate(at):
            below = point
            if isinstance(point, str) and point.startswith(HOUSING):
                j = int(point[len(HOUSING) + 1 : -1])
                motion[i, n + housed.index(j)] = 1.0
                below = attached.places[j]
            elif isinstance(point, str) and point.startswith(FOOT):
                below = ast.literal_eval(point[len(FOOT) :])
            else:
                on_structure.append(i)
            motion[i, first:] = attached.foot_motion(below)
        points = [at[i] for i in on_structure]
        motion[on_structure, :n] = np.hstack([p.component * p.rows(points) @ p.basis.shapes for p in planes])
        return motion

    for spring in attached.springs:
        ends = rows(spring.joined)
        stretch = ends[0] - (ends[1] if len(ends) > 1 else rows([foot(spring.position)])[0])
        stiffness += spring.stiffness * np.outer(stretch, stretch)
        viscous += spring.damping * np.outer(stretch, stretch)
    for i, oscillator in enumerate(attached.oscillators, first_oscillator):
        points, factors = zip(*oscillator.foot)
        stretch = -np.array(factors) @ rows(points)
        stretch[first:] = 0.0  # both ends of the spring move with the feet
        stretch[i] = 1.0
        omega = 2 * np.pi * oscillator.frequency
        stiffness += oscillator.mass * omega**2 * np.outer(stretch, stretch)
        viscous += 2 * oscillator.damping_ratio * omega * oscillator.mass * np.outer(stretch, stretch)
    return AttachedMatrices(mass, stiffness, viscous, cross, influence, rows, _plane_coupling(planes, size))


def _plane_coupling(planes: Sequence[_Plane], size: int) -> Callable[[], PlaneCoupling] | None:
    """Return the coupling of two equal bending planes of a turning shaft: attachments do not turn."""
    if len(planes) > 1 or planes[0].turning is None:
        return None
    coupling, shapes = planes[0].turning, planes[0].basis.shapes
    return lambda: PlaneCoupling(*(np.pad(part @ shapes, ((0, 0), (0, size - shapes.shape[1]))) for part in coupling()))


def _planes(structure: Structure, planes: Planes | None) -> list[tuple[Structure, float]]:
    """Return the structure in each bending plane, and the component in it of a motion along Z."""
    if planes is None:
        return [(structure, 1.0)]
    factors = 1 + planes.difference / 2, 1 - planes.difference / 2
    components = math.cos(planes.angle), math.sin(planes.angle)
    return [(_scale_modulus(structure, factor), share) for factor, share in zip(factors, components)]


def _scale_modulus(structure: Structure, factor: float) -> Structure:
    """Return the structure with moduli multiplied by a factor; its supports are unchanged."""
    if isinstance(structure, Beam):
        return dataclasses.replace(structure, young_modulus=factor * structure.young_modulus)
    if isinstance(structure, Shaft):
        sections = tuple(dataclasses.replace(s, material=_stiffen(s.material, factor)) for s in structure.sections)
        return dataclasses.replace(structure, sections=sections, material=_stiffen(structure.material, factor))
    raise ValueError("planes: only a beam or one shaft has two bending planes here")


def _stiffen(material: Material | None, factor: float) -> Material | None:
    return material and dataclasses.replace(material, young_modulus=factor * material.young_modulus)


def _reduce(
    structure: Structure, component: float, masses: Sequence[tuple[float | str, float]],
    loads: Sequence[tuple[tuple[float | str, float], ...]], modes: int,
) -> _Plane:  # fmt: skip
    points = [point for point, _ in masses] + [point for load in loads for point, _ in load]
    on_structure = [p for p in points if not (isinstance(p, str) and p.startswith((FOOT, HOUSING)))]
    linear = structure.assemble(tuple(dict.fromkeys(on_structure)), modes)
    rows, (added, influence) = linear.rows, with_masses(linear, masses)
    rocking = None if linear.rocking is None else linear.rocking.copy()
    if rocking is not None:
        for (point, _), (mass, at) in zip(masses, added):
            rocking += mass * rocked(point) * at
    known = set(on_structure)
    acting = [[(p, s) for p, s in load if p in known] for load in loads]
    basis = reduced(linear, added, [], [sum(s * rows([p])[0] for p, s in load) for load in acting if load], modes)
    shapes = basis.shapes
    damping = modal_damping(linear, basis.omega, shapes)
    modal_rocking = None if rocking is None else shapes.T @ rocking
    cross = np.zeros_like(damping) if linear.cross is None else shapes.T @ (linear.cross @ shapes)
    return _Plane(basis, damping, cross, shapes.T @ influence, modal_rocking, rows, component, linear.turning)


def with_masses(
    linear: Assembly, masses: Sequence[tuple[float | str, float]]
) -> tuple[list[tuple[float, np.ndarray]], np.ndarray]:
    """Return masses with the rows of their points, and the influence (n, 3) of a structure that carries them."""
    added, influence = [(mass, linear.rows([point])[0]) for point, mass in masses], linear.influence.copy()
    for (point, _), (mass, at) in zip(masses, added):
        influence += mass * np.outer(at, dof_vector(point))
    return added, influence


def _rocking_forces(planes: Sequence[_Plane], structure: Structure, about: float) -> np.ndarray:
    """Return inertia forces (n,) per unit angular acceleration about a position, m."""
    parts = []
    for plane in planes:
        if plane.rocking is None:
            kind = getattr(structure, "kind", "structure")
            raise ValueError(f"fixture: a base that rocks needs shafts, whose masses have positions, not {kind}")
        parts.append(plane.component * (plane.rocking - about * plane.influence[:, 2]))
    return np.concatenate(parts)
