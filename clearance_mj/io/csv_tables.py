"""Time records and FRFs in CSV files: a header with the columns' names, then one line of numbers per instant or line.

How columns are named: `clearance_mj.io.columns`. A file without a header has columns named "1", "2", ..., which are
mapped.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from decimal import Decimal
from os import PathLike

import numpy as np

from ..core.checks import naming, simplest_rate
from ..core.errors import RecordError
from ..core.files import read_lines, replacing
from ..signals.frf import FRF
from .channels import Channel
from .columns import SKIP, Column, Contents, listed, resolve, table_of_channels, table_of_frf, to_frf
from .registry import Format, register

__all__ = ["read_csv", "write_csv"]

SEPARATORS = (",", ";", "\t")
Row = tuple[int, list[str]]  # number of a line and its cells


def read_csv(path: str | PathLike[str], columns: Mapping[str, str] | None = None, fs: float | None = None) -> Contents:
    """Read the time records or the FRFs (of a file with a column of frequency) of a CSV file.

    Separated by commas, semicolons or tabs, with decimal points; lines before the header that begin with "#" are passed
    over. A file that ends in .gz may be compressed. ``columns`` gives channel and, if it is not SI, unit of a column by
    its header: ``{"Accel 1": "acc:1 [g]", "Temp": "skip"}``; others are named after their channel. ``fs`` (Hz) is of a
    file without time.
    """
    lines = read_lines(path)
    with naming(path):
        return _contents(lines, columns or {}, fs)


def write_csv(path: str | PathLike[str], obj: Contents) -> None:
    """Write time records of one rate, length and start, or FRFs, as CSV, every digit of every number."""
    with naming(f"{path}: cannot be written"):
        headers, numbers = table_of_frf(obj) if isinstance(obj, FRF) else _with_time(obj)
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8") as file:
        np.savetxt(file, numbers, "%.17g", ",", header=",".join(headers), comments="")


def _with_time(channels: Sequence[Channel]) -> tuple[list[str], np.ndarray]:
    headers, numbers = table_of_channels(channels)
    return ["time [s]", *headers], np.column_stack((channels[0].time, numbers))


def _contents(lines: list[str], mapped: Mapping[str, str], fs: float | None) -> Contents:
    filled = [(i, line) for i, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if len(filled) < 3:
        raise RecordError("holds no records; needs a line with the names of the columns, then two or more of numbers")
    at, header = filled[0]
    separator = max(SEPARATORS, key=header.count)
    try:
        cells = [cell.strip() for cell in next(csv.reader([header], delimiter=separator))]
    except csv.Error as error:
        raise RecordError(f"line {at}: is no line of columns' names ({error})") from None
    if headless := all(np.isfinite(_number(cell)) for cell in cells):
        cells = [str(i) for i in range(1, len(cells) + 1)]
        if not mapped:
            raise RecordError(
                f"line {at}: has numbers where the columns' names are expected; map the columns by their numbers: "
                f'"1=time", "2=acc:1 [g]"'
            )
    used = resolve(cells, mapped, at)
    body = filled if headless else filled[1:]
    rows = [(line, [cell.strip(' "') for cell in text.split(separator)]) for line, text in body]
    values = _numbers(rows, cells, [c.index for c in used])
    if any(c.reference for c in used):
        if fs is not None:
            raise RecordError("holds FRFs, which have no sampling rate")
        return to_frf(used, [*values.T])
    times = [c for c in used if c.quantity == "time"]
    rate, start = _timing(rows, cells, times, fs)
    return [c.channel(values[:, i], rate, start) for i, c in enumerate(used) if c not in times]


def _numbers(rows: list[Row], cells: list[str], used: list[int]) -> np.ndarray:
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


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan


def _timing(rows: list[Row], cells: list[str], times: list[Column], fs: float | None) -> tuple[float, float]:
    """Sampling rate in Hz and time of the first sample in s."""
    if not times:
        if fs is None:
            raise RecordError(f'has no column "time", only {listed(cells)}; map one to it, or give the sampling rate')
        return fs, 0.0
    if len(times) > 1 or fs is not None:
        raise RecordError("has a column of time; needs just one, and then no sampling rate beside it")
    index, scale = times[0].index, times[0].scale
    time = scale * np.array([float(row[index]) for _, row in rows])
    # The last digit where the times are largest: twice what rounding may have changed.
    digit = scale * 10.0 ** min(300, *(int(Decimal(row[index]).as_tuple().exponent) for _, row in rows[-5:]))
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


register(Format(
    "CSV", (".csv", ".tsv", ".txt"), (Channel, FRF), read_csv, write_csv, options=("columns", "fs"),
    note="a header or a map of columns; `.csv.gz` is read",
))  # fmt: skip
