"""Readings of the modes by sensors at candidate positions, and their noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..beam import mode_shapes
from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..linear import MAX_MODES
from ..rig import Rig
from ..structure import Shaft
from ..structure.base import parse_place

__all__ = ["Candidates", "candidates", "grid"]

MAX_CANDIDATES = 1000  # candidates that are spread over a structure; each is exchanged with every other


@dataclass(frozen=True, eq=False)
class Candidates:
    """Positions where sensors may sit, with the reading of each per mode.

    Raises
    ------
    ClearanceError
        If the shapes do not fit each other, or the noise is not positive.
    """

    position: np.ndarray
    """(n,) m along the one shaft; or texts, points of several shafts or degrees of freedom"""
    shapes: np.ndarray
    """(n, n_modes) Φ: reading per unit of each modal coordinate"""
    noise: np.ndarray
    """(n, n) R, covariance of the readings"""

    def __post_init__(self) -> None:
        n = len(self.position)
        if np.ndim(self.shapes) != 2 or len(self.shapes) != n or np.shape(self.noise) != (n, n):
            raise ClearanceError(
                f"candidates need {n} rows of shapes and a covariance ({n}, {n}), got {np.shape(self.shapes)} and "
                f"{np.shape(self.noise)}"
            )
        if not np.isfinite(self.shapes).all() or not np.isfinite(self.noise).all():
            raise ClearanceError("the candidates' shapes and noise must be finite")
        if np.linalg.eigvalsh(self.noise)[0] <= 0:
            raise ClearanceError("the noise of every candidate must be > 0, its covariance positive definite")

    def information(self, chosen: Sequence[int]) -> np.ndarray:
        """Return the Fisher information (n_modes, n_modes) of a layout.

        Parameters
        ----------
        chosen : sequence of int
            Indices of the candidates that get a sensor.
        """
        rows = self.shapes[list(chosen)]
        return rows.T @ self._precision(chosen) @ rows

    def _precision(self, chosen: Sequence[int]) -> np.ndarray:
        """R_SS⁻¹ (n_sensors, n_sensors) of a layout."""
        chosen = list(chosen)
        if self._independent:
            return np.diag(1 / np.diag(self.noise)[chosen])
        return np.linalg.inv(self.noise[np.ix_(chosen, chosen)])

    @cached_property
    def _independent(self) -> bool:
        """True if the noise of no two candidates is correlated."""
        return np.array_equal(self.noise, np.diag(np.diag(self.noise)))


def grid(rig: Rig, count: int) -> np.ndarray:
    """Return evenly spaced points (count,) along the parts of the shafts that are outside the bushings, rising.

    Numbers, m, on one shaft, texts such as "inner@0.4" on several, in numbers proportional to their lengths.

    Parameters
    ----------
    rig : Rig
        The rig.
    count : int
        Number of points, at least 1 for each shaft. Ends that a support holds are left out, all others are in.

    Raises
    ------
    ClearanceError
        If there are too few for the shafts, or no shafts.
    """
    if not (shafts := rig.linear.shafts):
        raise ClearanceError(
            f"rig {rig.name!r}: its structure has no shaft to spread candidates over; name them, as in 1:+Z,2:+Z,3:+Z"
        )
    if count > MAX_CANDIDATES:
        raise ClearanceError(f"at most {MAX_CANDIDATES} candidates are compared, each with each; got {count}")
    if count < len(shafts):
        raise ClearanceError(f"give at least {len(shafts)} candidate{'s' * (len(shafts) > 1)}, got {count}")
    if len(shafts) == 1:
        return _along(rig, shafts[0], count)
    ends = np.cumsum([shaft.end - shaft.start for shaft in shafts])
    counts = np.diff(np.round((count - len(shafts)) * ends / ends[-1]).astype(int), prepend=0) + 1
    points = [f"{s.name}@{x:.6g}" for s, n in zip(shafts, counts) for x in _along(rig, s, int(n)).tolist()]
    return np.array(points, dtype=object)


def _along(rig: Rig, shaft: Shaft, count: int) -> np.ndarray:
    """(count,) positions on one shaft, m."""
    placed = [(place, b.length) for b in rig.bushings if (place := parse_place(b.position))]
    bushings = [(x, length) for (name, x), length in placed if name == shaft.name]
    outside = shaft.end - shaft.start - sum(length for _, length in bushings)
    supported = {s.position for s in shaft.supports if s.kind in ("clamped", "pinned")}
    first, last = int(shaft.start in supported), int(shaft.end in supported)
    x = shaft.start + outside * (np.arange(first, first + count) / max(count - 1 + first + last, 1))
    for middle, length in sorted(bushings):
        x = np.where(x > middle - length / 2, x + length, x)
    return x


@checks_kinds
def candidates(
    rig: Rig, position: ArrayLike | Sequence[float | str], modes: Sequence[int] = (1, 2, 3, 4),
    weight: ArrayLike = 1.0, noise: ArrayLike = 1.0, unwanted: Sequence[int] = (),
) -> Candidates:  # fmt: skip
    """Return candidate positions for sensors on a rig, with their readings of the modes.

    Parameters
    ----------
    rig : Rig
        The rig, in its linear state within the gap.
    position : sequence of Point, length n
        Positions where a sensor may sit: m, or texts such as "inner@0.4" and "12:+Z".
    modes : sequence of int
        Modes to identify, from 1.
    weight : float or array_like, shape (n_modes,)
        Typical size of each modal coordinate's acceleration, sqrt(kg) m/s²; coordinates are counted in this unit. The
        determinant of every layout grows by the same factor, so weights matter to the trace, and to ``unwanted``.
    noise : float or array_like, shape (n,)
        Standard deviation of the reading at each position, m/s².
    unwanted : sequence of int
        Modes that the readings also hold, of coordinates about as large as the largest weight: correlated noise.

    Raises
    ------
    ClearanceError
        If a position is off the structure or given twice, or a mode, weight or noise is impossible.
    """
    points = list(np.asarray(position, dtype=object))
    x = np.array(points, dtype=object if any(isinstance(point, str) for point in points) else float)
    wanted, others = list(modes), list(unwanted)
    highest = max(wanted + others, default=0)
    if not points or len(set(points)) < len(points):
        raise ClearanceError(f"candidate positions must differ, and there must be some; got {points}")
    if highest > MAX_MODES:
        raise ClearanceError(f"modes must be 1 to {MAX_MODES}, got {highest}")
    try:
        for point in points:
            rig.linear.check(point)
    except ValueError as error:
        raise ClearanceError(f"a candidate must lie on the {'shaft' if rig.beam else 'structure'}: {error}") from None
    if not wanted or min(wanted + others) < 1 or len({*wanted, *others}) < len(wanted + others):
        raise ClearanceError(f"modes count from 1, each once, wanted or unwanted; got {wanted} and {others}")
    weight, noise = np.asarray(weight, dtype=float), np.asarray(noise, dtype=float)
    for name, values, size in (("weights", weight, len(wanted)), ("noise", noise, x.size)):
        if values.shape not in ((), (size,)) or not np.all((values > 0) & np.isfinite(values)):
            raise ClearanceError(f"{name}: give one number > 0 or {size}, got {values.tolist()}")
    shapes = mode_shapes(rig, points, highest)
    if highest > shapes.shape[1]:
        raise ClearanceError(f"rig {rig.name!r} has {shapes.shape[1]} modes, so there is no mode {highest}")
    disturbing = shapes[:, np.array(others, dtype=int) - 1] * weight.max()
    covariance = np.diag(np.broadcast_to(noise**2, x.size)) + disturbing @ disturbing.T
    return Candidates(x, shapes[:, np.array(wanted) - 1] * weight, covariance)
