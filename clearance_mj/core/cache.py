"""Results kept between runs, in files named by the digest of everything they were computed from, and a file lock.

A file that is there is the right one: other inputs, another version or changed sources have another name.
"""

from __future__ import annotations

import fcntl
import functools
import hashlib
import json
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, TypeVar
from zipfile import BadZipFile

import numpy as np

from ..version import __version__
from .checks import naming
from .errors import ClearanceError
from .files import SEAL, is_sealed, replacing, seal, sha256

__all__ = [
    "LIBRARIES", "ResultCache", "code", "code_outside", "digest", "file_lock", "library_version", "load_arrays",
    "save_arrays",
]  # fmt: skip

NOT_IN_RESULTS = ("cli", "core/drawing.py", "core/overview.py", "report", "vehicle")
"""Parts of the package whose sources do not touch simulations, laws and FRFs"""
_PACKAGE = Path(__file__).parents[1]
LIBRARIES = ("mujoco-core", "numba", "numpy", "pywavelets", "scipy")  # whose versions results depend on
_OURS = re.compile(r".+_[0-9a-f]{16}(\.[a-z0-9]+)+")  # files, and their temporary names
T = TypeVar("T")


def digest(*parts: object) -> str:
    """Return the digest of anything that JSON can hold."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


@functools.cache
def code(without: tuple[str, ...] = NOT_IN_RESULTS) -> str:
    """Return the digest of the package's sources, but for these folders and modules, and its libraries' versions."""
    files = [p for p in sorted(_PACKAGE.rglob("*.py")) if not p.relative_to(_PACKAGE).as_posix().startswith(without)]
    sources = [(str(p.relative_to(_PACKAGE)), sha256(p)) for p in files]
    return digest(__version__, sources, [(name, library_version(name)) for name in LIBRARIES])


def code_outside(*things: object) -> list[str]:
    """Return the digests of the files outside of the package, such as plugins, that define functions or objects."""
    modules = {thing.__module__ if hasattr(thing, "__name__") else type(thing).__module__ for thing in things}
    files = {Path(file).resolve() for name in modules if (file := getattr(sys.modules.get(name), "__file__", None))}
    return [sha256(p) for p in sorted(files) if not p.is_relative_to(_PACKAGE)]


def library_version(name: str) -> str:
    """Return the version of an installed library; empty if it is not known."""
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


class ResultCache:
    """Files of results in a folder, by name and the digest of their inputs; it is made when the first is written.

    Parameters
    ----------
    folder : Path
        Where results are kept.
    others : sequence of Path
        Folders of other commands, in which results are looked for, too.
    """

    def __init__(self, folder: Path, others: Sequence[Path] = ()):
        self.folder, self.others = folder, tuple(others)
        self.taken_over: dict[str, Path] = {}
        """folders of other commands by the names of the results taken from there"""
        self._used: set[str] = set()

    def get(
        self, name: str, inputs: object, compute: Callable[[], T], save: Callable[[T, Path], object],
        load: Callable[[Path], T], suffix: str = ".nc",
    ) -> T:  # fmt: skip
        """Return a result from its file NAME_DIGEST.SUFFIX, or compute it and write the file.

        ``inputs`` is everything that the result depends on besides the package's code, as plain data; ``save`` writes a
        result to a path and ``load`` reads it from there.
        """
        file = self._path(name, inputs, suffix).name
        for folder in (self.folder, *self.others):
            if is_sealed(folder / file):  # else it is damaged, or was not finished: it is computed anew
                if folder != self.folder:
                    self.taken_over[name] = folder
                return load(folder / file)
        return self.keep(name, inputs, compute(), save, suffix)

    def find(self, name: str, inputs: object, load: Callable[[Path], T], suffix: str = ".nc") -> T | None:
        """Return a result from its file, or None if that is not there; see `get`."""
        path = self._path(name, inputs, suffix)
        return load(path) if is_sealed(path) else None

    def keep(self, name: str, inputs: object, result: T, save: Callable[[T, Path], object], suffix: str = ".nc") -> T:
        """Write the file of a result that was computed elsewhere, and return the result; see `get`."""
        path = self._path(name, inputs, suffix)
        with replacing(path) as temporary:
            save(result, temporary)
        seal(path)
        return result

    def _path(self, name: str, inputs: object, suffix: str) -> Path:
        file = f"{name}_{digest(code(), inputs)[:16]}{suffix}"
        self._used.add(file)
        return self.folder / file

    def drop_unused(self) -> None:
        """Remove entries neither read nor written, such as results of other inputs, and those that a kill tore."""
        for path in self.folder.glob("*"):
            if path.name.removesuffix(SEAL) not in self._used and _OURS.fullmatch(path.name.removesuffix(SEAL)):
                path.unlink()


def save_arrays(arrays: Mapping[str, Any], path: Path) -> None:
    """Write named arrays as the file .npz of a `ResultCache`, whatever the name of the path."""
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)


def load_arrays(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays of a file that `save_arrays` wrote, by name; a ClearanceError if it holds anything else."""
    damages = OSError, ValueError, TypeError, BadZipFile
    with naming(path, damages, ClearanceError, "{}: holds no arrays ({})"), np.load(path) as file:
        return dict(file)


@contextmanager
def file_lock(path: Path, what: str, folder: Path | None = None) -> Iterator[None]:
    """Lock a file for what ``what`` writes next to it; the system releases it when the process ends in any way.

    A ClearanceError names the folder, or ``where``, if another process has locked it.
    """
    with path.open("a+") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.seek(0)
            raise ClearanceError(
                f"{folder or path.parent}: another {what} (process {file.read() or 'unknown'}) is writing there"
            ) from None
        file.truncate(0)
        file.write(str(os.getpid()))
        file.flush()
        yield
