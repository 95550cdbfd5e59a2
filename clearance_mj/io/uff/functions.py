"""Time functions in even steps: data sets 58 of function type 1, or 0 (general) over time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from decimal import Decimal

import numpy as np

from ...core.checks import NAME_LIMIT, even_rate, naming, simplest_rate
from ...core.errors import RecordError
from ...core.quantities import QUANTITIES
from ...universal.dataset_58 import REAL32, TIME, TIME_FUNCTION, Function, Header, function_block, numbers, samples
from ...universal.dataset_164 import time_measure
from ..channels import NOWHERE, Channel, ChannelHeader, place_of
from ..gaps import ChannelSamples

__all__ = [
    "abscissa", "channel_block", "distinct_names", "is_of_time", "name_of", "read_channel_header", "read_samples",
    "why_no_record",
]  # fmt: skip

_SCALES = {"khz": 1e3, "ms": 1e-3}  # of an abscissa, by its unit in lower case


def is_of_time(function: Function) -> bool:
    """Return True if a function is a time record."""
    return function.kind == TIME_FUNCTION or (function.kind == 0 and function.abscissa_type == TIME)


def why_no_record(data: bytes, function: Function) -> str:
    """Return why a function of time is no record, which is real and in even steps; "" if it is one."""
    if function.is_complex and np.any(samples(data, function).imag):
        return "a time record must be real, its samples are complex"
    if not function.is_over(TIME):
        return f"abscissa type {function.abscissa_type} of a time record must be 17 (time)"
    try:
        _timing(data, function, [])
    except RecordError as error:
        return str(error)
    return ""


def read_channel_header(data: bytes, function: Function, notes: list[str], name: str) -> ChannelHeader:
    """Return the header of a time function's channel; refuses a function that is no record in even steps."""
    with naming(f"data set {function.number}"):
        if why := why_no_record(data, function):
            raise RecordError(why)
        measure = time_measure(function, notes)
        fs, start = _timing(data, function, notes)
    place = place_of(function.response)
    place = place if place[0] else NOWHERE
    return ChannelHeader(name, *place, measure.quantity, function.size, fs, start, measure.unit)


def read_samples(data: bytes, function: Function, notes: list[str], name: str) -> ChannelSamples:
    """Return the numbers that a time function holds, and how they become a channel in SI units."""
    header, scale = read_channel_header(data, function, notes, name), time_measure(function, []).scale
    place = header.node, header.direction, header.quantity

    def channel(value: np.ndarray, fs: float, start: float) -> Channel:
        return Channel(header.name, *place, scale * value, fs, start, header.unit)

    return ChannelSamples(name, samples(data, function).real, header.fs, header.start, channel)


def name_of(function: Function) -> str:
    """Return the name of a function: its title, or that of its place, or of its quantity."""
    names = (function.name, function.entity, function.unit_title, function.response)
    return next(name for name in names if name.upper() not in ("", "NONE"))


def distinct_names(functions: Sequence[Function]) -> list[str]:
    """Return names of records; those of the same title are named after their place, too, or numbered."""
    titles = [name_of(f) for f in functions]
    count = Counter(titles)
    names: dict[str, None] = {}
    for f, title in zip(functions, titles):
        places = (f.entity, f.response if not f.response.startswith("0:") else "", f.unit_title)
        place = next((p for p in places if p.upper() not in ("", "NONE") and p != title), "")
        base = f"{title}, {place}"[:NAME_LIMIT].strip(", ") if count[title] > 1 else title
        name, number = base, 1
        while name in names:
            number += 1
            name = f"{base[: NAME_LIMIT - 8].strip()} ({number})"
        names[name] = None
    return list(names)


def abscissa(data: bytes, function: Function) -> np.ndarray:
    """Return (size,) abscissa of a function, in Hz or s where its unit is a multiple of these."""
    scale = _SCALES.get(function.axis_unit.lower(), 1.0)
    if function.even:
        return scale * (function.first + np.arange(function.size) * float(function.step or 0))
    return scale * numbers(data, function)[:, 0]


def _timing(data: bytes, function: Function, notes: list[str]) -> tuple[float, float]:
    """Return sampling rate in Hz and time of the first sample in s."""
    scale = _SCALES.get(function.axis_unit.lower(), 1.0)
    if function.even:
        if not float(function.step or 0) > 0:
            raise RecordError("the abscissa increment of a time record must be > 0")
        return simplest_rate(scale * float(function.step), scale * _half_digit(function.step)), scale * function.first
    # Precision of the stored times: E13.5, single, double.
    digits = 5e-6 if not function.axis_dtype else 1e-15 if function.axis_dtype.endswith("8") else 6e-8
    return even_rate(abscissa(data, function), digits, notes)


def channel_block(channel: Channel) -> bytes:
    """Return a channel in single precision; its time step has at most 8 digits."""
    if np.abs(channel.value).max() > np.finfo(np.float32).max:
        raise RecordError(f'channel "{channel.name}" exceeds single precision (3.4e38)')
    quantity = QUANTITIES.get(channel.quantity)
    header = Header(
        TIME_FUNCTION, REAL32, channel.size, True, channel.start, _step_text(channel.fs), TIME, channel.name,
        channel.label, numerator=quantity.codes[0] if quantity else 0,
        unit=quantity.ascii_unit if quantity else channel.unit or "NONE",
    )  # fmt: skip
    return function_block(header, channel.value.astype("<f4"))


def _step_text(fs: float) -> str:
    """Write 1/fs in the usual six digits if reading gives fs again, or else in up to eight, which fill the field."""
    texts = [f"{1 / fs:.{digits}e}" for digits in (5, 6, 7)]
    return next((text for text in texts if simplest_rate(float(text), _half_digit(text)) == fs), texts[-1])


def _half_digit(text: str) -> float:
    return 0.5 * 10.0 ** int(Decimal(text).as_tuple().exponent)
