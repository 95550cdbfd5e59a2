"""Arguments of the scripts that read published records, and their message without the records."""

import argparse
from collections.abc import Callable
from pathlib import Path

from clearance_mj.core.errors import RecordError

from .records import real_folder


def run(analyse: Callable, write: Callable, doc: str, records: str, arguments=None, **options) -> int:
    """Analyse the records in a folder, by default the one that CLEARANCE_REAL_DATA names; status 2 without them.

    Further options, each given as what argparse wants to know of it, go to the analysis by their names.
    """
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", default=real_folder(), help="of the records")
    parser.add_argument("--out", type=Path, required=True, help="folder for tables and figures")
    for name, known in options.items():
        parser.add_argument(f"--{name}", **known)
    given = parser.parse_args(arguments)
    if given.folder is None:
        parser.exit(2, f"{records} is not part of the project: name its folder, or set CLEARANCE_REAL_DATA\n")
    try:
        result = analyse(given.folder, **{name: getattr(given, name) for name in options})
    except RecordError as error:
        parser.exit(2, f"{error}\n")
    write(result, given.out)
    return 0
