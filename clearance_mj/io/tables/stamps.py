"""Instants as date and clock time, ISO, European or American, or as clock time alone."""

from __future__ import annotations

import contextlib
import re
from typing import TYPE_CHECKING

import numpy as np

from ...core.errors import RecordError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["STAMP", "read_stamps"]

_ORDERS = {"year-month-day": (0, 1, 2), "day-month-year": (2, 1, 0), "month-day-year": (2, 0, 1)}
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_DATE = r"(?P<a>\d{1,4})(?P<mark>[-./])(?P<b>\d{1,2}|[A-Za-z]{3})(?P=mark)(?P<c>\d{1,4})"
_CLOCK = (
    r"(?:(?P<hour>\d{1,2}):)?(?P<minute>\d{1,2}):(?P<second>\d{1,2})(?:[.,:](?P<fraction>\d{1,24}))?"
    r"\s?(?P<half>[AaPp][Mm])?(?:\s?(?:Z|UTC|[+-]\d\d:?\d\d))?"
)
STAMP = re.compile(rf"(?:{_DATE}(?:[T, ]\s?{_CLOCK})?|{_CLOCK.replace('?P<', '?P<_')})")
"""A date with or without a clock time, or a clock time: hours are left out before minutes and seconds alone"""
DAY = 86400.0  # s


def read_stamps(cells: pd.Series) -> tuple[np.ndarray, float, str] | None:
    """Return seconds since the first instant (n,), the last digit in s, and how dates were read; None of other text.

    A clock that goes past midnight goes on. Of days and months that could be either, the order is the one in which
    time goes on in even steps, otherwise that of the country whose separator it is.
    """
    if not (first := STAMP.fullmatch(str(cells.iloc[0]).strip())):
        return None
    has_date, has_clock = first["a"] is not None, bool(first["minute"] or first["_minute"])
    if not has_clock:
        return None
    pattern = rf"\s*{_DATE}[T, ]\s?{_CLOCK}\s*" if has_date else rf"\s*{_CLOCK}\s*"
    parts = cells.astype(str).str.extract(f"^{pattern}$")
    if parts["minute"].isna().any():
        return None
    part = {str(name): parts[name].fillna("0").to_numpy(str) for name in parts}
    clock = 3600.0 * _hours(part) + 60.0 * part["minute"].astype(float) + part["second"].astype(float)
    fraction = np.char.add("0.", part["fraction"]).astype(float)
    digit = 10.0 ** -max(map(len, {*parts["fraction"].fillna("").unique()}))
    if not has_date:
        days, words = np.concatenate(([0], np.cumsum(np.diff(clock) < -DAY / 2))), ""
        words = f", past midnight {days[-1]} times" if days[-1] > 1 else ", past midnight" if days[-1] else ""
    else:
        days, words = _days(part, clock)
    whole = clock - clock[0] + DAY * (days - days[0])
    return whole + (fraction - fraction[0]), digit, f"time begins at {str(cells.iloc[0]).strip()}{words}"


def _hours(part: dict[str, np.ndarray]) -> np.ndarray:
    hours = part["hour"].astype(float)
    half = np.char.lower(part["half"])
    return np.where(half == "0", hours, hours % 12 + 12 * (half == "pm"))


def _days(part: dict[str, np.ndarray], clock: np.ndarray) -> tuple[np.ndarray, str]:
    """Return days (n,) since some day, and in words the order in which dates were read."""
    first_two = np.char.add(np.char.add(part["a"], " "), np.char.add(part["b"], " "))
    dates, inverse = np.unique(np.char.add(first_two, part["c"]), return_inverse=True)
    fields = [date.split() for date in dates.tolist()]
    mark = str(part["mark"][0])
    if is_iso := len(fields[0][0]) == 4:
        names = ["year-month-day"]
    elif not fields[0][1].isdecimal() or mark == ".":
        names = ["day-month-year"]
    else:
        names = ["day-month-year", "month-day-year"][:: -1 if mark == "/" else 1]
    day_numbers: dict[str, np.ndarray] = {}
    for name in names:
        with contextlib.suppress(ValueError):
            number = np.array([_day(*(row[i] for i in _ORDERS[name])) for row in fields], dtype=float)
            day_numbers[name] = number[inverse]
    if not day_numbers:
        raise RecordError(f'"{mark.join(fields[0])}" is no date')
    name = min(day_numbers, key=lambda name: _unevenness(clock + DAY * day_numbers[name]))
    unsure = ", which it does not say" if len(day_numbers) > 1 and not mark == "." else ""
    return day_numbers[name], "" if is_iso else f" (dates are {name.replace('-', mark)}{unsure})"


def _day(year: str, month: str, day: str) -> int:
    """Return a date as the number of its day; a ValueError says that there is no such date."""
    import datetime

    number = int(month) if month.isdecimal() else _MONTHS.index(month.lower()) + 1
    return datetime.date(int(year) + 2000 * (len(year) < 3), number, int(day)).toordinal()


def _unevenness(time: np.ndarray) -> float:
    """Return the largest departure of a step from the median one, s."""
    steps = np.diff(time)
    return float(np.abs(steps - np.median(steps)).max(initial=0.0))
