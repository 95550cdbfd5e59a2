"""What every command has in common."""

from __future__ import annotations

import argparse
from pathlib import Path

__all__ = ["add_command"]


def add_command(commands, name: str, run, help_: str, **out) -> argparse.ArgumentParser:
    """Add a command with the options that all have: ``--json``, ``--quiet``, ``--out``.

    Parameters
    ----------
    commands : argparse subparsers
        Where to add it.
    name : str
        The command.
    run : callable
        Takes the parsed options, returns what ``--json`` prints.
    help_ : str
        One line.
    **out
        Default and help of ``--out``.
    """
    parser = commands.add_parser(name, help=help_, description=help_)
    parser.set_defaults(run=run)
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    parser.add_argument("--quiet", action="store_true", help="show no progress bars")
    parser.add_argument("--out", type=Path, **out)
    return parser
