"""`python -m clearance_mj.testrig [--rig NAME] FOLDER`: make the dataset of a virtual rig."""

import argparse
import sys
from collections.abc import Sequence

from ..errors import ClearanceError
from .records import generate
from .rigs import RIGS


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse the command line, make the dataset and return the exit status: 0, or 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m clearance_mj.testrig", description="Make a virtual rig's dataset.")
    parser.add_argument("path", help="folder, such as data/table1_rig")
    parser.add_argument("--rig", choices=RIGS, default="table1", help="which rig (default: table1)")
    options = parser.parse_args(arguments)
    try:
        generate(options.path, options.rig)
    except ClearanceError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
