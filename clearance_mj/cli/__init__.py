"""The command line. Bad input ends with one line that says what and where, and status 2."""

from __future__ import annotations

import argparse
import ast
import contextlib
import difflib
import errno
import io
import pkgutil
import re
import shutil
import sys
import textwrap
import warnings
from collections.abc import Iterable, Sequence
from importlib import import_module

from ..core.errors import ClearanceError
from ..core.files import to_json
from ..core.notes import RecordNote
from ..core.output_folder import vectors
from ..core.provenance import stale
from ..version import __version__
from .command import COMMANDS, Command, Parser, inform, inputs
from .streams import prepare, silence

__all__ = ["main"]

MISTAKEN = (errno.ENAMETOOLONG, errno.EACCES, errno.EPERM, errno.EROFS, errno.EISDIR, errno.ENOTDIR, errno.ENOENT,
            errno.ELOOP, errno.EINVAL, errno.EFBIG)  # fmt: skip
"""Errors of the system that come of a path that was given"""

_GROUPS = {
    "begin, read and write": "demo new map show convert",
    "identify from records": "identify update_rig twin hammer modes calibrate place drive",
    "predict": "simulate response backbone rattle_map listen sweep",
    "predict over tolerances, time and use": "production peaks life",
    "shafts that turn": "campbell unbalance orbits orbit_gaps running_clearance",
    "compare and see": "study compare animate motion live",
    "vehicles": "vehicle",
}  # modules of commands, by task; one is imported when it is used


def names() -> list[str]:
    """Return the names of all commands, those that a plugin added too."""
    return [*dict.fromkeys([*" ".join(_GROUPS.values()).replace("_", "-").split(), *COMMANDS])]


def find(name: str) -> Command:
    """Return a command by its name.

    Parameters
    ----------
    name : str
        One of `names`.
    """
    if name not in COMMANDS:
        import_module(f".{name.replace('-', '_')}", __name__)
    return COMMANDS[name]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run ``clearance-mj``.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: the process's own.

    Returns
    -------
    int
        0 when done, 1 when interrupted or failed in computing, 2 for bad input.
    """
    prepare()
    try:
        options = _parse(sys.argv[1:] if arguments is None else list(arguments))
        for words in stale(inputs(options)):
            inform(words)
        with contextlib.redirect_stdout(io.StringIO() if options.json else sys.stdout), warnings.catch_warnings():
            from ..rig.plausible import ImplausibleRig
            from .options import load_plugin

            warnings.showwarning = _print_warning
            warnings.simplefilter("error", ImplausibleRig)
            load_plugin(getattr(options, "plugin", None))
            with vectors(getattr(options, "figures", None)):
                result = options.entry.result(options)
            data = result.data | ({"out": str(options.out)} if options.out else {})
            said = to_json(data) if options.json else "".join(f"{words}\n" for words in result.words)
        print(said, end="")
        if sys.stdout:
            sys.stdout.flush()
    except ClearanceError as error:
        return _fail(str(error), 2)
    except KeyboardInterrupt:
        return _fail("interrupted; run the same command again to go on", 1)
    except BrokenPipeError:
        silence()
        return 1
    except OSError as error:  # a full disk, a name that is too long
        silence()
        file_name = f"{error.filename}: " if error.filename else ""
        return _fail(f"{file_name}{error.strerror or error}", 2 if error.errno in MISTAKEN else 1)
    except MemoryError as error:
        return _fail(f"not enough memory for what was asked ({str(error) or 'no more is known'}); ask for less", 2)
    return 0


def _print_warning(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
    inform(str(message), "note" if issubclass(category, RecordNote) else "warning")


def _fail(words: str, status: int) -> int:
    print(f"clearance-mj: {ClearanceError(words)}", file=sys.stderr)
    return status


def _parse(arguments: list[str]) -> argparse.Namespace:
    """Return the options of a command; an error for misspelt ones names the nearest known words."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = Parser(prog="clearance-mj", description="Vibration of shafts with clearance.", formatter_class=raw)
    parser.add_argument("--version", action="version", version=f"clearance-mj {__version__}")
    words = "one of those below; clearance-mj COMMAND --help says more"
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", help=words)
    name = next((word for word in arguments if not word.startswith("-")), None)
    if name in names():
        find(name).add(commands)
    elif name:
        parser.error(f"{name!r} is no command{_closest(name, names())}")
    else:
        for task, modules in _GROUPS.items():
            parser.add_argument_group(task, "\n".join(_command_line(each) for each in modules.split()))
    options, unknown = parser.parse_known_args(arguments)
    if unknown:
        known = re.findall(r"--[\w-]+", options.parser.format_usage())
        options.parser.error(f"{unknown[0]!r} is not known{_closest(unknown[0].partition('=')[0], known)}")
    return options


def _command_line(module: str) -> str:
    """Return a command's line in the list of all, its help read from the source without importing it."""
    source = ast.parse(pkgutil.get_data(__name__, f"{module}.py") or b"")
    (run,) = (node for node in source.body if isinstance(node, ast.FunctionDef) and node.name == "run")
    words = f"{module.replace('_', '-'):18s}{(ast.get_docstring(run) or '').rstrip('.')}"
    return textwrap.fill(words, shutil.get_terminal_size().columns - 4, subsequent_indent=18 * " ")


def _closest(word: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(word, list(known), 1)
    return f", did you mean {close[0]}?" if close else ""
