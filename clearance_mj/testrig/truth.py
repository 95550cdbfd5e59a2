"""What a virtual bushing really is, where the rig file holds datasheet values.

Nothing here is written into a dataset, and nothing outside this package may read it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from . import physics

__all__ = ["BoucWen", "Iwan", "LuGre", "Truth"]


@dataclass(frozen=True)
class BoucWen:
    """Smooth hysteresis, see `physics.bouc_wen`."""

    model: ClassVar[int] = physics.BOUC_WEN
    amplitude: float = 1.0
    """A"""
    beta: float = 1e7
    """1/mⁿ"""
    gamma: float = 1e7
    """1/mⁿ"""
    exponent: int = 2
    """n"""

    @property
    def parameters(self) -> np.ndarray:
        """(4,) as the integrator reads them."""
        return np.array([self.amplitude, self.beta, self.gamma, self.exponent])

    @property
    def states(self) -> int:
        """How many numbers remember the motion."""
        return 1


@dataclass(frozen=True)
class Iwan:
    """Parallel Jenkins elements of equal stiffness, their yield displacements evenly spread; see `physics.iwan`."""

    model: ClassVar[int] = physics.IWAN
    largest_yield: float
    """m; element i of N yields at (i - 1/2)/N of it"""
    elements: int = 12
    """N"""

    @property
    def parameters(self) -> np.ndarray:
        """(n,) yield displacement of each element, m."""
        return self.largest_yield * (np.arange(self.elements) + 0.5) / self.elements

    @property
    def states(self) -> int:
        """How many numbers remember the motion."""
        return self.elements


@dataclass(frozen=True)
class LuGre:
    """Bristles that slide with Stribeck's friction, see `physics.lugre`."""

    model: ClassVar[int] = physics.LUGRE
    coulomb: float
    """m, deflection of bristles that slide fast"""
    static: float
    """m, deflection of bristles that slide slowly"""
    stribeck_speed: float
    """m/s"""
    damping: float = 0.0
    """σ1, N s/m, of the bristles"""

    @property
    def parameters(self) -> np.ndarray:
        """(4,) as the integrator reads them."""
        return np.array([self.coulomb, self.static, self.stribeck_speed, self.damping])

    @property
    def states(self) -> int:
        """How many numbers remember the motion."""
        return 1


@dataclass(frozen=True)
class Truth:
    """A real bushing; the defaults are those of the rig of the article's Table 1."""

    contact_stiffness: float = 3e5
    """K of a whole bushing, N/m^1.5; each end has half"""
    contact_exponent: float = 1.5
    """Hertz"""
    contact_dissipation: float = 1.5
    """α, s/m"""
    grease_stiffness: float = 4369.0
    """k, N/m"""
    elastic_ratio: float = 0.8
    """λ"""
    hysteresis: BoucWen | Iwan | LuGre = field(default_factory=BoucWen)
    """of the other share of the stiffness"""
    film_damping: float = 4.0
    """c, N s/m"""
    film_height: float = 7.5e-4
    """h, m"""
    film_limit: float = 0.2
    """ε, smallest relative film thickness"""
    drift: float = 0.005
    """largest relative change of the grease stiffness, by temperature"""
