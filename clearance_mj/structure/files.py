"""Files that a structure is read from: found from the rig file's folder, and known by their content."""

from __future__ import annotations

import functools
import hashlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TypeAlias

from pydantic import BeforeValidator

from ..validation import Text

__all__ = ["FileName", "absolute", "content"]


def _text(value: object) -> object:
    return str(value) if isinstance(value, Path) else value


FileName: TypeAlias = Annotated[Text, BeforeValidator(_text)]
"""A text, or a pathlib.Path"""


def absolute(name: str) -> str:
    """Return a file's name from the root; a ValueError says that there is no such file."""
    path = Path(name).expanduser().absolute()
    if not path.is_file():
        raise ValueError(f"{name}: {'is a folder' if path.is_dir() else 'there is no such file'}")
    return str(path)


def content(names: Sequence[str], known: str | None) -> str:
    """Return the SHA-256 of the files' bytes, one after another; a ValueError if it is not the ``known`` one."""
    stats = [os.stat(name) for name in names]
    found = _sha256(tuple(names), tuple((s.st_mtime_ns, s.st_size) for s in stats))
    if known not in (None, found):
        raise ValueError(
            f"sha256 is not that of {' and '.join(names)}, which changed since the rig was written; take sha256 out of "
            "the rig file to use the changed one"
        )
    return found


@functools.lru_cache(maxsize=256)
def _sha256(names: tuple[str, ...], states: tuple[tuple[int, int], ...]) -> str:
    found = hashlib.sha256()
    for name in names:
        with open(name, "rb") as file:
            while block := file.read(2**20):
                found.update(block)
    return found.hexdigest()
