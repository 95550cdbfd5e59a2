"""One wall across one direction."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from ...rig.walls import register
from .slot import Slot

__all__ = ["Stop"]


@register
class Stop(Slot):
    """A wall a gap away from the middle, above it or below."""

    name: ClassVar[str] = "stop"
    side: Literal["upper", "lower"] = "upper"
    """side of positive or of negative displacements"""

    def parameters(self, gap: float) -> tuple[float, ...]:
        """Return the distances of the lower and the upper wall from the middle, infinite for the absent one."""
        return (math.inf, gap) if self.side == "upper" else (gap, math.inf)
