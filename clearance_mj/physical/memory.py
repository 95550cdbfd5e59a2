"""Addresses as arrays, for compiled code."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from ..core.jit import OPTIONS, jit

__all__ = ["doubles", "field", "integers", "pointer"]


@intrinsic
def _to_pointer(_: Any, place: Any) -> Any:
    """An address as a pointer."""

    def generate(context: Any, builder: Any, __: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], cgutils.voidptr_t)

    return types.voidptr(types.intp), generate


pointer: Any = _to_pointer  # Address as a pointer, for compiled code


@jit(**OPTIONS)
def doubles(place: int, n: int) -> np.ndarray:
    """Numbers of 8 bytes at an address."""
    return numba.carray(pointer(place), n, np.float64)


@jit(**OPTIONS)
def integers(place: int, n: int) -> np.ndarray:
    """Integers of 4 bytes at an address."""
    return numba.carray(pointer(place), n, np.int32)


@jit(**OPTIONS)
def field(place: int) -> int:
    """A pointer that a structure holds."""
    return numba.carray(pointer(place), 1, np.int64)[0]
