"""Size of the couples that act with forces in clearances, from spectra: likeliest by a variance component.

Unknown forces are fitted in every line. With couples taken too large, a fit moves the clearances away from where their
forces act: as far as the priors allow, without any misfit in the channels.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

__all__ = ["WhiteLines", "likeliest_end_moment_ratio"]


class WhiteLines(NamedTuple):
    """Spectral lines of a record over the standard deviation of each channel's noise."""

    gains: np.ndarray  #: (n_f, n_channels, n_unknowns) of the unknowns that are fitted in every line
    measured: np.ndarray  #: (n_f, n_channels)
    coupled: np.ndarray  #: (n_f, n_channels, n_couples) response to couples as large as the forces
    correlated: float  #: lines that count as one independent observation

    def thinned(self, most: int) -> WhiteLines:
        """Return every so many-th line, at most ``most``."""
        kept_lines = slice(None, None, -(-len(self.gains) // most))
        return WhiteLines(self.gains[kept_lines], self.measured[kept_lines], self.coupled[kept_lines], self.correlated)


def likeliest_end_moment_ratio(records: Sequence[WhiteLines], fractions: np.ndarray, outlying: float) -> float:
    """Return the likeliest of some fractions of the forces that act as independent couples, by restricted likelihood.

    That is the likelihood of the residuals of the fitted unknowns (Patterson & Thompson, Biometrika 58, 1971): with the
    covariance S of noise and couples, gains G and lines y, ln det S + ln det Gᴴ S⁻¹ G + yᴴ P y, where
    P = S⁻¹ - S⁻¹ G (Gᴴ S⁻¹ G)⁻¹ Gᴴ S⁻¹.

    Parameters
    ----------
    records : sequence of WhiteLines
        Lines of all records.
    fractions : ndarray, shape (n,)
        Values that are compared.
    outlying : float
        Standard deviations from which on a line counts less (Huber).
    """
    cost = np.zeros(len(fractions))
    for gains, measured, coupled, correlated in records:
        columns = np.concatenate((gains, measured[:, :, None]), axis=2)
        products = coupled @ coupled.conj().transpose(0, 2, 1)
        bound = outlying**2 * (gains.shape[1] - gains.shape[2])
        for k, fraction in enumerate(fractions):
            covariance = np.eye(gains.shape[1]) + fraction**2 * products
            inner = columns.conj().transpose(0, 2, 1) @ np.linalg.solve(covariance, columns)
            of_gains = _log_det(inner[:, :-1, :-1])
            residual = np.exp(_log_det(inner) - of_gains)  # yᴴ P y, by the Schur complement
            residual = np.where(residual > bound, 2 * np.sqrt(residual * bound) - bound, residual)
            cost[k] += np.sum(residual + _log_det(covariance) + of_gains) / correlated
    return float(fractions[int(np.argmin(cost))])


def _log_det(matrices: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.slogdet(matrices)[1])
