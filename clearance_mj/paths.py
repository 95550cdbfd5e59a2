"""Dotted paths into nested plain data, as TOML and JSON hold it: `bushings[0].gap`, or `bushings.gap` for all."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator

from .errors import ClearanceError

__all__ = ["changed", "numbers", "places", "value_at", "written"]

Place = tuple[str | int, ...]
_STEP = re.compile(r"(?:^|\.)([A-Za-z_]\w*)|\[(\d{1,9})\]")


def places(data: dict, path: str) -> list[Place]:
    """Return every place of a number that a path stands for.

    Parameters
    ----------
    data : dict
        Nested plain data.
    path : str
        Names joined by dots, with [i] for one entry of a list; a list without it stands for all its entries. The last
        name may be missing in the data: an optional field that is left out.

    Raises
    ------
    ClearanceError
        If the path is not written so, leads nowhere or to something else than numbers.
    """
    steps = [int(number) if number else name for name, number in _STEP.findall(path)]
    if not path or _STEP.sub("", path):
        raise ClearanceError(f"{path!r} is not a path such as bushings[0].gap")
    return list(_found(data, steps, (), path))


def _found(data, steps, before, path):
    if isinstance(data, list) and not (steps and isinstance(steps[0], int)):
        for i, item in enumerate(data):
            yield from _found(item, steps, (*before, i), path)
    elif not steps:
        if isinstance(data, bool) or not isinstance(data, int | float):
            raise ClearanceError(f"{path} holds {data!r}; only numbers can vary")
        yield before
    elif isinstance(data, dict) and steps[0] not in data and len(steps) == 1 and isinstance(steps[0], str):
        yield (*before, steps[0])
    else:
        try:
            inner = data[steps[0]]
        except (KeyError, IndexError, TypeError):
            raise ClearanceError(f"{path} leads nowhere: {_known(data, before)}") from None
        yield from _found(inner, steps[1:], (*before, steps[0]), path)


def _known(data, before) -> str:
    where = written(before) or "it"
    if isinstance(data, dict):
        return f"{where} has {', '.join(data)}"
    return f"{where} has {len(data)} entries" if isinstance(data, list) else f"{where} is {data!r}"


def written(place: Place) -> str:
    """Return the path that stands for one place.

    Parameters
    ----------
    place : tuple
        As `places` returns it.
    """
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in place)[1:]


def numbers(data: dict | list) -> Iterator[Place]:
    """Yield the place of every number.

    Parameters
    ----------
    data : dict or list
        Nested plain data.
    """
    for step, item in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(item, dict | list):
            yield from ((step, *place) for place in numbers(item))
        elif isinstance(item, int | float) and not isinstance(item, bool):
            yield (step,)


def value_at(data: dict, place: Place) -> float | None:
    """Return the number at a place, None where an optional field is left out.

    Parameters
    ----------
    data : dict
        Nested plain data.
    place : tuple
        As `places` returns it.
    """
    for step in place[:-1]:
        data = data[step]
    return data.get(place[-1]) if isinstance(data, dict) else data[place[-1]]


def changed(data: dict, changes: dict[Place, float]) -> dict:
    """Return a copy of nested plain data with other numbers.

    Parameters
    ----------
    data : dict
        Nested plain data.
    changes : dict
        New numbers by their places.
    """
    data = copy.deepcopy(data)
    for place, value in changes.items():
        part = data
        for step in place[:-1]:
            part = part[step]
        part[place[-1]] = value
    return data
