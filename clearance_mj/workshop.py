"""Where a study works: a folder that one process holds, what it keeps for the next study, and how it is published.

What is costly (laws, simulated cases) is kept in files named by the digest of everything it was computed from, so a
file that is there is the right one. A finished study takes them along in its folder ``cache``; the next study into
the same folder finds them there, computes what is new, and drops what it did not use.
"""

from __future__ import annotations

import fcntl
import functools
import hashlib
import json
import os
import shutil
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ._version import __version__
from .errors import ClearanceError
from .files import replacing

__all__ = ["Cache", "Workshop", "code", "digest", "held", "open_workshop"]

CACHE = "cache"
_PACKAGE = Path(__file__).parent
_NO_NUMBERS = ("cli", "report", "testrig", "vehicle")
"""Parts of the package whose sources do not touch what is kept"""
_LIBRARIES = ("mujoco-core", "numba", "numpy", "pywavelets", "scipy")


def digest(*parts) -> str:
    """Digest of plain data.

    Parameters
    ----------
    *parts
        Anything that JSON can hold.
    """
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


@functools.cache
def code() -> str:
    """Digest of the code that results come from: the package's version and sources, and its libraries' versions."""
    files = [p for p in sorted(_PACKAGE.rglob("*.py")) if p.relative_to(_PACKAGE).parts[0] not in _NO_NUMBERS]
    sources = [(str(p.relative_to(_PACKAGE)), hashlib.sha256(p.read_bytes()).hexdigest()) for p in files]
    return digest(__version__, sources, [(name, _version(name)) for name in _LIBRARIES])


def _version(name) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


class Cache:
    """Files by name, of this study and of the one before.

    Parameters
    ----------
    folder : Path
        Of this study.
    older : Path
        Of the study before; need not be there.
    """

    def __init__(self, folder: Path, older: Path):
        self.folder, self._older, self._used = folder, older, set()

    def find(self, name: str) -> Path | None:
        """Return the file of a name if there is one, and keep it for the next study.

        Parameters
        ----------
        name : str
            The file's name.
        """
        path, older = self.folder / name, self._older / name
        self._used.add(name)
        if not path.exists() and older.exists():
            with replacing(path) as temporary:
                shutil.copyfile(older, temporary)
        return path if path.exists() else None

    def write(self, name: str):
        """Context of a temporary path that becomes the file of a name once it is whole.

        Parameters
        ----------
        name : str
            The file's name.
        """
        self._used.add(name)
        return replacing(self.folder / name)

    def drop_unused(self):
        """Remove what was neither found nor written, such as an interrupted study's with other inputs."""
        for path in self.folder.iterdir():
            if path.name not in self._used:
                path.unlink()


class Workshop:
    """The folder in which a study works until everything is whole.

    Parameters
    ----------
    folder : Path
        The folder.
    out : Path
        Where the study is published.
    """

    def __init__(self, folder: Path, out: Path):
        self.out, self.finished, self._old = out, folder / "finished", out.with_name(out.name + ".old")
        self.cache = Cache(folder / CACHE, out / CACHE)
        self._undo_publishing()
        shutil.rmtree(self.finished, ignore_errors=True)
        self.finished.mkdir()

    def _undo_publishing(self):
        """Put the cache and the old study back where they were, if the process was killed while it published."""
        if (self.finished / CACHE).is_dir():
            (self.finished / CACHE).rename(self.cache.folder)
        if self._old.is_dir() and not self.out.exists():
            self._old.rename(self.out)

    def publish(self):
        """Put the finished folder, the cache inside, in the place of ``out``; an old study stays whole until then."""
        self.cache.drop_unused()
        self.cache.folder.rename(self.finished / CACHE)
        shutil.rmtree(self._old, ignore_errors=True)
        if self.out.exists():
            self.out.rename(self._old)
        self.finished.rename(self.out)
        shutil.rmtree(self._old, ignore_errors=True)


@contextmanager
def open_workshop(out: Path):
    """Yield the workshop in ``<out>.partial``, held by one process; kept for the next try unless all goes well.

    Parameters
    ----------
    out : Path
        Where the study is published.

    Raises
    ------
    ClearanceError
        If another process holds it, or it cannot be written, such as on a full disk.
    """
    folder = out.with_name(out.name + ".partial")
    try:
        (folder / CACHE).mkdir(parents=True, exist_ok=True)
        with held(folder / "lock", "study"):
            yield Workshop(folder, out)
            shutil.rmtree(folder)
    except OSError as error:
        raise ClearanceError(f"{folder}: cannot be written ({error.strerror or error})") from error


@contextmanager
def held(lock: Path, what: str):
    """Hold a lock file; the system lets go of it when the process ends, however it ends.

    Parameters
    ----------
    lock : Path
        The file, in the folder that one process may write into.
    what : str
        What writes there, for the message.

    Raises
    ------
    ClearanceError
        If another process holds it.
    """
    with lock.open("a+") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.seek(0)
            raise ClearanceError(
                f"{lock.parent}: another {what} (process {file.read() or 'unknown'}) is writing there"
            ) from None
        file.truncate(0)
        file.write(str(os.getpid()))
        file.flush()
        yield
