"""A circle."""

from __future__ import annotations

from collections.abc import MutableSequence, Sequence
from typing import ClassVar

from ...rig.walls import Wall, register
from ..lanes import larger
from ..vectors import TINY, length

__all__ = ["Round"]


@register
class Round(Wall):
    """A circle whose radius is the gap."""

    name: ClassVar[str] = "round"

    @staticmethod
    def law(p: Sequence[float], r: tuple[float, float], out: MutableSequence[float]) -> None:
        """Return the depth |r| - gap along r."""
        e = larger(length(r), TINY)
        out[0] = e - p[0]
        out[1] = r[0] / e
        out[2] = r[1] / e

    def reach(self, gap: float) -> float:
        """Return the gap."""
        return gap
