"""A problem of estimation: parameters, residuals of many points at once, and the coordinates in which it is solved."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .loss import Loss, Squares
from .parameter import Parameter

__all__ = ["LinearisedResiduals", "Problem", "one_by_one"]

Residuals = Callable[[np.ndarray], np.ndarray]
"""Function from values (n_points, n), SI units, to residuals (n_points, n_residuals)"""


class LinearisedResiduals(NamedTuple):
    """Residuals near a point and their derivatives."""

    residuals: np.ndarray
    """(n_residuals,)"""
    jacobian: np.ndarray
    """(n_residuals, n) by coordinates"""


class Problem:
    """An objective to minimise: the loss of the residuals plus the squared distances of parameters from their priors.

    A coordinate is a parameter's logarithm or value, whichever varies, less that of its start, in prior standard
    deviations: priors are then circles, and one step suits the differences of all. Without a prior the unit is that of
    the logarithm or value, or the one given.

    Parameters
    ----------
    parameters : sequence of Parameter
        Parameters to estimate.
    residuals : callable
        From values (n_points, n), SI units and within the bounds, to residuals (n_points, n_residuals), real or
        complex. Points at which there is no model have a residual that is not finite.
    loss : Loss, optional
        Loss of the residuals; the priors stay outside of it. By default the sum of squares.
    units : array_like, shape (n,), optional
        Units of the coordinates of parameters without a prior, of what varies.
    step : float or array_like, shape (n,)
        Coordinates, step of the differences.
    central : bool
        Take differences to both sides.
    lanes : bool
        True if many points take hardly longer than one: `solve` then tries all dampings at once.
    linearise : callable, optional
        From coordinates (n,) to residuals and Jacobian, instead of differences. Its residuals decide whether a step is
        kept; they may be means about the point, for models that jump.
    invalid : type of exception, or several
        Exceptions of the residuals where there is no model; the points of such a call are then taken one by one.
    """

    def __init__(
        self, parameters: Sequence[Parameter], residuals: Residuals, *, loss: Loss | None = None,
        units: ArrayLike = 1.0, step: ArrayLike = 1e-3, central: bool = False, lanes: bool = True,
        linearise: Callable[[np.ndarray], LinearisedResiduals] | None = None,
        invalid: type[Exception] | tuple[type[Exception], ...] = (),
    ) -> None:  # fmt: skip
        self.parameters, self.function, self.loss = tuple(parameters), residuals, loss or Squares()
        self.step, self.central, self.lanes = np.asarray(step, dtype=float), central, lanes
        self.linearise, self.invalid = linearise, invalid
        prior = np.array([p.prior_std for p in self.parameters])
        self.known = np.isfinite(prior)
        """(n,) bool: has a prior"""
        self.unit = np.where(self.known, prior, units)
        """(n,) of what varies, of each coordinate"""
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.array([[p.to_varied(p.low), p.to_varied(p.high)] for p in self.parameters]).reshape(-1, 2)
            start = np.array([p.to_varied(p.start) for p in self.parameters])
            # A start of zero has no logarithm: the search then begins midway between the bounds.
            self.origin = np.where(np.isfinite(start), start, ends.mean(axis=1))
        self.low, self.high = ((ends - self.origin[:, None]) / self.unit[:, None]).T
        self.evaluations = 0
        """points of which residuals were computed"""

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.parameters)

    def values(self, at: np.ndarray) -> np.ndarray:
        """Return values (..., n), SI units and within the bounds, of coordinates (..., n).

        Parameters
        ----------
        at : ndarray, shape (..., n)
            Coordinates of the point.
        """
        varied = np.moveaxis(self.origin + self.unit * at, -1, 0)
        values = [np.clip(p.from_varied(v), p.low, p.high) for p, v in zip(self.parameters, varied)]
        return np.stack(values, axis=-1) if values else np.empty(np.shape(at))

    def at(self, values: Mapping[str, float] | ArrayLike) -> np.ndarray:
        """Return coordinates (n,) within the bounds of values (n,), or by name; those not given are at their starts.

        Parameters
        ----------
        values : mapping of str to float, or array_like, shape (n,)
            SI units; a mapping may leave parameters out and hold others.
        """
        if isinstance(values, Mapping):
            given = [values.get(p.name, math.nan) for p in self.parameters]
        else:
            given = np.asarray(values, dtype=float).tolist()
        varied = [p.to_varied(np.clip(v, p.low, p.high)) for p, v in zip(self.parameters, given)]
        at = (np.array(varied) - self.origin) / self.unit
        return self.inside(np.where(np.isnan(at), 0.0, at))

    def inside(self, at: np.ndarray) -> np.ndarray:
        """Return coordinates (..., n) moved to within the bounds.

        Parameters
        ----------
        at : ndarray, shape (..., n)
            Coordinates of the point.
        """
        return np.clip(at, self.low, self.high)

    def residuals(self, at: np.ndarray) -> np.ndarray:
        """Return residuals (n_points, n_residuals) at coordinates (n_points, n); not finite where there is no model.

        Parameters
        ----------
        at : ndarray, shape (n_points, n)
            Coordinates of the point.
        """
        self.evaluations += len(at)
        return self._residuals(self.values(at))

    def _residuals(self, values: np.ndarray) -> np.ndarray:
        try:
            return np.asarray(self.function(values))
        except self.invalid:
            if len(values) == 1:
                return np.full((1, 1), np.inf)
        rows = [self._residuals(point[None])[0] for point in values]
        size = max(map(len, rows))
        return np.array([r if len(r) == size else np.full(size, np.inf) for r in rows])

    def prior_cost(self, at: np.ndarray) -> np.ndarray:
        """Return squared distances (...,) of coordinates (..., n) from the priors.

        Parameters
        ----------
        at : ndarray, shape (..., n)
            Coordinates of the point.
        """
        return np.sum(np.square(at[..., self.known]), axis=-1)

    def cost(self, at: np.ndarray, residuals: np.ndarray, loss: Loss | None = None) -> np.ndarray:
        """Return the objective (n_points,), infinite where there is no model: twice a negative log-posterior.

        Parameters
        ----------
        at : ndarray, shape (n_points, n)
            Coordinates of the point.
        residuals : ndarray, shape (n_points, n_residuals)
            Residuals at that point.
        loss : Loss, optional
            Instead of the problem's.
        """
        with np.errstate(invalid="ignore", over="ignore"):
            cost = (loss or self.loss).cost(residuals) + self.prior_cost(at)
        return np.where(np.isfinite(cost), cost, np.inf)

    def linearised(self, at: np.ndarray, residuals: np.ndarray | None = None) -> LinearisedResiduals:
        """Return residuals and Jacobian at coordinates (n,), by differences to within the bounds.

        Parameters
        ----------
        at : ndarray, shape (n,)
            Coordinates of the point.
        residuals : ndarray, shape (n_residuals,), optional
            Residuals there, where they are known.

        Returns
        -------
        LinearisedResiduals
            With zeros where neither side of a difference has a model.
        """
        if self.linearise is not None:
            return self.linearise(at)
        if self.central:
            ends = np.array((np.minimum(at + self.step, self.high), np.maximum(at - self.step, self.low)))
        else:
            ends = (at + np.where(at + self.step > self.high, -self.step, self.step))[None]
        shifted = [np.where(np.eye(self.size, dtype=bool), end, at) for end in ends]
        rows = self.residuals(np.vstack(shifted if residuals is not None else [*shifted, at[None]]))
        centre = rows[-1] if residuals is None else residuals
        sides = rows[: ends.size].reshape(*ends.shape, rows.shape[1])
        return LinearisedResiduals(centre, _quotients(centre, sides, ends - at).T)


def _quotients(centre: np.ndarray, sides: np.ndarray, widths: np.ndarray) -> np.ndarray:
    """Difference quotients (n, n_residuals) from points on one or both sides, or the valid ones of these.

    Residuals of the sides are (n_sides, n, n_residuals), their distances from the centre (n_sides, n).
    """
    valid = np.isfinite(sides).all(axis=2) & (widths != 0)
    ends, distances = np.where(valid[:, :, None], sides, centre), np.where(valid, widths, 0.0)
    behind, start = (ends[1], distances[1]) if len(sides) > 1 else (centre, np.zeros_like(distances[0]))
    width = distances[0] - start
    return (ends[0] - behind) / np.where(width != 0, width, np.inf)[:, None]


def one_by_one(function: Callable[[np.ndarray], np.ndarray]) -> Residuals:
    """Return the residuals of many points of a function that takes the values (n,) of one.

    Parameters
    ----------
    function : callable
        From values (n,), SI units, to residuals (n_residuals,).
    """
    return lambda values: np.array([function(point) for point in values])
