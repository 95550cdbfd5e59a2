"""How well modes are known from the FRFs that they were extracted from, and which of them are two poles of one peak."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import ArrayData
from .correlation import mac
from .ema import Modes, extract_modes, refitted_modes
from .frf import FRF
from .modal_fit import ModalFit, line_weight, poles_of

__all__ = ["HARDLY", "ModeErrors", "distinct_modes", "mode_errors"]

SAME_SHAPE = 0.9  # MAC from which on two modes whose half-power bands overlap are one peak
HARDLY = 0.02, 1 / 3
"""Relative standard deviation of the frequency, and error of the shape over its length, from which on a mode is hardly
extracted: two shapes with a third of random error each have a MAC of 0.8 with each other where they are equal."""


@dataclass(frozen=True, eq=False, repr=False)
class ModeErrors(ArrayData):
    """Random errors of modes, from what their fit leaves of the FRFs."""

    frequency: np.ndarray
    """(n,) relative standard deviation of the natural frequency"""
    shape: np.ndarray
    """(n,) root of the shape's total variance over its length"""

    @property
    def hardly(self) -> np.ndarray:
        """(n,) whether a mode is hardly extracted, see `HARDLY`."""
        # nan, of a fit without an inverse, is hardly extracted too
        return ~((self.frequency < HARDLY[0]) & (self.shape < HARDLY[1]))


def distinct_modes(frf: FRF, n_modes: int) -> Modes:
    """Extract modes, and join those that are one peak.

    The hump of a nonlinear resonance, or a noisy one, is fitted by two poles within each other's half-power band and of
    one shape, whose frequencies and dampings differ from record to record. The one that explains less is left out, and
    the others are fitted again.

    Parameters
    ----------
    frf : FRF
        As in `extract_modes`.
    n_modes : int
        Largest number of modes.
    """
    modes = extract_modes(frf, n_modes)
    while (pairs := _of_one_peak(modes)).size:
        own, _ = _fit(frf).explained(poles_of(_unknowns(frf, modes)))
        weaker = pairs.ravel()[np.argmin(own[pairs.ravel()])]
        kept = np.delete(np.arange(own.size), weaker)
        start = Modes(modes.frequency[kept], modes.damping[kept], modes.shape[:, kept], modes.responses)
        modes = refitted_modes(frf, start)
    return modes


def _of_one_peak(modes: Modes) -> np.ndarray:
    """(n, 2) pairs of modes that are two poles of one peak."""
    f, half_width = modes.frequency, modes.frequency * modes.damping
    close = np.abs(f[:, None] - f) < half_width[:, None] + half_width
    return np.argwhere(np.triu(close & (mac(modes.shape, modes.shape) > SAME_SHAPE), 1))


def _fit(frf: FRF) -> ModalFit:
    return ModalFit(frf.frequency, frf.functions, line_weight(frf.functions))


def _unknowns(frf: FRF, modes: Modes) -> np.ndarray:
    return np.log(np.concatenate((modes.frequency / frf.frequency[-1], modes.damping)))


def mode_errors(frf: FRF, modes: Modes) -> ModeErrors:
    """Return the random errors of extracted modes, from what their fit leaves at each line and function.

    Linear propagation with White's covariance, as what is left is largest where the FRFs are (H. White, A
    heteroskedasticity-consistent covariance matrix estimator, Econometrica 48, 1980).

    Parameters
    ----------
    frf : FRF
        That the modes were extracted from.
    modes : Modes
        The modes, of all its functions.
    """
    if not modes.frequency.size:
        return ModeErrors(np.empty(0), np.empty(0))
    fit, unknowns = _fit(frf), _unknowns(frf, modes)
    left, slope = fit.residual(unknowns)
    n = modes.frequency.size
    rows, own = slope.reshape(2 * n, -1), left.ravel()
    inverse = np.linalg.pinv(rows @ rows.T, hermitian=True)
    of_poles = np.diag(inverse @ (rows * own**2) @ rows.T @ inverse)[:n]
    return ModeErrors(np.sqrt(np.maximum(of_poles, 0)), fit.shape_errors(poles_of(unknowns), left))
