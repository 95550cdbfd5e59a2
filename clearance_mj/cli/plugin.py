"""``--plugin``: a Python file of the user's that registers something of its own."""

from __future__ import annotations

import argparse
import importlib
import sys
from pathlib import Path

from ..errors import ClearanceError

__all__ = ["add_plugin", "load_plugin"]


def add_plugin(parser: argparse.ArgumentParser, what: str) -> None:
    """Add the option; ``what`` the file registers has an article."""
    parser.add_argument("--plugin", type=Path, metavar="FILE", help=f"Python file that registers {what} of your own")


def load_plugin(plugin: Path | None) -> None:
    """Import a file, if one was given, by its name, so that other processes can import it too."""
    if plugin is None:
        return
    if not plugin.is_file():
        raise ClearanceError(f"--plugin {plugin}: no such file")
    sys.path.insert(0, str(plugin.resolve().parent))
    try:
        module = importlib.import_module(plugin.stem)
    except Exception as error:  # whatever a user's file does wrong
        raise ClearanceError(f"--plugin {plugin}: {type(error).__name__}: {error}") from error
    if Path(module.__file__ or "").resolve() != plugin.resolve():
        raise ClearanceError(f"--plugin {plugin}: another module has this name; rename the file")
