"""Spectra of a record compared with those of a rig, and the rig's misfit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...rig import Rig
from .spectra import complex_frequency, rms

__all__ = ["RecordMisfit", "relative_error", "rms_relative_error"]


@dataclass(frozen=True, eq=False)
class RecordMisfit:
    """Spectra of one record as measured, and of two rigs under the forces that meet all sensors best."""

    record: str  #: name of the record
    tested: Rig  #: whose shaker and spin are those of the record
    kind: str  #: "base" or "force": kind of excitation
    duration: float  #: s
    frequency: np.ndarray  #: (n_f,) Hz
    level: np.ndarray  #: (n_channels,) RMS of the channels, with the lines near the turns, which are left out
    measured: np.ndarray  #: (n_channels, n_f) complex, accelerometers, then probes, then the excitation
    before: np.ndarray  #: (n_channels, n_f) complex, of the rig file
    fitted: np.ndarray  #: (n_channels, n_f) complex, of the updated rig

    @property
    def omega(self) -> np.ndarray:
        """(n_f,) rad/s, the complex frequencies at which the spectra were taken."""
        return complex_frequency(self.frequency, self.duration)

    @property
    def is_whole(self) -> bool:
        """True if the record has all channels: none was left out."""
        return bool(self.level.all())

    @property
    def relative_error(self) -> np.ndarray:
        """(n_channels,) RMS of the residual over that of the channel; nan of one that was left out."""
        return relative_error(rms((self.fitted - self.measured).T), self.level)


def relative_error(residual: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return the residual of channels (n_channels,) over their level; nan of those that were left out."""
    return np.divide(residual, level, out=np.full(residual.shape, np.nan), where=level > 0)


def rms_relative_error(ratios: Sequence[np.ndarray]) -> np.ndarray:
    """Return the RMS (n_channels,) of misfits over the records that have a channel; 0 of one that none has."""
    squares = np.square(ratios)
    finite = np.isfinite(squares)
    return np.asarray(np.sqrt(np.sum(squares, axis=0, where=finite) / np.maximum(finite.sum(axis=0), 1)))
