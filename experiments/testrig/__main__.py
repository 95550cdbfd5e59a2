"""`python -m experiments.testrig [--rig NAME] FOLDER`: make the dataset of a virtual rig."""

import argparse
import sys
from collections.abc import Sequence

from clearance_mj.core.errors import ClearanceError
from experiments.testrig.records import generate
from experiments.testrig.rigs import RIGS


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse the command line, make the dataset and return the exit status: 0, or 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m experiments.testrig", description="Make a virtual rig's dataset.")
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
