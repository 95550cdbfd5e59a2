"""Base of the frozen data types that hold arrays: read-only arrays, equality by content, a short repr."""

from __future__ import annotations

import math
from collections.abc import Sequence, Sized
from dataclasses import Field, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ClearanceError
from ..core.overview import HasOverview

__all__ = ["ArrayData", "read_only", "rows_of", "runs", "same"]

MAX_CHARACTERS = 60  # characters of a field in a repr


def read_only(value: ArrayLike, dtype: type = float) -> np.ndarray:
    """Return numbers as a C-contiguous array that nobody can write to; copied unless it is one already."""
    if isinstance(value, np.ndarray) and value.dtype == dtype and value.flags.c_contiguous:
        if not value.flags.writeable:
            return value
    array: np.ndarray = np.array(value, dtype=dtype, order="C")
    array.flags.writeable = False
    return array


def same(a: object, b: object) -> bool:
    """Return True for equal data: numbers (nan equals nan), texts, arrays, tables, lists and mappings."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        a, b = np.asarray(a), np.asarray(b)
        return np.array_equal(a, b, equal_nan=a.dtype.kind in "fc" and b.dtype.kind in "fc")
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(value, b[key]) for key, value in a.items())
    if isinstance(a, list | tuple):
        return isinstance(b, list | tuple) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, float) and isinstance(b, float) and math.isnan(a):
        return math.isnan(b)
    if hasattr(a, "equals"):  # a data frame
        return isinstance(b, type(a)) and bool(a.equals(b))
    return bool(a == b)


def runs(mask: np.ndarray) -> np.ndarray:
    """Return begin and end (n, 2) of each stretch of true values in a row of them."""
    return np.flatnonzero(np.diff(np.pad(mask, 1))).reshape(-1, 2)


def rows_of(values: Sized, rows: Sequence[int] | None, error: type[ClearanceError] = ClearanceError) -> Sequence[int]:
    """Return the selected rows, all if None; refuses one that is not there."""
    selected = list(range(len(values)) if rows is None else rows)
    if not selected or not all(0 <= row < len(values) for row in selected):
        raise error(f"rows must be between 0 and {len(values) - 1}, got {selected}")
    return selected


class ArrayData:
    """Base of frozen dataclasses that hold arrays; decorate them with ``dataclass(frozen=True, eq=False, repr=False)``.

    Two objects are equal if they are of one type and every field that is compared is equal; equal objects have
    one hash, so that caches key on the content.
    """

    def _set(self, **values: object) -> None:
        """Set fields of the frozen object, in ``__post_init__``."""
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __post_init__(self) -> None:
        """Make each field that is an array a read-only one of numbers, real or complex."""
        for name in (f.name for f in self._fields() if str(f.type).startswith("np.ndarray")):
            if (value := getattr(self, name)) is not None:
                self._set(**{name: read_only(value, complex if np.iscomplexobj(value) else float)})

    def _fields(self) -> tuple[Field[Any], ...]:
        return fields(self)  # type: ignore[arg-type]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(same(getattr(self, f.name), getattr(other, f.name)) for f in self._fields() if f.compare)

    def __hash__(self) -> int:
        content: list[object] = [type(self)]
        for value in (getattr(self, f.name) for f in self._fields() if f.compare):
            if isinstance(value, np.ndarray):
                numbers = np.where(np.isnan(value), np.nan, value) + 0.0  # -0 equals 0, and nan any nan
                content += [value.shape, numbers.tobytes()]
            elif isinstance(value, str | int | float | tuple | ArrayData):
                content.append(value)
        return hash(tuple(content))

    def __repr__(self) -> str:
        parts = (f"{f.name}={_short(getattr(self, f.name))}" for f in self._fields())
        return f"{type(self).__name__}({', '.join(parts)})"


def _short(value: Any) -> str:
    if isinstance(value, HasOverview):
        return f"<{value._overview().title}>"
    if isinstance(value, np.ndarray):
        ends = f"[{value[0]:g} ... {value[-1]:g}]" if value.ndim == 1 and value.size > 1 else "array"
        return f"{ends} {value.shape}"
    if hasattr(value, "columns"):  # a data frame
        return f"table of {', '.join(map(str, value.columns))} ({len(value)} rows)"
    if isinstance(value, dict):
        return f"{{{', '.join(map(str, value))}}}"
    if isinstance(value, tuple) and len(value) > 4:
        return f"({value[0]!r} ... {value[-1]!r}: {len(value)})"
    text = repr(value)
    return text if len(text) <= MAX_CHARACTERS else f"{text[:MAX_CHARACTERS]}..."
