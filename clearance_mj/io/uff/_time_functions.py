"""Time functions: data sets 58 of function type 1."""

from __future__ import annotations

from decimal import Decimal

import numpy as np

from ...errors import RecordError
from .._checks import QUANTITIES, even_rate, naming, simplest_rate
from ..channels import Channel, ChannelHeader
from ._dataset_58 import (
    REAL32,
    TIME,
    TIME_FUNCTION,
    UNIT_LABELS,
    UNKNOWN,
    Function,
    Header,
    function_block,
    numbers,
    samples,
)
from ._dataset_164 import time_scale
from ._fields import quantity_of


def read_channel_header(data: bytes, function: Function) -> ChannelHeader:
    with naming(f"data set {function.number}"):
        quantity = quantity_of(function.numerator, "ordinate")
        if function.is_complex:
            raise RecordError("a time function must be real, its ordinate data type is complex")
        if function.abscissa_type not in (TIME, *UNKNOWN):
            raise RecordError(f"abscissa type {function.abscissa_type} of a time function must be 17 (time)")
        time_scale(function, quantity)
        fs, start = _timing(data, function)
    node, direction = function.response.split(":")
    name = function.response if function.name in ("", "NONE") else function.name
    return ChannelHeader(name, int(node), direction, quantity, function.size, fs, start)


def read_channel(data: bytes, function: Function) -> Channel:
    header = read_channel_header(data, function)
    value = samples(data, function, time_scale(function, header.quantity))
    return Channel(header.name, header.node, header.direction, header.quantity, value, header.fs, header.start)


def _timing(data: bytes, function: Function) -> tuple[float, float]:
    """Sampling rate in Hz and time of the first sample in s."""
    if function.even:
        return simplest_rate(float(function.step), _half_digit(function.step)), function.first
    # Precision of the stored times: E13.5, single, double.
    digits = 5e-6 if not function.dtype else 6e-8 if not function.is_double else 1e-15
    return even_rate(numbers(data, function)[:, 0], digits)


def channel_block(channel: Channel) -> bytes:
    """A channel in single precision; its time step has at most 8 digits."""
    if np.abs(channel.value).max() > np.finfo(np.float32).max:
        raise RecordError(f'channel "{channel.name}" exceeds single precision (3.4e38)')
    header = Header(
        name=channel.name,
        kind=TIME_FUNCTION,
        response=channel.label,
        reference="0:S",
        ordinate=REAL32,
        size=channel.size,
        even=True,
        first=channel.start,
        step=_step_text(channel.fs),
        abscissa_type=TIME,
        numerator=QUANTITIES[channel.quantity],
        denominator=0,
        unit=UNIT_LABELS[channel.quantity],
    )
    return function_block(header, channel.value.astype("<f4"))


def _step_text(fs: float) -> str:
    """Write 1/fs in the usual six digits if reading gives fs again, or else in up to eight, which fill the field."""
    texts = [f"{1 / fs:.{digits}e}" for digits in (5, 6, 7)]
    return next((text for text in texts if simplest_rate(float(text), _half_digit(text)) == fs), texts[-1])


def _half_digit(text: str) -> float:
    return 0.5 * 10.0 ** int(Decimal(text).as_tuple().exponent)
