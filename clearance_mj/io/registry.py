"""File formats by their suffixes. A format is one file that ends in `register`; `formats` reads and writes them all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from ..clearance.law import Law
from ..core.errors import RecordError
from ..rig import Rig
from ..signals.ema import Modes
from ..signals.frf import FRF
from ..signals.response import Response
from ..signals.spectra import Spectra
from ..structure.geometry import Geometry
from .channels import Channel

__all__ = ["FORMATS", "OBJECT_NAMES", "Format", "format_of", "register"]

# Objects of files; time records are lists of channels
OBJECT_NAMES: dict[type, str] = {
    Channel: "time records", Response: "responses", FRF: "FRFs", Spectra: "spectra", Modes: "modes",
    Geometry: "a geometry", Rig: "a rig", Law: "a law",
}  # fmt: skip
_PLAIN = (".wav", ".wave", ".flac", ".aif", ".aiff", ".ogg", ".mp3", ".npy", ".npz", ".bin", ".raw", ".dat", ".pcm")
"""Suffixes of plain time series."""


@dataclass(frozen=True)
class Format:
    """Format of files: its suffixes, the objects that it holds, and how they are read and written."""

    name: str  #: in messages and in the table of docs/files.md
    suffixes: tuple[str, ...]  #: such as (".uff", ".unv"), in lower case
    #: keys of `OBJECT_NAMES`; a format that does not hold `Response` writes one as its channels
    holds: tuple[type, ...]
    read: Callable[..., Any]  #: path, and the options as keywords -> an object, see `OBJECT_NAMES`
    write: Callable[..., None] | None = None
    """path, object; with geometry: path, object, rig. None: the format is read only"""
    options: tuple[str, ...] = ()
    """options of ``read``: "columns" and "fs" (see `clearance_mj.io.columns`), "resample", "reference" (of FRFs),
    "units" (of universal files)"""
    geometry: bool = False  #: True if it has a place for the nodes of a rig
    note: str = ""  #: for the table of docs/files.md


FORMATS: dict[str, Format] = {}  # Formats by suffix.


def register(new: Format) -> Format:
    """Register a format with `clearance_mj.read`, `clearance_mj.write`, the command line and the fuzzer.

    Parameters
    ----------
    new : Format
        The format.

    Raises
    ------
    RecordError
        If another format has one of its suffixes, or it holds an unknown type.
    """
    for suffix in new.suffixes:
        if (other := FORMATS.get(suffix)) and other.name != new.name:
            raise RecordError(f'format "{new.name}": suffix "{suffix}" is that of {other.name}')
    if unknown := [kind for kind in new.holds if kind not in OBJECT_NAMES]:
        known = ", ".join(kind.__name__ for kind in OBJECT_NAMES)
        raise RecordError(f'format "{new.name}" holds {unknown[0].__name__}; use {known}')
    FORMATS.update(dict.fromkeys(new.suffixes, new))
    return new


def format_of(path: str | PathLike[str]) -> Format:
    """Return the format of a file by its suffix; .gz is passed over."""
    path = Path(path)
    suffix = Path(path.stem if path.suffix.lower() == ".gz" else path.name).suffix.lower()
    if suffix in _PLAIN:
        raise RecordError(
            f"{path}: a {suffix} file does not say what its samples are, in which unit and at which node; save them as "
            'CSV with a header such as "time,base [g],acc:1 [g]", or as .mat'
        )
    RecordError.require_known(f"{path}: suffix", suffix, FORMATS)
    return FORMATS[suffix]
