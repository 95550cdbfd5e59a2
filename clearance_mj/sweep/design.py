"""Designs: values of the varied parameters in each case."""

from __future__ import annotations

import math
import typing
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import Field

from ..core.errors import ClearanceError
from ..core.validation import Number, Text, Whole, checked
from ..statistics.sobol import require_power_of_two, saltelli_points, unit_points

__all__ = ["Design", "Vary"]

Method = typing.Literal["grid", "latin-hypercube", "sobol", "saltelli"]
METHODS = typing.get_args(Method)
MAX_NUMBERS = 10_000_000  # cases times varied parameters: 80 MB, some of it several times while the points are drawn


@checked(ClearanceError)
class Vary:
    """A parameter that varies: over ``values``, or between ``low`` and ``high``."""

    path: Text
    """such as "rig.bushings[0].gap"; without a number, as in "rig.bushings.gap", all entries share one value"""
    values: tuple[Number, ...] | None = None
    """a grid takes each; other designs draw them with equal chances"""
    low: Number | None = None
    """lower end"""
    high: Number | None = None
    """upper end"""
    count: Whole | None = None
    """number of values from low to high, for a grid"""
    scale: typing.Literal["linear", "log"] = "linear"
    """even steps of the value, or of its logarithm"""

    def __post_init__(self) -> None:
        if (self.values is None) == (self.low is None and self.high is None):
            raise ClearanceError(f"vary {self.path}: give either values, or low and high")
        if (values := self.values) is not None:
            if not values or len(set(values)) < len(values):
                raise ClearanceError(f"vary {self.path}: values must be one or more, each once; got {list(values)}")
            if self.count is not None or self.scale != "linear":
                raise ClearanceError(f"vary {self.path}: count and scale go with low and high, not with values")
        elif self.low is None or self.high is None or not self.low < self.high:
            raise ClearanceError(f"vary {self.path}: needs low < high, got {self.low!r} and {self.high!r}")
        elif self.scale == "log" and self.low <= 0:
            raise ClearanceError(f"vary {self.path}: a log scale needs low > 0, got {self.low:g}")

    def levels(self) -> np.ndarray:
        """Return the values (n,) of a grid."""
        if self.values is not None:
            return np.array(self.values)
        if self.count is None or not 2 <= self.count <= MAX_NUMBERS:
            raise ClearanceError(f"vary {self.path}: a grid needs values, or low, high and count >= 2")
        between = np.geomspace if self.scale == "log" else np.linspace
        return between(*self._ends, self.count)

    def at(self, share: np.ndarray) -> np.ndarray:
        """Return the values at fractions of the range.

        Parameters
        ----------
        share : ndarray, shape (n,)
            0 <= share < 1, of the range or of its logarithm.
        """
        if self.values is not None:
            return np.array(self.values)[(share * len(self.values)).astype(int)]
        low, high = self._ends
        if self.scale == "log":
            return low * (high / low) ** share
        return low + (high - low) * share

    @property
    def _ends(self) -> tuple[float, float]:
        assert self.low is not None and self.high is not None
        return self.low, self.high


@checked(ClearanceError)
class Design:
    """Distribution of the cases over the ranges of the varied parameters.

    "grid": every combination. "latin-hypercube", "sobol": points of a unit cube. "saltelli": two Sobol' samples A
    and B, then A with one parameter after the other from B: samples × (parameters + 2) cases, from which Sobol indices
    follow (Saltelli et al., Computer Physics Communications 181, 2010).
    """

    method: Method = "grid"
    """ "grid", "latin-hypercube", "sobol" or "saltelli" """
    samples: Whole = 0
    """number of points; 0 for a grid"""
    seed: Annotated[Whole, Field(ge=0)] = 0
    """of the points"""

    def __post_init__(self) -> None:
        if self.method == "grid":
            if self.samples:
                raise ClearanceError("design.samples is not for a grid; give each parameter values, or a count")
        elif not 1 <= self.samples <= MAX_NUMBERS:
            raise ClearanceError(f"design.samples must be in 1..{MAX_NUMBERS}, got {self.samples}")
        elif self.method != "latin-hypercube":
            require_power_of_two("design.samples", self.samples)

    def points(self, varied: Sequence[Vary]) -> np.ndarray:
        """Return the values of the varied parameters in each case.

        Parameters
        ----------
        varied : sequence of Vary
            The parameters.

        Returns
        -------
        ndarray, shape (n_cases, n_varied)

        Raises
        ------
        ClearanceError
            If the cases are too many, or a parameter does not fit the design.
        """
        if self.method == "grid":
            levels = [v.levels() for v in varied]
            _require_few(math.prod(map(len, levels)), len(varied))
            return np.stack(np.meshgrid(*levels, indexing="ij"), axis=-1).reshape(-1, len(varied))
        for v in varied:
            if v.count is not None:
                raise ClearanceError(f"vary {v.path}: count is for a grid; {self.method} takes design.samples")
        d = len(varied)
        _require_few(self.samples * (d + 2 if self.method == "saltelli" else 1), d)
        if self.method == "saltelli":
            points = saltelli_points([[i] for i in range(d)], self.samples, self.seed)
        else:
            points = unit_points(self.method, self.samples, d, self.seed)
        return np.stack([v.at(share) for v, share in zip(varied, points.T)], axis=1)


def _require_few(n_cases: int, n_varied: int) -> None:
    if n_cases * n_varied > MAX_NUMBERS:
        raise ClearanceError(f"{n_cases} cases of {n_varied} parameters are too many (at most {MAX_NUMBERS} numbers)")
