"""Names of columns, in tables of time records and of FRFs.

A column of a time record is named after its channel: ``time``; ``base`` (acceleration of the base plate), ``force``
(of the shaker) or ``keyphasor`` (pulses of a shaft, in any unit); ``acc:3``, ``vel:3``, ``disp:6`` and ``force:5`` (at
a node), all along +Z, or ``acc:3:-Z`` for a sensor that is mounted the other way round.
A column of FRFs is ``frequency`` or two channels, ``acc:3/base``, and a
part: ``real``, ``imag``, ``magnitude``, ``phase``, ``coherence``, or none of a complex column. A unit follows in
brackets, ``acc:3 [g]``; without one it is SI. The caller may map other headers to these names. What is not mapped is a
raw channel: it keeps its name, its quantity is that of its unit or unknown, and it is nowhere.
"""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.checks import NAME_LIMIT, NOWHERE
from ..core.errors import RecordError
from ..core.quantities import QUANTITIES
from ..core.units import UNITS, quantity_of, ratio_factor, unit_factor
from ..rig import BASE_NODE, SHAKER_NODE
from ..rig.instruments import KEYPHASOR
from ..signals.frf import FRF
from ..signals.quantities import require_quantity, two_quantities
from ..signals.references import join_references
from .channels import UNKNOWN, Channel, place_of, require_one_time
from .gaps import ChannelSamples
from .tables.headers import LONGEST, is_time, split_header, unique_names
from .time_axis import TimeAxis

__all__ = ["SKIP", "ColumnHeader", "Columns"]

SKIP = "skip"  # entry of a column that is left out
EXAMPLES = ("time", "base", "force", "acc:1", "disp:6")
Columns = Mapping[str, str] | None  # channels by header
Contents = list[Channel] | FRF  # of a table: time records or FRFs
PARTS = ("real", "imag", "magnitude", "phase", "coherence")

PULSES = "keyphasor"
_PREFIX = {name: known.prefix for name, known in QUANTITIES.items()}
_QUANTITY = {prefix: quantity for quantity, prefix in _PREFIX.items()} | {"base": "acceleration"}
_NODES = {"base": BASE_NODE, "force": SHAKER_NODE}
_INPUTS = {(str(node), _QUANTITY[name]): name for name, node in _NODES.items()}
_CELL = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))?")
_PLACE = rf"(?:base|(?:{'|'.join(_PREFIX.values())}):\d{{1,9}}|force)(?::(?:[+-]R?[XYZ]|S))?"
_CHANNEL = re.compile(_PLACE)
_FREQUENCY = re.compile(r"freq(?:uency|uenz|uencies|\.)?|frequenz|fr[ée]quence", re.IGNORECASE)
_PREFIX_AND_NODE = re.compile(r"[a-z]{2,6}:\d", re.IGNORECASE)  # as in no name but a channel's
_FUNCTION = re.compile(rf"({_PLACE})/({_PLACE})(?:\s+({'|'.join(PARTS)}))?")


@dataclass(frozen=True)
class ColumnHeader:
    """Meaning of a column, as its header gives it."""

    index: int  #: place in the table, from 0
    name: str  #: header without its unit
    quantity: str  #: "time", "frequency", "acceleration" ..., "unknown"; of an FRF "acceleration/force"
    dof: str = ""  #: "3:+Z", of an FRF's response
    reference: str = ""  #: degree of freedom of an FRF's excitation
    part: str = ""  #: one of `PARTS`, or "" of a complex column
    scale: float = 1.0  #: SI units in one of the column's
    unit: str = ""  #: label in the file, of a time or of an unknown quantity
    is_raw: bool = False  #: True if only the file's own header, and no map, says what it is

    @property
    def is_raw_time(self) -> bool:
        """True if the header is a usual name of time other than this package's."""
        return self.is_raw and self.quantity == "time"

    def channel(self, value: np.ndarray, fs: float, start: float) -> Channel:
        """Return the column as a channel, from its numbers (n_t,) in its unit; ``fs`` in Hz, ``start`` in s."""
        unit = self.unit if self.quantity == UNKNOWN else ""
        return Channel(self.name, *place_of(self.dof), self.quantity, value * self.scale, fs, start, unit)

    def samples(self, axis: TimeAxis, value: np.ndarray, code: str = "") -> ChannelSamples:
        """Return the column's numbers (n,) on a time axis; ``code`` stands in place of the first that is missing."""
        return ChannelSamples(self.name, axis.samples(value), axis.fs, axis.start, self.channel, code)


