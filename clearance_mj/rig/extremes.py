"""Numbers of a rig that are out of all proportion, for messages about rigs that cannot be computed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..core.errors import RigError

__all__ = ["computable", "extremes"]

ORDINARY = {
    "length": (1e-3, 1e2), "diameter": (1e-4, 1e1), "inner_diameter": (1e-4, 1e1), "width": (1e-4, 1e1),
    "height": (1e-4, 1e1), "young_modulus": (1e6, 1e13), "density": (1e1, 1e5), "mass": (1e-6, 1e5),
    "inertia": (1e-12, 1e4), "stiffness": (1e-3, 1e12), "damping": (1e-6, 1e8), "translation": (1e-3, 1e14),
    "rotation": (1e-6, 1e12), "gap": (1e-7, 1e-1), "rayleigh": (1e-12, 1e4), "position": (1e-4, 1e2),
}  # fmt: skip
"""SI units; zero is ordinary wherever it is allowed"""
MAX_NAMED = 3  # fields that a warning names


def extremes(data: dict[str, Any]) -> str:
    """Return the numbers of a rig's plain data that are farthest from real rigs', in words; empty if none is."""
    ranked = sorted(_out_of_range(data, ""), reverse=True)
    return ", ".join(words for _, words in ranked[:MAX_NAMED])


@contextmanager
def computable(name: str, data: Callable[[], dict[str, Any]]) -> Iterator[None]:
    """Turn errors of arithmetic into a RigError that names the numbers of a rig that are out of all proportion."""
    try:
        yield
    except (ArithmeticError, ValueError) as error:  # LinAlgError is a ValueError
        numeric = isinstance(error, ArithmeticError | np.linalg.LinAlgError)
        words = "its masses and stiffnesses are too large or too small to compute with" if numeric else error
        numbers = extremes(data())
        raise RigError(f"rig {name!r}: {words}{f'; look at {numbers}' if numbers else ''}") from None


def _out_of_range(data: Any, path: str, field: str = "") -> Iterator[tuple[float, str]]:
    """Yield by how many decades each number is out of its range, and its name and value."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield from _out_of_range(value, f"{path}.{key}" if path else key, key)
    elif isinstance(data, list | tuple):
        for i, value in enumerate(data):
            yield from _out_of_range(value, f"{path}[{i}]", field)
    elif isinstance(data, int | float) and data and field in ORDINARY:
        low, high = ORDINARY[field]
        size = abs(data)
        if not low <= size <= high:
            decades = math.log10(low / size) if size < low else math.log10(size) - math.log10(high)
            yield decades, f"{path} = {data:g} (ordinary: {low:g} to {high:g})"
