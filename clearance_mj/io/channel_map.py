"""Maps of channels: the quantity, place and unit of each channel of a logger's files, by its name in them.

A map is made once for a bench, by hand or by `clearance_mj.map_channels`, and kept in a TOML file:

    [channels]
    "Accel plate [g]" = "base"          # a channel's name in the file, and its meaning
    "A3" = "acc:3:-Z [g]"               # a unit where the file says none, or a wrong one
    "Temp" = "skip"                     # left out
    "A7" = "?"                          # undecided: nothing is read with the map until it is

The names on the right are those of `clearance_mj.io.columns`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike

import numpy as np
import tomli_w

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import read_lines, write_text
from ..core.overview import HasOverview, Overview, few
from ..core.units import unit_factor
from .channels import UNKNOWN, Channel, place_of
from .columns import SKIP, ColumnHeader, resolve

__all__ = ["UNDECIDED", "ChannelMap"]

UNDECIDED = "?"
"""Entry of a channel whose meaning has still to be decided."""


@dataclass(frozen=True, repr=False)
class ChannelMap(HasOverview):
    """Meaning of each channel of a bench's files.

    Parameters
    ----------
    channels : mapping of str to str
        Entry of each channel, such as "acc:3:-Z [g]", "skip" or "?", by its name in the files.
    reasons : mapping of str to str
        Reasons for the entries, by the same names; they become comments of the file.
    notes : sequence of str
        Remarks on the files, comments at the head of the map's file.
    """

    channels: Mapping[str, str]
    reasons: Mapping[str, str] = field(default_factory=dict)
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        for name, entry in self.channels.items():
            if entry not in (SKIP, UNDECIDED):
                with naming(f'channel "{name}"'):
                    _column(name, entry)

    __repr__ = HasOverview.__repr__

    @property
    def undecided(self) -> tuple[str, ...]:
        """Names of the channels that somebody has to decide."""
        return tuple(name for name, entry in self.channels.items() if entry == UNDECIDED)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> ChannelMap:
        """Read a map from a TOML file.

        Parameters
        ----------
        path : str or Path
            The file.

        Raises
        ------
        RecordError
            If the file cannot be read, or a channel has an impossible entry.
        """
        text = "\n".join(read_lines(path))
        with naming(path):
            with naming("is no TOML file", tomllib.TOMLDecodeError, RecordError, "{} ({})"):
                table = tomllib.loads(text)
            channels = table.get("channels")
            if not isinstance(channels, dict) or not all(isinstance(v, str) for v in channels.values()):
                raise RecordError('needs a table [channels] with lines such as "A3" = "acc:3 [g]"')
            return cls(channels)

    def to_toml(self) -> str:
        """Return the map as the text of a TOML file, with its reasons as comments."""
        lines = [*(f"# {note}" for note in self.notes), "[channels]"]
        for name, entry in self.channels.items():
            line = tomli_w.dumps({name: entry}).strip()
            reason = self.reasons.get(name, "")
            lines.append(f"{line}  # {reason}" if reason else line)
        return "\n".join(lines) + "\n"

    def save(self, path: str | PathLike[str]) -> None:
        """Write the map as a TOML file.

        Parameters
        ----------
        path : str or Path
            The file; an existing one is replaced once the new one is whole.
        """
        write_text(path, self.to_toml())

    def apply(self, channels: Sequence[Channel]) -> list[Channel]:
        """Return channels with the quantity, place and unit that the map gives; those that it skips are left out.

        Parameters
        ----------
        channels : sequence of Channel
            Channels of a file. One that the map does not name is kept if its file says where it measured.

        Raises
        ------
        RecordError
            If a channel is undecided, unknown to the map and nowhere, or of another quantity than the map says.
        """
        mapped = []
        for channel in channels:
            entry = self.channels.get(channel.name)
            if entry == SKIP:
                continue
            if entry == UNDECIDED:
                reason = self.reasons.get(channel.name, "")
                raise RecordError(
                    f'channel "{channel.name}" is undecided in the map{f" ({reason})" if reason else ""}: write what '
                    f'it is instead of "{UNDECIDED}", such as "acc:3 [g]", or "{SKIP}" to leave it out'
                )
            if entry is None and (not channel.placed or channel.quantity == UNKNOWN):
                listing = few([f'"{name}"' for name in self.channels])
                raise RecordError(
                    f'channel "{channel.name}" is not in the map, which has {listing}; add a line such as '
                    f'"{channel.name}" = "acc:3 [g]", or = "{SKIP}"'
                )
            with naming(f'channel "{channel.name}"'):
                mapped.append(channel if entry is None else _apply_entry(channel, entry))
        if not mapped:
            raise RecordError("has no channel that the map does not skip")
        return mapped

    def _overview(self) -> Overview:
        rows = [(name, entry, self.reasons.get(name, "")) for name, entry in self.channels.items()]
        facts = {"undecided": few(self.undecided)} | {f"note {i}": note for i, note in enumerate(self.notes, 1)}
        return Overview(f"Map of {len(self.channels)} channels", facts, [("channel", "is", "because"), *rows])


def _column(name: str, entry: str) -> ColumnHeader:
    (column,) = resolve([name], {name: entry})
    if column.reference:
        raise RecordError(f'"{entry}" is an FRF; a map is of channels over time')
    return column


def _apply_entry(channel: Channel, entry: str) -> Channel:
    """Return a channel as the map has it; a unit that the map gives goes before that of the file."""
    column = _column(channel.name, entry)
    node, direction = place_of(column.dof)
    value = channel.value
    if "[" in entry or channel.quantity == UNKNOWN:
        is_scaled = channel.quantity != UNKNOWN and channel.unit
        as_in_file = 1 / unit_factor(channel.unit, channel.quantity) if is_scaled else 1.0
        value = np.asarray(value * (column.scale * as_in_file))
    elif column.quantity not in (channel.quantity, UNKNOWN):
        raise RecordError(
            f'is {channel.quantity} by its unit in the file, the map says "{entry}"; give the unit of its numbers too, '
            f'as in "{entry} [...]"'
        )
    return replace(channel, quantity=column.quantity, node=node, direction=direction, value=value, unit="")