def resolve(
    cells: Sequence[str], mapped: Mapping[str, str], line: int | None = None, notes: list[str] | None = None
) -> list[ColumnHeader]:
    """Return the columns of a table, or of a file's variables; ``notes`` takes changes of their names.

    A header is mapped by the whole of it, by its name without unit, or by the name that its channel gets.
    """
    kind, where = ("column", f"line {line}: ") if line else ("variable", "")
    names = unique_names([split_header(cell)[0] for cell in cells], [] if notes is None else notes)
    keys = [{cell, _name(cell), name} if cells.count(cell) == 1 else {name} for cell, name in zip(cells, names)]
    if missing := [header for header in mapped if not any(header in known for known in keys)]:
        suggestion = _suggest_name(missing[0], [*cells, *names])
        raise RecordError(f'{where}has no {kind} "{missing[0]}"{suggestion}; its {kind}s are {quoted(cells)}')
    has_channel_names = any(":" in cell or _name(cell) == "base" for cell in cells if _is_column_name(_name(cell)))
    used = []
    for index, (cell, name, aliases) in enumerate(zip(cells, names, keys)):
        entry = next((mapped[key] for key in aliases if key in mapped), None)
        if entry == SKIP:
            continue
        try:
            if entry is None and not _is_column_name(_name(cell)):
                used.append(_raw_column(index, cell, name, has_channel_names))
            else:
                used.append(_column(index, cell, cell if entry is None else entry))
        except RecordError as error:
            place = f"line {line}, column {index + 1}" if line else kind
            raise RecordError(f'{place} "{cell}": {error}') from None
    if any(c.quantity == "time" and not c.is_raw for c in used):  # then others are channels, such as stamps
        used = [as_channel(c) if c.is_raw_time else c for c in used]
    if used and used[0].is_raw and _FREQUENCY.fullmatch(used[0].name) and not any(c.quantity == "time" for c in used):
        used[0] = dataclasses.replace(used[0], quantity="frequency", scale=1e3 if used[0].unit == "kHz" else 1.0)
    functions = [c for c in used if c.reference or c.quantity == "frequency"]
    if functions and len(functions) != len(used):
        other = next(c for c in used if c not in functions)
        if other.is_raw:
            raise RecordError(
                f'{where}"{functions[0].name}" is of FRFs, "{other.name}" is the name of none; map it: '
                f'"{other.name}=acc:1/base real", or "{other.name}={SKIP}" to leave it out'
            )
        raise RecordError(f'{where}"{other.name}" is of a time record, "{functions[0].name}" of FRFs; needs one kind')
    if all(column.quantity in ("time", "frequency") for column in used):
        raise RecordError(f"{where}has no channel beside time; its {kind}s are {quoted(cells)}")
    return used


def as_channel(time: ColumnHeader) -> ColumnHeader:
    """Return a raw column of time as one of a channel, because another one is the time."""
    return dataclasses.replace(time, quantity=UNKNOWN, dof=NOWHERE, scale=1.0)


def _is_column_name(name: str) -> bool:
    """Return True if a name is one that this package gives to columns."""
    return name in ("time", "frequency", PULSES) or bool(_CHANNEL.fullmatch(name) or _FUNCTION.fullmatch(name))


def _raw_column(index: int, cell: str, name: str, has_channel_names: bool) -> ColumnHeader:
    """Return a column under the file's own name; a misspelt channel name is refused.

    A name counts as misspelt if it resembles a channel name and stands among such, or has a node after a colon.
    """
    plain = _name(cell)
    suggestion = _suggest_name(plain, _similar_channels(plain), 0.75)
    if suggestion and (_PREFIX_AND_NODE.match(plain) or (has_channel_names and not is_time(plain))):
        raise RecordError(
            f"not the name of a channel{suggestion}; use {quoted(EXAMPLES)} with the node's number, "
            f'or map it: "{cell}=acc:1" (or "{cell}={SKIP}" to leave it out)'
        )
    plain, unit = split_header(cell)
    if is_time(plain):
        try:
            scale = _scale(unit, "time")
        except RecordError:  # such as "hh:mm:ss" and "UTC" of stamps
            scale = np.nan
        return ColumnHeader(index, name, "time", scale=scale, unit=unit, is_raw=True)
    quantity, scale = quantity_of(unit) or (UNKNOWN, 1.0)
    unit = "".join(c if c.isprintable() else " " for c in unit)[:NAME_LIMIT].strip()
    return ColumnHeader(index, name, quantity, NOWHERE, scale=scale, unit=unit, is_raw=True)


