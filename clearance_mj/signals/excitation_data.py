"""A sampled excitation with its description, and checks of the parameters of its generators."""

from __future__ import annotations

from dataclasses import dataclass, field
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import ExcitationError
from ..core.memory import require_memory
from ..core.overview import HasOverview, Overview
from . import labelled
from .arrays import ArrayData, read_only

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "EXCITATION_UNITS", "Band", "Excitation", "common_kind", "described", "generator_of", "lines_within_band",
    "require", "require_band", "require_level", "require_period", "sample_count",
]  # fmt: skip

EXCITATION_UNITS = {"base": "m s-2", "force": "N", "mixed": ""}


@dataclass(frozen=True, eq=False, repr=False)
class Excitation(HasOverview, ArrayData):
    """A sampled excitation, of one input or of several at once.

    Raises
    ------
    ExcitationError
        If it is not finite rows of samples with a kind for each, or is sampled below twice its band.
    """

    value: np.ndarray
    """(n_t,) base acceleration in m/s² (kind "base") or force at the shaker in N (kind "force"); of several inputs
    (n_inputs, n_t), in the order of `Rig.inputs`"""
    fs: float
    """samples per second"""
    kind: str = "base"
    """ "base" or "force"; "mixed" of inputs of both kinds"""
    band: tuple[float, float] | None = None
    """Hz"""
    description: dict[str, Any] = field(default_factory=dict)
    """generator, its parameters and seed; plain data"""
    kinds: tuple[str, ...] = ()
    """kind of each of several inputs"""

    def __post_init__(self) -> None:
        value = read_only(self.value)
        if value.ndim not in ((1, 2) if self.kinds else (1,)) or not value.size:
            raise ExcitationError(f"an excitation is one row of samples, got shape {value.shape}; rows have kinds")
        finite = np.isfinite(np.atleast_2d(value)).all(axis=0)
        if not finite.all():
            raise ExcitationError(f"sample {int(np.argmin(finite))} of the excitation is not finite")
        ExcitationError.require_positive(" Hz", fs=self.fs)
        kinds = (self.kind,) if value.ndim == 1 else tuple(self.kinds)
        for kind in kinds:
            if kind not in ("base", "force"):
                raise ExcitationError(f'kind "{kind}" is unknown; use "base" (m/s²) or "force" (N)')
        if value.ndim == 2 and len(kinds) != len(value):
            raise ExcitationError(f"{len(kinds)} kinds for an excitation of {len(value)} inputs; give one for each")
        if self.band is not None and not 0 <= self.band[0] < self.band[1]:
            raise ExcitationError(f"band {self.band} must be two increasing frequencies in Hz")
        if self.band is not None and self.fs < 2 * self.band[1]:
            raise ExcitationError(f"fs {self.fs:g} Hz is below twice the band's upper end {self.band[1]:g} Hz")
        self._set(value=value, kinds=kinds, kind=common_kind(kinds))

    @property
    def time(self) -> np.ndarray:
        """(n_t,) s"""
        return np.arange(self.value.shape[-1]) / self.fs

    def _overview(self) -> Overview:
        units = ["m/s²" if kind == "base" else "N" for kind in self.kinds]
        parameters = {name: value for name, value in self.description.items() if isinstance(value, str | int | float)}
        facts = {
            "level": "; ".join(
                f"{np.sqrt(np.mean(row**2)):.4g} {unit} RMS, at most {np.abs(row).max():.4g}"
                for row, unit in zip(np.atleast_2d(self.value), units)
            ),
            "band": f"{self.band[0]:g} to {self.band[1]:g} Hz" if self.band else "",
            "from": ", ".join(f"{name} {value}" for name, value in parameters.items()),
        }
        quantity = " and ".join("base acceleration" if kind == "base" else "force" for kind in self.kinds)
        return Overview(f"Excitation, {quantity}, {self.value.shape[-1] / self.fs:g} s at {self.fs:g} Hz", facts)

    def to_xarray(self) -> xr.Dataset:
        """Return ``value`` (time,), or (input, time), with units; the description as JSON in an attribute."""
        variables = {"value": (("input", "time")[-self.value.ndim :], self.value, EXCITATION_UNITS[self.kind])}
        attributes = labelled.driving_attributes(self, "description")
        return labelled.dataset("excitation", variables, {"time": self.time}, attributes)

    @classmethod
    def from_xarray(cls, ds: xr.Dataset) -> Excitation:
        """Return the excitation of a dataset that `to_xarray` made; refuses others.

        Parameters
        ----------
        ds : xarray.Dataset
            The dataset.
        """
        labelled.require_kind(ds, "excitation")
        band, kinds = ds.attrs.get("band"), tuple(str(labelled.attribute(ds, "kind")).split())
        value = labelled.values(ds, "value", *(["input"] if len(kinds) > 1 else []), "time")
        fs, band = float(labelled.attribute(ds, "fs")), None if band is None else (float(band[0]), float(band[1]))
        return cls(value, fs, common_kind(kinds), band, labelled.from_json(ds, "description"), kinds)


