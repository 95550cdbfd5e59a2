"""What sensors at candidate positions would read of the modes, and with what noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..beam import ritz_model
from ..errors import ClearanceError
from ..rig import Rig

__all__ = ["Candidates", "candidates", "grid"]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Positions where sensors may sit, and what each would read.

    Raises
    ------
    ClearanceError
        If the shapes do not fit each other, or the noise is not positive.
    """

    position: np.ndarray
    """(n,) m from the clamp"""
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
        """Whether the noise of no two candidates is correlated."""
        return np.array_equal(self.noise, np.diag(np.diag(self.noise)))


def grid(rig: Rig, count: int) -> np.ndarray:
    """Evenly spaced positions (count,) along the part of the shaft that is outside the bushings, rising, m.

    Parameters
    ----------
    rig : Rig
        The rig.
    count : int
        How many, at least 1. The clamp is none of them, the last is at the tip or, if a bushing ends there, before it.
    """
    if count < 1:
        raise ClearanceError(f"give at least 1 candidate, got {count}")
    outside = rig.beam.length - sum(b.length for b in rig.bushings)
    x = outside * np.arange(1, count + 1) / count
    for bushing in sorted(rig.bushings, key=lambda b: b.position):
        x = np.where(x > bushing.ends[0], x + bushing.length, x)
    return x


def candidates(
    rig: Rig,
    position: ArrayLike,
    modes: Sequence[int] = (1, 2, 3, 4),
    weight: ArrayLike = 1.0,
    noise: ArrayLike = 1.0,
    unwanted: Sequence[int] = (),
) -> Candidates:
    """Describe what sensors on a rig would read.

    Parameters
    ----------
    rig : Rig
        The rig, in its linear state within the gap.
    position : array_like, shape (n,)
        Where a sensor may sit, m.
    modes : sequence of int
        Modes that are wanted, from 1.
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
        If a position is off the shaft or given twice, or a mode, weight or noise is impossible.
    """
    x, wanted, others = np.asarray(position, dtype=float), list(modes), list(unwanted)
    if not x.size or not np.all((x > 0) & (x <= rig.beam.length)) or np.unique(x).size < x.size:
        raise ClearanceError(f"candidate positions must differ and lie on the shaft, 0 < x <= {rig.beam.length:g} m")
    if not wanted or min(wanted + others) < 1 or len({*wanted, *others}) < len(wanted + others):
        raise ClearanceError(f"modes count from 1, each once, wanted or unwanted; got {wanted} and {others}")
    weight, noise = np.asarray(weight, dtype=float), np.asarray(noise, dtype=float)
    for name, values, size in (("weights", weight, len(wanted)), ("noise", noise, x.size)):
        if values.shape not in ((), (size,)) or not np.all((values > 0) & np.isfinite(values)):
            raise ClearanceError(f"{name}: give one number > 0 or {size}, got {values.tolist()}")
    shapes = ritz_model(rig, max(wanted + others) + 16, grease=True).shapes(x)
    disturbing = shapes[:, np.array(others, dtype=int) - 1] * weight.max()
    covariance = np.diag(np.broadcast_to(noise**2, x.size)) + disturbing @ disturbing.T
    return Candidates(x, shapes[:, np.array(wanted) - 1] * weight, covariance)
