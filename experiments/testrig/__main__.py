"""`python -m experiments.testrig [--rig NAME] FOLDER`: make the dataset of a virtual rig."""

import sys
from pathlib import Path
from typing import Literal

from experiments.script import run
from experiments.testrig.records import generate
from experiments.testrig.rigs import RIGS


def main(path: Path, rig: Literal[*RIGS] = "table1") -> None:
    """Make the dataset of a rig, such as data/table1_rig."""
    generate(path, rig)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
