"""Files of a structure: located from the rig file's folder, and identified by their content.

Arrays without a file are named by a data URI (RFC 2397), the content itself as text.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import io
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, BinaryIO, TypeAlias

from pydantic import BeforeValidator

from ..core.validation import Text

__all__ = ["FileName", "absolute", "content", "embedded", "is_embedded", "opened"]

_EMBEDDED = "data:application/octet-stream;base64,"


# A text, or a pathlib.Path.
FileName: TypeAlias = Annotated[Text, BeforeValidator(lambda value: str(value) if isinstance(value, Path) else value)]


def embedded(data: bytes) -> str:
    """Return the data URI of a content without a file."""
    return _EMBEDDED + base64.b64encode(data).decode()


def is_embedded(name: str) -> bool:
    """Return True if a name is a data URI."""
    return name.startswith(_EMBEDDED)


def opened(name: str) -> BinaryIO:
    """Open a file, or the content of a data URI."""
    return io.BytesIO(base64.b64decode(name[len(_EMBEDDED) :])) if is_embedded(name) else open(name, "rb")


def absolute(name: str) -> str:
    """Return a file's name from the root; a ValueError says that there is no such file."""
    if is_embedded(name):
        return name
    path = Path(name).expanduser().absolute()
    if not path.is_file():
        raise ValueError(f"{name}: {'is a folder' if path.is_dir() else 'there is no such file'}")
    return str(path)


def content(names: Sequence[str], known: str | None) -> str:
    """Return the SHA-256 of the files' bytes, one after another; a ValueError if it is not the ``known`` one."""
    stats = [None if is_embedded(name) else os.stat(name) for name in names]
    digest = _sha256(tuple(names), tuple(s and (s.st_mtime_ns, s.st_size) for s in stats))
    if known not in (None, digest):
        parts = ("the arrays" if is_embedded(name) else name for name in names)
        raise ValueError(
            f"sha256 is not that of {' and '.join(parts)}, which changed since the rig was written; take sha256 out of "
            "the rig file to use the changed one"
        )
    return digest


@functools.lru_cache(maxsize=16)  # names may hold megabytes
def _sha256(names: tuple[str, ...], states: tuple[tuple[int, int] | None, ...]) -> str:
    digest = hashlib.sha256()
    for name in names:
        with opened(name) as file:
            while block := file.read(2**20):
                digest.update(block)
    return digest.hexdigest()
