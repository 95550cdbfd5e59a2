"""Two walls across one direction; the gap function and its describing function."""

from collections.abc import MutableSequence, Sequence
from typing import Any, ClassVar

import numba
import numpy as np
from numpy.typing import ArrayLike

from ...rig.walls import Wall, register
from ..lanes import larger, signed

__all__ = ["Slot", "describing_function", "gap", "penetration"]


@register
class Slot(Wall):
    """A wall on each side, a gap away from the middle."""

    name: ClassVar[str] = "slot"
    coordinates: ClassVar[int] = 1

    @staticmethod
    def law(p: Sequence[float], r: tuple[float, float], out: MutableSequence[float]) -> None:
        """Return the depth in the nearer one of two parallel walls at -p[0] and p[1]."""
        above, below = r[1] - p[1], 0.0 - r[1] - p[0]
        out[0] = larger(above, below)
        out[1] = 0.0 * r[1]
        out[2] = signed(1.0 + 0.0 * r[1], above - below)

    def reach(self, gap: float) -> float:
        """Return the gap."""
        return gap

    def parameters(self, gap: float) -> tuple[float, ...]:
        """Return the distances of the lower and the upper wall from the middle."""
        return gap, gap


@numba.vectorize(["float64(float64, float64, float64)"], cache=True)
def penetration(x: Any, lower: Any, upper: Any) -> Any:
    """Return the signed penetration into one of two walls, m: x - upper above, x - lower below, 0 between.

    Parameters
    ----------
    x : array_like
        Displacement, m.
    lower, upper : array_like
        Positions of the walls, m; infinite where there is none.
    """
    return max(x - upper, 0.0) + min(x - lower, 0.0)


@numba.vectorize(["float64(float64, float64)"], cache=True)
def gap(x: Any, d: Any) -> Any:
    """Return the signed penetration beyond a clearance, m (Eq. 11): x - d above d, x + d below -d, 0 between.

    Parameters
    ----------
    x : array_like
        Displacement relative to the bushing, m.
    d : array_like
        Radial clearance, m.
    """
    return max(x - d, 0.0) + min(x + d, 0.0)


def describing_function(amplitude: ArrayLike, d: ArrayLike) -> np.ndarray:
    """Return the stiffness ratio N/k, between 0 and 1, of a spring with clearance under a harmonic motion.

    N/k = 1 - (2/π) [asin(d/X) + (d/X) √(1 - d²/X²)] for X > d, else 0 (Gelb & Vander Velde, Multiple-Input
    Describing Functions, 1968, appendix B, dead zone).

    Parameters
    ----------
    amplitude : array_like
        Amplitude X of the motion, m.
    d : array_like
        Radial clearance, m.
    """
    ratio = np.minimum(np.divide(d, amplitude), 1.0)
    return 1 - 2 / np.pi * (np.arcsin(ratio) + ratio * np.sqrt(1 - ratio**2))
