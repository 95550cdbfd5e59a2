"""clearance-mj identify: identify the clearance from records."""

from __future__ import annotations

from pathlib import Path

from ..identify.laws import METHODS as LAWS
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
        commands, "identify", _run, "identify the clearance's law from a dataset's records to identify",
        default=Path("law.json"), help="law file (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("dataset", type=Path, help="dataset folder")
    parser.add_argument("--method", default="output-error", help=f"one of {', '.join(LAWS)} (default: %(default)s)")


def _run(options):
    from ..identify import law
    from ..io.dataset import Dataset

    found = law(Dataset.load(options.dataset), options.method, None if options.quiet else options.method)
    found.save(options.out)
    if not options.json:
        print(f"law: {options.out}")
    return {"out": str(options.out), "law": found.to_dict()}
