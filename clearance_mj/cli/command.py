"""What every command has in common: its registration, the options that all have, and how results are written."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from ..errors import ClearanceError

__all__ = ["COMMANDS", "Command", "Parser", "command", "out_folder"]


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """End with status 2 and what is wrong."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


@dataclass(frozen=True)
class Command:
    """A command of the command line."""

    name: str
    """what users type"""
    help: str
    """one line"""
    options: Callable[[argparse.ArgumentParser], None]
    """adds the command's own options"""
    run: Callable[[argparse.Namespace], Any]
    """takes the parsed options, prints what was done, returns what ``--json`` prints instead"""
    out: Path | None
    """default of ``--out``"""
    out_help: str | None
    """help of ``--out``"""

    def add(self, commands: argparse._SubParsersAction[Parser]) -> None:
        """Add its parser, with the options that all commands have."""
        parser = commands.add_parser(self.name, help=self.help, description=self.help)
        parser.set_defaults(run=self.run, parser=parser)
        parser.add_argument("--json", action="store_true", help="print the result as JSON")
        parser.add_argument("--quiet", action="store_true", help="show no progress bars")
        parser.add_argument("--out", type=Path, default=self.out, help=self.out_help)
        self.options(parser)


COMMANDS: dict[str, Command] = {}
"""Every command by its name"""
Run = Callable[[argparse.Namespace], Any]


def command(
    name: str,
    help: str,
    options: Callable[[argparse.ArgumentParser], None],
    out: Path | None = None,
    out_help: str | None = None,
) -> Callable[[Run], Run]:
    """Make a function a command; a decorator. ``options`` adds its own options to its parser, ``out`` is a default."""

    def register(run: Run) -> Run:
        COMMANDS[name] = Command(name, help, options, run, out, out_help)
        return run

    return register


def out_folder(folder: Path | None, option: str = "--out") -> None:
    """Refuse a file that was given by an option where results need a folder."""
    if folder and folder.is_file():
        raise ClearanceError(f"{option} {folder} is a file; give a folder")
