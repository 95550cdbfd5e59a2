"""One number that scatters, and how two of them go together: distributions, limits of a drawing, correlations."""

from __future__ import annotations

import functools
import math
import re
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.stats import norm

from ..core.checks import naming
from ..core.errors import ClearanceError
from ..core.validation import Number, Text, checked
from ..rig.tolerance import Tolerance

__all__ = ["LAW", "Correlation", "Scattered"]

LAW = "law."  # with which paths begin that lead to numbers of a model's law
SIGMAS = 3.0  # standard deviations from the middle to the limits of a drawing
CUT = 4.0  # standard deviations beyond which no normal number lies that has a standard deviation alone
SIZE = re.compile(r"\s*([-+\d.eE]+)\s*(.*?)\s*")
_SHARE = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*%\s*")


@checked(ClearanceError)
class Scattered:
    """How a number, or each of several, scatters about its value in the model."""

    of: Text
    """path to a number of the rig, such as "bushings[0].gap"; "bushings.gap": that of every bushing, each for
    itself; or of the model's law, such as "law.k[0]" """
    std: Text | None = None
    """standard deviation with its unit, "0.02 mm", or "3 %" of the value (of an offset: of the gap)"""
    within: Text | None = None
    """in its place the limits of a drawing: 0.3 ± 0.05 mm has "0.05 mm"; three standard deviations of "normal" """
    distribution: Literal["normal", "lognormal", "uniform", "triangular"] = "normal"
    """ "normal" and "lognormal" end at the limits, or at four standard deviations; "lognormal" is of a share of the
    value; "uniform" and "triangular" have limits only"""
    price: Annotated[Number, Field(gt=0)] | None = None
    """what half of the scatter costs more than all of it, in any currency: a narrower one costs by 1/width - 1"""

    def __post_init__(self) -> None:
        if (self.std is None) == (self.within is None):
            raise ClearanceError(f"scatter of {self.of}: give either std or within")
        if self.distribution in ("uniform", "triangular") and self.within is None:
            raise ClearanceError(f'scatter of {self.of}: "{self.distribution}" has limits: give within, not std')
        _, relative = self._size
        if self.distribution == "lognormal" and not relative:
            raise ClearanceError(f'scatter of {self.of}: "lognormal" is of a share of the value, such as "10 %"')

    @functools.cached_property
    def _size(self) -> tuple[float, bool]:
        """How wide, in SI units or as a share of the value, and which of the two."""
        given = self.std if self.std is not None else self.within
        assert given is not None
        with naming(f"scatter of {self.of}", (ValueError, ClearanceError), ClearanceError):
            if self.of.startswith(LAW):
                if not (match := _SHARE.fullmatch(given)):
                    raise ClearanceError(f'"{given}" is no share of the value, such as "5 %"')
                size, relative = float(match[1]) / 100, True
            else:
                tolerance = Tolerance(self.of, given)
                size, relative = tolerance.size, tolerance.relative
            if size == 0:
                raise ClearanceError(f'"{given}" is none; leave it out')
        return size, relative

    def half_width(self, value: float, gap: float | None = None) -> tuple[float, float]:
        """Return standard deviation and distance of the limits from the middle, in SI units.

        Of "lognormal" both are of the logarithm.

        Parameters
        ----------
        value : float
            The number's value in the model.
        gap : float, optional
            The gap that an offset is measured by, m.
        """
        size, relative = self._size
        if self.distribution == "lognormal":
            if value <= 0:
                raise ClearanceError(f'scatter of {self.of}: "lognormal" needs a value > 0, the model has {value:g}')
            size = math.log1p(size)
        elif relative:
            size *= gap if gap is not None else abs(value)
        return (size, CUT * size) if self.within is None else (size / SIGMAS, size)

    def deviation(self, values: np.ndarray, value: float, gap: float | None = None) -> np.ndarray:
        """Return how far values (n,) are from the middle, over the distance of the limits.

        Parameters
        ----------
        values : ndarray, shape (n,)
            Of the number.
        value : float
            The number's value in the model.
        gap : float, optional
            The gap that an offset is measured by, m.
        """
        _, limit = self.half_width(value, gap)
        return (np.log(values / value) if self.distribution == "lognormal" else values - value) / limit

    def quantile(self, share: np.ndarray, value: float, gap: float | None = None) -> np.ndarray:
        """Return the values below which these shares (n,) of a production lie.

        Parameters
        ----------
        share : ndarray, shape (n,)
            Between 0 and 1.
        value : float
            The number's value in the model.
        gap : float, optional
            The gap that an offset is measured by, m.
        """
        std, limit = self.half_width(value, gap)
        if self.distribution == "uniform":
            return value + limit * (2 * share - 1)
        if self.distribution == "triangular":
            side = np.where(share < 0.5, -1.0, 1.0)
            return value + side * limit * (1 - np.sqrt(1 - np.abs(2 * share - 1)))
        tail = norm.cdf(-limit / std)
        steps = std * norm.ppf(tail + share * (1 - 2 * tail))
        return value * np.exp(steps) if self.distribution == "lognormal" else value + steps

    def narrowed(self, width: float) -> Scattered:
        """Return the same with a share of its standard deviation or limits; of "lognormal" of their logarithms.

        Parameters
        ----------
        width : float
            Share, > 0.
        """

        def scaled(text: str | None) -> str | None:
            if text is None:
                return None
            if self.distribution == "lognormal":
                return f"{100 * math.expm1(width * math.log1p(self._size[0])):.12g} %"
            size, unit = SIZE.fullmatch(text).groups()  # type: ignore[union-attr]
            return f"{float(size) * width:.12g} {unit}"

        return replace(self, std=scaled(self.std), within=scaled(self.within))


@checked(ClearanceError)
class Correlation:
    """How two numbers go together: the correlation of their normal scores (a Gaussian copula)."""

    of: tuple[Text, Text]
    """paths of single numbers, such as "bushings[0].gap" """
    value: Annotated[Number, Field(ge=-1, le=1)]
    """1: both are large together; -1: one is large where the other is small"""
