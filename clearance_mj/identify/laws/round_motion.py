"""Measured motion of a round clearance beside its restoring force along y and z: what laws are compared with."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import scipy.spatial

from ...clearance import ContactLaw, KelvinVoigt, along
from ...clearance.grease import GreaseModel
from ...clearance.record import clearance_records
from ...rig import Bushing, Rig
from ...rig.dimensions import shaft_radius
from ..forces.restoring import RestoringForce
from .forces_in_lanes import decimated
from .measured_motion import DECIMATION, FORCE_ERROR, INTERPOLATION, low_pass, path_of, samples_of

__all__ = ["RoundCase", "RoundMotion", "forces_along"]

WIDE = 1e3  # gaps, of a hole whose wall is never met


class RoundCase(NamedTuple):
    """A law of one round clearance."""

    bushing: Bushing  #: with its gap, wall, length and friction; its offset counts for nothing
    law: ContactLaw  #: of contact and filling
    rest: tuple[float, float] = (0.0, 0.0)  #: from the middle to where the shaft is when its probes read zero, m


def forces_along(
    case: RoundCase, x: np.ndarray, v: np.ndarray, spin: np.ndarray, step: float, lever: float = 1.0
) -> np.ndarray:
    """Return the forces (n_t, 2) of a law along y and z, N, in a motion of the shaft from where it rests.

    Parameters
    ----------
    case : RoundCase
        The law.
    x, v : ndarray, shape (n_t, 3, 2)
        Displacements and velocities of the middle and both ends, m and m/s.
    spin : ndarray, shape (n_t,)
        rad/s.
    step : float
        s.
    lever : float
        By which the law's ends are farther from the middle.
    """
    bushing = dataclasses.replace(case.bushing, offset=0.0, offset_y=0.0)
    records = clearance_records(SimpleNamespace(bushings=(bushing,)), case.law, step)
    offset = records.bushings["offset"][0]
    records.numbers[offset : offset + 2] = case.rest
    if lever != 1.0:
        x, v = (each[:, :1] + lever * (each - each[:, :1]) for each in (x, v))
    return along.forces_along(records, 0, x, v, spin)


class RoundMotion:
    """Motion and restoring force of one round clearance in all records, along y and z sample by sample.

    A steady force, such as that of the shaft's weight on the wall, moves nothing and is not known: of each record and
    direction the mean of the force is left out.

    Parameters
    ----------
    forces : sequence of RestoringForce
        Restoring forces of each record, all with one sample rate.
    rig : Rig
        The linear rig.
    number : int
        Index of the clearance.
    """

    def __init__(self, forces: Sequence[RestoringForce], rig: Rig, number: int) -> None:
        self.rig, self.number = rig, number
        self.nominal = dataclasses.replace(rig.bushings[number], radius=shaft_radius(rig, number) or None)
        self.rate = forces[0].fs / DECIMATION
        """samples compared per second, of each direction"""
        rows = 2 * number, 2 * number + 1
        self._motions = [_Motion.of(f, rows, f.rig.bushings[number].length) for f in forces]
        self._length = forces[0].rig.bushings[number].length
        self.turns = any(f.spin is not None for f in forces)
        """whether the shaft turns in any record"""
        pieces = [[samples_of(f, row, i) for row in rows] for i, f in enumerate(forces)]
        sizes = [2 * piece[0][0].size for piece in pieces]
        self._records = [slice(*part) for part in itertools.pairwise(np.cumsum([0, *sizes]).tolist())]
        both = [[np.column_stack(pair).ravel() for pair in zip(*piece)] for piece in pieces]
        self.force, level, noise, block, fitted, held_out = (np.concatenate(parts) for parts in zip(*both))
        level = np.repeat(np.sqrt(np.square(level).reshape(-1, 2).mean(axis=1)), 2)
        self.fitted, self.held_out = np.flatnonzero(fitted), np.flatnonzero(held_out)
        """numbers of the values that fits see, and of those that they do not"""
        self.weight = 1 / np.hypot(FORCE_ERROR * np.hypot(level, np.median(level[self.fitted])), noise)
        self._counted = self.weight**2 * fitted
        self.blocks = np.flatnonzero(np.diff(block[self.fitted], prepend=-1))
        """(n_blocks,) where blocks begin among the fitted values"""

    def forces(self, case: RoundCase) -> np.ndarray:
        """Return the forces (n,) of a law, N: y and z of each sample one after the other."""
        found = []
        lever = case.bushing.length / self._length if self._length else 1.0
        for motion in self._motions:
            out = forces_along(case, motion.x, motion.v, motion.spin, motion.step, lever)
            found.append(decimated(out, low_pass(), INTERPOLATION * DECIMATION).ravel())
        return np.concatenate(found)

    def residuals(self, cases: Sequence[RoundCase]) -> np.ndarray:
        """Return (n, n_cases) differences of laws' forces from the measured one, over their expected errors."""
        return np.column_stack([self._difference(self.forces(case)) for case in cases])

    def _difference(self, force: np.ndarray) -> np.ndarray:
        rest = force - self.force
        for part in self._records:
            own, counted = rest[part].reshape(-1, 2), self._counted[part].reshape(-1, 2)
            own -= np.sum(own * counted, axis=0) / np.maximum(counted.sum(axis=0), 1e-300)
        return np.asarray(rest * self.weight)

    def touches(self, case: RoundCase) -> bool:
        """Return whether an end ever goes beyond the gap."""
        reach = max(float(np.hypot(*(m.x[:, 1:] + np.array(case.rest)).T).max()) for m in self._motions)
        return reach > case.bushing.wall_model.reach(case.bushing.gap)

    @property
    def middle(self) -> np.ndarray:
        """Middle (2,), m, of the smallest circle about the motion: the hole's, if all of it is touched."""
        return smallest_circle(np.concatenate([m.x[::DECIMATION, 0] for m in self._motions]))[0]

    def in_gap(self, bushing: Bushing, fillings: Sequence[GreaseModel]) -> tuple[np.ndarray, np.ndarray]:
        """Return weighted forces of fillings and of the record where nothing touches, see `GapForces.in_gap`."""
        free = dataclasses.replace(bushing, gap=WIDE * bushing.gap, friction=None)
        inside = self.fitted  # a filling acts all the time, and what the wall adds is large and short
        columns = [self.forces(RoundCase(free, ContactLaw(KelvinVoigt(1.0), filling))) for filling in fillings]
        weight = self.weight[inside]
        return np.column_stack(columns)[inside] * weight[:, None], self.force[inside] * weight


