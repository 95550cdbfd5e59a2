"""Distribution of a scattering number, limits of a drawing, and correlation of two numbers."""

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

LAW = "law."  # prefix of paths to numbers of a model's law
SIGMAS = 3.0  # standard deviations from the middle to the limits of a drawing
CUT = 4.0  # standard deviations at which a normal distribution without limits is cut
SIZE = re.compile(r"\s*([-+\d.eE]+)\s*(.*?)\s*")
_SHARE = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*%\s*")


@checked(ClearanceError)
class Scattered:
    """Scatter of a number, or of each of several, about its value in the model."""

    of: Text
    """path to a number of the rig, such as "bushings[0].gap"; "bushings.gap": that of every bushing,
    independently; or of the model's law, such as "law.k[0]" """
    std: Text | None = None
    """standard deviation with its unit, "0.02 mm", or "3 %" of the value (of an offset: of the gap)"""
    within: Text | None = None
    """instead, the limits of a drawing: 0.3 ± 0.05 mm has "0.05 mm"; three standard deviations of "normal" """
    distribution: Literal["normal", "lognormal", "uniform", "triangular"] = "normal"
    """ "normal" and "lognormal" end at the limits, or at four standard deviations; "lognormal" is relative to the
    value; "uniform" and "triangular" have limits only"""
    price: Annotated[Number, Field(gt=0)] | None = None
    """extra cost of half of the scatter, in any currency: a narrower one costs by 1/width - 1"""

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
        """Width, in SI units or relative to the value, and True if it is relative."""
        text = self.std if self.std is not None else self.within
        assert text is not None
        with naming(f"scatter of {self.of}", (ValueError, ClearanceError), ClearanceError):
            if self.of.startswith(LAW):
                if not (match := _SHARE.fullmatch(text)):
                    raise ClearanceError(f'"{text}" is no share of the value, such as "5 %"')
                size, relative = float(match[1]) / 100, True
            else:
                tolerance = Tolerance(self.of, text)
                size, relative = tolerance.size, tolerance.relative
            if size == 0:
                raise ClearanceError(f'"{text}" is none; leave it out')
        return size, relative

    def half_width(self, value: float, gap: float | None = None) -> tuple[float, float]:
        """Return standard deviation and distance of the limits from the middle, in SI units.

        For "lognormal" both are those of the logarithm.

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
        """Return the deviations of values (n,) from the middle, over the distance of the limits.

        Parameters
        ----------
        values : ndarray, shape (n,)
            Values of the number.
        value : float
            The number's value in the model.
        gap : float, optional
            The gap that an offset is measured by, m.
        """
        _, limit = self.half_width(value, gap)
        return (np.log(values / value) if self.distribution == "lognormal" else values - value) / limit

    def quantile(self, share: np.ndarray, value: float, gap: float | None = None) -> np.ndarray:
        """Return the quantiles (n,) of the number.

        Parameters
        ----------
        share : ndarray, shape (n,)
            Probabilities, between 0 and 1.
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
        """Return the same with standard deviation or limits times a factor; for "lognormal" those of the logarithm.

        Parameters
        ----------
        width : float
            Factor, > 0.
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
    """Correlation of two numbers: that of their normal scores (a Gaussian copula)."""

    of: tuple[Text, Text]
    """paths of single numbers, such as "bushings[0].gap" """
    value: Annotated[Number, Field(ge=-1, le=1)]
    """1: both are large together; -1: one is large if the other is small"""
