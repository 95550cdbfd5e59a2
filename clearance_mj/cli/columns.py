"""Options that say what the columns of a table are, for the commands that read files."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

from ..errors import ClearanceError

__all__ = ["add_columns", "parse_columns"]


def add_columns(parser: argparse.ArgumentParser, name: str = "--column", of: str = "a CSV, LVM or MATLAB file") -> None:
    """Add the option ``name`` that maps columns ``of`` some file."""
    parser.add_argument(
        name, action="append", default=[], metavar="HEADER=CHANNEL",
        help=f'what a column of {of} is, such as "Accel 1=acc:1 [g]" or "Temp=skip"; may be repeated. Headers time, '
        "base, force, acc:NODE and disp:NODE need none; units in brackets, SI without",
    )  # fmt: skip


def parse_columns(pairs: Sequence[str], option: str = "--column") -> Iterator[tuple[str, str]]:
    """Header and channel of each "HEADER=CHANNEL"; a ClearanceError names the option if one is none."""
    for pair in pairs:
        header, equals, channel = pair.rpartition("=")
        if not (header and equals and channel):
            raise ClearanceError(f'{option} "{pair}": needs HEADER=CHANNEL, such as "Accel 1=acc:1 [g]"')
        yield header.strip(), channel.strip()
