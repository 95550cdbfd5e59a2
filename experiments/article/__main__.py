"""``python -m experiments.article NAMES``: the article's figures and tables beside ours."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from . import command
from .inputs import DATASET
from .runner import reproduce


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser("experiments.article", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="such as figure_02 or table_1; all or none: every one")
    out = Path("results/reproduce")
    parser.add_argument("--out", type=Path, default=out, help="folder of the results (default: %(default)s)")
    parser.add_argument("--dataset", type=Path, default=DATASET, help="test records (default: %(default)s)")
    parser.add_argument("--quick", action="store_true", help="fewer noises, laws and engines")
    parser.add_argument("--quiet", action="store_true", help="show no progress bars")
    return command.run(parser, _run, arguments)


def _run(options: argparse.Namespace) -> dict:
    items = reproduce(options.names, options.out, options.dataset, options.quick, not options.quiet)
    if not options.json:
        print(f"index: {options.out / 'index.html'}")
    return {"out": str(options.out), "items": items}


if __name__ == "__main__":
    sys.exit(main())