class _Motion(NamedTuple):
    """Motion of a record at a fine rate."""

    x: np.ndarray  #: (n, 3, 2) displacements along y and z of the middle and both ends, m
    v: np.ndarray  #: (n, 3, 2) velocities, m/s
    spin: np.ndarray  #: (n,) rad/s
    step: float  #: s

    @classmethod
    def of(cls, force: RestoringForce, rows: Sequence[int], length: float) -> _Motion:
        paths = [path_of(force, row, length) for row in rows]
        x, v = (np.ascontiguousarray(np.stack([getattr(p, name) for p in paths], axis=2)) for name in "xv")
        time = np.arange(len(x)) * paths[0].step
        spin = np.zeros(time.size) if force.spin is None else np.interp(time, force.time, force.spin)
        return cls(x, v, spin, paths[0].step)


def smallest_circle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return middle (2,) and radius of the smallest circle about points (n, 2), by Badoiu and Clarkson's steps.

    M. Badoiu, K. L. Clarkson, Optimal core-sets for balls, Computational Geometry 40, 2008.
    """
    points = points[scipy.spatial.ConvexHull(points).vertices]
    middle = points.mean(axis=0)
    for i in range(1, 2000):
        away = points - middle
        farthest = int(np.argmax(np.einsum("ij,ij->i", away, away)))
        middle = middle + away[farthest] / (i + 1)
    return middle, float(np.hypot(*(points - middle).T).max())
