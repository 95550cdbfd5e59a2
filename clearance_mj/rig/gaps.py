"""Other gaps of a rig's bushings: in m, with a unit, or as a factor of the rig's gaps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

from ..core.checks import naming
from ..core.errors import ClearanceError, RigError
from ..core.units import si_value
from .clearance import Bushing

__all__ = ["Gap", "bushings_with_gap"]

Gap: TypeAlias = float | str | Sequence[float | str] | Mapping[str, float | str]  # of all, one for each, or by bushing


def bushings_with_gap(bushings: Sequence[Bushing], names: Sequence[Sequence[str]], gap: Gap) -> tuple[Bushing, ...]:
    """Return bushings, each known by its names, with another gap; see `Rig.with_gap`."""
    if not bushings:
        raise RigError("the rig has no bushings whose gap could be another one")
    if not isinstance(gap, Mapping):
        gaps = [gap] * len(bushings) if isinstance(gap, str | int | float) else list(gap)
        if len(gaps) != len(bushings):
            raise RigError(f"gap must be one value or {len(bushings)}, one for each bushing; got {len(gaps)}")
        return tuple(_with_gap(i, *pair) for i, pair in enumerate(zip(bushings, gaps)))
    changed = list(bushings)
    for name, value in gap.items():
        matches = [i for i, aliases in enumerate(names) if name in (*aliases, f"bushings[{i}]")]
        if len(matches) != 1:
            listing = ", ".join(dict.fromkeys(aliases[0] for aliases in names))
            raise RigError(f'gap of "{name}": no one bushing has this name; the rig has {listing}')
        changed[matches[0]] = _with_gap(matches[0], bushings[matches[0]], value)
    return tuple(changed)


def _with_gap(i: int, bushing: Bushing, gap: float | str) -> Bushing:
    with naming(f"gap {gap!r} of bushings[{i}] ({bushing.where})", ClearanceError, RigError):
        value = _metres(gap, bushing.gap)
        if not 0 < value < math.inf:
            raise ClearanceError("must be above 0 and finite")
        return replace(bushing, gap=value)


def _metres(gap: float | str, nominal: float) -> float:
    """Return a gap in m, that of a factor such as "x0.5" times the bushing's nominal gap."""
    if not isinstance(gap, str):
        return float(gap)
    text = gap.strip()
    if text[:1] not in ("x", "×"):
        return si_value(text, "displacement")
    try:
        return nominal * float(text[1:])
    except ValueError:
        raise ClearanceError("is no factor, such as x0.5") from None
