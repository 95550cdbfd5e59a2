"""Checked values of laws: one row of numbers, schedules over an abscissa, models of contact and filling."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ..core.errors import LawError
from ..core.overview import few
from ..core.validation import to_plain
from ..rig import Grease
from .contact import ContactModel
from .grease import GreaseModel

__all__ = ["AnyGrease", "model_in_words", "number_row", "same_shape", "schedule", "several", "several_greases"]

AnyGrease = Grease | GreaseModel


def number_row(values: Any, name: str) -> np.ndarray:
    """Return one or more finite numbers, not negative, as a read-only array of at least one axis."""
    try:
        array = np.atleast_1d(np.array(values, dtype=float))
    except (TypeError, ValueError, OverflowError):
        raise LawError(f"{name} must be numbers, got {values!r}") from None
    if not array.size:
        raise LawError(f"{name} must hold one or more values")
    if not np.all(np.isfinite(array)) or np.any(array < 0):
        bad = array[~(np.isfinite(array) & (array >= 0))][0]
        raise LawError(f"{name} must be finite and >= 0, got {bad:g}")
    array.flags.writeable = False
    return array


def schedule(abscissa: Any, k: Any, c: Any, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a rising abscissa (n,), and k and c (n, n_bushings) over it."""
    abscissa, k, c = number_row(abscissa, name), number_row(k, "k"), number_row(c, "c")
    if abscissa.ndim != 1 or np.any(np.diff(abscissa) <= 0):
        raise LawError(f"{name} must be one increasing row of values")
    k, c = (v[:, None] if v.ndim == 1 else v for v in (k, c))
    for label, v in (("k", k), ("c", c)):
        if v.ndim != 2 or v.shape[0] != abscissa.size:
            raise LawError(f"{label} has shape {v.shape}, needs ({abscissa.size}, n_bushings) to fit {name}")
    return abscissa, *same_shape(k, c)


def same_shape(k: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return k and c in one shape; one of them may hold a single value for all bushings."""
    try:
        k, c = np.broadcast_arrays(k, c)
    except ValueError:
        raise LawError(f"k and c are for different numbers of bushings: shapes {k.shape} and {c.shape}") from None
    return k, c


def several_greases(grease: Any) -> tuple[AnyGrease, ...] | None:
    """Return one or several fillings as a tuple, or None."""
    return None if grease is None else several(grease, (Grease, GreaseModel), "grease")


def several(values: Any, kinds: tuple[type, ...], name: str) -> tuple[Any, ...]:
    """Return a tuple of one or more objects of the given kinds."""
    if isinstance(values, kinds):
        return (values,)
    values = tuple(values) if isinstance(values, list | tuple) else ()
    for i, value in enumerate(values):
        if not isinstance(value, kinds):
            names = " or ".join(kind.__name__ for kind in kinds)
            raise LawError(f"{name}[{i}] must be of {names}, got {value!r}")
    if not values:
        raise LawError(f"{name} must hold one or more elements")
    return values


def model_in_words(model: ContactModel | AnyGrease) -> str:
    """Return a model's name and its parameters that differ from their defaults."""
    defaults = {field.name: field.default for field in dataclasses.fields(model)}  # type: ignore[arg-type]
    changed = {name: value for name, value in to_plain(model).items() if value != defaults.get(name)}
    numbers = [f"{name} {_short(value)}" for name, value in changed.items()]
    return f"{getattr(model, 'name', 'Bouc-Wen')}: {few(numbers, 9)}"


def _short(value: object) -> str:
    """Return a number with 4 significant digits, or a list of them, as text."""
    if isinstance(value, list):
        return f"[{', '.join(map(_short, value))}]"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
