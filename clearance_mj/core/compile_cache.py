"""Folder of numba's compiled code: next to the sources, else the user's, else in the system's temporary folder.

Imported with the package, before anything is compiled. Where packages and home are read-only, as in many containers
and on clusters, numba would refuse to compile at all.
"""

from __future__ import annotations

import os
import sys
import tempfile
import warnings
from pathlib import Path

__all__ = ["choose"]

_PACKAGE = Path(__file__).parents[1]


def choose() -> None:
    """Set a folder for numba where it would have none, and warn; where none is writable, compile every time."""
    if "NUMBA_CACHE_DIR" in os.environ or any(map(_is_writable, (_PACKAGE / "__pycache__", _user_folder()))):
        return
    folder = Path(tempfile.gettempdir()) / f"clearance_mj-{os.getuid()}"
    if _is_writable(folder) and folder.stat().st_uid == os.getuid() and not folder.is_symlink():
        os.environ["NUMBA_CACHE_DIR"] = str(folder)  # for processes that are started, too
        if "numba" in sys.modules:
            sys.modules["numba"].config.CACHE_DIR = str(folder)
        os.environ.setdefault("MPLCONFIGDIR", str(folder))
        warnings.warn(f"clearance_mj keeps what it compiles in {folder}: its own folder is read-only", stacklevel=2)
        return
    warnings.warn("clearance_mj compiles anew in every process: no folder for what is compiled", stacklevel=2)
    from numba.core.dispatcher import Dispatcher
    from numba.np.ufunc.ufuncbuilder import UFuncDispatcher

    for kind in (Dispatcher, UFuncDispatcher):
        kind.enable_caching = lambda self: None  # type: ignore[method-assign]


def _user_folder() -> Path:
    """Return the folder in which numba keeps what a user compiled."""
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")) / "numba"


def _is_writable(folder: Path) -> bool:
    """Return True if files can be made in a folder, which is made if needed."""
    if not folder.is_absolute():
        return False
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
