"""What the channels of a logger's files are: names of files' channels, and where on the rig each one measures.

A map is made once for a bench, by hand or by `clearance_mj.map_channels`, and kept in a TOML file:

    [channels]
    "Accel plate [g]" = "base"          # a channel's name in the file, and what it is
    "A3" = "acc:3:-Z [g]"               # a unit where the file says none, or a wrong one
    "Temp" = "skip"                     # left out
    "A7" = "?"                          # undecided: nothing is read with the map until it is

The names on the right are those of `clearance_mj.io.columns`.
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike

import numpy as np
import tomli_w

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import read_lines, write_text
from ..core.overview import Overview, Shown, few
from ..core.units import unit_factor
from .channels import UNKNOWN, Channel
from .columns import SKIP, Column, resolve

__all__ = ["UNDECIDED", "ChannelMap"]

UNDECIDED = "?"
"""What a channel is mapped to that somebody has to decide."""


@dataclass(frozen=True, repr=False)
class ChannelMap(Shown):
    """What each channel of a bench's files is.

    Parameters
    ----------
    channels : mapping of str to str
        What each channel is, such as "acc:3:-Z [g]", "skip" or "?", by its name in the files.
    reasons : mapping of str to str
        Why, in words, by the same names; they become comments of the file.
    notes : sequence of str
        What else is said of the files.
    """

    channels: Mapping[str, str]
    reasons: Mapping[str, str] = field(default_factory=dict)
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        for name, given in self.channels.items():
            if given not in (SKIP, UNDECIDED):
                with naming(f'channel "{name}"'):
                    _column(name, given)

    __repr__ = Shown.__repr__

    @property
    def undecided(self) -> tuple[str, ...]:
        """Names of the channels that somebody has to decide."""
        return tuple(name for name, given in self.channels.items() if given == UNDECIDED)

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
            If the file cannot be read, or a channel is mapped to what no channel can be.
        """
        text = "\n".join(read_lines(path))
        with naming(path):
            with naming("is no TOML file", tomllib.TOMLDecodeError, RecordError, "{} ({})"):
                found = tomllib.loads(text)
            channels = found.get("channels")
            if not isinstance(channels, dict) or not all(isinstance(v, str) for v in channels.values()):
                raise RecordError('needs a table [channels] with lines such as "A3" = "acc:3 [g]"')
            return cls(channels)

    def to_toml(self) -> str:
        """Return the map as the text of a TOML file, with its reasons as comments."""
        lines = [*(f"# {note}" for note in self.notes), "[channels]"]
        for name, given in self.channels.items():
            line = tomli_w.dumps({name: given}).strip()
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
        """Return channels with the quantity, place and values that the map says; others that it skips are left out.

        Parameters
        ----------
        channels : sequence of Channel
            Channels of a file. One that the map does not name is kept if its file says where it measured.

        Raises
        ------
        RecordError
            If a channel is undecided, unknown to the map and nowhere, or of another quantity than the map says.
        """
        found = []
        for channel in channels:
            given = self.channels.get(channel.name)
            if given == SKIP:
                continue
            if given == UNDECIDED:
                reason = self.reasons.get(channel.name, "")
                raise RecordError(
                    f'channel "{channel.name}" is undecided in the map{f" ({reason})" if reason else ""}: write what '
                    f'it is instead of "{UNDECIDED}", such as "acc:3 [g]", or "{SKIP}" to leave it out'
                )
            if given is None:
                if not channel.placed or channel.quantity == UNKNOWN:
                    known = few([f'"{name}"' for name in self.channels])
                    raise RecordError(
                        f'channel "{channel.name}" is not in the map, which has {known}; add a line such as '
                        f'"{channel.name}" = "acc:3 [g]", or = "{SKIP}"'
                    )
                found.append(channel)
                continue
            with naming(f'channel "{channel.name}"'):
                found.append(_mapped(channel, given))
        if not found:
            raise RecordError("has no channel that the map does not skip")
        return found

    def _overview(self) -> Overview:
        rows = [(name, given, self.reasons.get(name, "")) for name, given in self.channels.items()]
        facts = {"undecided": few(self.undecided)} | {f"note {i}": note for i, note in enumerate(self.notes, 1)}
        return Overview(f"Map of {len(self.channels)} channels", facts, [("channel", "is", "because"), *rows])


def _column(name: str, given: str) -> Column:
    (column,) = resolve([name], {name: given})
    if column.reference:
        raise RecordError(f'"{given}" is an FRF; a map is of channels over time')
    return column


def _mapped(channel: Channel, given: str) -> Channel:
    """A channel as the map has it; a unit that the map gives goes before that of the file."""
    column = _column(channel.name, given)
    node, direction = column.dof.split(":")
    value = channel.value
    if "[" in given or channel.quantity == UNKNOWN:
        as_in_file = 1.0
        if channel.quantity != UNKNOWN and channel.unit:
            as_in_file = 1 / unit_factor(channel.unit, channel.quantity)
        value = np.asarray(value * (column.scale * as_in_file))
    elif column.quantity not in (channel.quantity, UNKNOWN):
        raise RecordError(
            f'is {channel.quantity} by its unit in the file, the map says "{given}"; give the unit of its numbers too, '
            f'as in "{given} [...]"'
        )
    return dataclasses.replace(
        channel, quantity=column.quantity, node=int(node), direction=direction, value=value, unit=""
    )
