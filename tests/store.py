"""A store for one run of the tests: folders that are expensive are made once, for all files and all processes."""

import fcntl
import functools
import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import clearance_mj

PACKAGE = Path(clearance_mj.__file__).parent


@functools.cache
def code() -> str:
    """Digest of all Python sources of the package."""
    hasher = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        hasher.update(str(path.relative_to(PACKAGE)).encode() + b"\0" + path.read_bytes())
    return hasher.hexdigest()


def shared_folder(tmp_path_factory) -> Path:
    """The temporary folder that all processes of a run share: under xdist each has its own one inside of it."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base


def content(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of change of each file."""
    stats = {str(p.relative_to(folder)): p.stat() for p in folder.rglob("*") if p.is_file()}
    return {name: (stat.st_size, stat.st_mtime_ns) for name, stat in stats.items()}


@contextmanager
def kept(tmp_path_factory, name: str, key: object, make: Callable[[Path], object]) -> Iterator[Path]:
    """A folder that ``make`` fills, made by whoever asks first while the others wait.

    It is there to be read; whoever writes takes a copy. Where it has changed in the end, an error says so.

    Parameters
    ----------
    tmp_path_factory
        pytest's fixture.
    name : str
        What the folder is called.
    key : object
        Everything that its content depends on beside the package's code, as JSON can hold it.
    make : callable
        Is given the path of an empty folder. Where it fails nothing is left, and the next one tries again.
    """
    made_from = hashlib.sha256(json.dumps([code(), name, key], sort_keys=True).encode()).hexdigest()
    store = shared_folder(tmp_path_factory) / "store" / made_from[:16]
    store.mkdir(parents=True, exist_ok=True)
    with (store / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (store / name).is_dir():
            with tempfile.TemporaryDirectory(dir=store) as unfinished:
                folder = Path(unfinished) / name
                folder.mkdir()
                make(folder)
                folder.rename(store / name)
    before = content(store / name)
    yield store / name
    changed = set(before.items()) ^ set(content(store / name).items())
    assert not changed, f"a test has written into {store / name}, which others read: {sorted(changed)}"
