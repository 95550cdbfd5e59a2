"""Spans of bushings along their shafts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

from ..structure.base import is_rotation, parse_direction, parse_place
from .clearance import Bushing

__all__ = ["check_bushings"]


def check_bushings(bushings: Sequence[Bushing], check: Callable[[float | str], None]) -> None:
    """Refuse bushings that reach past the structure or into each other; ``check`` refuses points outside."""
    on_shafts: dict[str, list[tuple[float, float, int]]] = {}
    for i, b in enumerate(bushings):
        if b.to == b.position:
            raise ValueError(f"bushings[{i}].to is the bushing's own position; give another point")
        place = parse_place(b.position)
        if b.to is not None and is_rotation(b.to) != is_rotation(b.position):
            raise ValueError(f'bushings[{i}].to "{b.to}" and position "{b.position}": one is an angle, one a length')
        axes = [(parse_direction(point) or "Z")[0] for point in b.joined if parse_place(point)]
        if len({*axes}) > 1:
            raise ValueError(f"bushings[{i}].to is along {axes[1]}, and position along {axes[0]}; give one direction")
        if place is None or is_rotation(b.position):
            if b.length:
                raise ValueError(f"bushings[{i}].length must be 0, as its position is a degree of freedom")
            continue
        for point in b.joined:
            _check_ends(i, b, point, check)
        first, last = place[1] - b.length / 2, place[1] + b.length / 2
        on_shafts.setdefault(place[0], []).append((first, last, i))
    for spans in on_shafts.values():
        for (_, end, i), (start, _, j) in pairwise(sorted(spans)):
            if end >= start:
                raise ValueError(
                    f"bushings[{j}] overlaps bushings[{i}]: it starts at {start:g} m, the other ends at {end:g} m"
                )


def _check_ends(i: int, bushing: Bushing, point: float | str, check: Callable[[float | str], None]) -> None:
    """Refuse a bushing that reaches past the shaft on which a point of it is."""
    length, place = bushing.length, parse_place(point)
    try:
        for end in bushing.ends_of(point):
            check(end)
    except ValueError as error:
        middle = place[1] if place else 0.0
        reach = f"from {middle - length / 2:g} to {middle + length / 2:g} m"
        past = str(error).partition("lies outside ")[2] or str(error)
        raise ValueError(f"bushings[{i}].length {length:g} m makes it reach {reach}, past {past}") from None
