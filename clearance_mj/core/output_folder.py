"""The folder that a command writes into: it may hold other files, and only those of this program are ever replaced.

Everything is first written into the hidden folder ``.clearance-mj`` inside, which also has the lock, the result cache
and the manifest: path and SHA-256 of every file that was written. Once all files are whole they are moved to their
places. A file counts as this program's if the manifest lists it and its digest is still the one written there; any
other file is the user's. Publishing is refused if it would replace such a file. The manifest also says which versions
and which inputs, by their digests, each command made its files from.

The list of moves is written down before the first one: a process that is killed in between leaves no
``report.html`` or ``summary.json`` (they go first and come last), and the next command finishes the moves.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path, PurePosixPath
from typing import Any

from .cache import ResultCache, file_lock
from .checks import naming
from .errors import ClearanceError
from .files import plain_file, sha256, write_text
from .provenance import MANIFEST, WORK, files_of, made_from

__all__ = ["FIGURES", "OutputFolder", "output_folder", "vectors"]

MARK, MARK_TEXT = "README", "Working folder of clearance-mj: result cache, lock and manifest of what it wrote beside.\n"
FIGURES: ContextVar[tuple[str, ...]] = ContextVar("FIGURES", default=())
"""Formats in which a command's figures are written beside PNG: "svg" or "pdf" """
LAST = ("summary.json", "report.html", "identified.json", "index.html")
"""Files that a reader starts from: while they are there, the others belong to them"""


@contextmanager
def vectors(kind: str | None) -> Iterator[None]:
    """Write figures as "svg" or "pdf" too, meanwhile."""
    before = FIGURES.set((kind,) if kind else ())
    try:
        yield
    finally:
        FIGURES.reset(before)


class OutputFolder:
    """A folder into which the command ``what`` publishes files; made by `output_folder`."""

    def __init__(self, path: Path, what: str, inputs: Iterable[Path] = (), aside: str = ""):
        self.path, self.what, self._work = path, what, path / WORK
        self._inputs = [Path(os.path.realpath(file)) for file in files_of(inputs)]
        self.new = self._work / "new"
        """Folder to write to; `publish` moves its files to their place."""
        self.cache = ResultCache(self._work / "cache")
        self._manifest, self._moves = path / MANIFEST, self._work / "moves.json"
        self._finish_moves()
        shutil.rmtree(self.new, ignore_errors=True)
        self.new.mkdir()
        for name, entry in self._manifest_files().items():
            if entry["by"] == what and os.path.lexists(path / name) and not self._is_ours(name):
                other = path / f"{name}{aside}"
                if not aside or os.path.lexists(other):
                    raise ClearanceError(
                        f"{path / name} was changed after clearance-mj wrote it; move it away, or give another --out"
                    )
                (path / name).rename(other)

    def refuse_others(self, *names: str) -> None:
        """Raise an error if a file to be replaced by one of these is not this program's, or is being read."""
        for name in names:
            if Path(os.path.realpath(self.path / name)) in self._inputs:
                raise ClearanceError(f"{self.path / name} is read by this command; give another --out")
            if os.path.lexists(self.path / name) and not self._is_ours(name):
                raise ClearanceError(
                    f"{self.path / name} is there and not listed as written by this version of clearance-mj; "
                    "move it away, or give another --out"
                )
            for parent in (self.path / name).parents:
                if parent == self.path:
                    break
                if os.path.lexists(parent) and not parent.is_dir():
                    raise ClearanceError(f"{parent} is a file where a folder is needed; give another --out")

    def publish(self) -> None:
        """Move all files in `new` to their places, and remove those of the last run that there are no more.

        If a file is in the way that is not this program's, an error says so and nothing is moved.
        """
        written = {str(p.relative_to(self.new).as_posix()): p for p in sorted(self.new.rglob("*")) if p.is_file()}
        self.refuse_others(*written)
        stale = [n for n, by in self._manifest_files().items() if by["by"] == self.what and n not in written]
        files = {name: {"sha256": sha256(path), "by": self.what} for name, path in written.items()}
        kept = {n: entry for n, entry in self._manifest_files().items() if n not in written and n not in stale}
        known = _read_json(self._manifest, "files").get("made", {}) if self._manifest.exists() else {}
        made = {what: record for what, record in known.items() if any(entry["by"] == what for entry in kept.values())}
        made[self.what] = made_from(self._inputs, self.what)
        moves = {"new": files, "stale": dict.fromkeys(stale), "files": kept | files, "made": made}
        _write_json(self._moves, moves)
        self._finish_moves()

    def _finish_moves(self) -> None:
        """Make the moves on record, those of a killed process too; each can be made twice."""
        if not self._moves.exists():
            return
        moves = _read_json(self._moves, "new", "stale", "files")
        new, stale = moves["new"], moves["stale"]
        waiting = [name for name in new if (self.new / name).exists()]
        self.refuse_others(*waiting)
        for name in [*reversed(LAST), *stale]:
            if (name in waiting or name in stale) and self._is_ours(name):
                (self.path / name).unlink()
                _remove_empty((self.path / name).parent, self.path)
        for name in sorted(waiting, key=lambda name: LAST.index(name) if name in LAST else -1):
            (self.path / name).parent.mkdir(parents=True, exist_ok=True)
            (self.new / name).replace(self.path / name)
        _write_json(self._manifest, {"files": moves["files"], "made": moves.get("made", {})})
        self._moves.unlink()
        shutil.rmtree(self.new, ignore_errors=True)

    def _manifest_files(self) -> dict[str, dict[str, str]]:
        """Return the manifest: SHA-256 and command by path."""
        return _read_json(self._manifest, "files")["files"] if self._manifest.exists() else {}

    def _is_ours(self, name: str) -> bool:
        """Return True if the manifest lists a file that is still as it was written."""
        path, entry = self.path / name, self._manifest_files().get(name)
        return entry is not None and path.is_file() and not path.is_symlink() and sha256(path) == entry["sha256"]


