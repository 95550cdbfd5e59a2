"""Measured time functions, which every format of records reads and writes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.checks import DIRECTIONS, NAME_LIMIT, UNKNOWN, require_finite
from ..core.errors import RecordError
from ..core.quantities import QUANTITIES
from ..signals.channel_check import check_channel

__all__ = ["DIRECTIONS", "NOWHERE", "QUANTITIES", "UNKNOWN", "Channel", "ChannelHeader", "channel_faults", "place_of"]

NOWHERE = (0, "S")
"""Node and direction of a channel whose file does not say where it measured."""


@dataclass(frozen=True, eq=False)
class _Measured:
    """Name, place and quantity of a time function."""

    name: str
    """label in the file"""
    node: int
    """number of the node"""
    direction: str
    """ "+X" to "-RZ", or "S" for a scalar"""
    quantity: str
    """one of `core.quantities.QUANTITIES`, such as "acceleration" (m/s²), or
    "unknown", which no calculation uses until `clearance_mj.map_channels` or a map of columns gives its quantity"""

    @property
    def label(self) -> str:
        """Degree of freedom, such as "3:+Z"."""
        return f"{self.node}:{self.direction}"

    @property
    def placed(self) -> bool:
        """True if the file says where the channel measured."""
        return (self.node, self.direction) != NOWHERE


@dataclass(frozen=True)
class ChannelHeader(_Measured):
    """Header of a time function, without its samples; the fields are those of `Channel`."""

    size: int
    fs: float
    start: float
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Channel(_Measured):
    """One measured time function; a RecordError names a channel with impossible values.

    Values are in SI units where the quantity is known, and otherwise as they are in the file.
    """

    value: np.ndarray
    """(n_t,), read-only"""
    fs: float
    """samples per second"""
    start: float = 0.0
    """s, time of the first sample"""
    unit: str = ""
    """label of the unit in the file of a channel of unknown quantity; "" if the file says none"""

    def __post_init__(self) -> None:
        name, value = self.name, np.ascontiguousarray(self.value, dtype=float).view()
        if not name or len(name) > NAME_LIMIT or not name.isprintable() or name != name.strip():
            raise RecordError(f"channel name {name!r} must be 1 to {NAME_LIMIT} printable characters")
        if not 0 <= self.node < 10**9:
            raise RecordError(f'channel "{name}": node {self.node} must be a whole number of at most 9 digits')
        RecordError.require_known(f'channel "{name}": direction', self.direction, DIRECTIONS)
        RecordError.require_known(f'channel "{name}": quantity', self.quantity, (*QUANTITIES, UNKNOWN))
        if len(self.unit) > NAME_LIMIT or not self.unit.isprintable():
            raise RecordError(f'channel "{name}": unit {self.unit!r} must be at most {NAME_LIMIT} printable characters')
        if value.ndim != 1 or not value.size:
            raise RecordError(f'channel "{name}" must be one row of samples, got shape {value.shape}')
        require_finite(value, f'channel "{name}"')
        if not 0 < self.fs < np.inf or not np.isfinite(self.start):
            raise RecordError(f'channel "{name}": fs must be > 0 Hz and start finite, got {self.fs}, {self.start}')
        value.flags.writeable = False
        object.__setattr__(self, "value", value)

    @property
    def size(self) -> int:
        """Number of samples."""
        return self.value.size

    @property
    def time(self) -> np.ndarray:
        """(n_t,) s"""
        return self.start + np.arange(self.size) / self.fs


def place_of(dof: str) -> tuple[int, str]:
    """Return node and direction of a degree of freedom, such as "3:+Z"."""
    node, _, direction = dof.partition(":")
    return int(node), direction


def channel_faults(channels: Sequence[Channel], all_known: bool = True) -> list[str]:
    """Return in words which channels are clipped or constant; ``all_known``: of known quantity, for pulses are flat."""
    faults = []
    for c in channels:
        try:
            if c.quantity != UNKNOWN or not all_known:
                check_channel(f'channel "{c.name}"', c.value, c.fs)
        except RecordError as error:
            faults.append(str(error))
    return faults


def require_one_time(channels: Sequence[Channel]) -> None:
    """Refuse channels of different rate, length or start; those of one table need the same."""
    if not channels:
        raise RecordError("there is no channel")
    first = channels[0]
    for c in channels:
        if (c.size, c.fs, c.start) != (first.size, first.fs, first.start):
            raise RecordError(
                f'channel "{c.name}" has {c.size} samples at {c.fs:g} Hz from {c.start:g} s, "{first.name}" has '
                f"{first.size} at {first.fs:g} Hz from {first.start:g} s; a table needs one time, .uff does not"
            )