def _column(index: int, cell: str, entry: str) -> ColumnHeader:
    name, unit = _split(entry)
    unit = _split(cell)[1] if unit is None else unit
    if name in ("time", "frequency"):
        return ColumnHeader(index, _name(cell), name, scale=_scale(unit, name), unit=unit or "")
    if name == PULSES:
        return ColumnHeader(index, _name(cell), UNKNOWN, KEYPHASOR, unit=unit or "")
    if function := _FUNCTION.fullmatch(name):
        return _frf_column(index, _name(cell), unit, *function.groups())
    if not _CHANNEL.fullmatch(name):
        suggestion = _suggest_name(name, _similar_channels(name))
        raise RecordError(f"not the name of a channel{suggestion}; use {quoted(EXAMPLES)} with the node's number")
    quantity, dof = _place(name)
    return ColumnHeader(index, _name(cell), quantity, dof, scale=_scale(unit, quantity))


def _frf_column(
    index: int, name: str, unit: str | None, response: str, reference: str, part: str | None
) -> ColumnHeader:
    (above, dof), (below, reference) = _place(response), _place(reference)
    if part == "phase" and not unit:
        raise RecordError("a phase needs its unit, [deg] or [rad], got none")
    scale = 1.0
    if unit and part != "coherence":
        scale = unit_factor(unit, "angle") if part == "phase" else ratio_factor(unit, above, below)
    return ColumnHeader(index, name, f"{above}/{below}", dof, reference, part or "", scale)


def _place(name: str) -> tuple[str, str]:
    """Return quantity and degree of freedom of a channel's name."""
    kind, *rest = name.split(":")
    node = int(rest.pop(0)) if rest and rest[0].isdigit() else _NODES[kind]
    return _QUANTITY[kind], f"{node}:{rest[0] if rest else '+Z'}"


def frf_of_columns(columns: Sequence[ColumnHeader], values: Sequence[np.ndarray]) -> FRF:
    """Return the FRFs that the columns of a table hold."""
    axes = [value * c.scale for c, value in zip(columns, values) if c.quantity == "frequency"]
    if len(axes) != 1:
        raise RecordError(f'needs one column "frequency", has {len(axes)}')
    groups: dict[str, list[tuple[ColumnHeader, np.ndarray]]] = {}
    for column, value in zip(columns, values):
        if column.reference:
            groups.setdefault(column.reference, []).append((column, value * column.scale))
    return join_references([_frf_to_one_reference(axes[0].real, group) for group in groups.values()])


def _frf_to_one_reference(frequency: np.ndarray, group: list[tuple[ColumnHeader, np.ndarray]]) -> FRF:
    """Return the FRFs to one reference."""
    functions: dict[tuple[str, str], dict[str, np.ndarray]] = {}
    first = group[0][0]
    for column, value in group:
        parts = functions.setdefault((column.dof, column.quantity), {})
        if column.part in parts:
            raise RecordError(f'"{column.name}": {column.part or "the function"} of {column.dof} comes twice')
        parts[column.part] = value
    value = np.array([_complex(dof, parts) for (dof, _), parts in functions.items()])
    has_coherence = ["coherence" in parts for parts in functions.values()]
    if any(has_coherence) and not all(has_coherence):
        missing, _ = [*functions][has_coherence.index(False)]
        raise RecordError(f"has no coherence of {missing}; needs that of all functions or none")
    coherence = np.array([parts["coherence"] for parts in functions.values()]).real if all(has_coherence) else None
    responses, quantities = zip(*functions)
    return FRF(frequency, value, coherence, responses, (first.reference,), quantities=quantities)


def _complex(dof: str, parts: Mapping[str, np.ndarray]) -> np.ndarray:
    match sorted(parts.keys() - {"coherence"}):
        case [""]:
            return parts[""]
        case ["imag", "real"]:
            return parts["real"] + 1j * parts["imag"]
        case ["magnitude", "phase"]:
            return parts["magnitude"] * np.exp(1j * parts["phase"])
        case names:
            raise RecordError(
                f"response {dof} has {' and '.join(names) or 'no values'}; needs real and imag, or magnitude and phase"
            )


def channel_name(dof: str, quantity: str) -> str:
    """Return the name of a channel's column, without a unit."""
    node, direction = dof.split(":")
    name = _INPUTS.get((node, quantity), f"{_PREFIX[quantity]}:{node}")
    return name if direction == "+Z" else f"{name}:{direction}"


