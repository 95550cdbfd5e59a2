"""Free parameters of a rig: numbers that its linear state depends on, bounds, and a rig with other values."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import operator
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.errors import ClearanceError, RigError
from ..core.plain_numbers import Key, find_numbers, get_number, numbers, path_of, with_number
from ..estimate.parameter import Parameter
from ..rig import Rig
from ..rig.tolerance import FIELDS
from ..structure.base import parse_place

__all__ = ["Free", "value_of"]

TAPERED = ("diameter", "inner_diameter", "width", "height")
SHAFT = ("length", "young_modulus", "density", "poisson_ratio", *TAPERED)
POINTS = ("position", "to", "mass", "stiffness", "damping")
"""fields that may be free: of a section, of a shaft, and of elements at points of it"""
SHAFT_FACTOR, OTHER_FACTOR = 1.2, 10.0
"""default bounds are start / factor to start × factor: of the shaft, and of all else but positions"""
NEAREST = 0.02  # lowest default bound of a position, over the shaft's length
ROUNDING = 1e-9

Free = Mapping[str, tuple[float, float] | None]
"""paths of the free parameters with their bounds, SI units; None: default bounds"""


def keys_of(rig: Rig, path: str) -> list[Key]:
    """Return the keys, in the rig's plain data, of all numbers of a path; a RigError lists the known paths."""
    data = rig.to_dict()
    valid = [key for key in numbers(data) if _affects_linear_rig(key)]
    with contextlib.suppress(ClearanceError):  # of beam.rayleigh each has its own unit: none share a value
        keys = find_numbers(data, path)
        if keys and set(keys) <= set(valid) and (isinstance(_field_of(keys[0])[-1], str) or path == path_of(keys[0])):
            return keys
    names = dict.fromkeys(re.sub(r"\[\d+\]", "[N]", path_of(key)) for key in map(_field_of, valid))
    counts = ", ".join(f"{len(getattr(rig, kind))} {kind}" for kind in ("masses", "bushings", "sensors"))
    raise RigError(f"{path!r} is no free parameter of rig {rig.name!r} ({counts}); known: {', '.join(names)}")


def _affects_linear_rig(key: Key) -> bool:
    """Return True if the linear rig depends on a number."""
    at_points = key[0] in ("masses", "bushings", "sensors") and key[-1] in POINTS and "contact" not in key
    return at_points or key[0] in ("beam", "structure")


def _field_of(key: Key) -> Key:
    """Return the key of a field; both ends of a section have one."""
    return key[:-1] if len(key) > 1 and key[-2] in TAPERED else key


def value_of(rig: Rig, path: str) -> float:
    """Return the value of a parameter; the mean where several numbers share it.

    Parameters
    ----------
    rig : Rig
        The rig.
    path : str
        Such as "bushings[0].position", or "bushings.grease.stiffness" for all bushings.

    Raises
    ------
    RigError
        For an unknown path; the message lists the known ones.
    """
    data = rig.to_dict()
    return float(np.mean([get_number(data, key) for key in keys_of(rig, path)]))


def free_parameter(rig: Rig, path: str, bounds: tuple[float, float] | None) -> Parameter:
    """Return the parameter of a path, which starts at the rig's value; without bounds, the default ones."""
    value, last = value_of(rig, path), path.rpartition(".")[2]
    field = last.partition("[")[0]
    if bounds is None:
        if value <= 0:
            raise RigError(f"{path} starts at {value:g} and has no bounds; give them, as in {path}=1:10")
        factor, is_place = SHAFT_FACTOR if field in SHAFT else OTHER_FACTOR, field in ("position", "to")
        bounds = _shaft_ends(rig, keys_of(rig, path)[0]) if is_place else (value / factor, value * factor)
    low, high = bounds
    if not 0 < low < high < np.inf:
        raise RigError(f"the bounds of {path} must be 0 < low < high, got {low:g} and {high:g}")
    if value > 0 and not (1 - ROUNDING) * low <= value <= (1 + ROUNDING) * high:
        raise RigError(f"{path} starts at {value:g}, outside its bounds {low:g} to {high:g}")
    units = FIELDS | {"rayleigh[0]": "1/s", "rayleigh[1]": "s"}
    return Parameter(path, units.get(last, units.get(field, "")), value, low, high)


def _shaft_ends(rig: Rig, key: Key) -> tuple[float, float]:
    """Return default bounds of a position: the shaft that it is on, without the part near its start."""
    data: Any = rig.to_dict()
    shafts = rig.linear.shafts
    if key[:2] == ("structure", "parts"):
        shaft = shafts[int(key[2])]
    else:
        name, _ = parse_place(functools.reduce(operator.getitem, key, data)) or ("", 0.0)
        shaft = {shaft.name: shaft for shaft in shafts}.get(name, shafts[0])
    return max(shaft.start, 0.0) + NEAREST * shaft.length, shaft.end


def with_values(rig: Rig, values: Mapping[Key, float]) -> Rig:
    """Return a rig with other numbers; it is checked once all are in."""
    return _replaced(rig, values)


def _replaced(part: Any, values: Mapping[Key, float]) -> Any:
    if () in values:
        return with_number(part, values[()])
    inner: dict[Any, dict[Key, float]] = {}
    for (first, *rest), value in values.items():
        inner.setdefault(first, {})[tuple(rest)] = value
    if isinstance(part, tuple):
        return tuple(_replaced(item, inner[i]) if i in inner else item for i, item in enumerate(part))
    return dataclasses.replace(part, **{name: _replaced(getattr(part, name), sub) for name, sub in inner.items()})
