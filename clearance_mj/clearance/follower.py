"""The follower of a contact at one end of a bushing: when it begins, how fast, and when it is over; compiled.

One source for plain numbers, for the lanes of a register and for periodic motions. What is remembered of a contact is
one number, the speed at which it began, m/s, with the sign of the wall that it is at; 0 in the gap. So a shaft that
goes from one wall to the other within a step begins a new contact.
"""

from __future__ import annotations

from typing import Any

from ..core.jit import jit
from .lanes import larger, where_above
from .pointers import call_law

__all__ = [
    "SLOWEST_IMPACT", "contact_force", "end_values", "impact_speed", "lasting", "pushing", "signed_penetration",
]  # fmt: skip

SLOWEST_IMPACT = 1e-6  # m/s; a contact that begins more slowly is damped as if it began at this speed


@jit(inline="always")
def signed_penetration(x: Any, lower: Any, upper: Any) -> Any:
    """Return the penetration into one of two walls, m: x - upper above, x - lower below, 0 between."""
    return larger(x - upper, 0.0) - larger(lower - x, 0.0)


@jit(inline="always")
def lasting(impact: Any, g: Any) -> Any:
    """Return the speed at which a contact began, m/s, that lasts at signed penetration g, m; 0 if none does."""
    return where_above(abs(impact), impact * g)


@jit(inline="always")
def impact_speed(impact: Any, g: Any, inwards: Any) -> Any:
    """Return the speed, m/s, > 0, at which the contact at signed penetration g began; 0 in the gap.

    ``impact`` is what was remembered of the step before; ``inwards`` the speed at which a contact begins that did not
    last from then.
    """
    kept = lasting(impact, g)
    # A kept speed is at least the slowest one, so half of it separates kept ones from 0 without a branch.
    begun = where_above(larger(inwards, SLOWEST_IMPACT), 0.5 * SLOWEST_IMPACT - kept)
    return where_above(kept + begun, abs(g))


@jit(inline="always")
def end_values(law: int, parameters: Any, out: Any, depth: Any, inwards: Any, impact: Any) -> tuple[Any, Any]:
    """Return stiffness, N/m, and damping, N s/m, of one end: half of what the bushing's contact law answers."""
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
