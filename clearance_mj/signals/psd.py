"""Power spectral densities as standards and road or engine measurements state them, and Gaussian noise with them."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.checks import naming
from ..core.errors import ClearanceError, ExcitationError, RecordError
from ..core.files import read_lines
from ..core.overview import HasOverview, Overview
from .arrays import ArrayData, read_only
from .excitation_data import Band, generator_of, lines_within_band, require, require_level, sample_count

__all__ = ["PSD", "psd_noise"]

UNITS = {"base": "(m/s²)²/Hz", "force": "N²/Hz"}
FREQUENCY, VALUE = "frequency", "psd"  # columns of a file
EVEN = 10  # steps from which on a table may be one of evenly spaced lines
HOLE = 1.5  # of the step of evenly spaced lines, from which on a line is missing


@dataclass(frozen=True, eq=False, repr=False)
class PSD(HasOverview, ArrayData):
    """A one-sided power spectral density, stated at frequencies; zero outside of them.

    Between two frequencies it is a power law, a straight line over logarithms of both, as standards such as ISO 16750-3
    and MIL-STD-810 state breakpoints; where either value is zero, a straight line.

    Raises
    ------
    ExcitationError
        If there are fewer than two frequencies, they do not rise from above 0, one is missing among evenly spaced ones,
        or a value is negative or not finite.
    """

    frequency: np.ndarray
    """(n,) Hz, rising"""
    value: np.ndarray
    """(n,) (m/s²)²/Hz of kind "base", N²/Hz of kind "force" """
    kind: str = "base"
    """"base" (acceleration of the base) or "force" (at the shaker)"""
    description: dict[str, Any] = field(default_factory=dict)
    """where it comes from; plain data"""

    def __post_init__(self) -> None:
        frequency, value = read_only(self.frequency), read_only(self.value)
        if frequency.ndim != 1 or frequency.shape != value.shape or frequency.size < 2:
            shapes = f"{frequency.shape} and {value.shape}"
            raise ExcitationError(f"a PSD is two or more frequencies and as many values, got {shapes}")
        if self.kind not in UNITS:
            raise ExcitationError(f'kind "{self.kind}" is unknown; use "base" ((m/s²)²/Hz) or "force" (N²/Hz)')
        for name, numbers in (("frequency", frequency), ("value", value)):
            if not np.isfinite(numbers).all():
                raise ExcitationError(f"{name} {int(np.argmin(np.isfinite(numbers))) + 1} of the PSD is not finite")
        _require_rising(frequency)
        if (value < 0).any():
            i = int(np.argmax(value < 0))
            raise ExcitationError(f"the PSD is negative, {value[i]:g}, at {frequency[i]:g} Hz; it must be >= 0")
        if not value.any():
            raise ExcitationError("the PSD is zero at all frequencies; one value must be above 0")
        self._set(frequency=frequency, value=value)

    @classmethod
    def load(cls, path: str | PathLike[str], kind: str = "base") -> PSD:
        """Read a CSV file with a header ``frequency, psd``; lines that begin with # are comments.

        Parameters
        ----------
        path : str or Path
            The file: frequencies in Hz, values in (m/s²)²/Hz or N²/Hz.
        kind : str
            "base" or "force".

        Raises
        ------
        RecordError
            If the file cannot be read, has no such columns, or a cell that is no number; the message names the line.
        ExcitationError
            If its numbers are no PSD.
        """
        text = enumerate(read_lines(path), 1)
        lines = [(n, line) for n, line in text if line.strip() and line.lstrip()[0] != "#"]
        with naming(path, ClearanceError):
            return cls(*_columns(lines), kind, {"file": str(path)})

    @property
    def band(self) -> Band:
        """(2,) lowest and highest frequency, Hz."""
        return float(self.frequency[0]), float(self.frequency[-1])

    @property
    def rms(self) -> float:
        """Root mean square, m/s² or N: the square root of the area, exact for its power laws."""
        (f, f2), (s, s2) = (np.stack((x[:-1], x[1:])) for x in (self.frequency, self.value))
        area = (s + s2) * (f2 - f) / 2
        law = (s > 0) & (s2 > 0)
        f, f2, s, s2 = f[law], f2[law], s[law], s2[law]
        octave = np.log(f2 / f)
        grown = np.log(s2 / s) + octave  # of f S over the stretch: ∫ S df = f S (e^g - 1)/g · ln(f2/f)
        small = np.abs(grown) < 1e-9
        area[law] = f * s * octave * np.where(small, 1.0, np.expm1(grown) / np.where(small, 1.0, grown))
        return float(np.sqrt(area.sum()))

    def at(self, frequency: ArrayLike) -> np.ndarray:
        """Return the density at frequencies, (n,) Hz; zero outside of the band.

        Parameters
        ----------
        frequency : array_like
            Frequencies, Hz.
        """
        f = np.asarray(frequency, dtype=float)
        lower = np.clip(np.searchsorted(self.frequency, f, side="right") - 1, 0, self.frequency.size - 2)
        (f1, f2), (s1, s2) = ((x[lower], x[lower + 1]) for x in (self.frequency, self.value))
        law = (s1 > 0) & (s2 > 0)
        within = (f >= self.frequency[0]) & (f <= self.frequency[-1])
        fraction = np.log(np.where(within, f, f1) / f1) / np.log(f2 / f1)
        power = np.where(law, s1, 1.0) * (np.where(law, s2, 1.0) / np.where(law, s1, 1.0)) ** fraction
        return np.where(within, np.where(law, power, s1 + (s2 - s1) * (f - f1) / (f2 - f1)), 0.0)

    def scaled(self, rms: float) -> PSD:
        """Return the PSD of the same shape with another root mean square.

        Parameters
        ----------
        rms : float
            m/s² or N, above 0.
        """
        require_level(rms=rms)
        require(rms > 0, "rms", rms, "must be > 0")
        with np.errstate(over="ignore"):  # a value that is not finite is refused
            value = self.value * np.square(rms / self.rms)
        return replace(self, value=value, description=self.description | {"rms": float(rms)})

    def to_dict(self) -> dict[str, Any]:
        """Return frequencies, values, kind and description as plain data."""
        numbers = {"frequency": self.frequency.tolist(), "value": self.value.tolist()}
        return numbers | {"kind": self.kind, "description": self.description}

    def _overview(self) -> Overview:
        origin = {name: value for name, value in self.description.items() if isinstance(value, str | int | float)}
        facts = {
            "level": f"{self.rms:.4g} {'m/s²' if self.kind == 'base' else 'N'} RMS",
            "band": f"{self.band[0]:g} to {self.band[1]:g} Hz",
            "largest": f"{self.value.max():.4g} {UNITS[self.kind]} at {self.frequency[self.value.argmax()]:g} Hz",
            "from": ", ".join(f"{name} {value}" for name, value in origin.items()),
        }
        return Overview(f"PSD at {self.frequency.size} frequencies", facts)


def psd_noise(psd: PSD, duration: float, fs: float, seed: int | list[int]) -> np.ndarray:
    """Return Gaussian noise (n_t,) whose lines have independent normal parts of variance S Δf: the PSD on average."""
    size = sample_count(duration, fs)
    lines = lines_within_band(size, fs, psd.band)
    lines = lines[2 * lines < size]
    density = psd.at(np.clip(lines * fs / size, *psd.band))
    require(
        density.any(), "duration", duration, f"puts no line of {fs / size:g} Hz into the band {psd.band} of the PSD"
    )
    spectrum = np.zeros(size // 2 + 1, dtype=complex)
    parts = generator_of(seed).standard_normal((2, lines.size)).T @ (1, 1j)
    spectrum[lines] = size / 2 * np.sqrt(density * fs / size) * parts
    return np.fft.irfft(spectrum, size)


def _require_rising(frequency: np.ndarray) -> None:
    """Refuse frequencies that do not rise, and a hole among evenly spaced ones."""
    if frequency[0] <= 0:
        raise ExcitationError(f"the PSD begins at {frequency[0]:g} Hz; frequencies must be above 0, leave the line out")
    steps = np.diff(frequency)
    if (steps <= 0).any():
        i = int(np.argmax(steps <= 0))
        raise ExcitationError(
            f"the PSD's frequencies must rise: {frequency[i + 1]:g} Hz follows {frequency[i]:g} Hz (move one side of "
            "a step by a little)"
        )
    usual = np.median(steps)
    even = np.abs(steps - usual) < 0.01 * usual
    if steps.size >= EVEN and even.mean() >= 0.8 and steps.max() > HOLE * usual:
        i = int(steps.argmax())
        raise ExcitationError(
            f"the PSD has a hole from {frequency[i]:g} to {frequency[i + 1]:g} Hz, where its lines are {usual:g} Hz "
            "apart elsewhere; fill in the missing lines"
        )


def _columns(lines: list[tuple[int, str]]) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies and values of numbered lines, the first of which is the header."""
    rows = [(n, [cell.strip() for cell in row]) for (n, _), row in zip(lines, csv.reader(text for _, text in lines))]
    header = [cell.lower() for cell in rows[0][1]] if rows else []
    names = [cell.partition("[")[0].partition("(")[0].strip() for cell in header]
    for name in (FREQUENCY, VALUE):
        if name not in names:
            raise RecordError(f'needs a header with columns "{FREQUENCY}" and "{VALUE}", found {", ".join(header)!r}')
    indices = [names.index(name) for name in (FREQUENCY, VALUE)]
    numbers = np.empty((2, len(rows) - 1))
    for i, (number, row) in enumerate(rows[1:]):
        for column, index in enumerate(indices):
            try:
                numbers[column, i] = float(row[index])
            except (IndexError, ValueError):
                cell = row[index] if index < len(row) else ""
                raise RecordError(f'line {number}, column "{names[index]}": {cell!r} is not a number') from None
    return numbers[0], numbers[1]
