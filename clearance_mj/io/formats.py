"""Any file of time records, responses, FRFs, modes, rigs or laws, by its suffix: `clearance_mj.read` and `write`.

Each format is a file that registers itself, see `clearance_mj.io.registry`; those of the package are imported here.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from ..clearance.law import Law
from ..clearance.law_files import load_law
from ..core.checks import naming
from ..core.errors import RecordError
from ..core.notes import note
from ..rig import Rig
from ..signals.ema import Modes
from ..signals.frf import FRF
from ..signals.response import Response
from ..signals.spectra import Spectra
from ..structure.geometry import Geometry
from . import csv_tables, lvm, mat, mdf, results, sheets, tdms, uff
from .channel_map import ChannelMap
from .channels import NOWHERE, Channel, place_of
from .contents import FileContents, pick_part
from .dataset import BASE_NODE, SHAKER_NODE, Dataset, Record
from .record import Kind, Role
from .registry import FORMATS, OBJECT_NAMES, Format, format_of, register
from .time_axis import resample_channels

__all__ = [
    "FORMATS", "Contents", "Format", "driving_kind", "force_channels", "format_of", "read", "read_channels",
    "read_frf", "read_record", "register", "to_channels", "write",
]  # fmt: skip

BUILT_IN = (uff, csv_tables, mat, lvm, tdms, mdf, sheets, results)  # modules of the package that register formats
OPTIONS = {"columns": "names of columns are", "fs": "a sampling rate is", "units": "units are"}
Contents = list[Channel] | Response | FRF | Spectra | Modes | Geometry | Rig | Law | Dataset | FileContents  # of files
Columns = Mapping[str, str]


def read(
    path: str | PathLike[str], columns: Columns | None = None, fs: float | None = None, reference: str | None = None,
    what: str | None = None, units: str | None = None, resample: float | None = None,
) -> Contents:  # fmt: skip
    """Read a file in the format of its suffix, or a dataset folder.

    Parameters
    ----------
    path : str or Path
        The file or folder.
    columns : mapping of str to str, optional
        Channels by column of CSV and LVM files or variable of MATLAB files, see `clearance_mj.io.columns`.
    fs : float, optional
        Samples per second of a CSV or MATLAB file that does not say.
    reference : str, optional
        Reference, such as "5:+Z", to which FRFs are returned where a file has several.
    what : str, optional
        Part to return of a file that holds several: "channels", "frf", "spectra", "modes" or "geometry".
    units : str, optional
        Units of a universal file, whatever its data set 164 says: "SI", or length and force, such as "mm,N".
    resample : float, optional
        Samples per second to which all time records are brought, over the time common to all; those at uneven times
        are interpolated. A `RecordNote` says so.

    Returns
    -------
    list of Channel, Response, FRF, Spectra, Modes, Geometry, Rig, Law, Dataset or FileContents
        Data of the file: time records are channels, several kinds of data a `FileContents`, which lists them.

    Raises
    ------
    RecordError
        If the file cannot be used; the message names it and the place.
    """
    if Path(path).is_dir():
        return Dataset.load(Path(path))
    fmt = format_of(path)
    given = dict(columns=columns or None, fs=fs, reference=reference, units=units, resample=resample)
    options: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    for name in options.keys() - {*fmt.options, "reference", "resample"}:
        names = sorted({f.name for f in FORMATS.values() if name in f.options})
        raise RecordError(f"{path}: {OPTIONS[name]} for {', '.join(names)} files")
    obj = fmt.read(path, **{name: value for name, value in options.items() if name in fmt.options})
    with naming(path):
        if what is not None:
            obj = pick_part(obj, what)
        if resample is not None:
            obj = _resample(path, obj, resample)
        return obj if reference is None or not isinstance(obj, FRF) else obj.to_reference(reference)


def _resample(path: str | PathLike[str], obj: Contents, rate: float) -> Contents:
    """Return a file's data with its time records resampled to one rate."""
    notes: list[str] = []
    if isinstance(obj, FileContents) and obj.channels:
        obj = dataclasses.replace(obj, channels=tuple(resample_channels(obj.channels, rate, notes)))
    elif isinstance(obj, list):
        obj = resample_channels(obj, rate, notes)
    else:
        raise RecordError(f"holds {_words(obj)}; only time records are resampled")
    note(path, notes)
    return obj


