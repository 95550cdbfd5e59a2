"""Variable projection: at every line the unknown forces that meet all channels best, and their residual.

Golub and Pereyra, The differentiation of pseudo-inverses and nonlinear least squares problems whose variables
separate, SIAM J. Numer. Anal. 10, 1973; derivatives as Kaufman, BIT 15, 1975.
"""

from __future__ import annotations

import numpy as np

__all__ = ["Projection"]


class Projection:
    """Forces that meet whitened channels best, and the residual.

    Parameters
    ----------
    gains : ndarray, shape (n_f, n_channels, n_forces + 1)
        Gains of the forces in the clearances and of the excitation.
    measured : ndarray, shape (n_f, n_channels)
        Measured complex spectra.
    whitening : ndarray, shape (n_f, n_channels, n_channels)
        Makes the errors of the channels independent, of unit variance.
    """

    def __init__(self, gains: np.ndarray, measured: np.ndarray, whitening: np.ndarray) -> None:
        self.whitening, self._gains, self._measured = whitening, gains, measured
        self._basis, upper = np.linalg.qr(whitening @ gains)
        target = whitening @ measured[:, :, None]
        inside = self._basis.conj().transpose(0, 2, 1) @ target
        self.forces = np.linalg.solve(upper, inside)
        """(n_f, n_bushings + 1, 1)"""
        self.residual = (target - self._basis @ inside)[:, :, 0]
        """(n_f, n_channels) whitened"""

    def fitted(self, noise: np.ndarray) -> np.ndarray:
        """Return the spectra (n_f, n_channels) that forces and couples explain, for the noise's standard deviation."""
        return self._measured - noise**2 * (self.residual[:, None, :] @ self.whitening.conj())[:, 0]

    def freedom(self, noise: np.ndarray) -> float:
        """Return the fraction of noise, standard deviation (n_f, n_channels), that neither forces nor couples explain.

        Channels without noise do not count.
        """
        white_noise = self.whitening * noise[:, None, :]
        explained = self._basis.conj().transpose(0, 2, 1) @ white_noise
        return float(np.sum(np.abs(white_noise) ** 2) - np.sum(np.abs(explained) ** 2)) / np.count_nonzero(noise)

    def changed(self, gains: np.ndarray) -> np.ndarray:
        """Return the change (n_f, n_channels) of the same forces' response by other gains."""
        return ((gains - self._gains) @ self.forces)[:, :, 0]

    def without_forces(self, values: np.ndarray) -> np.ndarray:
        """Return the part of values (n, n_f, n_channels) that no forces explain, whitened."""
        columns = self.whitening @ values.transpose(1, 2, 0)
        return (columns - self._basis @ (self._basis.conj().transpose(0, 2, 1) @ columns)).transpose(2, 0, 1)
