"""A structure that moves along y and z, reduced to modes: two bending planes of shafts, which turning couples.

With the modes as coordinates and the spin Ω > 0 from y to z,

    q̈ + (C + Ω G) q̇ + (ω² + Ω H) q = f.

Modes of a shaft are those of its plane along y, then of that along z. G is skew: the moment of a disc's polar inertia
I on its slopes is -I Ω ż' about one and I Ω ẏ' about the other. H is skew too: damping that turns with the shaft sees
the velocity ẏ + Ω z, ż - Ω y of the turning shaft's material. It is the share η2 K of Rayleigh's damping, with K of the
shaft alone; all other damping stands still.

Source: Childs, Turbomachinery Rotordynamics, 1993, chapter 3; Krämer, Dynamics of Rotors and Foundations, 1993.
"""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from ..core.errors import RigError
from ..rig import Rig
from ..rig.extremes import computable
from ..rig.sensing import SensorRows, sensor_rows
from ..structure import Shaft, Structure
from ..structure.base import Turning, parse_dof
from ..structure.modal import Reduction, reduction

__all__ = ["SpatialCoordinates", "SpatialModel", "spatial_model"]


class SpatialCoordinates(ABC):
    """What a model of a rig in space makes of the motion of its points: what sensors read, and what drives it."""

    rig: Rig

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of coordinates."""

    @abstractmethod
    def moved(self, points: Sequence[float | str]) -> np.ndarray:
        """Return the displacement (n_points, 2, n) of points along y and z per coordinate."""

    @abstractmethod
    def directed(self, points: Sequence[float | str], direction: np.ndarray) -> np.ndarray:
        """Return the displacement (n_points, n) of points along directions per coordinate."""

    @functools.cached_property
    def sensor_rows(self) -> SensorRows:
        """What the sensors read of the coordinates and of the base."""
        return sensor_rows(self.rig, self.directed, self.size)

    @property
    def at_sensors(self) -> np.ndarray:
        """(n_sensors, n) what the sensors read of the coordinates, before it is differentiated to their order."""
        return self.sensor_rows.rows

    @property
    def sensors_on_base(self) -> np.ndarray:
        """(n_sensors,) the same of the base."""
        return self.sensor_rows.on_base

    def push(self) -> np.ndarray:
        """Return the force (n,) of the shaker on the coordinates per N."""
        points, factors = self.rig.shaker.pushed()
        return np.asarray(factors @ self.directed(points, self.rig.shaker.unit_direction))

    @functools.cached_property
    def unbalance(self) -> np.ndarray:
        """(2, n) force of all unbalances on the modes per Ω² cos φ and Ω² sin φ, with φ the shaft's angle."""
        found = np.zeros((2, self.size))
        for each in self.rig.unbalances:
            y, z = each.moment * self.moved([each.position])[0]
            cos, sin = np.cos(each.phase), np.sin(each.phase)
            found += np.array([cos * y + sin * z, cos * z - sin * y])
        return found


@dataclass(frozen=True, eq=False)
class SpatialModel(SpatialCoordinates):
    """A rig's structure along y and z: q̈ + (C + Ω G) q̇ + (ω² + Ω H) q = f. Made by `spatial_model`."""

    rig: Rig
    """the rig"""
    omega: np.ndarray
    """(n,) natural circular frequencies of the structure at rest, 1/s"""
    damping: np.ndarray
    """(n,) diagonal of C, 1/s"""
    coupling: np.ndarray
    """(n, n) the rest of C, 1/s; (0, 0) if there is none"""
    gyroscopic: np.ndarray
    """(n, n) G, skew, per rad/s of the spin; (0, 0) of a rig that does not turn"""
    circulatory: np.ndarray
    """(n, n) H, skew, 1/s, of the damping that turns with the shaft; (0, 0) of a rig that does not turn"""
    influence: np.ndarray
    """(n, 3) inertia forces on the modes per unit acceleration of the base along X, Y and Z"""
    planes: tuple[slice, slice]
    """the coordinates that move along y and along z: half of them each for shafts, else all"""
    _reductions: tuple[Reduction, ...]

    @property
    def size(self) -> int:
        """Number of degrees of freedom."""
        return self.omega.size

    def moved(self, points: Sequence[float | str]) -> np.ndarray:
        """Return how points move along y and z, of modes of unit mass.

        Parameters
        ----------
        points : sequence of Point, length n_points
            Positions, m, or degrees of freedom, of whose nodes both are returned.

        Returns
        -------
        ndarray, shape (n_points, 2, n)
            1/sqrt(kg).
        """
        found = np.zeros((len(points), 2, self.size))
        for i, (axis, part) in enumerate(zip("YZ", self.planes)):
            here = self._reductions[min(i, len(self._reductions) - 1)]
            found[:, i, part] = here.rows([_along(point, axis) for point in points]) @ here.transform
        return found

    def directed(self, points: Sequence[float | str], direction: np.ndarray) -> np.ndarray:
        """Return how points move in directions (n_points, n): degrees of freedom in their own.

        Parameters
        ----------
        points : sequence of Point, length n_points
            Positions, m, or degrees of freedom.
        direction : ndarray, shape (n_points, 3) or (3,)
            Unit vectors, for positions on shafts.
        """
        found = np.einsum("pd,pdn->pn", np.broadcast_to(direction, (len(points), 3))[:, 1:], self.moved(points))
        named = [i for i, point in enumerate(points) if parse_dof(point)]
        if named:  # its own direction may be X, or a rotation
            (own,) = self._reductions
            found[named] = own.rows([points[i] for i in named]) @ own.transform
        return found

    def _clearances(self, joined: Sequence[tuple[float | str, ...]]) -> np.ndarray:
        found = self.moved([points[0] for points in joined])
        second = [i for i, points in enumerate(joined) if len(points) > 1]
        found[second] -= self.moved([joined[i][1] for i in second])
        return found

    @functools.cached_property
    def at_points(self) -> np.ndarray:
        """(3 n_bushings, 2, n) relative motion along y and z of the clearances' middles, then of both ends of each."""
        return np.concatenate((self._clearances(self.rig.clearance_points), self._clearances(self.rig.clearance_ends)))

    def input(self, kind: str) -> np.ndarray:
        """Return the force (n,) on the modes per unit of excitation: N per m/s² of the base, or per N of the shaker.

        Parameters
        ----------
        kind : str
            Kind of excitation: "base" or "force".

        Raises
        ------
        RigError
            If the structure does not tell what the excitation does to it, or the base moves none of its masses.
        """
        if refusal := self.rig.linear.refusal(kind):
            raise RigError(f"rig {self.rig.name!r}: {refusal}")
        along = self.rig.shaker.unit_direction
        if kind == "base":
            force = -self.influence @ along
            if not force.any():
                raise RigError(
                    f"rig {self.rig.name!r}: the base moves along {tuple(along.tolist())}, which moves no mass of the "
                    "structure; give another shaker.direction"
                )
            return force
        return self.push()

    @property
    def weight(self) -> np.ndarray:
        """(n,) force of gravity on the modes."""
        return self.influence @ np.array(self.rig.gravity or (0.0, 0.0, 0.0))


