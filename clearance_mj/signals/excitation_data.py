"""A sampled excitation: its samples, and how they were made."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import ExcitationError
from ..core.overview import Overview, Shown
from . import labelled
from .arrays import ArrayData, read_only
from .excitation_checks import Band

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Excitation", "described"]


@dataclass(frozen=True, eq=False, repr=False)
class Excitation(Shown, ArrayData):
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
    """ "base" or "force" """
    band: tuple[float, float] | None = None
    """Hz"""
    description: dict[str, Any] = field(default_factory=dict)
    """generator, its parameters and seed; plain data"""

    def __post_init__(self) -> None:
        value = read_only(self.value)
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
        self._set(value=value)

    @property
    def time(self) -> np.ndarray:
        """(n_t,) s"""
        return np.arange(self.value.size) / self.fs

    def _overview(self) -> Overview:
        of = {name: value for name, value in self.description.items() if isinstance(value, str | int | float)}
        facts = {
            "level": f"{np.sqrt(np.mean(self.value**2)):.4g} {'m/s²' if self.kind == 'base' else 'N'} RMS, "
            f"at most {np.abs(self.value).max():.4g}",
            "band": f"{self.band[0]:g} to {self.band[1]:g} Hz" if self.band else "",
            "from": ", ".join(f"{name} {value}" for name, value in of.items()),
        }
        what = "base acceleration" if self.kind == "base" else "force"
        return Overview(f"Excitation, {what}, {self.value.size / self.fs:g} s at {self.fs:g} Hz", facts)

    def to_xarray(self) -> xr.Dataset:
        """Return ``value`` (time,) with units; the description (plain data) as JSON in an attribute."""
        units = "m s-2" if self.kind == "base" else "N"
        attributes: dict[str, Any] = {"fs": float(self.fs), "kind": self.kind}
        attributes["description"] = labelled.plain_json(self.description, "description")
        if self.band is not None:
            attributes["band"] = np.array(self.band, dtype=float)
        return labelled.dataset("excitation", {"value": ("time", self.value, units)}, {"time": self.time}, attributes)

    @classmethod
    def from_xarray(cls, ds: xr.Dataset) -> Excitation:
        """Return the excitation of a dataset that `to_xarray` made; refuses others.

        Parameters
        ----------
        ds : xarray.Dataset
            The dataset.
        """
        labelled.require_kind(ds, "excitation")
        band = ds.attrs.get("band")
        return cls(
            labelled.values(ds, "value", "time"),
            float(labelled.attribute(ds, "fs")),
            str(labelled.attribute(ds, "kind")),
            None if band is None else (float(band[0]), float(band[1])),
            labelled.from_json(ds, "description"),
        )


def described(
    generator: str, value: np.ndarray, fs: float, kind: str, band: Band | None, **parameters: object
) -> Excitation:
    """Return the excitation of samples, which says how it was made, in plain data."""
    if band is not None:
        ends = [float(band[0]), float(band[1])]
        parameters["band"], band = ends, (min(ends), max(ends))
    parameters = {key: item.item() if isinstance(item, np.generic) else item for key, item in parameters.items()}
    return Excitation(value, fs, kind, band, {"generator": generator, "fs": float(fs), "kind": kind, **parameters})
