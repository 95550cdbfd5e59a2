"""Any file of time records or FRFs, by its suffix.

A format is one entry of `FORMATS`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..errors import RecordError
from ..rig import Rig
from ..signals.ema import Modes
from ..signals.frf import FRF
from ..signals.response import Response
from . import results
from .csv_tables import read_csv, write_csv
from .dataset import Record, bushing_nodes
from .mat import read_mat, write_mat
from .uff import Channel, read_uff, write_uff

__all__ = [
    "FORMATS",
    "format_of",
    "read",
    "read_channels",
    "read_frf",
    "read_record",
    "to_channels",
    "write",
]


@dataclass(frozen=True)
class Format:
    """How files of one kind are read and written."""

    name: str
    read: Callable
    """path [, columns, fs] -> list of Channel, FRF, Response or Modes"""
    write: Callable
    """path, object [, rig]"""
    table: bool = False
    """whether its columns can be mapped"""
    geometry: bool = False
    """whether it holds the nodes of a rig"""


_CSV, _UFF = Format("CSV", read_csv, write_csv, table=True), Format("UFF", read_uff, write_uff, geometry=True)
_MAT, _NETCDF = Format("MATLAB", read_mat, write_mat, table=True), Format("NetCDF", results.load, results.save)
FORMATS = {
    **dict.fromkeys((".uff", ".unv", ".uf"), _UFF),
    **dict.fromkeys((".csv", ".tsv", ".txt"), _CSV),
    ".mat": _MAT,
    **dict.fromkeys((".nc", ".h5", ".hdf5"), _NETCDF),
}
"""By suffix"""
_PLAIN = (".wav", ".wave", ".flac", ".aif", ".aiff", ".ogg", ".mp3", ".npy", ".npz", ".bin", ".raw", ".dat", ".pcm")
"""Suffixes of plain time series"""


def format_of(path) -> Format:
    """How a file is read and written.

    Parameters
    ----------
    path : str or Path
        Its suffix decides; .gz is passed over.

    Raises
    ------
    RecordError
        If the suffix is unknown, or that of a plain time series, which knows neither units nor channels.
    """
    path = Path(path)
    suffix = Path(path.stem if path.suffix.lower() == ".gz" else path.name).suffix.lower()
    if suffix in _PLAIN:
        raise RecordError(
            f"{path}: a {suffix} file does not say what its samples are, in which unit and at which node; save them as "
            'CSV with a header such as "time,base [g],acc:1 [g]", or as .mat'
        )
    if suffix not in FORMATS:
        raise RecordError(f'{path}: suffix "{suffix}" is unknown; use {", ".join(FORMATS)}')
    return FORMATS[suffix]


def read(path, columns: Mapping[str, str] | None = None, fs: float | None = None):
    """Read a file of time records, FRFs or modes.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : mapping of str to str, optional
        What columns of CSV and variables of MATLAB files are, see `clearance_mj.io.columns`.
    fs : float, optional
        Samples per second of a CSV or MATLAB file that does not say.

    Returns
    -------
    list of Channel, FRF, Response or Modes

    Raises
    ------
    RecordError
        If the file cannot be used; the message names it and the place.
    """
    kind = format_of(path)
    if kind.table:
        return kind.read(path, columns, fs)
    if columns or fs is not None:
        raise RecordError(f"{path}: names of columns and a sampling rate are for CSV and MATLAB files")
    return kind.read(path)


def read_channels(
    path, columns: Mapping[str, str] | None = None, fs: float | None = None, rig: Rig | None = None
) -> list[Channel]:
    """Read a file of time records.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : mapping of str to str, optional
        As `read` takes it.
    fs : float, optional
        As `read` takes it.
    rig : Rig, optional
        Says at which nodes the displacements of a simulated response are.

    Returns
    -------
    list of Channel

    Raises
    ------
    RecordError
        As `read`, and if the file holds something else.
    """
    obj = read(path, columns, fs)
    if isinstance(obj, Response):
        return to_channels(obj, rig)
    if not isinstance(obj, list):
        raise RecordError(f"{path}: holds {_WORDS[type(obj)]}, needs time records")
    return obj


def read_record(
    path,
    rig: Rig,
    role: str,
    columns: Mapping[str, str] | None = None,
    fs: float | None = None,
    **described,
) -> Record:
    """Read a file with the time records of one test on a rig.

    Parameters
    ----------
    path : str or Path
        The file; the record is named after it.
    rig : Rig
        The rig; its shaker says what drove it.
    role : str
        "identify" or "validate".
    columns : mapping of str to str, optional
        As `read` takes it.
    fs : float, optional
        As `read` takes it.
    **described
        Further fields of `Record`: description, level, seed, band.

    Returns
    -------
    Record

    Raises
    ------
    RecordError
        As `read_channels`, and if the channels do not fit the rig.
    """
    path = Path(path)
    channels = read_channels(path, columns, fs, rig)
    name = re.sub(r"[^A-Za-z0-9._-]", "_", path.name.split(".")[0])[:64].lstrip("._-") or "record"
    origin = {"file": path.name}
    try:
        return Record(name, role, rig, channels[0].fs, channels, rig.shaker.kind, provenance=origin, **described)
    except RecordError as error:
        raise RecordError(f"{path}: {error}") from None


def read_frf(path, columns: Mapping[str, str] | None = None, reference: str | None = None) -> FRF:
    """Read a file of FRFs to one or several references.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : mapping of str to str, optional
        As `read` takes it.
    reference : str, optional
        Return those to this one only, such as "5:+Z".

    Returns
    -------
    FRF

    Raises
    ------
    RecordError
        As `read`, and if the file holds something else, or no FRFs to the reference.
    """
    kind = format_of(path)
    obj = read_uff(path, reference) if kind is _UFF and not columns else read(path, columns)
    if not isinstance(obj, FRF):
        hint = "" if isinstance(obj, Modes) else "; clearance-mj convert --frf makes them of records"
        raise RecordError(f"{path}: holds {_WORDS[type(obj)]}, needs FRFs{hint}")
    try:
        return obj.to_reference(reference) if reference else obj
    except RecordError as error:
        raise RecordError(f"{path}: {error}") from None


_WORDS = {list: "time records", Response: "time records", FRF: "FRFs", Modes: "modes"}


def write(path, obj, rig: Rig | None = None):
    """Write time records, FRFs or modes in the format of the suffix.

    Parameters
    ----------
    path : str or Path
        The file; an existing one is replaced once the new one is whole.
    obj : list of Channel, FRF, Response or Modes
        A response is written to NetCDF as it is, to other formats as the channels that it amounts to; modes to UFF.
    rig : Rig, optional
        Its nodes are written too where the format has a place for them, see `write_uff`.

    Raises
    ------
    RecordError
        If the suffix is unknown or the format cannot hold the object.
    """
    kind = format_of(path)
    if Path(path).suffix.lower() == ".gz":
        raise RecordError(f"{path}: compressed files are read, not written")
    if isinstance(obj, Modes) and kind is not _UFF:
        raise RecordError(f"{path}: modes are written to universal files (.uff) only")
    if isinstance(obj, Response) and kind is not _NETCDF:
        obj = to_channels(obj, rig)
    if kind.geometry:
        kind.write(path, obj, rig)
    else:
        kind.write(path, obj)


def to_channels(response: Response, rig: Rig | None = None) -> list[Channel]:
    """Channels of a response: excitation, accelerations and, with a rig, displacements at the bushings' sensors.

    Contact and grease forces are not among them: nothing measures them.

    Parameters
    ----------
    response : Response
        The time histories.
    rig : Rig, optional
        Says at which nodes the displacements are; without it they are left out.

    Returns
    -------
    list of Channel
    """
    quantity = {"base": "acceleration", "force": "force"}[response.kind]
    columns = [("excitation", response.reference, quantity, response.excitation)]
    labels = response.responses or tuple(f"{i + 1}:+Z" for i in range(len(response.acceleration)))
    columns += [(f"acceleration {dof}", dof, "acceleration", a) for dof, a in zip(labels, response.acceleration)]
    if rig and response.displacement is not None:
        for node, value in zip(bushing_nodes(rig), response.displacement):
            if node is not None:
                columns.append((f"displacement {node}:+Z", f"{node}:+Z", "displacement", value))
    return [
        Channel(name, int(dof.split(":")[0]), dof.split(":")[1], quantity, value, response.fs)
        for name, dof, quantity, value in columns
    ]