@functools.lru_cache(maxsize=64)
def spatial_model(rig: Rig, n_modes: int = 8, grease: bool = False, turning: bool | None = None) -> SpatialModel:
    """Reduce a rig's structure to modes along y and z, with static shapes at its bushings in both.

    Parameters
    ----------
    rig : Rig
        The rig; its own motion does not matter.
    n_modes : int
        Modes of each plane of shafts, or of the whole of another structure.
    grease : bool
        Count the in-gap stiffness of the grease to the structure's, in both directions.
    turning : bool, optional
        Whether the shaft may turn; None: if the rig has a spin.

    Raises
    ------
    RigError
        If the structure's mass is not positive or its stiffness negative, or it cannot turn as asked.
    """
    springs = tuple(b.grease.stiffness for b in rig.bushings) if grease else ()
    masses = tuple((m.position, m.mass) for m in rig.point_masses)
    turns = rig.spin is not None if turning is None else turning
    with computable(rig.name, rig.to_dict):
        planes, forces = _planes(rig, turns)
        if planes:
            beside = rig.attached  # alike along y and z
            found = [reduction(s, rig.clearance_points, masses, forces, springs, n_modes, beside) for s in planes]
        else:
            joined = tuple(tuple(_along(p, axis) for p in pair) for pair in rig.clearance_points for axis in "YZ")
            both = tuple(k for k in springs for _ in "YZ")
            found = [reduction(rig.linear, joined, masses, forces, both, n_modes)]
    omega, damping = (np.concatenate([getattr(part, name) for part in found]) for name in ("omega", "damping"))
    sizes = [part.omega.size for part in found]
    coupling = np.zeros((0, 0))
    if any(part.coupling.size for part in found):
        blocks = [part.coupling if part.coupling.size else np.zeros((n, n)) for part, n in zip(found, sizes)]
        coupling = scipy.linalg.block_diag(*blocks)
    influence = np.vstack([part.transform.T @ part.influence for part in found])
    halves = (slice(0, omega.size), slice(0, omega.size))
    if len(found) == 2:
        halves = (slice(0, sizes[0]), slice(sizes[0], omega.size))
        influence[: sizes[0], 1], influence[: sizes[0], 2] = influence[: sizes[0], 2].copy(), 0.0
    polar, material = np.zeros((0, 0)), np.zeros((0, 0))
    if turns:
        (shaft,) = rig.linear.shafts
        y, z = (_coupled(part) for part in found)
        polar, material = _skew(y.polar.T @ z.polar), _skew(shaft.rayleigh[1] * y.strain.T @ z.strain)
    return SpatialModel(rig, omega, damping, coupling, polar, material, influence, halves, tuple(found))


def _planes(rig: Rig, turns: bool) -> tuple[tuple[Structure, ...], tuple[tuple[float | str, float], ...]]:
    """The structure along y and along z, if it is of shafts, and the forces on it."""
    forces = rig.shaker.forces if rig.shaker.kind == "force" else ()
    across = rig.linear.in_other_plane
    if not turns:
        return () if across is None else (across, rig.linear), forces
    shafts = rig.linear.shafts
    if len(shafts) != 1:
        raise ValueError(f"only a beam or one shaft turns; its structure is {len(shafts)} shafts")
    shaft: Shaft = shafts[0]
    shaft.check_turning()
    # A strong damper at a support bends the shaft there: the static shapes under its force are among the coordinates.
    damped = tuple((s.position, 1.0) for s in shaft.supports if s.translation_damping)
    return (shaft.in_other_plane, shaft), (*forces, *damped)


def _along(point: float | str, axis: str) -> float | str:
    """The degree of freedom along an axis of a node of which a point names another one."""
    dof = parse_dof(point)
    return point if dof is None else f"{dof[0]}:{axis}"


def _coupled(found: Reduction) -> Turning:
    """What couples the planes, in the modes of one of them."""
    assert found.turning
    return Turning(*(rows @ found.transform for rows in found.turning()))


def _skew(coupling: np.ndarray) -> np.ndarray:
    """A matrix of both planes: what moves along z acts along y, and the other way round with the other sign."""
    n, m = coupling.shape
    return np.block([[np.zeros((n, n)), coupling], [-coupling.T, np.zeros((m, m))]])