def common_kind(kinds: tuple[str, ...]) -> str:
    """Return the kind of all inputs, or "mixed" where they differ."""
    return kinds[0] if len(set(kinds)) == 1 else "mixed"


def described(
    generator: str, value: np.ndarray, fs: float, kind: str, band: Band | None, **parameters: object
) -> Excitation:
    """Return the excitation of samples, with its generator and parameters as plain data."""
    if band is not None:
        ends = [float(band[0]), float(band[1])]
        parameters["band"], band = ends, (min(ends), max(ends))
    parameters = {key: item.item() if isinstance(item, np.generic) else item for key, item in parameters.items()}
    return Excitation(value, fs, kind, band, {"generator": generator, "fs": float(fs), "kind": kind, **parameters})


Band = tuple[float, float]
MAX_SAMPLES = 2**31
BYTES_PER_SAMPLE = 48  # memory that making an excitation takes for each sample


def sample_count(duration: float, fs: float) -> int:
    """Return the number of samples, or refuse the duration or the rate."""
    require(0 < fs < np.inf, "fs", fs, "must be > 0 Hz")
    require(0 < duration < np.inf and duration * fs >= 1.5, "duration", duration, "must be two samples or more")
    require(duration * fs < MAX_SAMPLES, "duration", duration, f"must be less than {MAX_SAMPLES} samples of 1/fs")
    require_memory(BYTES_PER_SAMPLE * duration * fs, f"{duration:g} s at {fs:g} Hz", "take less, or blocks of it")
    return round(duration * fs)


def generator_of(seed: int | list[int]) -> np.random.Generator:
    """Return the random number generator of a seed, or refuse it."""
    is_whole = all(isinstance(part, Integral) and part >= 0 for part in (seed if isinstance(seed, list) else [seed]))
    require(is_whole, "seed", seed, "must be a whole number >= 0")
    return np.random.default_rng(seed)


def require_level(**levels: float) -> None:
    """Refuse levels, by name, that are negative or not finite."""
    for name, level in levels.items():
        require(0 <= level < np.inf, name, level, "must be >= 0")


def require_period(period: float, duration: float, fs: float) -> None:
    """Refuse a period, s, that is not between a sample and the duration."""
    require(1 / fs < period <= duration, "period", period, "must be more than a sample and at most the duration")


def require_band(band: Band, fs: float) -> Band:
    """Return both ends of a band, Hz, or refuse it."""
    low, high = band
    require(0 <= low < high, "band", band, "must be two rising frequencies in Hz")
    require(high <= fs / 2, "band", band, f"must end at or below fs / 2 = {fs / 2:g} Hz")
    return low, high


def require(condition: object, name: str, value: object, rule: str) -> None:
    """Refuse a value if a condition does not hold; the message is its name, the value and the rule."""
    if not condition:
        raise ExcitationError(f"{name} {value!r}: {rule}")


def lines_within_band(samples: int, fs: float, band: Band) -> np.ndarray:
    """Return the whole numbers of cycles in so many samples that lie within a band, Hz; never 0."""
    low, high = require_band(band, fs)
    slack = 1e-9 * samples
    first, last = np.ceil(low * samples / fs - slack), np.floor(high * samples / fs + slack)
    return np.arange(max(1, int(first)), int(last) + 1)
