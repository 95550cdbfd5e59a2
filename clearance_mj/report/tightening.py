"""Which tolerance to tighten: one figure for a design review, and the same in words."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..tolerance import Tightening
from .style import COLOURS, FONT, REPEAT, Drawing, canvas, tidy

__all__ = ["draw_tightening", "tightening_table", "tightening_words"]


def draw_tightening(found: Tightening, name: str = "tightening") -> Drawing:
    """Draw, for each number, what share of its tolerance it may have, and what share of the designs is left without.

    Parameters
    ----------
    found : Tightening
        What each tolerance may be.
    name : str
        Of the figure's file.
    """
    order = np.argsort(found.share_without)
    places = np.arange(order.size)
    figure = canvas(0.9 + 0.3 * order.size)
    left, right = figure.subplots(1, 2, sharey=True)
    left.barh(places, 100 * found.share_without[order], 0.6, color=COLOURS[0])
    left.axvline(100 * found.share, color=REPEAT, lw=1.0, label="as it stands")
    left.axvline(100 * found.allowed, color=COLOURS[1], lw=1.2, ls="--", label="allowed")
    left.set_xlim(left=0)
    left.set_yticks(places, [found.names[i] for i in order], fontsize=FONT - 1)
    left.invert_yaxis()
    tidy(left, f"{found.what}, without the scatter of", "", "Share of the designs (%)")
    width = np.where(np.isnan(found.width), 0.0, found.width)[order]
    right.barh(places - 0.17, 100 * width, 0.32, color=COLOURS[3], label="this tolerance alone")
    for place, i in zip(places, order):
        if math.isnan(found.width[i]):
            right.text(1, place - 0.17, "does not do alone", va="center", fontsize=FONT - 1.5)
    if found.cheapest:
        of = [100 * found.cheapest.get(found.names[i], 1.0) for i in order]
        right.barh(places + 0.17, of, 0.32, color=COLOURS[5], label="cheapest set")
    figure.legend(fontsize=FONT - 1, frameon=False, loc="outside lower center", ncols=4)
    right.set_xlim(0, 105)
    tidy(right, f"tolerance for at most {100 * found.allowed:g} %", "", "Share of the tolerance as it is (%)")
    caption = (
        f"{found.what[0].upper()}{found.what[1:]} at levels up to {found.level:g} {found.unit}. Left: share of the "
        "designs without the scatter of one number; grey line: of all of it; dashed: what is allowed. Right: what is "
        "left of its tolerance where it is tightened alone, and in the cheapest set."
    )
    return Drawing(name, figure, caption, "Bars of shares of designs and of tolerances for each number.")


def tightening_table(found: Tightening) -> dict[str, Any]:
    """Return everything but the designs as plain data."""
    return {
        "level": found.level, "what": found.what, "allowed": found.allowed, "share": found.share,
        "share_limits": list(found.share_limits), "numbers": found.rows(), "cost": found.cost,
        "cheapest_share": found.cheapest_share, "cheapest_limits": list(found.cheapest_limits),
        "error_db": found.error, "gap_factor": found.gap, "gaps": list(found.gaps), "gap_share": found.gap_share,
        "gap_limits": list(found.gap_limits),
    }  # fmt: skip


def tightening_words(found: Tightening) -> list[str]:
    """Say in whole sentences which tolerances to tighten, and how far."""
    low, high = found.share_limits
    said = [
        f"{found.what} up to {found.level:g} {found.unit}: {100 * found.share:.3g} % of the designs ({100 * low:.3g} "
        f"to {100 * high:.3g} %), {100 * found.allowed:g} % are allowed."
    ]
    if found.share <= found.allowed:
        return [*said, "The tolerances do as they are."]
    for i in np.argsort(found.share_without):
        width = found.width[i]
        if width < 1:
            said.append(f"{found.names[i]} alone would do with {100 * width:.3g} % of its tolerance.")
    if not np.any(found.width < 1):
        priced = any(number.price for number in found.scatter.numbers) and not found.cheapest
        said.append(f"No tolerance does alone{', nor do those with a price together' if priced else ''}.")
    if found.cheapest:
        parts = ", ".join(f"{name} {100 * width:.3g} %" for name, width in found.cheapest.items())
        low, high = found.cheapest_limits
        said.append(
            f"The cheapest set, at {found.cost:.4g}: {parts} of their tolerances; computed anew, "
            f"{100 * found.cheapest_share:.3g} % of the designs ({100 * low:.3g} to {100 * high:.3g} %)."
        )
    if found.gaps:
        low, high = found.gap_limits
        does = "The nominal gap does" if found.gap_share <= found.allowed else "Nor does the nominal gap"
        gaps = ", ".join(f"{1e3 * gap:.3g}" for gap in dict.fromkeys(found.gaps))
        said.append(
            f"{does}: at {found.gap:.3g} times the present one ({gaps} mm), with the tolerances as they are, computed "
            f"anew, {100 * found.gap_share:.3g} % of the designs ({100 * low:.3g} to {100 * high:.3g} %)."
        )
    said.append(f"Learnt from the designs within {found.error:.2g} dB of the level (RMS, cross-validated).")
    return said
