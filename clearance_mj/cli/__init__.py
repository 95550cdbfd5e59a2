"""The command line. Bad input ends with one line that says what and where, and status 2."""

from __future__ import annotations

import argparse
import contextlib
import difflib
import errno
import io
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
from ..rig.plausible import ImplausibleRig
from ..version import __version__
from .command import COMMANDS, Parser, inputs, say
from .options import load_plugin
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
}  # of commands, by task; each module registers its own
for _module in " ".join(_GROUPS.values()).split():
    import_module(f".{_module}", __name__)


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
        options = _parsed(sys.argv[1:] if arguments is None else list(arguments))
        for words in stale(inputs(options)):
            say(words)
        with contextlib.redirect_stdout(io.StringIO() if options.json else sys.stdout), warnings.catch_warnings():
            warnings.showwarning = _say
            warnings.simplefilter("error", ImplausibleRig)
            load_plugin(getattr(options, "plugin", None))
            with vectors(getattr(options, "figures", None)):
                result = options.run(options)
        if options.json:
            print(to_json(result), end="")
        if sys.stdout:
            sys.stdout.flush()
    except ClearanceError as error:
        return _failed(str(error), 2)
    except KeyboardInterrupt:
        return _failed("interrupted; run the same command again to go on", 1)
    except BrokenPipeError:
        silence()
        return 1
    except OSError as error:  # a full disk, a name that is too long
        silence()
        where = f"{error.filename}: " if error.filename else ""
        return _failed(f"{where}{error.strerror or error}", 2 if error.errno in MISTAKEN else 1)
    except MemoryError as error:
        return _failed(f"not enough memory for what was asked ({str(error) or 'no more is known'}); ask for less", 2)
    return 0


def _say(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
    say(str(message), "note" if issubclass(category, RecordNote) else "warning")


def _failed(words: str, status: int) -> int:
    print(f"clearance-mj: {ClearanceError(words)}", file=sys.stderr)
    return status


def _parsed(arguments: list[str]) -> argparse.Namespace:
    """Options of a command; what is misspelt ends with the nearest known words."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = Parser(prog="clearance-mj", description="Vibration of shafts with clearance.", formatter_class=raw)
    parser.add_argument("--version", action="version", version=f"clearance-mj {__version__}")
    words = "one of those below; clearance-mj COMMAND --help says more"
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", help=words)
    for command in COMMANDS.values():
        command.add(commands)
    for task, modules in _GROUPS.items():
        names = modules.replace("_", "-").split()
        parser.add_argument_group(task, "\n".join(_listed(name, COMMANDS[name].help) for name in names))
    if arguments and not arguments[0].startswith("-") and arguments[0] not in COMMANDS:
        parser.error(f"{arguments[0]!r} is no command{_meant(arguments[0], COMMANDS)}")
    options, unknown = parser.parse_known_args(arguments)
    if unknown:
        known = [flag for flag in options.parser._option_string_actions if flag.startswith("--")]
        options.parser.error(f"{unknown[0]!r} is not known{_meant(unknown[0].partition('=')[0], known)}")
    return options


def _listed(name: str, help: str) -> str:
    """A command in the list of all, its words beside its name."""
    return textwrap.fill(f"{name:18s}{help}", shutil.get_terminal_size().columns - 4, subsequent_indent=18 * " ")


def _meant(word: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(word, list(known), 1)
    return f", did you mean {close[0]}?" if close else ""
