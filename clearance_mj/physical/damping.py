"""Damping of contacts, limits and teeth, given as a damping ratio or a coefficient of restitution."""

from __future__ import annotations

import math

from ..core.errors import LawError

__all__ = ["damping_ratio_of", "restitution_of"]

_LARGEST = 1e3  # damping ratio of the search: its restitution is 2.5e-7


def damping_ratio_of(c: float | None, damping_ratio: float | None, restitution: float | None) -> float | None:
    """Return the damping ratio of a damping ratio or restitution, or None for a damping c.

    Parameters
    ----------
    c : float or None
        N s/m.
    damping_ratio : float or None
        ζ, of the critical damping 2 √(k m), >= 0.
    restitution : float or None
        Speed after an impact over that before, > 0 and <= 1, of the mass m on a contact that does not pull.

    Raises
    ------
    LawError
        For several of them, and values out of range.
    """
    options = {"c": c, "damping_ratio": damping_ratio, "restitution": restitution}
    names = [name for name, value in options.items() if value is not None]
    if len(names) > 1:
        raise LawError(f"give one of c, damping_ratio and restitution, got {' and '.join(names)}")
    if restitution is not None:
        if not 0 < restitution <= 1:
            raise LawError(f"restitution {restitution} must be > 0 and <= 1")
        return _ratio_of_restitution(restitution)
    if damping_ratio is not None and not 0 <= damping_ratio < math.inf:
        raise LawError(f"damping_ratio {damping_ratio} must be finite and >= 0")
    return damping_ratio


def restitution_of(damping_ratio: float) -> float:
    """Return the restitution of a spring and damper that never pulls: it lets go where k r + c ṙ is zero.

    exp(-2 ζ arccos ζ/√(1 - ζ²)) (Schwager & Pöschel, Granular Matter 9, 2007), with arcosh and ζ² - 1 above ζ = 1.
    """
    if abs(damping_ratio - 1) < 1e-9:
        return math.exp(-2.0)
    angle = math.acos(damping_ratio) if damping_ratio < 1 else math.acosh(damping_ratio)
    return math.exp(-2 * damping_ratio * angle / math.sqrt(abs(1 - damping_ratio**2)))


def _ratio_of_restitution(restitution: float) -> float:
    low, high = 0.0, _LARGEST
    while high - low > 1e-15 * high:
        middle = (low + high) / 2
        if middle in (low, high):
            break
        low, high = (middle, high) if restitution_of(middle) > restitution else (low, middle)
    return low
