"""The time of a text table: its column of numbers or stamps, or the sampling rate above it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.checks import JITTER, jittering_rate, simplest_rate
from ...core.errors import RecordError
from ...core.units import UNITS
from ..columns import SKIP, ColumnHeader, quoted
from ..time_axis import Rates, TimeAxis, instants_in_seconds, time_axis
from .numbers import TableBody
from .stamps import read_stamps

__all__ = ["time_of"]

_NAMELESS = ("x", "abscissa", "name", "channel", "column 1")  # of a first column, which say nothing of it
_AGREES = 1e-3  # relative difference of two rates that are the same
_COARSE = 0.1  # of a step, from which on the last digit is one of a jitter
_WHOLE = 0.999  # of the last digit that a step must have: steps of less would not all differ by it


def time_of(
    body: TableBody, used: Sequence[ColumnHeader], cells: Sequence[str], rates: Rates, known: tuple[float, int] | None
) -> tuple[TimeAxis, frozenset[int]]:
    """Return the instants of the samples: by a column of time, the caller's rate, or that of a line above the table.

    ``known`` is such a rate in Hz and the number of its line. The second value are the columns of time.
    Notes say which was taken, and if two differ.
    """
    fs, notes = rates.fs, rates.notes
    times = [c for c in used if c.quantity == "time"]
    if times and times[0].is_raw_time:
        times = _select_time(body, times)
    if not times and fs is None and known is None:
        times = _rising_first_column(body, used, notes)
    if not times:
        if fs is not None:
            return TimeAxis(fs), frozenset()
        if known is None:
            raise RecordError(
                f'has no column "time", only {quoted(cells)}; map one to it, or give the sampling rate (--fs)'
            )
        notes.append(f"{known[0]:.9g} Hz, from line {known[1]}")
        return TimeAxis(known[0]), frozenset()
    if len(times) > 1 or fs is not None:
        raise RecordError(
            f'has a column of time; needs just one, and then no sampling rate beside it ("{times[-1].name}={SKIP}" '
            "leaves it out)"
        )
    (column,) = times
    all_of_time = frozenset(c.index for c in (*used, column) if c.quantity == "time")
    axis = _axis_of_column(body, column, cells, rates, known)
    if known and axis.time is None and abs(axis.fs / known[0] - 1) > _AGREES:
        notes.append(f'{axis.fs:.9g} Hz by "{column.name}", not the {known[0]:.9g} Hz of line {known[1]}')
    return axis, all_of_time


def _select_time(body: TableBody, times: Sequence[ColumnHeader]) -> list[ColumnHeader]:
    """Return the one raw column of time to take, of numbers rather than of stamps, or several that differ."""
    numbers = [c for c in times if body.kind(c.index) == "number"]
    if len(numbers) < 2:
        return numbers or [c for c in times if body.kind(c.index) == "stamp"][:1]
    since = [c.scale * (body.numbers(c.index) - body.numbers(c.index)[0]) for c in numbers]
    slack = JITTER * np.abs(np.nanmedian(np.diff(since[0])))  # one may be a date, or jitter
    same = [time for time in since if np.allclose(time, since[0], rtol=0, atol=slack, equal_nan=True)]
    return numbers[:1] if len(same) == len(numbers) else numbers


def _rising_first_column(body: TableBody, used: Sequence[ColumnHeader], notes: list[str]) -> list[ColumnHeader]:
    """Return the first column if it rises in even steps and has a unit of time, or none and no name but "X"."""
    first = min(used, key=lambda c: c.index)
    if not first.is_raw or body.kind(first.index) != "number" or first.unit not in ("", *UNITS["time"]):
        return []
    values = body.numbers(first.index)
    steps = np.diff(values)
    if not np.isfinite(values).all() or not 0 < steps.min() or np.ptp(steps) > 1e-3 * steps.mean() or len(steps) < 3:
        return []
    if first.unit == "" and (first.name.lower() not in _NAMELESS or (steps == 1).all()):
        return []
    column = ColumnHeader(first.index, first.name, "time", scale=UNITS["time"][first.unit or "s"], is_raw=True)
    notes.append(f'"{first.name}" is taken for time in {first.unit or "s"}')
    return [column]


def _axis_of_column(
    body: TableBody, column: ColumnHeader, cells: Sequence[str], rates: Rates, stated: tuple[float, int] | None
) -> TimeAxis:
    """Return the instants of samples by a column of time."""
    notes = rates.notes
    index, where = column.index, f'column {column.index + 1} "{cells[column.index]}"'
    if body.kind(index) == "stamp" and (stamps := read_stamps(body.frame[index])):
        time, digit, words = stamps
        notes.append(words)
    elif np.isnan(column.scale):
        raise RecordError(f'{where}: unit "{column.unit}" of time is unknown; map it: "{column.name}=time [s]"')
    else:
        stored = body.frame[index]  # whole numbers as they are
        value = stored.to_numpy() if stored.dtype.kind in "iu" else body.numbers(index)
        time, scale = instants_in_seconds(value, column.scale, column.name, notes, column.unit)
        digit = max(scale * body.last_digit(index), scale * float(np.spacing(float(value[0]))))
    faulty = np.flatnonzero(~np.isfinite(time))
    if faulty.size:
        row = body.cells(faulty[0])
        cell = f'"{row[index]}"' if index < len(row) and row[index] else "an empty cell"
        raise RecordError(
            f"line {body.lines[faulty[0]][0]}, {where}: {cell} is not a number or a time; mend it, or end the file "
            "before it"
        )
    step = (time[-1] - time[0]) / (time.size - 1)
    is_off = np.abs(time - (time[0] + step * np.arange(time.size))) > 1e-3 * abs(step) + digit
    if stated and not is_off.any() and step > 0 and abs(step * stated[0] - 1) < max(_AGREES, digit / step / time.size):
        if step < _WHOLE * digit:
            notes.append(f"{stated[0]:.9g} Hz, from line {stated[1]}: the times have too few digits")
            return TimeAxis(stated[0], float(time[0]))
    is_coarse = digit > _COARSE * step > 0 and np.ptp(np.diff(time)) > 1e-3 * step  # rounded: no two instants tell it
    if is_coarse and not is_off.any() and (even_axis := jittering_rate(time, notes)):
        return TimeAxis(*even_axis)
    if step > _WHOLE * digit and not is_off.any():
        return TimeAxis(simplest_rate(float(step), digit / (time.size - 1)), float(time[0]))
    try:
        return time_axis(time, 0.0, rates)
    except RecordError:
        steps = np.diff(time)
        i = int(np.argmax(np.abs(steps - np.median(steps)))) + 1
        raise RecordError(
            f"line {body.lines[i][0]}, {where}: goes from {time[i - 1]:.9g} s to {time[i]:.9g} s, its usual step is "
            f"{np.median(steps):.6g} s; needs one time step throughout, and digits enough to tell it, --resample RATE "
            f'to interpolate, or the sampling rate in place of it ("{column.name}={SKIP}" and --fs)'
        ) from None
