"""What every command has in common: its registration, the options that all have, and how results are written."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, Protocol

from ..errors import ClearanceError
from ..files import replacing, to_json

__all__ = ["COMMANDS", "Command", "Parser", "command", "out_folder", "write_figures", "write_json"]


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
    """takes the parsed options, returns what ``--json`` prints"""
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


def write_json(path: Path, data: Any) -> None:
    """Write plain data; the file is replaced only once the new one is whole."""
    with replacing(path) as temporary:
        temporary.write_text(to_json(data), encoding="utf-8")


class _Drawing(Protocol):
    @property
    def name(self) -> str: ...

    def png(self) -> bytes: ...


def write_figures(folder: Path, drawings: Iterable[_Drawing]) -> list[str]:
    """Write drawings as PNG files named like them; return the files' paths."""
    paths = []
    for drawing in drawings:
        paths.append(folder / f"{drawing.name}.png")
        with replacing(paths[-1]) as temporary:
            temporary.write_bytes(drawing.png())
    return [str(path) for path in paths]
