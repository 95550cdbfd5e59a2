"""Which tolerance to tighten: one figure for a design review, and the same in words."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..tolerance import Tightening
from .style import COLOURS, FONT, REPEAT, Drawing, canvas, tidy

__all__ = ["draw_tightening", "tightening_table", "tightening_words"]


def draw_tightening(plan: Tightening, name: str = "tightening") -> Drawing:
    """Draw, for each number, its tightened tolerance, and the fraction of designs that fail without its scatter.

    Parameters
    ----------
    plan : Tightening
        The tolerance that each number may have.
    name : str
        Of the figure's file.
    """
    order = np.argsort(plan.share_without)
    places = np.arange(order.size)
    figure = canvas(0.9 + 0.3 * order.size)
    left, right = figure.subplots(1, 2, sharey=True)
    left.barh(places, 100 * plan.share_without[order], 0.6, color=COLOURS[0])
    left.axvline(100 * plan.share, color=REPEAT, lw=1.0, label="as it stands")
    left.axvline(100 * plan.allowed, color=COLOURS[1], lw=1.2, ls="--", label="allowed")
    left.set_xlim(left=0)
    left.set_yticks(places, [plan.names[i] for i in order], fontsize=FONT - 1)
    left.invert_yaxis()
    tidy(left, f"{plan.what}, without the scatter of", "", "Share of the designs (%)")
    width = np.where(np.isnan(plan.width), 0.0, plan.width)[order]
    right.barh(places - 0.17, 100 * width, 0.32, color=COLOURS[3], label="this tolerance alone")
    for place, i in zip(places, order):
        if math.isnan(plan.width[i]):
            right.text(1, place - 0.17, "does not do alone", va="center", fontsize=FONT - 1.5)
    if plan.cheapest:
        cheapest = [100 * plan.cheapest.get(plan.names[i], 1.0) for i in order]
        right.barh(places + 0.17, cheapest, 0.32, color=COLOURS[5], label="cheapest set")
    figure.legend(fontsize=FONT - 1, frameon=False, loc="outside lower center", ncols=4)
    right.set_xlim(0, 105)
    tidy(right, f"tolerance for at most {100 * plan.allowed:g} %", "", "Share of the tolerance as it is (%)")
    caption = (
        f"{plan.what[0].upper()}{plan.what[1:]} at levels up to {plan.level:g} {plan.unit}. Left: share of the "
        "designs without the scatter of one number; grey line: of all of it; dashed: what is allowed. Right: what is "
        "left of its tolerance where it is tightened alone, and in the cheapest set."
    )
    return Drawing(name, figure, caption, "Bars of shares of designs and of tolerances for each number.")


def tightening_table(plan: Tightening) -> dict[str, Any]:
    """Return everything but the designs as plain data."""
    return {
        "level": plan.level, "what": plan.what, "allowed": plan.allowed, "share": plan.share,
        "share_limits": list(plan.share_limits), "numbers": plan.rows(), "cost": plan.cost,
        "cheapest_share": plan.cheapest_share, "cheapest_limits": list(plan.cheapest_limits),
        "error_db": plan.error, "gap_factor": plan.gap, "gaps": list(plan.gaps), "gap_share": plan.gap_share,
        "gap_limits": list(plan.gap_limits),
    }  # fmt: skip


def tightening_words(plan: Tightening) -> list[str]:
    """Return sentences on the tolerances to tighten, and how far."""
    low, high = plan.share_limits
    said = [
        f"{plan.what} up to {plan.level:g} {plan.unit}: {100 * plan.share:.3g} % of the designs ({100 * low:.3g} "
        f"to {100 * high:.3g} %), {100 * plan.allowed:g} % are allowed."
    ]
    if plan.share <= plan.allowed:
        return [*said, "The tolerances do as they are."]
    for i in np.argsort(plan.share_without):
        width = plan.width[i]
        if width < 1:
            said.append(f"{plan.names[i]} alone would do with {100 * width:.3g} % of its tolerance.")
    if not np.any(plan.width < 1):
        priced = any(number.price for number in plan.scatter.numbers) and not plan.cheapest
        said.append(f"No tolerance does alone{', nor do those with a price together' if priced else ''}.")
    if plan.cheapest:
        parts = ", ".join(f"{name} {100 * width:.3g} %" for name, width in plan.cheapest.items())
        low, high = plan.cheapest_limits
        said.append(
            f"The cheapest set, at {plan.cost:.4g}: {parts} of their tolerances; computed anew, "
            f"{100 * plan.cheapest_share:.3g} % of the designs ({100 * low:.3g} to {100 * high:.3g} %)."
        )
    if plan.gaps:
        low, high = plan.gap_limits
        claim = "The nominal gap does" if plan.gap_share <= plan.allowed else "Nor does the nominal gap"
        gaps = ", ".join(f"{1e3 * gap:.3g}" for gap in dict.fromkeys(plan.gaps))
        said.append(
            f"{claim}: at {plan.gap:.3g} times the present one ({gaps} mm), with the tolerances as they are, computed "
            f"anew, {100 * plan.gap_share:.3g} % of the designs ({100 * low:.3g} to {100 * high:.3g} %)."
        )
    said.append(f"Learnt from the designs within {plan.error:.2g} dB of the level (RMS, cross-validated).")
    return said
