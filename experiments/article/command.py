"""Options that the article's commands share, and one line with status 2 for bad input."""

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any

from clearance_mj.core.errors import ClearanceError
from clearance_mj.core.files import to_json


def run(
    parser: argparse.ArgumentParser, function: Callable[[argparse.Namespace], Any], arguments: Sequence[str] | None
):
    """Parse arguments, run the function, print what it returns if ``--json`` is asked for; return the exit status."""
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    options = parser.parse_args(arguments)
    try:
        result = function(options)
    except ClearanceError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"{parser.prog}: interrupted; run the same command again to go on", file=sys.stderr)
        return 1
    if options.json:
        print(to_json(result), end="")
    return 0
