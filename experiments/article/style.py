"""The library's colours by name, and sheets and panels of the width of the documentation's pages."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearance_mj.report.style import COLOURS, FAINT, FONT, REPEAT, TEST

BLACK, GREY = TEST, REPEAT
BLUE, VERMILION, _, GREEN, PURPLE, ORANGE, SKY, *_ = COLOURS
WIDTH = 6.5  # in


def sheet(height: float) -> Figure:
    """Return an empty figure of the page's width and a height in inches."""
    return Figure(figsize=(WIDTH, height), layout="constrained", facecolor="white")


def panel(ax: Axes, title: str = "", xlabel: str = "", ylabel: str = "") -> None:
    """Give a panel its words, labels with quantity and unit, and grid."""
    ax.set_title(title, fontsize=FONT, loc="left", pad=3)
    ax.set_xlabel(xlabel, fontsize=FONT)
    ax.set_ylabel(ylabel, fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1, width=0.6, length=3)
    ax.grid(True, color=FAINT, linewidth=0.5)
    ax.set_axisbelow(True)
    for spine in ax.spines.values():
        spine.set_linewidth(0.6)
