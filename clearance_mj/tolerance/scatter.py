"""How the numbers of a production scatter: distributions, limits of a drawing, correlations."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field
from scipy.stats import norm

from ..core.errors import ClearanceError
from ..core.validation import Number, Text, checked, from_plain, read_plain, to_plain
from ..model import Model
from ..rig import Rig
from ..rig.tolerance import CLAMP_COMPLIANCES, Tolerance
from .designs import LAW, Designs, DrawingRule

__all__ = ["Correlation", "Scatter", "Scattered"]

SIGMAS = 3.0  # standard deviations from the middle to the limits of a drawing
CUT = 4.0  # standard deviations beyond which no normal number lies that has a standard deviation alone
INSTRUMENTS = ("gain", "delay", "probe_delay", "direction", "probe_angle")
"""Fields of sensors and probes: a production does not scatter by them"""
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
    """ "normal" and "lognormal" end at the limits, or at four standard deviations; "uniform" and "triangular" have only
    limits"""
    price: Annotated[Number, Field(gt=0)] | None = None
    """what half of the scatter costs more than all of it, in any currency: a narrower one costs by 1/width - 1"""

    def __post_init__(self) -> None:
        if (self.std is None) == (self.within is None):
            raise ClearanceError(f"scatter of {self.of}: give either std or within")
        if self.distribution in ("uniform", "triangular") and self.within is None:
            raise ClearanceError(f'scatter of {self.of}: "{self.distribution}" has limits: give within, not std')
        self._size  # noqa: B018 that refuses what is no size

    @functools.cached_property
    def _size(self) -> tuple[float, bool]:
        """How wide, in SI units or as a share of the value, and which of the two."""
        given = self.std if self.std is not None else self.within
        assert given is not None
        try:
            if self.of.startswith(LAW):
                match = _SHARE.fullmatch(given)
                if not match:
                    raise ValueError(f'"{given}" is no share of the value, such as "5 %"')
                size, relative = float(match[1]) / 100, True
            else:
                tolerance = Tolerance(self.of, given)
                size, relative = tolerance.size, tolerance.relative
        except (ValueError, ClearanceError) as error:
            raise ClearanceError(f"scatter of {self.of}: {error}") from None
        if size == 0:
            raise ClearanceError(f'scatter of {self.of}: "{given}" is none; leave it out')
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
            size = math.log1p(size if relative else size / value)
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


@checked(ClearanceError)
class Correlation:
    """How two numbers go together: the correlation of their normal scores (a Gaussian copula)."""

    of: tuple[Text, Text]
    """paths of single numbers, such as "bushings[0].gap" """
    value: Annotated[Number, Field(ge=-1, le=1)]
    """1: both are large together; -1: one is large where the other is small"""


@dataclass(frozen=True)
class Scatter:
    """How a production scatters.

    Raises
    ------
    ClearanceError
        If there is nothing, a number scatters twice, or a correlation is of a number that does not scatter.
    """

    numbers: tuple[Scattered, ...]
    """what scatters"""
    correlations: tuple[Correlation, ...] = ()
    """between pairs of numbers"""
    left_out: tuple[str, ...] = ()
    """those of the rig's tolerances that a production does not scatter by"""

    def __post_init__(self) -> None:
        if not self.numbers:
            raise ClearanceError("nothing scatters: give [[scatter]] in a file, or [[tolerances]] in the rig file")

    @classmethod
    def of_rig(cls, rig: Rig) -> Scatter:
        """Return the scatter that a rig file's own tolerances say: normal, of their standard deviations.

        Parameters
        ----------
        rig : Rig
            With ``tolerances``; those of instruments and of the clamp's compliance, and exact numbers, are left out.
        """
        kept: list[Tolerance] = []
        left: list[Tolerance] = []
        for each in rig.tolerances:
            instrument = each.of.rpartition(".")[2] in INSTRUMENTS or each.of in CLAMP_COMPLIANCES
            (left if instrument or each.size == 0 else kept).append(each)
        return cls(tuple(Scattered(t.of, std=t.std) for t in kept), (), tuple(t.of for t in left))

    @classmethod
    def load(cls, path: str | Path) -> Scatter:
        """Read a scatter file (TOML): ``[[scatter]]`` with what `Scattered` has, ``[[correlations]]`` of `Correlation`.

        Parameters
        ----------
        path : str or Path
            The file.

        Raises
        ------
        ClearanceError
            If it cannot be read, or holds what is impossible.
        """
        data = read_plain(path, ClearanceError)
        if unknown := [key for key in data if key not in ("scatter", "correlations")]:
            raise ClearanceError(f"{path}: {unknown[0]} is not a known key; known: scatter, correlations")
        try:
            numbers = from_plain(tuple[Scattered, ...], data.get("scatter", []), "scatter", ClearanceError)
            pairs = from_plain(tuple[Correlation, ...], data.get("correlations", []), "correlations", ClearanceError)
            return cls(numbers, pairs)
        except ClearanceError as error:
            raise ClearanceError(f"{path}: {error}") from None

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, as a scatter file holds it."""
        return {"scatter": to_plain(self.numbers), "correlations": to_plain(self.correlations)}

    def narrowed(self, widths: Mapping[str, float]) -> Scatter:
        """Return a scatter of which some numbers have a share of their width.

        Parameters
        ----------
        widths : mapping of str to float
            Shares, > 0, by the paths in `numbers`.
        """
        return replace(self, numbers=tuple(_narrowed(each, widths.get(each.of, 1.0)) for each in self.numbers))

    def draw(self, model: Model, n: int, seed: int = 0) -> Designs:
        """Draw designs, of which the first ones stay the same if more are drawn.

        Parameters
        ----------
        model : Model
            Its numbers are the middle.
        n : int
            Number of designs.
        seed : int
            Of scrambled Sobol' points.

        Raises
        ------
        ClearanceError
            If a path leads nowhere, correlations are none that numbers can have, or a design is impossible.
        """
        return DrawingRule(self.numbers, self.correlations, model).draw(n, seed)


def _narrowed(number: Scattered, width: float) -> Scattered:
    def scaled(text: str | None) -> str | None:
        if text is None:
            return None
        size, unit = re.match(r"\s*([-+\d.eE]+)\s*(.*)", text).groups()  # type: ignore[union-attr]
        return f"{float(size) * width:.12g} {unit}"

    return replace(number, std=scaled(number.std), within=scaled(number.within))
