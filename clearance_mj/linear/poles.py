"""Poles of a linear model at a spin, with the motion of each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

__all__ = ["Poles"]


class Poles(NamedTuple):
    """Motions q e^(λt) of a linear model."""

    value: np.ndarray  #: (m,) λ, 1/s
    motion: np.ndarray  #: (n, m) coordinates of each

    def selected(self, which: np.ndarray | list[int] | slice) -> Poles:
        """Return some of the poles, in the order of their indices.

        Parameters
        ----------
        which : ndarray, list of int or slice
            Their indices.
        """
        return Poles(self.value[which], self.motion[:, which])

    @property
    def vibrating(self) -> Poles:
        """Poles that vibrate, of each pair the one with positive imaginary part, by rising frequency."""
        upper = np.flatnonzero(self.value.imag > 0)
        return self.selected(upper[np.argsort(self.value[upper].imag)])
