"""The gap function and its describing function."""

from typing import Any

import numba
import numpy as np
from numpy.typing import ArrayLike

__all__ = ["describing_function", "gap", "penetration"]


@numba.vectorize(["float64(float64, float64, float64)"], cache=True)
def penetration(x: Any, lower: Any, upper: Any) -> Any:
    """Signed penetration into one of two walls, m: x - upper above, x - lower below, 0 between.

    Parameters
    ----------
    x : array_like
        Displacement, m.
    lower, upper : array_like
        Where the walls are, m; infinite where there is none.
    """
    return max(x - upper, 0.0) + min(x - lower, 0.0)


@numba.vectorize(["float64(float64, float64)"], cache=True)
def gap(x: Any, d: Any) -> Any:
    """Signed penetration beyond a clearance, m (Eq. 11): x - d above d, x + d below -d, 0 between.

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
