"""clearance-mj compare: compare two FRF files."""

from __future__ import annotations

from pathlib import Path

from ..io.files import replacing, to_json
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
        commands, "compare", _run, "compare the FRFs of two universal files (test first)",
        default=None, help="also write the comparison to this JSON file",
    )  # fmt: skip
    parser.add_argument("test", type=Path, help="universal file with the test's FRFs")
    parser.add_argument("model", type=Path, help="universal file with the model's FRFs")


def _run(options):
    from ..correlation import compare
    from ..errors import RecordError
    from ..frf import FRF
    from ..io.uff import read_uff

    frfs = [read_uff(path) for path in (options.test, options.model)]
    for path, frf in zip((options.test, options.model), frfs):
        if not isinstance(frf, FRF):
            raise RecordError(f"{path}: holds time records, compare needs FRFs")
    summary = compare(*frfs).summary()
    if options.out:
        with replacing(options.out) as temporary:
            temporary.write_text(to_json(summary), encoding="utf-8")
    if not options.json:
        for name, value in summary.items():
            print(f"{name:24s} {value:.4g}")
    return summary
