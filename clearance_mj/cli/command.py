"""Parts common to all commands: declaration, options that all have, and writing of results."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

from ..core.cache import code
from ..core.errors import ClearanceError
from ..core.files import to_json, write_text
from ..core.output_folder import output_folder
from ..core.provenance import is_marked, made_from
from ..version import __version__

if TYPE_CHECKING:  # what is only listed needs no library
    from ..model import Model
    from ..report.style import Drawing

__all__ = [
    "COMMANDS", "RESULTS", "Command", "Group", "Option", "Options", "Parser", "Result", "command", "flag", "given",
    "inform", "inputs", "option", "out_file", "provenance", "settings", "spelled", "warn_of_depths",
]  # fmt: skip

OUTPUTS = {"out", "new", "energy", "figures", "schema"}  # options that name what is written; every other path is read
RESULTS = ("*.csv", "*.json", "*.png")  # files that most commands write
Options: TypeAlias = argparse.Namespace


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """End with status 2 and what is wrong."""
        self.exit(2, f"{ClearanceError(f'{self.prog}: {message}')} (see {self.prog} --help)\n")


@dataclass(frozen=True)
class Option:
    """An option of a command or, without dashes, an argument."""

    name: str  #: what users type
    settings: dict[str, Any]  #: of `argparse.ArgumentParser.add_argument`

    def add(self, parser: argparse._ActionsContainer) -> None:
        """Let a parser know it."""
        parser.add_argument(self.name, **self.settings)


@dataclass(frozen=True)
class Group:
    """Options that are listed under a title; without one they exclude each other."""

    title: str | None  #: what they are of
    options: tuple[Option | Group, ...]  #: in the order of the help

    def add(self, parser: argparse._ActionsContainer) -> None:
        """Let a parser know them."""
        group = parser.add_argument_group(self.title) if self.title else parser.add_mutually_exclusive_group()
        for each in self.options:
            each.add(group)


def option(name: str, help: str, type: Callable[[str], Any] | None = None, default: Any = None, **more: Any) -> Option:
    """Return an option, whose help says its default; of one that may be repeated that is none."""
    if more.get("action") == "append":
        default, help = [], f"{help}; may be repeated"
    elif default not in (None, ()) and "(default: " not in help:
        help += " (default: %(default)s)"
    return Option(name, {"help": help, "type": type, "default": default} | more)


def flag(name: str, help: str) -> Option:
    """Return an option without a value."""
    return Option(name, {"help": help, "action": "store_true"})


@dataclass(frozen=True)
class Result:
    """Results of a command."""

    data: dict[str, Any]  #: what ``--json`` prints, and the command's JSON file holds
    words: Iterable[str] = ()  #: lines that are printed
    rows: Any = None  #: table of the command's CSV file
    drawings: Iterable[Drawing] = ()  #: figures, in order


@dataclass(frozen=True)
class Command:
    """A command of the command line."""

    name: str  #: what users type
    run: Callable[[Options], Result]  #: takes the parsed options
    options: tuple[Option | Group, ...]  #: of this command
    out: Path | None  #: default of ``--out``
    out_help: str | None  #: help of ``--out``
    base: str  #: name of its JSON and CSV files
    holds_data: bool  #: whether its JSON file is what ``--json`` prints
    writes: Sequence[str]  #: files that it writes into the folder ``--out``
    suffixes: Sequence[str]  #: of the file ``--out``, of which only this program's are replaced

    def add(self, commands: argparse._SubParsersAction[Parser]) -> None:
        """Add its parser, with the options that all commands have."""
        parser = commands.add_parser(self.name, description=self.run.__doc__)
        parser.set_defaults(entry=self, parser=parser)
        common = [flag("--json", "print the result as JSON"), flag("--quiet", "show no progress bars")]
        common += [option("--out", self.out_help or "", Path, self.out)]
        if self.writes or (self.out and not self.out.suffix):
            common += [option("--figures", "write figures so too, beside PNG", choices=("svg", "pdf"))]
        for each in (*common, *self.options):
            each.add(parser)

    def result(self, options: Options) -> Result:
        """Return the results with options; files are written into the folder ``--out``.

        They are written into ``options.new``, and once all are whole they take their places in the folder, see
        `output_folder`. Others that are there are not replaced.
        """
        if options.out and self.suffixes:
            out_file(options.out, self.suffixes, inputs(options))
        if not (options.out and self.writes):
            return self.run(options)
        with output_folder(options.out, self.name, inputs(options)) as folder:
            folder.refuse_others(*self.writes)
            options.new = folder.new
            return self._write(self.run(options), options)

    def _write(self, result: Result, options: Options) -> Result:
        """Write data, rows and drawings; nothing if the data are no JSON."""
        from ..report.tables import write_csv

        drawings = [*result.drawings]
        figures = [str(options.out / f"{drawing.name}.png") for drawing in drawings]
        data, words = result.data | ({"figures": figures} if figures else {}), [*result.words]
        if self.holds_data:
            data |= {"provenance": provenance(options)}
            write_text(options.new / f"{self.base}.json", to_json(data))
        if result.rows is not None:
            write_csv(options.new / f"{self.base}.csv", result.rows)
        for path, drawing in zip(figures, drawings):
            drawing.write(options.new)
            words.append(f"figure: {path}\n  {drawing.caption}")
        page = next((name for name in self.writes if name.endswith(".html")), "")
        words.append(f"{self.name}: {options.out / page}")
        return Result(data, words)


COMMANDS: dict[str, Command] = {}  # Every command that was imported, by its name.


def command(
    name: str, *options: Option | Group, out: str | None = None, out_help: str | None = None, base: str | None = None,
    writes: Sequence[str] = (), suffixes: Sequence[str] = (),
) -> Callable[[Callable[[Options], Result]], Callable[[Options], Result]]:  # fmt: skip
    """Make a function a command; a decorator. The function's docstring is the command's help, ``out`` a default.

    Where ``writes`` names files, ``--out`` is a folder, by default one in ``results``, and of its `Result`
    ``BASE.json``, ``BASE.csv`` and drawings are written into it; ``base`` is by default the folder's name, and ``*``
    in a file's name.
    """
    if writes and out is None:
        out = f"results/{name.replace('-', '_')}"
    base = base or Path(out or name).name
    files = [file.replace("*", base) for file in writes]
    if files and out_help is None:
        out_help = f"folder for {', '.join(files)}"

    def register(run: Callable[[Options], Result]) -> Callable[[Options], Result]:
        folder, holds_data = Path(out) if out else None, "*.json" in writes
        COMMANDS[name] = Command(name, run, options, folder, out_help, base, holds_data, files, suffixes)
        return run

    return register


def given(options: Options, *names: str) -> list[str]:
    """Return the options that were given of some that are by default None or empty."""
    return [f"--{name.replace('_', '-')}" for name in names if getattr(options, name) not in (None, (), [])]


def inputs(options: Options) -> list[Path]:
    """Return the files and folders that a command was given to read."""
    values = (value for name, value in vars(options).items() if name not in OUTPUTS)
    each = (part for value in values for part in (value if isinstance(value, list) else [value]))
    return [path for path in each if isinstance(path, Path)]


def provenance(options: Options) -> dict[str, Any]:
    """Return the provenance of results: versions of the program and its libraries, digests of the files read."""
    return made_from(inputs(options), options.command)


def settings(model: Model) -> dict[str, Any]:
    """Return metadata of a model's results: rig, law, the version, and the digest of the program's sources."""
    return {"version": __version__, "code": code()} | model.to_dict()


def inform(words: str, kind: str = "note") -> None:
    """Print a message to the user, besides the results."""
    print(f"clearance-mj: {kind}: {words}", file=sys.stderr)


def warn_of_depths(model: Model, largest: Any, quantity: str = "penetration") -> None:
    """Warn of walls pressed too deep, from the largest penetrations (n_bushings,), m, or contact forces, N.

    Of a force the depth is that of both ends at the largest stiffness: it is at least so deep.
    """
    from ..rig.depths import depth_words

    if quantity == "contact_force":
        largest = largest / model.law.largest([bushing.gap for bushing in model.rig.bushings])[0]
    for words in depth_words(model.rig, largest) if quantity != "acceleration" else ():
        inform(words, "warning")


def spelled(*words: object) -> str:
    """Return a command of this program as one types it in a shell: names with blanks in quotes."""
    return shlex.join(["clearance-mj", *map(str, words)])


def out_file(
    path: Path, suffixes: Sequence[str], read: Sequence[Path], ours: Callable[[Path], bool] = is_marked
) -> None:
    """Refuse a file to write that has another suffix, is ``read`` too, or is there already and not ``ours``."""
    if path.suffix.lower() not in suffixes:
        raise ClearanceError(f"--out {path}: give a name that ends in {' or '.join(suffixes)}")
    if not path.exists():
        return
    if any(other.exists() and path.samefile(other) for other in read):
        raise ClearanceError(f"--out {path} is read by this command; give another name")
    if path.is_file() and not ours(path):
        raise ClearanceError(f"--out {path} is there and does not say that clearance-mj wrote it; give another name")
