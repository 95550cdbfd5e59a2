"""Time records in CSV files: a header with the channels' names, then one line of numbers per instant.

A column is named after its channel: ``time``; ``base`` (acceleration of the base plate) or ``force`` (of the shaker);
``acc:3`` and ``disp:6`` (acceleration at node 3, displacement at node 6), all along +Z, or ``acc:3:-Z`` for a sensor
that is mounted the other way round. A unit follows in brackets, ``acc:3 [g]``; without one it is SI. Other headers are
mapped to these names by the caller.
"""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from ..errors import RecordError
from ..rig import BASE_NODE, SHAKER_NODE
from .lvm import read_text
from .uff import Channel
from .uff.channels import simplest_rate

__all__ = ["SKIP", "UNITS", "read_csv"]

UNITS = {
    "time": {"s": 1.0, "ms": 1e-3},
    "acceleration": {"m/s2": 1.0, "mm/s2": 1e-3, "g": 9.80665},
    "displacement": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
    "force": {"N": 1.0, "kN": 1e3},
}
"""Units that are known, in SI units, by quantity"""
SKIP = "skip"
"""What a column is mapped to that is to be left out"""
SEPARATORS = (",", ";", "\t")
EXAMPLES = ("time", "base", "force", "acc:1", "disp:6")

_CELL = re.compile(r"(.*?)\s*(?:[\[(]([^\[\]()]*)[\])])?")
_CHANNEL = re.compile(r"(time|base|force|(?:acc|disp):(\d{1,9}))(?::([+-]Z))?")
_QUANTITIES = {"time": "time", "base": "acceleration", "force": "force", "acc": "acceleration", "disp": "displacement"}
_NODES = {"base": BASE_NODE, "force": SHAKER_NODE}


@dataclass(frozen=True)
class _Column:
    """What the header says of a column."""

    index: int
    name: str
    quantity: str
    node: int
    direction: str
    scale: float
    """SI units in one of the column's"""


def read_csv(path, columns: Mapping[str, str] | None = None, fs: float | None = None) -> list[Channel]:
    """Read the time records of a CSV file.

    Separated by commas, semicolons or tabs, with decimal points; lines before the header that begin with "#" are
    passed over. A file that ends in .gz may be compressed.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : mapping of str to str, optional
        Channel and, if it is not SI, unit of a column, by its header: ``{"Accel 1": "acc:1 [g]", "Temp": "skip"}``.
        Columns that are not in it are named after their channel.
    fs : float, optional
        Samples per second of a file without a column of time.

    Returns
    -------
    list of Channel

    Raises
    ------
    RecordError
        Naming file, line and column, if the file cannot be read, a header or unit is unknown, a number is missing or
        not finite, or the time steps are uneven.
    """
    lines = read_text(path)
    try:
        return _channels(lines, columns or {}, fs)
    except RecordError as error:
        raise RecordError(f"{path}: {error}") from None


