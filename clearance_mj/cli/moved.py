"""Commands of the article, which is no part of the package: they say what replaced them."""

from __future__ import annotations

import argparse

from ..core.errors import ClearanceError
from .command import command

MOVED = {
    "reproduce": "make reproduce ITEMS=NAMES, or python -m experiments.article NAMES --out F --quick --dataset D",
    "audit": "make audit, or python -m experiments.article.audit --out F --tables T",
}
"""What replaced each command, in the source tree"""


def _options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("names", nargs="*", help=argparse.SUPPRESS)
    parser.add_argument("--quick", action="store_true", help=argparse.SUPPRESS)
    for option in ("--dataset", "--tables"):
        parser.add_argument(option, help=argparse.SUPPRESS)


def _run(options: argparse.Namespace) -> None:
    raise ClearanceError(f"{options.command} is no part of the package; in the source tree: {MOVED[options.command]}")


for _name, _words in MOVED.items():
    command(_name, f"moved to the source tree: {_words}", _options)(_run)
