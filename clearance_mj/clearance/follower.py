"""Impact speed, begin and end of a contact at one end of a bushing; compiled.

One source for plain numbers, for the lanes of a register and for periodic motions. The state of a contact is one
number, the impact speed, m/s, with the sign of the wall; 0 in the gap. A shaft that moves from one wall to the other
within a step thus begins a new contact.
"""

from __future__ import annotations

from typing import Any

from ..core.jit import jit
from .lanes import larger, where_above
from .pointers import call_law

__all__ = ["SLOWEST_IMPACT", "contact_force", "end_values", "impact_speed", "lasting", "pushing", "signed_penetration"]

SLOWEST_IMPACT = 1e-6  # m/s, lower limit of the impact speed in the damping


@jit(inline="always")
def signed_penetration(x: Any, lower: Any, upper: Any) -> Any:
    """Return the penetration into one of two walls, m: x - upper above, x - lower below, 0 between."""
    return larger(x - upper, 0.0) - larger(lower - x, 0.0)


@jit(inline="always")
def lasting(impact: Any, g: Any) -> Any:
    """Return the impact speed, m/s, of a contact that lasts at signed penetration g, m; 0 if none does."""
    return where_above(abs(impact), impact * g)


@jit(inline="always")
def impact_speed(impact: Any, g: Any, inwards: Any) -> Any:
    """Return the speed, m/s, > 0, at which the contact at signed penetration g began; 0 in the gap.

    ``impact`` is the state of the step before; ``inwards`` the impact speed of a new contact.
    """
    previous = lasting(impact, g)
    # A previous speed is at least the slowest one, so half of that separates it from 0 without a branch.
    new = where_above(larger(inwards, SLOWEST_IMPACT), 0.5 * SLOWEST_IMPACT - previous)
    return where_above(previous + new, abs(g))


@jit(inline="always")
def end_values(law: int, parameters: Any, out: Any, depth: Any, inwards: Any, impact: Any) -> tuple[Any, Any]:
    """Return stiffness, N/m, and damping, N s/m, of one end: half of those of the bushing's contact law."""
    call_law(law, parameters, depth, inwards, impact, out)
    return 0.5 * out[0], 0.5 * out[1]


@jit(inline="always")
def pushing(force: Any, adhesion: bool) -> Any:
    """Return the force of a wall, N, which never pulls without adhesion."""
    return force if adhesion else max(force, 0.0)


@jit(inline="always")
def contact_force(k: float, c: float, penetration: float, speed: float, adhesion: bool) -> float:
    """Return the force k δ + c δ̇ during contact, N; without adhesion it never pulls."""
    return 0.0 if penetration <= 0.0 else pushing(k * penetration + c * speed, adhesion)
