"""Look of figures, in notebooks too: colours, sizes, axes. Each figure stands alone, without pyplot's state.

Colours are Okabe and Ito's palette, with the wine red of Tol's.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.lines import Line2D

__all__ = [
    "ALARM", "COLOURS", "FAINT", "FONT", "REPEAT", "TEST", "WIDTH", "bode", "canvas", "decibel", "envelope",
    "key", "of_curves", "phase", "tidy",
]  # fmt: skip

WIDTH = 7.5  # in
FONT = 8  # pt
TEST, REPEAT, FAINT = "#000000", "#8c8c8c", "#d9d9d9"
COLOURS = ("#0072b2", "#d55e00", "#882255", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#6b4f2a")
"""of laws, bushings and whatever else is distinguished"""
ALARM = COLOURS[1]
COLUMNS = 1000  # of a history that are drawn: the lowest and the highest sample of each
_COLOUR = re.compile(r"(stroke|fill): (#[0-9a-f]{6})")
_MIXED = 70  # % of a line's colour in a notebook; the rest is the text's, so that dark ones show on dark pages


class _NotebookFigure(Figure):
    """A figure that notebooks show by themselves, in the page's text colour and on its background, light or dark."""

    def _repr_html_(self) -> str:
        buffer = io.StringIO()
        with matplotlib.rc_context({"svg.fonttype": "path"}):
            self.savefig(buffer, format="svg", transparent=True)
        image = buffer.getvalue()
        # A style sheet inside the image would hold for the whole page. Hatches lie on fills, not on the page.
        image = re.sub(r"<(style|metadata).*?</\1>", "", image[image.index("<svg") :], flags=re.S)
        parts = re.split(r"(<pattern.*?</pattern>)", image, flags=re.S)
        image = "".join(part if part.startswith("<pattern") else _COLOUR.sub(_follow_page, part) for part in parts)
        look = "max-width:100%;height:auto;fill:currentColor;stroke-linejoin:round;stroke-linecap:butt"
        return f'<div>{image.replace("<svg", f"""<svg style="{look}" """, 1)}</div>'

    def _repr_png_(self) -> bytes:
        """For what shows no HTML; white behind."""
        buffer = io.BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


def _follow_page(match: re.Match[str]) -> str:
    """Return an image's colour as one visible on light and dark pages; fills other than black may be of a scale."""
    kind, colour = match.groups()
    if colour == TEST:
        return f"{kind}: currentColor"
    if kind == "fill" or colour == "#ffffff":
        return match[0]
    if colour == FAINT:
        return "stroke: currentColor; stroke-opacity: 0.15"
    return f"{match[0]}; stroke: color-mix(in srgb, {colour} {_MIXED}%, currentColor)"


def canvas(height: float, width: float = WIDTH) -> Figure:
    """Return an empty figure of a height and a width in inches, whose panels are laid out when it is drawn."""
    return _NotebookFigure(figsize=(width, height), layout="constrained", facecolor="white")


def tidy(ax: Axes, title: str = "", ylabel: str = "", xlabel: str = "") -> None:
    """Give axes the report's fonts, lines and grid, and their words; labels have quantity and unit."""
    ax.tick_params(labelsize=FONT - 1, width=0.6, length=3)
    ax.tick_params(which="minor", labelsize=FONT - 2)
    ax.grid(True, color=FAINT, linewidth=0.5)
    ax.set_axisbelow(True)
    for spine in ax.spines.values():
        spine.set_linewidth(0.6)
    ax.set_title(title, fontsize=FONT, loc="left", pad=3)
    ax.set_ylabel(ylabel, fontsize=FONT)
    ax.set_xlabel(xlabel, fontsize=FONT)


def key(figure: FigureBase, handles: Sequence[Artist], columns: int = 4) -> None:
    """Put a legend above the panels; of handles with one label the last is shown."""
    lines = [*{each.get_label(): each for each in handles}.values()]
    figure.legend(handles=lines, loc="outside upper center", ncols=columns, fontsize=FONT, frameon=False)


def bode(
    curves: Mapping[str, Sequence[tuple[str, np.ndarray, dict[str, Any]]]], rpm: np.ndarray, quantity: str
) -> tuple[Figure, np.ndarray]:
    """Draw complex curves over the spin (rev/min): amplitude and phase lag, a pair of panels for each title.

    A curve is its label, its values and its look; axes are (n_titles, 2), in a figure whose legend is still to come.
    """
    figure = canvas(0.6 + 2.6 * len(curves))
    axes = figure.subplots(2 * len(curves), 1, sharex=True, height_ratios=(1.7, 1) * len(curves)).reshape(-1, 2)
    for (above, below), (title, lines) in zip(axes, curves.items()):
        for label, value, look in lines:
            above.plot(rpm, np.abs(value), label=label, **look)
            below.plot(rpm, 180 + phase(-value.conj()), **look)
        tidy(above, title, quantity)
        tidy(below, "", "Phase lag (°)", "Spin (rev/min)" if below is axes[-1, 1] else "")
        below.set(ylim=(370, -10), yticks=[0, 90, 180, 270, 360], xlim=(rpm.min(), rpm.max()))
    figure.align_ylabels(axes.ravel())
    return figure, axes


def of_curves(looks: dict[str, dict[str, Any]]) -> list[Line2D]:
    """Return a legend's lines out of labels with their looks."""
    return [Line2D([], [], label=label, **look) for label, look in looks.items()]


def decibel(value: np.ndarray) -> np.ndarray:
    """Return magnitudes in dB."""
    with np.errstate(divide="ignore"):
        level: np.ndarray = 20 * np.log10(np.abs(value))
    return level


def phase(value: np.ndarray) -> np.ma.MaskedArray:
    """Return the phase in degrees, -180 to 180, masked where it wraps: lines have a gap there, charts the value."""
    degrees = np.degrees(np.angle(value))
    return np.ma.masked_array(degrees, np.abs(np.diff(degrees, prepend=degrees[:1])) > 180)


def envelope(time: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a history with as many samples as a figure can show: no peak is lost.

    Of each of 1000 equal stretches the lowest and the highest sample are left; short histories stay whole.
    """
    size = value.size // COLUMNS
    if size < 3:
        return time, value
    starts = np.arange(0, value.size, size)
    order = np.empty(2 * starts.size)
    order[::2], order[1::2] = np.minimum.reduceat(value, starts), np.maximum.reduceat(value, starts)
    return np.repeat(time[starts], 2), order
