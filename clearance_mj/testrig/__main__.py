"""`python -m clearance_mj.testrig FOLDER`: regenerate the virtual rig's dataset."""

import argparse
import sys
from pathlib import Path

from ..errors import ClearanceError
from ..rig import Rig
from .records import generate
from .truth import Truth

RIG_FILE = Path(__file__).parents[2] / "models" / "table1_rig.toml"
"""The datasheet rig, in the source tree: all that the dataset tells of the rig"""


def main(arguments=None) -> int:
    """Parse the command line, make the dataset and return the exit status: 0, or 2 for bad input."""
    parser = argparse.ArgumentParser(
        prog="python -m clearance_mj.testrig", description="Make the virtual rig's dataset."
    )
    parser.add_argument("path", help="folder, such as data/table1_rig")
    path = parser.parse_args(arguments).path
    try:
        generate(path, Rig.load(RIG_FILE), Truth())
    except ClearanceError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
