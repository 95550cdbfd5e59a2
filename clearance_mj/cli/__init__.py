"""The command line. Bad input ends with one line that says what and where, and status 2."""

from __future__ import annotations

import argparse
import contextlib
import difflib
import io
import sys
import warnings
from collections.abc import Iterable, Sequence
from importlib import import_module

from .._version import __version__
from ..errors import ClearanceError
from ..files import to_json
from .command import COMMANDS, Parser

__all__ = ["main"]

for _module in (
    *("new", "study", "identify", "twin", "live", "simulate", "animate", "motion", "compare", "convert", "modes"),
    *("moved", "calibrate", "update_rig", "place", "sweep", "response", "backbone", "rattle_map", "vehicle"),
):  # each registers its command; in the order of the help
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
    options = _parsed(sys.argv[1:] if arguments is None else list(arguments))
    try:
        with contextlib.redirect_stdout(io.StringIO() if options.json else sys.stdout), warnings.catch_warnings():
            warnings.showwarning = lambda message, *_, **__: print(f"clearance-mj: warning: {message}", file=sys.stderr)
            result = options.run(options)
    except ClearanceError as error:
        print(f"clearance-mj: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("clearance-mj: interrupted; run the same command again to go on", file=sys.stderr)
        return 1
    except BrokenPipeError:
        return 1
    except OSError as error:  # a full disk, a folder that may not be written
        print(f"clearance-mj: {error}", file=sys.stderr)
        return 1
    if options.json:
        print(to_json(result), end="")
    return 0


def _parsed(arguments: list[str]) -> argparse.Namespace:
    """Options of a command; what is misspelt ends with the nearest known words."""
    parser = Parser(prog="clearance-mj", description="Vibration of shafts with clearance.")
    parser.add_argument("--version", action="version", version=f"clearance-mj {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command in COMMANDS.values():
        command.add(commands)
    if arguments and not arguments[0].startswith("-") and arguments[0] not in COMMANDS:
        parser.error(f"{arguments[0]!r} is no command{_meant(arguments[0], COMMANDS)}")
    options, unknown = parser.parse_known_args(arguments)
    if unknown:
        known = [flag for flag in options.parser._option_string_actions if flag.startswith("--")]
        options.parser.error(f"{unknown[0]!r} is not known{_meant(unknown[0].partition('=')[0], known)}")
    return options


def _meant(word: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(word, list(known), 1)
    return f", did you mean {close[0]}?" if close else ""
