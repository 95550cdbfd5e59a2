"""Measured time functions, and data sets 58 of function type 1."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from ...errors import RecordError
from ._dataset_58 import (
    NAME_LIMIT,
    REAL32,
    TIME,
    TIME_FUNCTION,
    UNKNOWN,
    Function,
    Header,
    function_block,
    numbers,
    samples,
)
from ._fields import DIRECTIONS, QUANTITIES, UNITS, quantity_of, require_finite
from ._units import time_scale

__all__ = ["Channel", "ChannelHeader"]


@dataclass(frozen=True, eq=False)
class Channel:
    """One measured time function in SI units.

    Raises
    ------
    RecordError
        For a value that no channel can have; the message names the channel.
    """

    name: str
    """label in the file"""
    node: int
    """number of the node"""
    direction: str
    """ "+X" to "-RZ", or "S" for a scalar"""
    quantity: str
    """ "acceleration" (m/s²), "velocity" (m/s), "displacement" (m) or "force" (N)"""
    value: np.ndarray
    """(n_t,)"""
    fs: float
    """samples per second"""
    start: float = 0.0
    """s, time of the first sample"""

    def __post_init__(self):
        name, value = self.name, np.ascontiguousarray(self.value, dtype=float)
        if not name or len(name) > NAME_LIMIT or not name.isprintable() or name != name.strip():
            raise RecordError(f"channel name {name!r} must be 1 to {NAME_LIMIT} printable characters")
        if not 0 <= self.node < 10**9:
            raise RecordError(f'channel "{name}": node {self.node} must be a whole number of at most 9 digits')
        if self.direction not in DIRECTIONS:
            raise RecordError(f'channel "{name}": direction "{self.direction}" is unknown; use {", ".join(DIRECTIONS)}')
        if self.quantity not in QUANTITIES:
            raise RecordError(f'channel "{name}": quantity "{self.quantity}" is unknown; use {", ".join(QUANTITIES)}')
        if value.ndim != 1 or not value.size:
            raise RecordError(f'channel "{name}" must be one row of samples, got shape {value.shape}')
        require_finite(value, f'channel "{name}"')
        if not 0 < self.fs < np.inf or not np.isfinite(self.start):
            raise RecordError(f'channel "{name}": fs must be > 0 Hz and start finite, got {self.fs}, {self.start}')
        object.__setattr__(self, "value", value)

    @property
    def label(self) -> str:
        """Degree of freedom, such as "3:+Z"."""
        return f"{self.node}:{self.direction}"

    @property
    def size(self) -> int:
        """Number of samples."""
        return self.value.size


@dataclass(frozen=True)
class ChannelHeader:
    """What a file says of a time function, without its samples; the fields are those of `Channel`."""

    name: str
    """label in the file"""
    node: int
    """number of the node"""
    direction: str
    """ "+X" to "-RZ", or "S" for a scalar"""
    quantity: str
    """as in `Channel`"""
    size: int
    """number of samples"""
    fs: float
    """samples per second"""
    start: float
    """s, time of the first sample"""


def read_channel_header(data: bytes, function: Function) -> ChannelHeader:
    try:
        quantity = quantity_of(function.numerator, "ordinate")
        if function.is_complex:
            raise RecordError("a time function must be real, its ordinate data type is complex")
        if function.abscissa_type not in (TIME, *UNKNOWN):
            raise RecordError(f"abscissa type {function.abscissa_type} of a time function must be 17 (time)")
        time_scale(function, quantity)
    except RecordError as error:
        raise RecordError(f"data set {function.number}: {error}") from None
    node, direction = function.response.split(":")
    fs, start = _timing(data, function)
    name = function.response if function.name in ("", "NONE") else function.name
    return ChannelHeader(name, int(node), direction, quantity, function.size, fs, start)


def read_channel(data: bytes, function: Function) -> Channel:
    header = read_channel_header(data, function)
    value = samples(data, function, time_scale(function, header.quantity))
    return Channel(header.name, header.node, header.direction, header.quantity, value, header.fs, header.start)


def _timing(data: bytes, function: Function) -> tuple[float, float]:
    """Sampling rate in Hz and time of the first sample in s."""
    if function.even:
        slack = 0.5 * 10.0 ** Decimal(function.step).as_tuple().exponent
        return simplest_rate(float(function.step), slack), function.first
    # Precision of the stored times: E13.5, single, double.
    digits = 5e-6 if not function.dtype else 6e-8 if not function.is_double else 1e-15
    try:
        return even_rate(numbers(data, function)[:, 0], digits)
    except RecordError as error:
        raise RecordError(f"data set {function.number}: {error}") from None


def even_rate(time: np.ndarray, digits: float) -> tuple[float, float]:
    """Sampling rate in Hz and time of the first sample in s, of instants in even steps.

    Parameters
    ----------
    time : ndarray, shape (n_t,)
        s.
    digits : float
        Relative precision of the numbers.

    Raises
    ------
    RecordError
        If the steps are uneven.
    """
    if time.size < 2:
        raise RecordError("needs two samples to tell its time step")
    step = (time[-1] - time[0]) / (time.size - 1)
    slack = 2 * digits * np.abs(time).max()
    off = np.abs(time - (time[0] + step * np.arange(time.size))) > 1e-3 * step + slack
    if not step > slack or off.any():
        raise RecordError(
            f"its times are uneven at sample {int(np.argmax(off))} or have too few digits; needs one time step "
            "throughout"
        )
    return simplest_rate(float(step), slack / (time.size - 1)), float(time[0])


def simplest_rate(step: float, slack: float) -> float:
    """Return the rate with the fewest decimals whose time step is ``step`` within ``slack``.

    Six digits is all that a header holds of a time step: 1/2048 s is written as 4.88281e-04.

    Parameters
    ----------
    step : float
        s, as it was written.
    slack : float
        s, what rounding may have changed.

    Returns
    -------
    float
        Samples per second.
    """
    slack = 1.001 * min(slack, 1e-5 * step)
    for decimals in range(12):
        rate = round(1 / step, decimals)
        if rate > 0 and abs(1 / rate - step) <= slack:
            return rate
    return 1 / step


def require_one_time(channels):
    """Refuse channels that do not share rate, length and start, as those of one table do.

    Parameters
    ----------
    channels : sequence of Channel
        The channels.

    Raises
    ------
    RecordError
        Naming the two that differ; also if there is none.
    """
    if not channels:
        raise RecordError("there is no channel")
    first = channels[0]
    for c in channels:
        if (c.size, c.fs, c.start) != (first.size, first.fs, first.start):
            raise RecordError(
                f'channel "{c.name}" has {c.size} samples at {c.fs:g} Hz from {c.start:g} s, "{first.name}" has '
                f"{first.size} at {first.fs:g} Hz from {first.start:g} s; a table needs one time, .uff does not"
            )


def channel_blocks(obj) -> list[bytes]:
    try:
        channels = list(getattr(obj, "channels", obj))
    except TypeError:
        channels = [obj]
    for item in channels:
        if not isinstance(item, Channel):
            raise RecordError(f"needs a sequence of Channel, a Record or an FRF, got {type(item).__name__}")
    if not channels:
        raise RecordError("there is no channel")
    return [_channel_block(c) for c in channels]


def _channel_block(channel: Channel) -> bytes:
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
        unit=UNITS[channel.quantity],
    )
    return function_block(header, channel.value.astype("<f4"))


def _step_text(fs: float) -> str:
    """Write 1/fs in the usual six digits if reading gives fs again, or else in up to eight, which fill the field."""
    for digits in (5, 6, 7):
        text = f"{1 / fs:.{digits}e}"
        slack = 0.5 * 10.0 ** Decimal(text).as_tuple().exponent
        if simplest_rate(float(text), slack) == fs:
            return text
    return text
