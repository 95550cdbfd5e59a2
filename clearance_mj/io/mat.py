"""Time records and FRFs in MATLAB files (.mat, version 5 to 7).

Variables are the columns of `clearance_mj.io.columns`: a vector is one column, named after its channel with an
underscore for the colon (``acc_3``) or mapped; a matrix has one column after another, ``data:1``, ``data:2``, .... A
scalar ``fs`` is the sampling rate. A cell array ``columns`` names the columns of ``data`` or of ``frf`` and
``coherence``: so the files are that are written here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np
import scipy.io

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import read_bytes, replacing
from ..core.matlab import Value, arrays
from ..core.notes import note
from ..signals.frf import FRF
from .channels import Channel
from .columns import ColumnHeader, Columns, Contents, frf_names, frf_of_columns, quoted, resolve, table_of_channels
from .containers import waveforms
from .gaps import gapless_channels
from .registry import Format, register
from .tables.headers import is_time
from .time_axis import Rate, Rates, TimeAxis, instants_in_seconds, time_axis
from .waveforms import channels_of_waveforms

__all__ = ["read_mat", "read_variables", "write_mat"]

_CHANNEL = re.compile(r"(acc|vel|disp|force)_(\d+)")
_NAMED = ("data", "frf", "coherence")  # matrices whose columns the cell array names


def read_mat(path: str | PathLike[str], columns: Columns = None, fs: Rate = None, resample: Rate = None) -> Contents:
    """Read the time records or the FRFs (of a file with frequencies) of a MATLAB file, saved as version 5 to 7.

    ``columns`` gives channel and, if it is not SI, unit of a variable: ``{"a": "acc:1 [g]", "data:3": "base", "T":
    "skip"}``; others are named after their channel. Text, structures and scalars are passed over. ``fs`` (Hz) is of a
    file without the variable ``time`` or ``fs``, ``resample`` (Hz) has samples at uneven times interpolated.
    """
    variables, rates = read_variables(path), Rates(fs, resample, [])
    with naming(path):
        contents = _contents(variables, columns or {}, rates)
    note(path, rates.notes)
    return contents


def write_mat(path: str | PathLike[str], obj: Contents) -> None:
    """Write time records or FRFs as a MATLAB file of version 5, in SI units.

    Channels of one rate, length and start: ``data`` (n_t, n), ``time``, ``fs``. An FRF: ``frf`` (n_f, n) complex,
    ``coherence``, ``frequency`` in Hz. ``columns`` names the columns of either.
    """
    with naming(f"{path}: cannot be written"):
        variables = _frf_variables(obj) if isinstance(obj, FRF) else _record_variables(obj)
    with replacing(path) as temporary, temporary.open("wb") as file:
        scipy.io.savemat(file, variables, do_compression=True, oned_as="column")


def _record_variables(channels: Sequence[Channel]) -> dict[str, Any]:
    headers, numbers = table_of_channels(channels)
    return {"time": channels[0].time, "fs": channels[0].fs, "data": numbers, "columns": np.array(headers, dtype=object)}


def _frf_variables(frf: FRF) -> dict[str, Any]:
    frfs = [frf.to_reference(reference) for reference in frf.references]
    names = [f"{name} [{unit}]" for pair in map(frf_names, frfs) for name, unit in zip(*pair)]
    variables = {"frequency": frf.frequency, "frf": np.concatenate([frf.functions for frf in frfs]).T}
    variables["columns"] = np.array(names, dtype=object)
    coherence = [frf.coherence[:, 0] for frf in frfs if frf.coherence is not None]
    if coherence and len(coherence) < len(frfs):
        raise RecordError("only some references have a coherence; a MATLAB table needs all or none, .csv does not")
    if coherence:
        variables["coherence"] = np.concatenate(coherence).T
    return variables


def read_variables(path: str | PathLike[str]) -> dict[str, Value]:
    """Return the variables of a file, read by `matlab.arrays`; a RecordError names the file if it cannot be read."""
    data = read_bytes(path)
    if data[124:128] in (b"\x00\x02IM", b"\x02\x00MI"):
        raise RecordError(
            f"{path}: is a MATLAB file of version 7.3, which is not read; save it in MATLAB with "
            "save(file, '-v7'), or write CSV"
        )
    with naming(f"{path}: not a whole MATLAB file", (RecordError, ValueError), RecordError):  # a shape beyond numpy's
        return arrays(data)


def _contents(variables: Mapping[str, Value], mapped: Mapping[str, str], rates: Rates) -> Contents:
    table = dict(_vectors(variables))
    is_plain = not {"time", "fs", "columns"}.isdisjoint((*variables, *mapped.values())) or any(map(is_time, table))
    if not is_plain and any(isinstance(value, dict | list) for value in variables.values()):
        if waves := [*waveforms(variables, rates.notes)]:
            return channels_of_waveforms(waves, mapped, rates)
    if not table:
        raise RecordError(
            "holds no numeric vectors or matrices; save plain variables, or structures with fields such as data, dt "
            "(s) or fs (Hz), unit and name"
        )
    columns = resolve([*table], mapped)
    vectors = list(table.values())
    values = [vectors[c.index] for c in columns]
    is_frf = any(c.reference for c in columns)
    for column, value in zip(columns, values):
        if value.size != values[0].size:
            raise RecordError(
                f'variable "{column.name}" has {value.size} numbers, "{columns[0].name}" has {values[0].size}'
            )
        if np.iscomplexobj(value) and (not column.reference or column.part):
            raise RecordError(f'variable "{column.name}" is complex; needs real numbers')
        if is_frf and not np.isfinite(value).all():
            raise RecordError(f'variable "{column.name}": number {np.argmin(np.isfinite(value)) + 1} is not finite')
    if is_frf:
        return frf_of_columns(columns, values)
    axis = _timing(columns, values, rates, variables.get("fs"))
    parts = [c.samples(axis, v) for c, v in zip(columns, values) if c.quantity != "time"]
    return gapless_channels(parts, rates.notes)


def _vectors(variables: Mapping[str, Value]) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and numbers of each column."""
    names = _names(variables.get("columns"))
    for name, value in variables.items():
        if not isinstance(value, np.ndarray):
            continue
        if not name.isidentifier():
            raise RecordError(f"holds a variable with the impossible name {name!r}")
        if value.ndim != 2 or value.size < 2:
            continue
        value = value.T if value.shape[0] < value.shape[1] else value
        if name in _NAMED and names:
            if len(names) != value.shape[1]:
                raise RecordError(f'"columns" names {len(names)} columns, "{name}" has {value.shape[1]}')
            suffix = " coherence" if name == "coherence" else ""
            headers = [n.split(" [")[0] + suffix if suffix else n for n in names]
        elif value.shape[1] == 1:
            headers = [_CHANNEL.sub(r"\1:\2", name)]
        else:
            headers = [f"{name}:{i}" for i in range(1, value.shape[1] + 1)]
        yield from zip(headers, value.T)


