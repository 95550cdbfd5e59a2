"""Excitations of the rig: what the shaker does."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .errors import ExcitationError

__all__ = ["Excitation"]


@dataclass(frozen=True)
class Excitation:
    """A sampled excitation.

    Raises
    ------
    ExcitationError
        If it is not one finite row of samples, or is sampled below twice its band.
    """

    value: np.ndarray
    """(n_t,) base acceleration in m/s² (kind "base") or force at the shaker in N (kind "force")"""
    fs: float
    """samples per second"""
    kind: str = "base"
    band: tuple[float, float] | None = None
    """Hz"""
    description: dict = field(default_factory=dict)
    """generator, its parameters and seed; plain data"""

    def __post_init__(self):
        value = np.ascontiguousarray(self.value, dtype=float)
        if value.ndim != 1 or not value.size:
            raise ExcitationError(f"an excitation is one row of samples, got shape {value.shape}")
        if not np.all(np.isfinite(value)):
            raise ExcitationError(f"sample {int(np.argmin(np.isfinite(value)))} of the excitation is not finite")
        if not 0 < self.fs < np.inf:
            raise ExcitationError(f"fs must be > 0 Hz, got {self.fs!r}")
        if self.kind not in ("base", "force"):
            raise ExcitationError(f'kind "{self.kind}" is unknown; use "base" (m/s²) or "force" (N)')
        if self.band is not None and not 0 <= self.band[0] < self.band[1]:
            raise ExcitationError(f"band {self.band} must be two increasing frequencies in Hz")
        if self.band is not None and self.fs < 2 * self.band[1]:
            raise ExcitationError(f"fs {self.fs:g} Hz is below twice the band's upper end {self.band[1]:g} Hz")
        object.__setattr__(self, "value", value)

    @property
    def time(self) -> np.ndarray:
        """(n_t,) s"""
        return np.arange(self.value.size) / self.fs
