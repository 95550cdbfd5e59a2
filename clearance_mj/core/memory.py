"""Available memory: computations that need more are refused before they begin."""

from __future__ import annotations

import os
import resource
from pathlib import Path

from .errors import ClearanceError

__all__ = ["require_memory"]


def require_memory(size: float, what: str, remedy: str) -> None:
    """Refuse what needs more memory than there is.

    Parameters
    ----------
    size : float
        bytes.
    what : str
        Needs them, such as "10 sensors at 1e+09 samples".
    remedy : str
        What to do instead.
    """
    if size > 2**24 and size > (free := _available_memory()):
        raise ClearanceError(f"{what} need {size / 2**30:.3g} GiB of memory, {free / 2**30:.3g} GiB are left; {remedy}")


def _available_memory() -> float:
    """Return the bytes of memory that are available, within the limit of the process."""
    page = os.sysconf("SC_PAGE_SIZE")
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        free = 1024.0 * next(int(line.split()[1]) for line in lines if line.startswith("MemAvailable"))
        used = page * int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (OSError, ValueError, StopIteration):  # no Linux
        free, used = float(page * os.sysconf("SC_PHYS_PAGES")), 0
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    return free if most == resource.RLIM_INFINITY else min(free, max(0, most - used))
