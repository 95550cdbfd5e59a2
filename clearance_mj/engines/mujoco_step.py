"""MuJoCo's step for compiled loops, with counted instead of logged warnings, and its contact forces."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numba
import numpy as np

from ..core.errors import LawError, SimulationError
from ..physical.library import LIBRARY, external
from ..rig import Rig
from .base import Engine, location

__all__ = ["check_warnings", "contact_rows", "mj_step", "refuse_adhesion", "warnings_counted"]


ROUNDING = 1e-12

mj_step: Any = external("mj_step", numba.types.intp, numba.types.intp)


@contextmanager
def warnings_counted() -> Iterator[None]:
    """Let MuJoCo count its warnings, for `check_warnings`, instead of writing a log into the working folder."""
    global _counting
    with _COUNTING:
        if not _counting:
            _HANDLER.value, _PREVIOUS.value = ctypes.cast(_ignore.ctypes, ctypes.c_void_p).value, _HANDLER.value
        _counting += 1
    try:
        yield
    finally:
        with _COUNTING:
            _counting -= 1
            if not _counting:
                _HANDLER.value = _PREVIOUS.value


@numba.cfunc(numba.types.void(numba.types.voidptr))
def _ignore(_: Any) -> None:
    pass


_HANDLER = ctypes.c_void_p.in_dll(LIBRARY, "mju_user_warning")
_PREVIOUS = ctypes.c_void_p()
_COUNTING, _counting = threading.Lock(), 0


def check_warnings(rig: Rig, data: mujoco.MjData, start: float, largest: int) -> None:
    """Raise a SimulationError if MuJoCo's solver warned since a time, s; the motion is largest at a bushing."""
    for index in np.flatnonzero(data.warning.number):
        name = mujoco.mjtWarning(int(index)).name
        raise SimulationError(
            f"rig {rig.name!r}: MuJoCo's solver warned {name} between t = {start:.6f} s and "
            f"{data.time:.6f} s, the largest motion {location(rig, largest)}"
        )


def refuse_adhesion(engine: Engine, bushings: np.ndarray) -> None:
    """Raise a LawError for bushings whose contacts may pull."""
    if np.any(bushings["adhesion"]):
        raise LawError(f"the {engine.name} engine cannot simulate adhesion: MuJoCo's contacts never pull; use modal")


def contact_rows(ends: np.ndarray, pairs: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Return the contact force (n_rows, nv) of each clearance row, summed over its ends, per constraint force.

    These come from contacts at ``ends`` (2 n_rows, nv), of which ``pairs`` (n_rows, 2) belong to a row, and reactions
    of supports ``held``. (0, nv) where the joints' forces do not distinguish them, as where a support and a bushing are
    on one rigid link.
    """
    rows = np.vstack((ends, held))
    forces = np.linalg.pinv(rows.T)[: len(ends)][pairs].sum(axis=1)
    forces[np.abs(forces) < ROUNDING * np.abs(forces).max(initial=0.0)] = 0.0  # planes are not coupled
    expected = np.zeros((len(pairs), len(rows)))
    np.put_along_axis(expected, pairs, 1.0, axis=1)
    distinct = np.allclose(forces @ rows.T, expected * rows.any(axis=1), rtol=0, atol=1e-6)
    return np.ascontiguousarray(-forces) if distinct else np.zeros((0, rows.shape[1]))
