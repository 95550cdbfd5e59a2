"""What results come from: versions of the program and its libraries, digests of the files that were read."""

from __future__ import annotations

import platform
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from ._version import __version__
from .cache import LIBRARIES, code, library_version
from .files import sha256

__all__ = ["MARK", "files_of", "is_marked", "made_from"]

MARK = "clearance_mj"
"""Key of the program's version in everything that it writes"""
IN_FOLDERS = ("rig.toml", "law.json", "dataset.toml")
"""Files that are read of a folder, beside the records of its list"""


def made_from(inputs: Iterable[Path], what: str) -> dict[str, Any]:
    """Return versions, and the digest of every file among ``inputs``, of folders those that are read.

    Parameters
    ----------
    inputs : iterable of Path
        Files, and folders of a dataset, or of a rig and its law.
    what : str
        The command, or what else made the results.

    Returns
    -------
    dict
        ``clearance_mj`` (version), ``code`` (digest of the sources), ``python``, ``libraries`` (versions), ``made_by``
        and ``inputs`` (SHA-256 by path).
    """
    return {
        MARK: __version__,
        "code": code(),
        "python": platform.python_version(),
        "libraries": {name: library_version(name) for name in LIBRARIES},
        "made_by": what,
        "inputs": {str(file): sha256(file) for file in files_of(inputs)},
    }


def is_marked(path: Path) -> bool:
    """Return whether a file names this program, as all that it writes and may replace does."""
    with path.open("rb") as file:
        return any(MARK.encode() in block for block in (file.read(2**16), _end(path)))


def _end(path: Path) -> bytes:
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 2**16))
        return file.read()


def files_of(inputs: Iterable[Path]) -> list[Path]:
    """Return the files among ``inputs``, and of folders those that are read, each once."""
    return [*dict.fromkeys(file for path in inputs for file in _files(path))]


def _files(path: Path) -> Iterator[Path]:
    if path.is_file():
        yield path
    elif path.is_dir():
        names = (*IN_FOLDERS, *_listed(path / "dataset.toml"))
        yield from (path / name for name in names if (path / name).is_file())


def _listed(path: Path) -> list[str]:
    """Records' files of a dataset's list; none if there is no list that can be read."""
    try:
        return [str(entry["file"]) for entry in tomllib.loads(path.read_text(encoding="utf-8"))["records"]]
    except (OSError, ValueError, KeyError, TypeError):
        return []