def _channels(lines, mapped, fs) -> list[Channel]:
    filled = [(i, line) for i, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if len(filled) < 3:
        raise RecordError("holds no records; needs a line with the names of the columns, then two or more of numbers")
    (at, header), *body = filled
    separator = max(SEPARATORS, key=header.count)
    cells = [cell.strip() for cell in next(csv.reader([header], delimiter=separator))]
    used = _columns(cells, mapped, at)
    rows = [(line, [cell.strip(' "') for cell in text.split(separator)]) for line, text in body]
    values = _numbers(rows, cells, [c.index for c in used])
    times = [c for c in used if c.quantity == "time"]
    rate, start = _timing(rows, cells, times, fs)
    return [
        Channel(c.name, c.node, c.direction, c.quantity, values[:, i] * c.scale, rate, start)
        for i, c in enumerate(used)
        if c not in times
    ]


def _columns(cells, mapped, line) -> list[_Column]:
    """The columns to use."""
    missing = [header for header in mapped if header not in cells and header not in map(_name, cells)]
    if missing:
        near = _nearest(missing[0], cells)
        raise RecordError(f'line {line}: has no column "{missing[0]}"{near}; its columns are {_listed(cells)}')
    used = []
    for index, cell in enumerate(cells):
        where = f'line {line}, column {index + 1} "{cell}"'
        given = mapped.get(cell, mapped.get(_name(cell), cell))
        if given == SKIP:
            continue
        name, unit = _CELL.fullmatch(given).groups()
        channel = _CHANNEL.fullmatch(name)
        if not channel:
            like = _nearest(name, _channels_like(name))
            raise RecordError(
                f"{where}: not the name of a channel{like}; use {_listed(EXAMPLES)} with the node's number, "
                f'or map it: "{cell}=acc:1" (or "{cell}={SKIP}" to leave it out)'
            )
        kind = channel[1].split(":")[0]
        quantity = _QUANTITIES[kind]
        scale = _scale(unit if unit is not None else _CELL.fullmatch(cell)[2], quantity, where)
        node = int(channel[2] or _NODES.get(kind, 0))
        used.append(_Column(index, _name(cell), quantity, node, channel[3] or "+Z", scale))
    if all(column.quantity == "time" for column in used):
        raise RecordError(f"line {line}: has no channel beside time; its columns are {_listed(cells)}")
    return used


def _name(cell) -> str:
    return _CELL.fullmatch(cell)[1]


def _scale(unit, quantity, where) -> float:
    if not unit:
        return 1.0
    plain = unit.replace("²", "2").replace("µ", "u").replace("μ", "u")
    plain = re.sub(r"[\s^*]", "", plain)
    if plain not in UNITS[quantity]:
        raise RecordError(f'{where}: unit "{unit}" of {quantity} is unknown; use {", ".join(UNITS[quantity])}')
    return UNITS[quantity][plain]


def _channels_like(name) -> list[str]:
    """Names of channels at the node that a name holds."""
    node = re.search(r"\d*$", name)[0] or "1"
    return ["time", "base", "force", f"acc:{node}", f"disp:{node}"]


def _nearest(name, known) -> str:
    """A question after what was meant, if something like it is known."""
    found = difflib.get_close_matches(name, known, 1, 0.6)
    return f' (did you mean "{found[0]}"?)' if found else ""


def _listed(names) -> str:
    return ", ".join(f'"{name}"' for name in names)


def _numbers(rows, cells, used) -> np.ndarray:
    """(n, n_used) numbers of the columns to use, all finite."""
    for line, row in rows:
        if len(row) != len(cells):
            raise RecordError(f"line {line}: has {len(row)} columns, the header {len(cells)}")
    chosen = [[row[i] for i in used] for _, row in rows]
    try:
        values = np.array(chosen, dtype=float)
    except ValueError:
        values = np.array([[_number(cell) for cell in row] for row in chosen])
    if not np.isfinite(values).all():
        at, column = np.argwhere(~np.isfinite(values))[0]
        cell, index = chosen[at][column], used[column]
        hint = " (decimals are written with a point)" if re.fullmatch(r"[+-]?\d+,\d+", cell) else ""
        found = f'"{cell}"' if cell else "an empty cell"
        raise RecordError(
            f'line {rows[at][0]}, column {index + 1} "{cells[index]}": {found} is not a number{hint}; mend it, end the '
            f'file before it, or leave the column out ("{cells[index]}={SKIP}")'
        )
    return values


def _number(text) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan


def _timing(rows, cells, times, fs) -> tuple[float, float]:
    """Sampling rate in Hz and time of the first sample in s."""
    if not times:
        if fs is None:
            raise RecordError(f'has no column "time", only {_listed(cells)}; map one to it, or give the sampling rate')
        return fs, 0.0
    if len(times) > 1 or fs is not None:
        raise RecordError("has a column of time; needs just one, and then no sampling rate beside it")
    index, scale = times[0].index, times[0].scale
    time = scale * np.array([float(row[index]) for _, row in rows])
    # The last digit where the times are largest: twice what rounding may have changed.
    digit = scale * 10.0 ** min(Decimal(row[index]).as_tuple().exponent for _, row in rows[-5:])
    step = (time[-1] - time[0]) / (time.size - 1)
    off = np.abs(time - (time[0] + step * np.arange(time.size))) > 1e-3 * abs(step) + digit
    if not step > digit or off.any():
        steps = np.diff(time)
        at = int(np.argmax(np.abs(steps - np.median(steps)))) + 1
        raise RecordError(
            f'line {rows[at][0]}, column {index + 1} "{cells[index]}": goes from {time[at - 1]:.9g} s to '
            f"{time[at]:.9g} s, its usual step is {np.median(steps):.6g} s; needs one time step throughout, and digits "
            "enough to tell it"
        )
    return simplest_rate(float(step), digit / (time.size - 1)), float(time[0])
