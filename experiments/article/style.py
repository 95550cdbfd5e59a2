"""Looks that the figures share: Okabe and Ito's colours, the article's where it names them."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

__all__ = ["BLACK", "BLUE", "GREEN", "GREY", "ORANGE", "PURPLE", "SKY", "VERMILION", "panel", "sheet"]

BLACK, GREY, BLUE, SKY = "#000000", "#8c8c8c", "#0072b2", "#56b4e9"
VERMILION, ORANGE, GREEN, PURPLE = "#d55e00", "#e69f00", "#009e73", "#cc79a7"
FONT = 8
"""pt"""
WIDTH = 6.5
"""in"""


def sheet(height: float) -> Figure:
    """Return an empty figure of the page's width and a height in inches."""
    return Figure(figsize=(WIDTH, height), layout="constrained", facecolor="white")


def panel(ax: Axes, title: str = "", xlabel: str = "", ylabel: str = "") -> None:
    """Give a panel its words, labels with quantity and unit, and grid."""
    ax.set_title(title, fontsize=FONT, loc="left", pad=3)
    ax.set_xlabel(xlabel, fontsize=FONT)
    ax.set_ylabel(ylabel, fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1, width=0.6, length=3)
    ax.grid(True, color="#d9d9d9", linewidth=0.5)
    ax.set_axisbelow(True)
    for spine in ax.spines.values():
        spine.set_linewidth(0.6)
