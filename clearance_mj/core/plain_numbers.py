"""Numbers in nested plain data, as TOML and JSON hold it, by their paths: `bushings[0].gap`.

`bushings.gap` stands for one value in all entries. The 0.4 of a place such as "inner@0.4" is a number too.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator, Mapping
from typing import Any

from .errors import ClearanceError

__all__ = ["Key", "find_numbers", "get_number", "number_in", "numbers", "path_of", "replace_numbers", "with_number"]

Key = tuple[str | int, ...]  # names and indices that lead to one number in nested plain data.
_PLACE = re.compile(r"(.*@)([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)(:[+-]?[RK]?[XYZ])?")
_STEP = re.compile(r"(?:^|\.)([A-Za-z_]\w*)|\[(\d{1,9})\]")


def find_numbers(data: dict[str, Any], path: str) -> list[Key]:
    """Return the keys of every number that a path stands for; the last name may be an optional field that is left out.

    Names are joined by dots, with [i] for one entry of a list; a list without it stands for all its entries.
    """
    steps = [int(number) if number else name for name, number in _STEP.findall(path)]
    if not path or _STEP.sub("", path):
        raise ClearanceError(f"{path!r} is not a path such as bushings[0].gap")
    return list(_find(data, steps, (), path))


def _find(data: Any, steps: list[str | int], before: Key, path: str) -> Iterator[Key]:
    if isinstance(data, list) and not (steps and isinstance(steps[0], int)):
        for i, item in enumerate(data):
            yield from _find(item, steps, (*before, i), path)
    elif not steps:
        if number_in(data) is None:
            raise ClearanceError(f"{path} holds {data!r}; only numbers can vary")
        yield before
    elif isinstance(data, dict) and steps[0] not in data and len(steps) == 1 and isinstance(steps[0], str):
        yield (*before, steps[0])
    else:
        try:
            inner = data[steps[0]]
        except (KeyError, IndexError, TypeError):
            raise ClearanceError(f"{path} leads nowhere: {_holder(data, before)}") from None
        yield from _find(inner, steps[1:], (*before, steps[0]), path)


def _holder(data: Any, before: Key) -> str:
    number_path = path_of(before) or "it"
    if isinstance(data, dict):
        return f"{number_path} has {', '.join(data)}"
    return f"{number_path} has {len(data)} entries" if isinstance(data, list) else f"{number_path} is {data!r}"


def path_of(key: Key) -> str:
    """Return the path that stands for one number."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in key)[1:]


def numbers(data: dict[str, Any] | list[Any]) -> Iterator[Key]:
    """Yield the key of every number."""
    for step, item in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(item, dict | list):
            yield from ((step, *key) for key in numbers(item))
        elif number_in(item) is not None:
            yield (step,)


def number_in(item: object) -> float | None:
    """Return the number that plain data is, or holds behind an @; None if there is none."""
    if isinstance(item, str) and (place := _PLACE.fullmatch(item)):
        return float(place[2])
    return item if isinstance(item, int | float) and not isinstance(item, bool) else None


def with_number(item: object, number: float) -> float | str:
    """Return the same plain data with another number."""
    place = _PLACE.fullmatch(item) if isinstance(item, str) else None
    return f"{place[1]}{number!r}{place[3] or ''}" if place else number


def get_number(data: Any, key: Key) -> float | None:
    """Return the number at a key, None where an optional field is left out."""
    for step in key[:-1]:
        data = data[step]
    return number_in(data.get(key[-1]) if isinstance(data, dict) else data[key[-1]])


def replace_numbers(data: dict[str, Any], changes: Mapping[Key, float]) -> dict[str, Any]:
    """Return a copy of nested plain data with other numbers by their keys."""
    data = copy.deepcopy(data)
    for key, value in changes.items():
        part: Any = data
        for step in key[:-1]:
            part = part[step]
        part[key[-1]] = with_number(part.get(key[-1]) if isinstance(part, dict) else part[key[-1]], value)
    return data
