"""A parameter of a fit: its start, its bounds and its prior."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

__all__ = ["Parameter"]


@dataclass(frozen=True)
class Parameter:
    """A parameter to estimate: its start, its bounds and its prior."""

    name: str
    """in words, or a path into a rig or law"""
    unit: str
    """of its values, SI"""
    start: float
    """where the search begins, and the mean of the prior"""
    low: float
    """lower bound"""
    high: float
    """upper bound"""
    prior_std: float = math.inf
    """standard deviation before the fit, of the logarithm where that is what varies; infinite: the bounds only"""
    transform: Literal["log", "linear"] = "log"
    """what varies in a fit: the logarithm of a positive number, or the number"""

    def to_varied(self, value: float) -> float:
        """Return what varies in a fit: the logarithm of a value, or the value itself.

        Parameters
        ----------
        value : float
            Value in SI units.
        """
        return float(np.log(value)) if self.transform == "log" else float(value)

    def from_varied(self, varied: np.ndarray) -> np.ndarray:
        """Return the values, SI units, of what varies in a fit.

        Parameters
        ----------
        varied : ndarray
            Varied values, of any shape.
        """
        return np.exp(varied) if self.transform == "log" else np.asarray(varied)

    @property
    def has_prior(self) -> bool:
        """True if more than the bounds is known before the fit."""
        return math.isfinite(self.prior_std)

    @property
    def known_std(self) -> float:
        """Standard deviation before the fit: the prior's, or that of the uniform distribution between the bounds."""
        if self.has_prior:
            return self.prior_std
        return (self.to_varied(self.high) - self.to_varied(self.low)) / math.sqrt(12)
