"""What the scripts that read published records share: their arguments, and what they say without the records."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from clearance_mj.errors import RecordError

from .records import real_folder


def run(analyse: Callable, write: Callable, doc: str, records: str, arguments=None) -> int:
    """Analyse the records in a folder, by default the one that CLEARANCE_REAL_DATA names; status 2 without them."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", default=real_folder(), help="of the records")
    parser.add_argument("--out", type=Path, required=True, help="folder for tables and figures")
    options = parser.parse_args(arguments)
    if options.folder is None:
        parser.exit(2, f"{records} is not part of the project: name its folder, or set CLEARANCE_REAL_DATA\n")
    try:
        result = analyse(options.folder)
    except RecordError as error:
        parser.exit(2, f"{error}\n")
    write(result, options.out)
    return 0
