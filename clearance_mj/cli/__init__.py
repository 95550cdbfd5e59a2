"""The command line. Bad input ends with one line that says what and where, and status 2."""

from __future__ import annotations

import argparse
import sys

from .._version import __version__
from ..errors import ClearanceError
from ..files import to_json
from . import (
    animate,
    calibrate,
    compare,
    convert,
    identify,
    motion,
    moved,
    new,
    place,
    simulate,
    study,
    sweep,
    vehicle,
)

__all__ = ["COMMANDS", "main"]

COMMANDS = (
    new,
    study,
    identify,
    simulate,
    animate,
    motion,
    compare,
    convert,
    moved,
    calibrate,
    place,
    sweep,
    vehicle,
)
"""Modules with `add(commands)`, which adds the command's parser, in the order of the help"""


def main(arguments=None) -> int:
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
    options = _parser().parse_args(arguments)
    try:
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


def _parser():
    parser = argparse.ArgumentParser(prog="clearance-mj", description="Vibration of shafts with clearance.")
    parser.add_argument("--version", action="version", version=f"clearance-mj {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command in COMMANDS:
        command.add(commands)
    return parser
