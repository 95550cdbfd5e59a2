"""Poles of a linear model at a spin: one state matrix, one scaling, one set of vectors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

__all__ = ["Eigenmotions", "Poles", "eigenmotions"]

WORST_POLES = 1e10  # condition of the poles' vectors beyond which they are not used


class Poles(NamedTuple):
    """Motions q e^(λt) of a linear model."""

    value: np.ndarray  #: (m,) λ, 1/s
    motion: np.ndarray  #: (n, m) coordinates of each

    def selected(self, which: np.ndarray | list[int] | slice) -> Poles:
        """Return some of them, in the order of their numbers.

        Parameters
        ----------
        which : ndarray, list of int or slice
            Their numbers.
        """
        return Poles(self.value[which], self.motion[:, which])

    @property
    def vibrating(self) -> Poles:
        """Those that vibrate, of each pair the one with positive imaginary part, by rising frequency."""
        upper = np.flatnonzero(self.value.imag > 0)
        return self.selected(upper[np.argsort(self.value[upper].imag)])


class Eigenmotions(NamedTuple):
    """Eigenvectors of a state matrix whose rows are scaled to one size."""

    value: np.ndarray  # (2 n,)
    vectors: np.ndarray  # (2 n, 2 n)
    scale: np.ndarray  # (n,) 1/s, of the velocities

    def drive(self) -> np.ndarray:
        """Return the share (2 n, n) that a force on each coordinate has in each motion.

        Raises
        ------
        LinAlgError
            If motions have no vectors of their own, as those of a free body.
        """
        if not np.linalg.cond(self.vectors, 1) < WORST_POLES:
            raise np.linalg.LinAlgError("poles have no vectors of their own")
        return np.asarray(np.linalg.inv(self.vectors)[:, self.scale.size :] / self.scale)


def eigenmotions(state: np.ndarray, scale: np.ndarray) -> Eigenmotions:
    """Return eigenvalues and vectors of a state matrix (2 n, 2 n) whose velocities are divided by a scale (n,)."""
    both = np.concatenate((np.ones(scale.size), scale))
    return Eigenmotions(*np.linalg.eig(state / both[:, None] * both), scale)
