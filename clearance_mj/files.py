"""Files that are whole or not there: written under a temporary name, then renamed. JSON that every reader takes."""

import gzip
import json
import math
import os
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

from .errors import ClearanceError, RecordError

__all__ = ["TOO_DENSE", "most_unpacked", "read_lines", "replacing", "to_json", "write_text"]

DENSEST = 50
"""Times its size that a compressed file may unpack to: measured numbers reach 2 to 10"""
TOO_DENSE = f"unpacks to more than {DENSEST} times its size, which no record does; unpack it and look what it holds"


def most_unpacked(size: int) -> int:
    """Bytes that a compressed file of ``size`` bytes may unpack to; beyond that it is damaged or made to harm."""
    return max(2**20, DENSEST * size)


def read_lines(path: str | PathLike[str]) -> list[str]:
    """Read the lines of a text file (UTF-8 or Latin-1), plain or compressed by gzip (seen from its first bytes)."""
    path = Path(path)
    try:
        data = path.read_bytes()
        if data[:2] == b"\x1f\x8b":
            with gzip.open(path) as file:
                size, data = len(data), file.read(most_unpacked(len(data)) + 1)
            if len(data) > most_unpacked(size):
                raise RecordError(f"{path}: {TOO_DENSE}")
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise RecordError(f"{path}: damaged gzip file ({error})") from None
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror or error}") from None
    if b"\0" in data:
        raise RecordError(f"{path}: not a text file")
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return data.decode("latin-1").splitlines()


@contextmanager
def replacing(path: str | PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path, which takes the place of ``path`` on success; else the old file stays as it was.

    The folder is made if needed. A ClearanceError says why it cannot be written, such as on a full disk.
    """
    path = Path(path)
    temporary: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
        temporary = Path(name)
        os.close(handle)
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    except OSError as error:
        raise ClearanceError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        if temporary:
            temporary.unlink(missing_ok=True)


def write_text(path: str | PathLike[str], text: str) -> None:
    """Write text as UTF-8, as `replacing` does."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def to_json(data: Any) -> str:
    """Return plain data as JSON text, numbers that are not finite as null."""
    return json.dumps(_finite(data), indent=1, allow_nan=False) + "\n"


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
