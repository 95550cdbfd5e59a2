"""Channels in nested fields: structures of MATLAB, groups of HDF5 and netCDF-4, the dictionaries of SEP 005.

Programs store a channel as numbers next to fields with its name, unit and sampling interval or rate, or times; fields
of a level hold for those below it. Known are the fields of Simcenter (``x_values.increment``, ``y_values.values``),
B&K (``File_Header``, ``Channel_1_Header``, ``Channel_1_Data``), Rattlesnake (``time_data``, ``channels``) and SEP 005
(``data``, ``fs``, ``name``, ``unit_str``; sdypy's), and others that are named as these are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.checks import DIRECTIONS, simplest_rate
from ..core.notes import note
from ..core.units import quantity_of
from .channels import Channel
from .columns import channel_name, written_header
from .tables.headers import is_time
from .time_axis import Rates
from .waveforms import Waveform, channels_of_waveforms

if TYPE_CHECKING:
    import h5py

__all__ = ["fields_of_hdf5", "from_sep005", "to_sep005", "waveforms"]

_KEYS = {
    "step": "increment dt delta deltat deltax xdelta samplinginterval sampleinterval samplingperiod sampleperiod "
    "sampletime interval timestep xincrement wfincrement",
    "rate": "fs samplerate samplingrate samplefrequency samplingfrequency rate fsample samplespersecond frequency",
    "start": "startvalue start t0 x0 starttime wfstartoffset",
    "unit": "unit units label unitstr yunit unitlabel unitstring unitdescription engineeringunit engineeringunits",
    "name": "name channelname signalname title description comment",
    "node": "nodenumber",
    "direction": "nodedirection",
}
"""Names of fields, in lower case without marks"""
_MEANING = {key: meaning for meaning, keys in _KEYS.items() for key in keys.split()}
_NUMBERS = re.compile(r"(?:y_?)?(?:data|values?|samples)|time_data|signal|y", re.IGNORECASE)  # names of no channel
_LEAST = 4  # samples of a channel
Fields = Mapping[str, Any]


def waveforms(fields: Fields, notes: list[str], name: str = "", above: Fields | None = None) -> Iterator[Waveform]:
    """Return the channels in nested fields; ``above`` is the metadata of the levels above."""
    metadata = {**(above or {}), **_metadata(fields)}
    arrays = {key: np.asarray(value) for key, value in fields.items() if _is_array(value)}
    longest = max((max(array.shape) for array in arrays.values()), default=0)
    times = [key for key, array in arrays.items() if is_time(key) and array.size == longest]
    for key, array in arrays.items():
        if key in times or max(array.shape) != longest:
            continue
        merged = metadata | _metadata(fields.get(_header(key), {}))
        if times and "step" not in merged:
            unit = str(_metadata(fields.get(_header(times[0]), {})).get("unit", ""))
            merged["time"] = np.ravel(arrays[times[0]]) * (quantity_of(unit, ["time"]) or ("", 1.0))[1]
        yield from _columns(array, name if _NUMBERS.fullmatch(key) and name else key, merged, notes)
    for key, value in fields.items():
        below = value if isinstance(value, list | tuple) else [value]
        for i, item in enumerate(below, 1):
            if isinstance(item, Mapping) and "time_data" not in fields:
                label = f"{key}:{i}" if len(below) > 1 else key
                yield from waveforms(item, notes, name if _NUMBERS.fullmatch(key) and name else label, metadata)


def _header(key: str) -> str:
    """Return the key of the fields that describe the numbers under a key."""
    return f"{key.removesuffix('Data')}Header"


def _is_array(value: Any) -> bool:
    kind = getattr(value, "dtype", np.dtype(object)).kind
    return kind in "iufc" and 1 <= value.ndim <= 2 and max(value.shape) >= _LEAST


def _has_array(value: Any) -> bool:
    return _is_array(value) or (isinstance(value, Mapping) and any(map(_has_array, value.values())))


def _metadata(fields: Fields) -> dict[str, Any]:
    """Return the metadata in fields by its meaning, that of nested fields without channels included if it agrees."""
    level: dict[str, Any] = {}
    below: dict[str, Any] = {}
    headers = {_header(key) for key in fields}
    for key, value in fields.items():
        if isinstance(value, Mapping) and key not in headers and not _has_array(value):
            nested = _metadata(value)
            if "step" in nested and "unit" in nested:
                nested["axis"] = nested.pop("unit")
            below |= {meaning: v if below.get(meaning, v) == v else None for meaning, v in nested.items()}
        elif meaning := _MEANING.get(re.sub(r"[\W_]", "", key.lower())):
            plain = value.ravel().tolist() if isinstance(value, np.ndarray) else value
            level.setdefault(meaning, plain[0] if isinstance(plain, list) and len(plain) == 1 else plain)
    return {meaning: value for meaning, value in (below | level).items() if value is not None}


def _columns(array: np.ndarray, name: str, metadata: Fields, notes: list[str]) -> Iterator[Waveform]:
    """Return the channels of numbers (n,), (n, n_channels) or (n_channels, n)."""
    axis = quantity_of(str(metadata.get("axis") or "s"), ["time"])
    if axis is None or array.dtype.kind == "c":
        words = "complex" if axis else f"over {metadata['axis']}"
        notes.append(f'left out "{name}", which is {words}, no time record')
        return
    start, time, rate = _number(metadata.get("start")) * axis[1], None, _number(metadata.get("rate")) or None
    if step := _number(metadata.get("step")) * axis[1]:
        rate = simplest_rate(step, 1e-12 * step)
    elif "time" in metadata:
        start, time, rate = 0.0, np.asarray(metadata["time"], float), None
    rows = np.atleast_2d(array if array.ndim == 1 or array.shape[0] < array.shape[1] else array.T)
    for i, value in enumerate(rows):
        meanings = ("unit", "name", "node", "direction")
        unit, label, node, direction = (_channel_text(metadata.get(meaning), i, len(rows)) for meaning in meanings)
        label = name if not label or is_time(label) else label
        label = label if len(rows) == 1 or isinstance(metadata.get("name"), list) else f"{label}:{i + 1}"
        dof = f"{node}:{(direction[-1:] + direction[:-1]) or 'S'}"
        measure = quantity_of(unit)
        if measure and node.isdecimal() and dof.partition(":")[2] in DIRECTIONS:
            label = channel_name(dof, measure[0])
        yield Waveform(label, unit, np.asarray(value, float), rate, start, name, time, 1e-9)


def _channel_text(entry: Any, i: int, count: int) -> str:
    """Return the entry of channel ``i`` as text, from a list with one entry per channel or a single entry for all."""
    if isinstance(entry, list):
        entry = entry[i] if len(entry) == count else ""
    return entry.decode(errors="replace") if isinstance(entry, bytes) else str(entry or "").strip()


def _number(entry: Any) -> float:
    """Return a positive or negative number, 0 for anything else."""
    try:
        return float(entry)
    except (TypeError, ValueError):
        return 0.0


def fields_of_hdf5(group: h5py.Group) -> dict[str, Any]:
    """Return groups, data sets and attributes of HDF5 as nested fields; attributes of numbers as their header."""
    import h5py

    fields: dict[str, Any] = dict(group.attrs)
    for key, item in group.items():
        if hasattr(item, "items"):
            fields[key] = fields_of_hdf5(item)
        elif (item.shape is not None and item.dtype.kind in "iufS") or h5py.check_string_dtype(item.dtype):
            # A dimension of netCDF-4 is stored as a data set of zeros.
            if not str(item.attrs.get("NAME", b"")).strip("b'").startswith("This is a netCDF dimension but"):
                fields |= {key: item[()], _header(key): dict(item.attrs)}
    return fields


def from_sep005(series: Sequence[Fields]) -> list[Channel]:
    """Return time series of SEP 005, the exchange format of sdypy, as channels.

    Parameters
    ----------
    series : sequence of dict
        With ``data``, ``name``, ``unit_str`` and ``fs`` (Hz) or ``time`` (s).

    Raises
    ------
    RecordError
        If one of them says no rate or times, or holds no numbers.
    """
    notes: list[str] = []
    waves: list[Waveform] = []
    for item in series:
        arrays = {key: np.asarray(item[key], float) for key in ("data", "time") if item.get(key) is not None}
        waves += waveforms({**item, **arrays}, notes, str(item.get("name", "data")))
    channels = channels_of_waveforms(waves, {}, Rates(None, None, notes))
    note("SEP 005", notes)
    return channels


def to_sep005(channels: Sequence[Channel]) -> list[dict[str, Any]]:
    """Return channels as time series of SEP 005, in SI units or those of their file.

    Parameters
    ----------
    channels : sequence of Channel
        Time records, as `clearance_mj.read` returns them.
    """
    series = []
    for channel in channels:
        name, unit = written_header(channel)
        series.append({"name": name, "data": channel.value, "fs": channel.fs, "unit_str": unit})
        if channel.start:
            series[-1]["time"] = channel.time
    return series
