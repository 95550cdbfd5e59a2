"""clearance-mj reproduce: the article's figures and tables."""

from __future__ import annotations

from pathlib import Path

from .command import add_command

__all__ = ["add"]


def add(commands):
    """Add the command.

    Parameters
    ----------
    commands : argparse subparsers
        Where to add it.
    """
    parser = add_command(
        commands, "reproduce", _run, "compute the article's figures and tables again",
        default=Path("results/reproduce"), help="folder of the results (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("names", nargs="*", metavar="NAME", help="such as figure_02 or table_1; all: every one")
    dataset = Path("data/table1_rig")
    parser.add_argument("--dataset", type=Path, default=dataset, help="test records (default: %(default)s)")
    parser.add_argument("--quick", action="store_true", help="fewer noises, laws and engines")


def _run(options):
    from experiments.article import reproduce

    items = reproduce(options.names, options.out, options.dataset, options.quick, not options.quiet)
    if not options.json:
        print(f"index: {options.out / 'index.html'}")
    return {"out": str(options.out), "items": items}