def timed_table(obj: Contents) -> tuple[list[str], np.ndarray]:
    """Return the headers and real numbers (n, n_columns) of a text table, time or frequency first."""
    if isinstance(obj, FRF):
        return table_of_frf(obj)
    headers, numbers = table_of_channels(obj)
    return ["time [s]", *headers], np.column_stack((obj[0].time, numbers))


def table_of_channels(channels: Sequence[Channel]) -> tuple[list[str], np.ndarray]:
    """Return the headers and numbers (n_t, n) of time records, without time; raw channels keep their names."""
    require_one_time(channels)
    pairs = map(written_header, channels)
    headers = [f"{name} [{unit}]" if unit or split_header(name)[1] else name for name, unit in pairs]
    if duplicate := next((h for h in headers if headers.count(h) > 1), None):
        raise RecordError(f'two channels would be columns "{duplicate}"; give each its own node, or write .uff')
    return headers, np.stack([c.value for c in channels], axis=1)


def written_header(channel: Channel) -> tuple[str, str]:
    """Return name and unit under which a channel is written: by its place if it has one, otherwise its own name."""
    unit = channel.unit if channel.quantity == UNKNOWN else next(iter(UNITS[channel.quantity]))
    if channel.placed and channel.quantity != UNKNOWN:
        return channel_name(channel.label, channel.quantity), unit
    if channel.label == KEYPHASOR:
        return PULSES, unit
    if _is_column_name(_name(channel.name)) or is_time(channel.name):
        raise RecordError(f'channel "{channel.name}" would be read as another from a table; rename it, or write .uff')
    return channel.name, unit


def frf_names(frf: FRF) -> tuple[list[str], list[str]]:
    """Return the headers of FRFs without a part, such as "acc:3/base", and their units."""
    require_quantity(frf)
    ratios = [two_quantities(quantity) for quantity in frf.row_quantities]
    finite = np.isfinite(frf.value) & (True if frf.coherence is None else np.isfinite(frf.coherence))
    if not finite.all():
        line = int(np.argmin(finite.all(axis=(0, 1))))
        raise RecordError(f"the FRF is not finite at {frf.frequency[line]:g} Hz")
    names = [
        f"{channel_name(dof, above)}/{channel_name(frf.reference, below)}"
        for dof, (above, below) in zip(frf.responses, ratios)
    ]
    return names, ["({})/({})".format(*(next(iter(UNITS[quantity])) for quantity in pair)) for pair in ratios]


def table_of_frf(frf: FRF) -> tuple[list[str], np.ndarray]:
    """Return headers and real numbers (n_f, n) of FRFs, frequency first: real and imaginary parts, then coherences."""
    headers, columns = ["frequency [Hz]"], [frf.frequency]
    for single in map(frf.to_reference, frf.references):
        names, units = frf_names(single)
        headers += [f"{name} {part} [{unit}]" for name, unit in zip(names, units) for part in ("real", "imag")]
        columns += [part for value in single.functions for part in (value.real, value.imag)]
        if single.coherence is not None:
            headers += [f"{name} coherence" for name in names]
            columns += list(single.coherence[:, 0])
    return headers, np.stack(columns, axis=1)


def _split(cell: str) -> tuple[str, str | None]:
    """Return name and unit."""
    match = _CELL.fullmatch(cell) if len(cell) < LONGEST else None
    name, square, curved = match.groups() if match else (cell, None, None)
    return name, square if square is not None else curved


def _name(cell: str) -> str:
    return _split(cell)[0]


def _scale(unit: str | None, quantity: str) -> float:
    return unit_factor(unit, quantity) if unit else 1.0


def _similar_channels(name: str) -> list[str]:
    """Return channel names at the node that a name ends in."""
    node = name[len(name.rstrip("0123456789")) :][:9] or "1"
    return ["time", "frequency", "base", "force", f"acc:{node}", f"vel:{node}", f"disp:{node}", f"acc:{node}/base"]


def _suggest_name(name: str, names: Sequence[str], cutoff: float = 0.6) -> str:
    """Return the words "(did you mean ...?)", or "" if no known name is similar."""
    matches = difflib.get_close_matches(name[:NAME_LIMIT], names, 1, cutoff)
    return f' (did you mean "{matches[0]}"?)' if matches else ""


def quoted(names: Iterable[str]) -> str:
    """Return the names in quotation marks."""
    return ", ".join(f'"{name}"' for name in names)
