"""What every command has in common: its registration, the options that all have, and how results are written."""

from __future__ import annotations

import argparse
import contextlib
import io
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from ..core.errors import ClearanceError

if TYPE_CHECKING:  # the command line starts without the library
    from ..model import Model
    from ..report.style import Drawing

__all__ = [
    "COMMANDS", "Command", "Parser", "command", "inputs", "out_file", "out_folder", "provenance", "results_of", "say",
    "settings", "spelled", "warn_of_depths", "write_results",
]  # fmt: skip

OUTPUTS = {"out", "new", "energy", "figures", "schema"}  # options that name what is written; every other path is read


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """End with status 2 and what is wrong."""
        self.exit(2, f"{ClearanceError(f'{self.prog}: {message}')} (see {self.prog} --help)\n")


@dataclass(frozen=True)
class Command:
    """A command of the command line."""

    name: str  #: what users type
    help: str  #: one line
    options: Callable[[argparse.ArgumentParser], None]  #: adds the command's own options
    run: Callable[[argparse.Namespace], Any]
    """takes the parsed options, prints what was done, returns what ``--json`` prints instead"""
    out: Path | None  #: default of ``--out``
    out_help: str | None  #: help of ``--out``
    is_folder: bool  #: whether ``--out`` is a folder, which figures are written into

    def add(self, commands: argparse._SubParsersAction[Parser]) -> None:
        """Add its parser, with the options that all commands have."""
        parser = commands.add_parser(self.name, description=self.help)
        parser.set_defaults(run=self.run, parser=parser)
        parser.add_argument("--json", action="store_true", help="print the result as JSON")
        parser.add_argument("--quiet", action="store_true", help="show no progress bars")
        parser.add_argument("--out", type=Path, default=self.out, help=self.out_help)
        if self.is_folder:
            parser.add_argument("--figures", choices=("svg", "pdf"), help="write figures so too, beside PNG")
        self.options(parser)


COMMANDS: dict[str, Command] = {}  # Every command by its name.
Run = Callable[[argparse.Namespace], Any]


def command(
    name: str,
    help: str,
    options: Callable[[argparse.ArgumentParser], None],
    out: Path | None = None,
    out_help: str | None = None,
    writes: Sequence[str] = (),
) -> Callable[[Run], Run]:
    """Make a function a command; a decorator. ``options`` adds its own options to its parser, ``out`` is a default.

    Where ``writes`` names files, ``--out`` is a folder: the function writes them into ``options.new``, and once all
    are whole they take their places in the folder, see `output_folder`. Others that are there are not replaced.
    """

    def register(run: Run) -> Run:
        published = _publishing(name, writes, run) if writes else run
        is_folder = bool(writes or (out and not out.suffix))
        COMMANDS[name] = Command(name, help, options, published, out, out_help, is_folder)
        return run

    return register


def results_of(name: str, *more: str) -> dict[str, Any]:
    """Return where a command writes NAME.csv, .json, .png and ``more`` files, as arguments of `command`."""
    files = (*(f"{name}.{end}" for end in ("csv", "json", "png")), *more)
    words = f"folder for {', '.join(files)} (default: %(default)s)"
    return {"out": Path("results") / name, "out_help": words, "writes": files}


def _publishing(name: str, writes: Sequence[str], run: Run) -> Run:
    def published(options: argparse.Namespace) -> Any:
        from ..core.output_folder import output_folder

        if options.out is None:
            return run(options)
        with output_folder(options.out, name, inputs(options)) as folder:
            folder.refuse_others(*writes)
            options.new = folder.new
            with contextlib.redirect_stdout(io.StringIO()) as said:
                found = run(options)
        print(said.getvalue(), end="")  # where nobody can read, the files are there all the same
        return found

    return published


def inputs(options: argparse.Namespace) -> list[Path]:
    """Files and folders that a command was given to read."""
    return [path for name, value in vars(options).items() if name not in OUTPUTS for path in _paths(value)]


def _paths(value: object) -> Iterator[Path]:
    if isinstance(value, Path):
        yield value
    elif isinstance(value, list):
        yield from (path for path in value if isinstance(path, Path))


def provenance(options: argparse.Namespace) -> dict[str, Any]:
    """Return what a command's results come from: versions of the program and its libraries, digests of what it read."""
    from ..core.provenance import made_from

    return made_from(inputs(options), options.command)


def write_results(
    options: argparse.Namespace, name: str, result: dict[str, Any], table: Any = None, *drawings: Drawing
) -> dict[str, Any]:
    """Write what a command found, with what it comes from: as JSON, rows as CSV, drawings; return what ``--json`` says.

    Nothing is written if the results are no JSON.
    """
    from ..core.files import to_json, write_text
    from ..report.tables import write_csv

    result = result | {"provenance": provenance(options)}
    write_text(options.new / f"{name}.json", to_json(result))
    if table is not None:
        write_csv(options.new / f"{name}.csv", table)
    for drawing in drawings:
        drawing.write(options.new)
    return result | {"out": str(options.out)}


def settings(model: Model) -> dict[str, Any]:
    """Return what results of a model carry: rig, law, the version, and the digest of the program's sources."""
    from ..core.cache import code
    from ..version import __version__

    return {"version": __version__, "code": code()} | model.to_dict()


def say(words: str, kind: str = "note") -> None:
    """Tell the user something beside the results."""
    print(f"clearance-mj: {kind}: {words}", file=sys.stderr)


def warn_of_depths(model: Model, largest: Any, quantity: str = "penetration") -> None:
    """Say where walls are pressed too deep, from the largest penetrations (n_bushings,), m, or contact forces, N.

    Of a force the depth is that of both ends at the largest stiffness: it is at least so deep.
    """
    from ..rig.depths import depth_words

    if quantity == "contact_force":
        largest = largest / model.law.largest([bushing.gap for bushing in model.rig.bushings])[0]
    for words in depth_words(model.rig, largest) if quantity != "acceleration" else ():
        say(words, "warning")


def spelled(*words: object) -> str:
    """Return a command of this program as one types it in a shell: names with blanks in quotes."""
    return shlex.join(["clearance-mj", *map(str, words)])


def out_folder(folder: Path | None) -> None:
    """Refuse a file that was given by ``--out`` where results need a folder."""
    if folder and folder.is_file():
        raise ClearanceError(f"--out {folder} is a file; give a folder")


def out_file(path: Path, suffixes: Sequence[str], read: Sequence[Path], ours: Callable[[Path], bool]) -> None:
    """Refuse a file to write that has another suffix, is ``read`` too, or is there already and not ``ours``."""
    if path.suffix.lower() not in suffixes:
        raise ClearanceError(f"--out {path}: give a name that ends in {' or '.join(suffixes)}")
    if not path.exists():
        return
    if any(other.exists() and path.samefile(other) for other in read):
        raise ClearanceError(f"--out {path} is read by this command; give another name")
    if path.is_file() and not ours(path):
        raise ClearanceError(f"--out {path} is there and does not say that clearance-mj wrote it; give another name")
