"""Base class of oil films of plain bearings: dimensions, equilibrium and interface of engines."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import scipy.optimize

from ..core.errors import LawError
from ..core.validation import Flag, NotNegative, Positive, checked, seldom
from .contact import Numbers
from .grease import GreaseModel, Vector

__all__ = ["OilBearing"]


@checked(LawError, name="grease")
class OilBearing(GreaseModel):
    """A plain bearing filled with oil; `force` acts on the journal."""

    is_circulatory: ClassVar[bool] = True
    fullest: ClassVar[float]  #: eccentricity ratio up to which the film's forces are known
    viscosity: Positive
    """μ, Pa s"""
    radius: Positive
    """R, m, of the journal"""
    length: Positive
    """L, m"""
    clearance: Positive
    """C, m, radial"""
    asperities: NotNegative = seldom(default=0.0)
    """m: height of both surfaces' asperities, at which the film ends and contact begins"""
    cavitated: Flag = seldom(default=True)
    """True if oil cannot pull; False: pressure below ambient is possible"""

    def __post_init__(self) -> None:
        if self.asperities >= self.clearance:
            raise ValueError(
                f"asperities {self.asperities:g} m are as high as the film in the clearance {self.clearance:g} m is "
                "thick; there is no room for oil"
            )

    @property
    def widest(self) -> float:
        """Largest eccentricity ratio with a film."""
        return 1 - self.asperities / self.clearance

    @property
    def most(self) -> float:
        """Eccentricity ratio beyond which the film thickness is constant."""
        return min(self.widest, self.fullest)

    def states(self, coordinates: int) -> int:
        """Return 0: the film has no state."""
        return 0

    @staticmethod
    def energy(
        p: Sequence[float], before: Sequence[float], state: Sequence[float], r: Vector, dr: Vector, out: Numbers
    ) -> None:
        """Write zeros: a film stores no energy; its loss is the work of its forces."""
        out[0] = out[1] = 0.0

    @abstractmethod
    def force(self, displacement: Any, velocity: Any, spin: float) -> np.ndarray:
        """Return the film's force on the journal, N.

        Parameters
        ----------
        displacement : array_like, shape (..., 2)
            y and z from the bearing's middle, m; beyond the asperities the film thickness is constant.
        velocity : array_like, shape (..., 2)
            m/s.
        spin : float
            Ω, rad/s, from y to z.

        Returns
        -------
        ndarray, shape (..., 2)
            Along y and z.
        """

    @abstractmethod
    def coefficients(self, displacement: Any, spin: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the film's stiffness and damping for small motions about a journal at rest: the eight coefficients.

        Parameters
        ----------
        displacement : array_like, shape (2,)
            y and z from the bearing's middle, m.
        spin : float
            Ω, rad/s.

        Returns
        -------
        stiffness : ndarray, shape (2, 2)
            N/m: force against each direction, per displacement in each.
        damping : ndarray, shape (2, 2)
            N s/m.
        """

    def equilibrium(self, load: Any, spin: float) -> np.ndarray:
        """Return the equilibrium of a turning journal under a steady load: y and z from the bearing's middle (2,), m.

        Parameters
        ----------
        load : array_like, shape (2,)
            N, on the journal along y and z.
        spin : float
            Ω, rad/s.

        Raises
        ------
        LawError
            If the film does not carry the load: it does not turn, or the journal would rest on asperities.
        """
        load_vector = np.asarray(load, dtype=float)
        weight, limit = float(np.hypot(*load_vector)), self.most
        if weight == 0:
            return np.zeros(2)

        def capacity(ratio: float) -> float:
            return float(np.hypot(*self.force([self.clearance * ratio, 0.0], [0.0, 0.0], spin)))

        if capacity(limit) <= weight:
            raise LawError(
                f"the film carries {capacity(limit):.4g} N at {spin:g} rad/s down to its asperities, the load is "
                f"{weight:.4g} N; give more speed or viscosity, or less clearance"
            )
        ratio = scipy.optimize.brentq(lambda x: capacity(x) - weight, 0.0, limit, xtol=1e-15)
        force = self.force([self.clearance * ratio, 0.0], [0.0, 0.0], spin)
        rotation = -complex(*load_vector) / complex(*force)  # rotates the film's force against the load
        rotation *= self.clearance * ratio / abs(rotation)
        return np.array([rotation.real, rotation.imag])