@contextmanager
def output_folder(path: str | Path, what: str, inputs: Iterable[Path] = (), aside: str = "") -> Iterator[OutputFolder]:
    """Yield a folder, made if needed, for a command to write into; what it wrote is published if the block ends well.

    Write below its ``new``; results in its ``cache`` stay for the next run, also if the block fails. Files that are
    ``inputs`` are never replaced. Files of this program that were changed since, or damaged, are refused, or renamed if
    there is a suffix ``aside`` for them. A ClearanceError says if the path is a file, another process writes there, a
    file of this program was changed, a file that is not this program's is in the way, or the folder cannot be written.
    """
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise ClearanceError(f"--out {path} is a file; give a folder")
    work = Path(os.path.realpath(path)) / WORK
    missing = [folder for folder in (path, *path.parents) if not os.path.lexists(folder)]
    is_first = not os.path.lexists(work)
    try:
        ours = not work.is_symlink() and work.is_dir() and ((work / MARK).is_file() or not any(work.iterdir()))
        if not (is_first or ours):
            raise ClearanceError(f"{path / WORK} is not a working folder of clearance-mj; give another --out")
        work.mkdir(parents=True, exist_ok=True)
        (work / MARK).write_text(MARK_TEXT)
        with file_lock(work / "lock", what, path):
            folder = OutputFolder(path, what, inputs, aside)
            yield folder
            folder.publish()
    except OSError as error:
        raise ClearanceError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        if is_first and not (work / "cache").exists() and not (work / "manifest.json").exists():
            shutil.rmtree(work, ignore_errors=True)  # nothing was done
            for empty in missing:
                with contextlib.suppress(OSError):  # others may have put something there
                    empty.rmdir()


def _write_json(path: Path, data: object) -> None:
    write_text(path, json.dumps(data, indent=1) + "\n")


def _read_json(path: Path, *keys: str) -> dict[str, dict[str, Any]]:
    """Return a manifest or a list of moves, which may not lead out of the folder."""
    damages = ValueError, AttributeError, TypeError, KeyError
    with naming(path, damages, ClearanceError, "{}: is damaged ({}); give another --out"):
        data = json.loads(plain_file(path).read_text(encoding="utf-8"))
        for name, entry in ((name, entry) for key in keys for name, entry in data[key].items()):
            if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts:
                raise ValueError("a path leads out of the folder")
            if entry is not None and not entry.keys() >= {"sha256", "by"}:
                raise ValueError(f"{name} has no digest")
    return data


def _remove_empty(folder: Path, top: Path) -> None:
    """Remove a folder that became empty, and those around it, up to the top."""
    while folder != top and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent
