"""Provenance of results: versions of the program and its libraries, digests of the files that were read.

Files that this program wrote, and those that these come from, are known again: `stale` says which are not as they were.
"""

from __future__ import annotations

import json
import os
import platform
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from ..version import __version__
from .cache import LIBRARIES, code, library_version
from .files import sha256

__all__ = ["BESIDE", "MANIFEST", "MARK", "WORK", "files_of", "is_marked", "made_from", "stale"]

MARK = "clearance_mj"  # key of the program's version in everything that it writes
WORK = ".clearance-mj"  # name of the hidden folder in a folder that was written
MANIFEST = f"{WORK}/manifest.json"  # what was written into a folder, and from what
BESIDE = ".provenance.json"  # suffix of the file with the provenance of another of any format
MAX_BYTES = 2**22  # bytes of a JSON file that is looked into
MAX_DEPTH = 2  # folders that a file may lie in below the one that was written
IN_FOLDERS = ("rig.toml", "law.json", "dataset.toml")  # files read of a folder, besides the records of its list


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
        MARK: __version__, "code": code(), "python": platform.python_version(),
        "libraries": {name: library_version(name) for name in LIBRARIES}, "made_by": what,
        "inputs": {str(file): sha256(file) for file in files_of(inputs)},
    }  # fmt: skip


def is_marked(path: Path) -> bool:
    """Return whether a file names this program, as all that it writes and may replace does."""
    with path.open("rb") as file:
        begin = file.read(2**16)
        file.seek(max(0, path.stat().st_size - 2**16))
        return MARK.encode() in begin or MARK.encode() in file.read()


def stale(paths: Iterable[Path]) -> list[str]:
    """Return in words which files are not as this program wrote them, or were made from files that are others now.

    Parameters
    ----------
    paths : iterable of Path
        Files that are going to be read, and folders as in `made_from`.
    """
    words = []
    for file in files_of(paths):
        try:
            written, source = _read_provenance(file)
            if written and written["sha256"] != sha256(file):
                words.append(f"{file} was changed after clearance-mj {written['by']} wrote it")
            inputs = source.get("inputs", {})
            changed = [path for path, digest in inputs.items() if os.path.isfile(path) and sha256(path) != digest]
            changed = [path for path in changed if not _has_grown(Path(path), inputs)]
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            continue  # no record that can be read
        words += [f"{file} was made from another {path} than is there now" for path in changed]
    return words


def _has_grown(path: Path, inputs: Iterable[str]) -> bool:
    """Return True if a file is a dataset's list that only got further records: what was read is in it still."""
    if path.name != "dataset.toml":
        return False
    read = {os.path.relpath(other, path.parent) for other in inputs} - {*IN_FOLDERS}
    return {name for name in read if not name.startswith("..")} < {*_dataset_files(path)}


def _read_provenance(file: Path) -> tuple[dict[str, str] | None, dict[str, Any]]:
    """Return digest and command of a file, if a manifest has them, and its provenance, as far as that is known."""
    for folder in Path(os.path.abspath(file)).parents[: MAX_DEPTH + 1]:
        if (folder / MANIFEST).is_file():
            manifest = _read_json(folder / MANIFEST)
            if entry := manifest["files"].get(Path(os.path.abspath(file)).relative_to(folder).as_posix()):
                return entry, manifest.get("made", {}).get(entry["by"], {})
    if (metadata_file := file.with_name(f"{file.name}{BESIDE}")).is_file():
        source = _read_json(metadata_file)
        return {"sha256": source["sha256"], "by": source["made_by"]}, source
    if file.suffix != ".json" or file.stat().st_size > MAX_BYTES:
        return None, {}
    return None, _read_json(file).get("provenance", {})


def _read_json(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))


def files_of(inputs: Iterable[Path]) -> list[Path]:
    """Return the files among ``inputs``, and of folders those that are read, each once."""
    return [*dict.fromkeys(file for path in inputs for file in _files(path))]


def _files(path: Path) -> Iterator[Path]:
    if path.is_file():
        yield path
    elif path.is_dir():
        names = (*IN_FOLDERS, *_dataset_files(path / "dataset.toml"))
        yield from (path / name for name in names if (path / name).is_file())


def _dataset_files(path: Path) -> list[str]:
    """Return the records' files of a dataset's list; none if there is no list that can be read."""
    try:
        return [str(entry["file"]) for entry in tomllib.loads(path.read_text(encoding="utf-8"))["records"]]
    except (OSError, ValueError, KeyError, TypeError):
        return []