def _kind(obj: object) -> type:
    """Return the key of `OBJECT_NAMES`, or the type of an object that no file holds."""
    if isinstance(obj, list | tuple) and all(isinstance(item, Channel) for item in obj):
        return Channel
    return next((kind for kind in OBJECT_NAMES if isinstance(obj, kind)), type(obj))


def _words(obj: object) -> str:
    return OBJECT_NAMES.get(_kind(obj), "a dataset")


def read_channels(
    path: str | PathLike[str], columns: Columns | None = None, fs: float | None = None, rig: Rig | None = None,
    units: str | None = None, channel_map: ChannelMap | None = None, resample: float | None = None,
) -> list[Channel]:  # fmt: skip
    """Read a file of time records and apply a map of channels to it.

    ``rig`` says at which nodes the displacements of a simulated response are; the rest as `read` takes it.
    """
    obj = read(path, columns, fs, units=units, resample=resample)
    if isinstance(obj, FileContents):
        with naming(path):
            obj = pick_part(obj, "channels")
    if isinstance(obj, Response):
        return to_channels(obj, rig)
    if not isinstance(obj, list):
        raise RecordError(f"{path}: holds {_words(obj)}, needs time records")
    with naming(path):
        return channel_map.apply(obj) if channel_map else obj


def read_record(
    path: str | PathLike[str], rig: Rig, role: Role, columns: Columns | None = None, fs: float | None = None,
    units: str | None = None, channel_map: ChannelMap | None = None, resample: float | None = None,
    kind: Kind | None = None, **described: Any,
) -> Record:  # fmt: skip
    """Read a file with the time records of one test on a rig, which is named after the file.

    ``columns``, ``fs``, ``units``, ``channel_map`` and ``resample`` as `read_channels` takes them; ``kind`` of
    excitation, by default "spin" of orbits, else that of the rig's shaker, or the other input if that alone was
    recorded; ``described``: description, level, seed, band, spin of `Record`.
    """
    path = Path(path)
    channels = read_channels(path, columns, fs, rig, units, channel_map, resample)
    stem = Path(path.stem).stem if path.suffix.lower() == ".gz" else path.stem
    name = re.sub(r"[^A-Za-z0-9._-]", "_", stem)[:64].lstrip("._-") or "record"
    origin = {"file": path.name}
    with naming(path):
        drive = kind or ("spin" if role == "orbit" else driving_kind(channels, rig))
        return Record(name, role, rig, channels[0].fs, channels, drive, provenance=origin, **described)


def driving_kind(channels: Sequence[Channel], rig: Rig) -> Kind:
    """Return the kind of excitation of a test: the rig's shaker's, or the other if that alone was recorded.

    Parameters
    ----------
    channels : sequence of Channel
        Channels that were recorded.
    rig : Rig
        The rig; its shaker says where a force acts.
    """
    recorded = {(c.node, c.quantity) for c in channels}
    if rig.shaker.kind == "force":
        return "force" if (SHAKER_NODE, "force") in recorded or (BASE_NODE, "acceleration") not in recorded else "base"
    if (BASE_NODE, "acceleration") in recorded or (SHAKER_NODE, "force") not in recorded:
        return "base"
    if rig.shaker.position is None:
        raise RecordError("a force drives this record, and the rig does not say where: give [shaker] its position")
    return "force"


def read_frf(
    path: str | PathLike[str], columns: Columns | None = None, reference: str | None = None, what: str = "frf",
    units: str | None = None,
) -> FRF:  # fmt: skip
    """Read a file of FRFs to one or several references.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : mapping of str to str, optional
        As `read` takes it.
    reference : str, optional
        As `read` takes it.
    what : str
        Which FRFs of a file that has several, such as "frf 2".
    units : str, optional
        As `read` takes it.

    Raises
    ------
    RecordError
        As `read`, and if the file holds something else, or no FRFs to the reference.
    """
    obj = read(path, columns, reference=reference, units=units)
    if isinstance(obj, FileContents):
        with naming(path):
            obj = pick_part(obj, what)
    if isinstance(obj, FRF):
        return obj
    hint = "; clearance-mj convert --frf makes them of records" if isinstance(obj, list | Response) else ""
    hint = "; signals.frf_from_spectra makes them of auto and cross spectra" if isinstance(obj, Spectra) else hint
    raise RecordError(f"{path}: holds {_words(obj)}, needs FRFs{hint}")


def write(path: str | PathLike[str], obj: object, rig: Rig | None = None) -> None:
    """Write time records, a response, FRFs, spectra, modes, a geometry, a rig or a law in the format of the suffix.

    Parameters
    ----------
    path : str or Path
        The file; an existing one is replaced once the new one is whole.
    obj : list of Channel, Response, FRF, Spectra, Modes, Geometry, FileContents, Rig or Law
        A format without responses gets the channels of one; a format with a single kind of data gets the one part of
        several that it can hold, if there is just one.
    rig : Rig, optional
        Rig whose nodes are written too where the format has a place for them, see `clearance_mj.write_uff`.

    Raises
    ------
    RecordError
        If the suffix is unknown or the format cannot hold the object.
    """
    fmt = format_of(path)
    if Path(path).suffix.lower() == ".gz":
        raise RecordError(f"{path}: compressed files are read, not written")
    if isinstance(obj, Response) and Response not in fmt.holds and Channel in fmt.holds:
        obj = [*to_channels(obj, rig), *force_channels(obj, rig)]
    holds_all = isinstance(obj, FileContents) and fmt.geometry
    if isinstance(obj, FileContents) and not holds_all:
        fitting = {name: part for name, part in obj.parts.items() if _kind(part) in fmt.holds}
        if len(fitting) != 1:
            names = ", ".join(f'"{name}"' for name in fitting) or f"none of {', '.join(obj.parts)}"
            raise RecordError(f"{path}: {fmt.name} files take one of {names}; choose it (what=, --what)")
        (obj,) = fitting.values()
    if fmt.write is None or not (holds_all or _kind(obj) in fmt.holds):
        suffixes = [suffix for suffix, f in FORMATS.items() if f.write and _kind(obj) in f.holds]
        remedy = f"; use {', '.join(suffixes)}" if suffixes else ""
        kind = OBJECT_NAMES.get(_kind(obj), type(obj).__name__)
        raise RecordError(f"{path}: {fmt.name} files cannot take {kind}{remedy}")
    if isinstance(obj, FRF) and obj.window_rate and fmt.name in ("CSV", "MATLAB"):
        note(path, [f"has no place for the exponential window of the FRFs, {obj.window_rate:.4g} 1/s; .uff has"])
    fmt.write(path, obj, *([rig] if fmt.geometry else []))


def to_channels(response: Response, rig: Rig | None = None) -> list[Channel]:
    """Return the channels of a response: excitation, sensors' signals and, with a rig, displacements in clearances.

    Contact and grease forces are not among them, see `force_channels`: nothing measures them.
    """
    inputs = zip(response.references, response.kinds, response.inputs)
    columns = [(f"excitation {dof}" * bool(i) or "excitation", dof, {"base": "acceleration"}.get(k, k), value)
               for i, (dof, k, value) in enumerate(inputs)]  # fmt: skip
    labels = response.responses or tuple(f"{i + 1}:+Z" for i in range(len(response.channels)))
    rows = zip(labels, response.quantities, response.channels)
    columns += [(f"{quantity} {dof}", dof, quantity, value) for dof, quantity, value in rows]
    if rig and response.displacement is not None:
        probes = zip(rig.probe_labels, response.displacement)
        columns += [(f"displacement {dof}", dof, "displacement", value) for dof, value in probes]
    return [Channel(name, *place_of(dof), quantity, value, response.fs) for name, dof, quantity, value in columns]


def force_channels(response: Response, rig: Rig | None = None) -> list[Channel]:
    """Return contact and grease forces as channels without a node, which no calculation uses: "contact force 6:+Z", N.

    Without a rig they are numbered.
    """
    channels = []
    for name in ("contact_force", "grease_force"):
        force = getattr(response, name)
        rows = () if force is None else force
        for label, row in zip(rig.probe_labels if rig else range(1, len(rows) + 1), rows):
            channels.append(Channel(f"{name.replace('_', ' ')} {label}", *NOWHERE, "force", row, response.fs))
    return channels


register(Format("TOML", (".toml",), (Rig,), Rig.load, lambda path, rig: rig.save(path), note="a rig"))
register(Format("JSON", (".json",), (Law,), load_law, lambda path, law: law.save(path), note="a law"))