def _names(cells: Value) -> list[str]:
    """Return the strings of a cell array."""
    if not isinstance(cells, list):
        return []
    return ["".join(c if c.isprintable() else " " for c in str(name)) for name in cells]


def _timing(used: list[ColumnHeader], values: list[np.ndarray], rates: Rates, stored: Value) -> TimeAxis:
    """Return the instants of the samples."""
    if not (times := [(c, value) for c, value in zip(used, values) if c.quantity == "time"]):
        if rates.fs is not None:
            return TimeAxis(rates.fs)
        if stored is None:
            raise RecordError(
                f'has no variable "time" or "fs", only {quoted(c.name for c in used)}; map one to time, or '
                "give the sampling rate"
            )
        if not isinstance(stored, np.ndarray) or stored.size != 1 or np.iscomplexobj(stored):
            raise RecordError('variable "fs" must be one number, the samples per second')
        return TimeAxis(float(stored.item()))
    if len(times) > 1 or rates.fs is not None:
        raise RecordError("has a variable of time; needs just one, and then no sampling rate beside it")
    ((column, value),) = times
    time, _ = instants_in_seconds(value, column.scale, column.name, rates.notes, column.unit)
    return time_axis(time, 1e-15, rates)


register(Format(
    "MATLAB", (".mat",), (Channel, FRF), read_mat, write_mat, options=("columns", "fs", "resample"),
    note="version 5 to 7, not 7.3 (`save(file, '-v7')`)",
))  # fmt: skip
