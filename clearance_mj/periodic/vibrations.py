"""Base of periodic vibrations: harmonics at the sensors and clearances of a rig."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import ClearanceError
from ..signals import labelled
from ..signals.arrays import ArrayData, rows_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["UNITS", "Vibrations", "complex_amplitudes", "half_extents", "turned"]

UNITS = {"acceleration": "m/s²", "displacement": "m", "clearance_displacement": "m", "contact_force": "N",
         "grease_force": "N"}  # fmt: skip


DIRECTIONS = 180
"""Directions in which the extent of an orbit is measured, y and z among them: its maximum is accurate to 4e-5."""


class Vibrations(ArrayData):
    """Base of frozen dataclasses with harmonics (n, n_sensors or n_bushings, H + 1) of the quantities of `UNITS`."""

    responses: tuple[str, ...]
    clearances: tuple[str, ...]

    def amplitude(self, quantity: str = "acceleration") -> np.ndarray:
        """Return half of the peak-to-peak value of a period, (n, n_sensors or n_bushings).

        Parameters
        ----------
        quantity : str
            "acceleration", "displacement", "clearance_displacement", "contact_force" or "grease_force".

        Raises
        ------
        ClearanceError
            For another quantity.
        """
        ClearanceError.require_known("quantity", quantity, UNITS)
        return np.ptp(history(getattr(self, quantity)), axis=-1) / 2

    def _names(self, quantity: str, rows: Sequence[int] | None) -> dict[int, str]:
        """Return the requested rows of a quantity, by default all, with their names."""
        names = self.responses if quantity in ("acceleration", "displacement") else self.clearances
        return {row: names[row] for row in rows_of(names, rows)}

    def _variables(self) -> dict[str, Any]:
        """Return the harmonics as variables of a labelled dataset."""
        axis = {name: "response" if name in ("acceleration", "displacement") else "clearance" for name in UNITS}
        return {
            name: (("point", axis[name], "harmonic"), getattr(self, name), unit.replace("/s²", " s-2"))
            for name, unit in UNITS.items()
        }

    def _dataset(
        self, holds: str, variables: dict[str, Any], harmonic: Sequence[float] | np.ndarray, attributes: dict[str, Any]
    ) -> xr.Dataset:
        """Return a labelled dataset over (point, response or clearance, harmonic)."""
        coordinates = {"response": self.responses, "clearance": self.clearances, "harmonic": harmonic}
        return labelled.dataset(holds, variables, coordinates, attributes)


def history(harmonics: np.ndarray) -> np.ndarray:
    """Return values (..., 16 H + 16) over a period of complex amplitudes (..., H + 1)."""
    padded = harmonics * np.where(np.arange(harmonics.shape[-1]) > 0, 0.5, 1.0)
    samples = 16 * harmonics.shape[-1]
    return np.asarray(np.fft.irfft(padded, samples) * samples)


def half_extents(harmonics: np.ndarray) -> np.ndarray:
    """Return half of the largest extent (n, n_orbits) in any direction of orbits (n, 2 n_orbits, H + 1), along y, z."""
    orbits = history(harmonics).reshape(len(harmonics), -1, 2, 16 * harmonics.shape[-1])
    angle = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    across = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    return np.array([np.ptp(across @ orbit, axis=-1).max(axis=-1) / 2 for orbit in orbits])


def complex_amplitudes(values: np.ndarray) -> np.ndarray:
    """Return complex amplitudes (..., H + 1) of real harmonics (..., K)."""
    amplitudes = np.empty((*values.shape[:-1], values.shape[-1] // 2 + 1), dtype=complex)
    amplitudes[..., 0] = values[..., 0]
    amplitudes[..., 1:] = values[..., 1::2] - 1j * values[..., 2::2]
    return amplitudes


def turned(values: np.ndarray, angle: float) -> np.ndarray:
    """Return real harmonics (..., K) of a motion that is ahead by an angle of its fundamental, rad."""
    amplitudes = complex_amplitudes(values)[..., 1:] * np.exp(1j * angle * np.arange(1, values.shape[-1] // 2 + 1))
    shifted = values.copy()
    shifted[..., 1::2], shifted[..., 2::2] = amplitudes.real, -amplitudes.imag
    return shifted
