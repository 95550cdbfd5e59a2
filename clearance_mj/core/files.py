"""Files that are whole or not there: written under a temporary name, then renamed. JSON that every reader takes."""

import codecs
import errno
import gzip
import hashlib
import json
import math
import os
import re
import secrets
import stat
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

from .errors import ClearanceError, RecordError

__all__ = [
    "TOO_DENSE", "is_sealed", "most_unpacked", "plain_file", "read_bytes", "read_lines", "read_text",
    "remove_leftovers", "replacing", "seal", "sha256", "to_json", "write_text",
]  # fmt: skip

MAX_EXPANSION = 50  # times its size that a compressed file may unpack to: measured numbers reach 2 to 10
TOO_DENSE = (
    f"unpacks to more than {MAX_EXPANSION} times its size, which no record does; unpack it and look what it holds"
)

SEAL = ".sha256"  # suffix of the file that holds the digest of another
MAX_BYTES = 4 * 2**30  # bytes of a file that is read at once: more is no record, or fills the memory of most machines
SPECIAL_FILE_KINDS = {
    stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket", stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}  # fmt: skip
"""Names of the kinds of paths that are no plain file"""


def plain_file(path: str | PathLike[str]) -> Path:
    """Return the path of a file that can be read to its end; an OSError says what is no file, or too large a one."""
    status = os.stat(path)
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if file_kind := SPECIAL_FILE_KINDS.get(stat.S_IFMT(status.st_mode)):
        raise OSError(errno.EINVAL, f"it is {file_kind}, not a plain file", str(path))
    if status.st_size > MAX_BYTES:
        size = f"it has {status.st_size / 2**30:.3g} GiB; at most {MAX_BYTES / 2**30:g} GiB are read"
        raise OSError(errno.EFBIG, size, str(path))
    return Path(path)


def read_bytes(path: str | PathLike[str]) -> bytes:
    """Return the bytes of a plain file.

    Raises
    ------
    RecordError
        If it cannot be read.
    """
    try:
        return plain_file(path).read_bytes()
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror or error}") from None


def most_unpacked(size: int) -> int:
    """Return the bytes a compressed file of ``size`` bytes may unpack to; beyond, it is damaged or made to harm."""
    return max(2**20, MAX_EXPANSION * size)


def read_text(path: str | PathLike[str]) -> tuple[bytes, str]:
    """Read a text file, plain or compressed by gzip (seen from its first bytes), as UTF-8 without a byte order mark.

    The second is the encoding that it was in: UTF-8 or UTF-16 if it is such text, otherwise Windows-1252, whose
    printable characters Latin-1 shares.
    """
    path = Path(path)
    try:
        data = plain_file(path).read_bytes()
        if data[:2] == b"\x1f\x8b":
            with gzip.open(path) as file:
                size, data = len(data), file.read(most_unpacked(len(data)) + 1)
            if len(data) > most_unpacked(size):
                raise RecordError(f"{path}: {TOO_DENSE}")
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise RecordError(f"{path}: damaged gzip file ({error})") from None
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror or error}") from None
    try:
        if utf16 := _UTF_16.get(data[:2]) or (_UTF_16_TEXT.match(data) and "utf-16-le"):
            return data.decode(utf16).removeprefix("\ufeff").encode(), "UTF-16"
        if b"\0" in data:
            raise RecordError(f"{path}: not a text file")
        if not data.isascii():  # twenty times as fast
            data.decode("utf-8")
        return data.removeprefix(codecs.BOM_UTF8), "UTF-8"
    except UnicodeError:
        if utf16:
            raise RecordError(f"{path}: not a text file: damaged UTF-16") from None
    return data.decode("cp1252", "replace").encode(), "Windows-1252"


_UTF_16 = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
_UTF_16_TEXT = re.compile(rb"(?:[\t\r\n -~]\0){8}")  # without a byte order mark: eight characters of a plain line


def read_lines(path: str | PathLike[str]) -> list[str]:
    """Read the lines of a text file as `read_text` does."""
    return read_text(path)[0].decode().splitlines()


@contextmanager
def replacing(path: str | PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path, which takes the place of ``path`` on success; else the old file stays as it was.

    The folder is made if needed. A link stays one: the file that it leads to is replaced. A file keeps its permissions.
    A ClearanceError says why it cannot be written, such as on a full disk, or that it is no plain file.
    """
    path = Path(path)
    temporary: Path | None = None
    try:
        target = Path(os.path.realpath(path))
        known = target.stat().st_mode if os.path.lexists(target) else None
        if known and (file_kind := SPECIAL_FILE_KINDS.get(stat.S_IFMT(known))):
            raise ClearanceError(f"{path}: is {file_kind}, not a file; give another name")
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary = target.with_name(f".{target.name[:60]}.{secrets.token_hex(4)}{target.suffix[:20]}")
        temporary.touch(exist_ok=False)
        yield temporary
        if known:
            temporary.chmod(stat.S_IMODE(known))
        temporary.replace(target)
    except OSError as error:
        raise ClearanceError(f"{path}: cannot be written ({error.strerror or error})") from error
    except UnicodeEncodeError as error:
        raise ClearanceError(f"{path}: cannot be written: a name or text in it is no text ({error.reason})") from error
    finally:
        if temporary:
            temporary.unlink(missing_ok=True)


def remove_leftovers(folder: Path, names: Iterable[str]) -> None:
    """Remove temporary files that a killed `replacing` left behind of files of these names."""
    known = "|".join(re.escape(name[:60]) for name in names)
    for path in folder.iterdir():
        if re.fullmatch(rf"\.({known})\.[0-9a-f]{{8}}(\.\w+)?", path.name) and path.is_file() and not path.is_symlink():
            path.unlink()


def write_text(path: str | PathLike[str], text: str) -> None:
    """Write text as UTF-8, as `replacing` does."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def sha256(path: str | PathLike[str]) -> str:
    """Return the SHA-256 of a file's bytes."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def seal(path: Path) -> None:
    """Write the digest of a file next to it, so that damage to the file is noticed."""
    write_text(Path(f"{path}{SEAL}"), sha256(path) + "\n")


def is_sealed(path: Path) -> bool:
    """Return whether a file is there as it was when it was sealed."""
    seal_of_it = Path(f"{path}{SEAL}")
    return path.is_file() and seal_of_it.is_file() and seal_of_it.read_bytes().strip() == sha256(path).encode()


def to_json(data: Any) -> str:
    """Return plain data as JSON text, numbers that are not finite as null."""
    return json.dumps(_finite(data), indent=1, allow_nan=False) + "\n"


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
