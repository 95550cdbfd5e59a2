"""Time functions as measurement programs store them, each with its name, unit, rate and start, as channels."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import plain_file
from ..core.notes import note
from .channels import Channel
from .columns import raw_header, resolve
from .gaps import GAPS, Samples, gapless_channels

__all__ = ["GAPS", "Program", "Waveform", "named_channels"]


@dataclass(frozen=True, eq=False)
class Waveform:
    """One time function of a file."""

    name: str
    unit: str  #: label in the file
    value: np.ndarray  #: (n,) in that unit
    fs: float  #: samples per second
    start: float  #: s, time of the first sample
    group: str = ""  #: of channels in the file


@dataclass(frozen=True)
class Program:
    """A package that reads and writes a format of measurement programs."""

    name: str  #: "npTDMS"
    module: str  #: that is imported
    format: str  #: "TDMS"
    extra: str  #: of this package that brings it

    def require(self) -> None:
        """Refuse if it is not installed."""
        if importlib.util.find_spec(self.module) is None:
            raise RecordError(f'{self.format} needs the package {self.name}: pip install "clearance-mj[{self.extra}]"')

    def read(
        self,
        path: str | PathLike[str],
        waves: Callable[[bytes, list[str]], Iterable[Waveform]],
        mapped: Mapping[str, str] | None,
    ) -> list[Channel]:
        """Return the channels of a file, whose waveforms ``waves`` finds in its bytes; notes say what is left out.

        Whatever the package raises of a damaged file becomes one line.
        """
        notes: list[str] = []
        with naming(path):
            self.require()
            try:
                found = list(waves(plain_file(path).read_bytes(), notes))
            except RecordError:
                raise
            except OSError as error:
                raise RecordError(error.strerror or str(error)) from None
            except Exception as error:
                reason = " ".join(str(error).split()) or type(error).__name__
                raise RecordError(f"not a whole {self.format} file: {reason}") from None
            channels = named_channels(found, mapped or {}, notes)
        note(path, notes)
        return channels

    def headers(self, path: str | PathLike[str], channels: Sequence[Channel]) -> list[tuple[str, str]]:
        """Return name and unit under which each channel is written; refuses none, and two of one name."""
        with naming(f"{path}: cannot be written"):
            self.require()
            if not channels:
                raise RecordError("there is no channel")
            headers = [raw_header(channel) for channel in channels]
            names = [name for name, _ in headers]
            if twice := next((name for name in names if names.count(name) > 1), None):
                raise RecordError(f'two channels would be "{twice}"; give each its own node, or write .uff')
        return headers


def named_channels(waves: Sequence[Waveform], mapped: Mapping[str, str], notes: list[str]) -> list[Channel]:
    """Return channels under their own names, or those that a map of names gives them.

    A name that several groups have gets its group before it; notes say so, and which rates there are.
    """
    if not waves:
        raise RecordError("holds no time records")
    names = [wave.name for wave in waves]
    headers = []
    for wave in waves:
        name = f"{wave.group}/{wave.name}" if names.count(wave.name) > 1 and wave.group else wave.name
        headers.append(f"{name} [{wave.unit}]" if wave.unit else name)
    used = resolve(headers, mapped, None, notes)
    if any(column.reference or column.quantity in ("time", "frequency") for column in used):
        raise RecordError("its columns are channels over time: needs names such as acc:1, no FRFs and no time")
    picked = [(c, waves[c.index]) for c in used]
    found = gapless_channels([Samples(c.name, w.value, w.fs, w.start, c.channel) for c, w in picked], notes)
    rates = {(c.fs, c.size) for c in found}
    if len(rates) > 1:
        counted = [f"{sum((c.fs, c.size) == rate for c in found)} at {rate[0]:.9g} Hz" for rate in sorted(rates)]
        notes.append(f"channels of several rates or lengths: {', '.join(counted)}")
    return found
