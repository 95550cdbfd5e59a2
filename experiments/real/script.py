"""What the scripts that read published records share: their arguments, and what they say without the records."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from clearance_mj.errors import RecordError

from .records import real_folder


def run(analyse: Callable, write: Callable, doc: str, records: str, arguments=None) -> int:
    """Analyse the records in the folder that CLEARANCE_REAL_DATA names and write the result; status 2 without them."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder for the table and the figure")
    out = parser.parse_args(arguments).out
    folder = real_folder()
    if folder is None:
        parser.exit(2, f"{records} is not part of the project: name its folder in CLEARANCE_REAL_DATA\n")
    try:
        result = analyse(folder)
    except RecordError as error:
        parser.exit(2, f"{error}\n")
    write(result, out)
    return 0
