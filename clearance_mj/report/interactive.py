"""Interactive charts out of figures: the lines of a matplotlib figure as data that the page's script draws with uPlot.

A figure is described once: what `chart` finds in it (panels, lines with label, colour and dashes, axes with words and
limits) is what its picture shows. Panels one below the other, up to the next with a title, are a cell: an FRF's
magnitude, phase and coherence. Axes that are not visible are panels of the chart alone. A line that its transform
shifts upwards is drawn so, and read as its data are. Only lines are taken, no images and no filled areas.
"""

from __future__ import annotations

import base64
import itertools
import json
import re
import zlib
from collections.abc import Iterable
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

__all__ = ["MAX_POINTS", "chart", "decimated", "embedded", "thinned"]

MAX_POINTS = 4000  # of a line; more cannot be seen
PIXELS = 118  # of a chart for an inch of its figure
_DECIBEL = re.compile(r"\bdB re (.+)\)")
_LETTER = re.compile(r"\(\w+\)")
_SHIFTED = re.compile(r", [^(,]* up per \w+")


def embedded(figure: Figure) -> str:
    """Return a figure's chart as JSON for a script element, where words that look like markup end nothing."""
    return Markup(json.dumps(chart(figure), separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c"))


def chart(figure: Figure) -> dict[str, Any]:
    """Return a figure's lines as plain data.

    Parameters
    ----------
    figure : Figure
        Its lines have labels; those over a logarithmic or linear x that never steps back are drawn as they are, points
        without a line in any order.

    Returns
    -------
    dict
        "arrays": evenly spaced as ``from``, ``step`` and ``n``, else ``n`` of the "numbers" from ``at`` on; "numbers":
        as `packed` gives them; "series": label, colour, width, dashes; "cells": title, column and panels, whose lines
        point into arrays and series.

    Raises
    ------
    ValueError
        If the x of a line steps back.
    """
    data = _Data()
    cells: list[dict[str, Any]] = []
    for column, axes in enumerate(_columns(figure)):
        cells_of_column: list[dict[str, Any]] = []
        for ax in axes:
            title = ax.get_title(loc="left")
            if not cells_of_column or (title and not _LETTER.fullmatch(title)):
                words = "" if _LETTER.fullmatch(title) else title
                cells_of_column.append({"title": words, "column": column, "top": _position(ax)[1], "panels": []})
            cells_of_column[-1]["panels"].append(_panel(ax, figure, data))
        cells += cells_of_column
    cells.sort(key=lambda cell: (-round(cell["top"], 2), cell["column"]))
    return {"arrays": data.arrays, "numbers": packed(data.numbers), "series": data.series, "cells": cells}


def packed(numbers: np.ndarray) -> str:
    """Return numbers as float32, the first bytes of all and so on, compressed (zlib), in base64.

    Of neighbours on a curve the sign and the exponent are mostly the same: so ordered they take two thirds of the room.
    """
    planes = numbers.astype("<f4").view(np.uint8).reshape(-1, 4).T
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode("ascii")


class _Data:
    """Arrays and series of a chart, each stored once."""

    def __init__(self) -> None:
        self.arrays: list[dict[str, Any]] = []
        self.series: list[dict[str, Any]] = []
        self.numbers = np.zeros(0, dtype=np.float32)
        self._known: dict[bytes, int] = {}

    def array(self, values: np.ndarray) -> int:
        step = (values[-1] - values[0]) / (values.size - 1) if values.size > 1 else 0.0
        even = values[0] + step * np.arange(values.size)
        if step > 0 and np.allclose(values, even, rtol=0, atol=1e-6 * step):
            entry = {"from": float(values[0]), "step": float(step), "n": values.size}
            return self._store(self.arrays, entry, json.dumps(entry).encode())
        single = values.astype(np.float32)
        number = self._store(self.arrays, {"at": self.numbers.size, "n": values.size}, single.tobytes())
        if self.arrays[number]["at"] == self.numbers.size:
            self.numbers = np.concatenate([self.numbers, single])
        return number

    def line(self, line: Line2D) -> int:
        # matplotlib has no public way to the dashes of a line.
        dashes = getattr(line, "_dash_pattern", (0, None))[1]
        joined = line.get_linestyle() not in ("None", "none", "", " ")
        entry = {
            "label": str(line.get_label()), "colour": to_hex(line.get_color()), "width": line.get_linewidth(),
            "dash": [round(float(length), 2) for length in dashes] if joined and dashes else [], "joined": joined,
            "points": line.get_marker() not in ("None", "none", "", " ", None),
        }  # fmt: skip
        return self._store(self.series, entry, json.dumps(entry).encode())

    def _store(self, entries: list[dict[str, Any]], entry: dict[str, Any], key: bytes) -> int:
        if key not in self._known:
            self._known[key] = len(entries)
            entries.append(entry)
        return self._known[key]


def _columns(figure: Figure) -> list[list[Axes]]:
    """Return the axes with lines, from left to right and each column from its top."""
    shown = [ax for ax in figure.axes if any(_is_curve(ax, line) for line in ax.lines)]
    shown.sort(key=lambda ax: round(_position(ax)[0], 2))
    groups = itertools.groupby(shown, key=lambda ax: round(_position(ax)[0], 2))
    return [sorted(group, key=lambda ax: -round(_position(ax)[1], 3)) for _, group in groups]


def _position(ax: Axes) -> tuple[float, float]:
    """Return left and top, as fractions of the whole figure."""
    whole = ax.get_figure(root=True).bbox  # type: ignore[union-attr]
    return ax.bbox.x0 / whole.width, ax.bbox.y1 / whole.height


def _is_curve(ax: Axes, line: Line2D) -> bool:
    """Return True if both coordinates are data, shifted or not; those of marks across the axes are not."""
    return all(line.get_transform().contains_branch_seperately(ax.transData)) and np.size(line.get_xdata()) > 0


def _panel(ax: Axes, figure: Figure, data: _Data) -> dict[str, Any]:
    words = _first_text(other.get_ylabel() for other in _row_axes(ax, figure))
    decibel = _DECIBEL.search(words.replace("\n", " "))
    (left, right), (bottom, top) = sorted(ax.get_xlim()), sorted(ax.get_ylim())
    return {
        "height": max(70, round(PIXELS * ax.bbox.height / figure.dpi)),
        "x": _first_text(other.get_xlabel() for other in _column_axes(ax, figure)).replace("\n", " "),
        "y": words.replace("\n", " "),
        "read": _SHIFTED.sub("", words.replace("\n", " ")),
        "log": [ax.get_xscale() == "log", ax.get_yscale() == "log"],
        "limits": [[float(left), float(right)], [float(bottom), float(top)]],
        "decibel": decibel[1] if decibel and not _SHIFTED.search(words) else "",
        "lines": [_line(ax, line, data) for line in ax.lines if _is_curve(ax, line)],
        "marks": [_mark(line) for line in ax.lines if not _is_curve(ax, line)],
    }


def _line(ax: Axes, line: Line2D, data: _Data) -> dict[str, Any]:
    series = data.line(line)
    x, y = (np.asarray(values, dtype=float) for values in line.get_data())
    if not data.series[series]["joined"]:
        inside = (x >= min(ax.get_xlim())) & (x <= max(ax.get_xlim()))
        x, y = thinned(x[inside], y[inside])
    elif np.any(np.diff(x) < 0):
        raise ValueError(f"the x of line “{line.get_label()}” steps back: no cursor could read it")
    else:
        x, y = decimated(x, y)
    up = float((line.get_transform() - ax.transData).transform((0, 0))[1]) if ax.get_yscale() == "linear" else 0.0
    return {"series": series, "x": data.array(x), "y": data.array(y), "up": round(up, 9)}


def decimated(x: np.ndarray, y: np.ndarray, most: int = MAX_POINTS) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest value of each of ``most / 2`` pieces, in their order, at their x.

    Parameters
    ----------
    x, y : ndarray (n,)
        A line; returned as it is if it has no more than ``most`` points.
    most : int
        Points to return at most.
    """
    if x.size <= most:
        return x, y
    kept = set()
    for piece in np.array_split(np.arange(x.size), most // 2):
        values = y[piece]
        if np.isnan(values).any():
            kept.add(int(piece[np.isnan(values).argmax()]))
        if np.isfinite(values).any():
            kept |= {int(piece[np.nanargmin(values)]), int(piece[np.nanargmax(values)])}
    order = sorted(kept)
    return x[order], y[order]


def thinned(x: np.ndarray, y: np.ndarray, most: int = MAX_POINTS) -> tuple[np.ndarray, np.ndarray]:
    """Return points in the order of their x, of many the outer ones and some between them in each piece of the axis.

    Parameters
    ----------
    x, y : ndarray (n,)
        Points in any order.
    most : int
        Points to return at most: four in each of equal pieces of the axis, the least and the largest y among them.
    """
    order = np.lexsort((y, x))
    x, y = x[order], y[order]
    if x.size <= most:
        return x, y
    edges = np.searchsorted(x, np.linspace(x[0], x[-1], most // 4 + 1)[1:-1])
    kept: set[int] = set()
    for piece in filter(len, np.split(np.arange(x.size), edges)):
        by_size = piece[np.argsort(y[piece])]
        kept |= set(by_size[np.linspace(0, piece.size - 1, min(piece.size, 4)).astype(int)].tolist())
    chosen = sorted(kept)
    return x[chosen], y[chosen]


def _mark(line: Line2D) -> dict[str, Any]:
    """Return a line across the axes, at one x or one y."""
    x, y = (np.asarray(values, dtype=float) for values in line.get_data())
    across = x[0] == x[-1]
    return {"x" if across else "y": float(x[0] if across else y[0]), "colour": to_hex(line.get_color())}


def _row_axes(ax: Axes, figure: Figure) -> list[Axes]:
    """Return the axes and those of equal height to its left: panels of a row have the first one's words."""
    top, left = round(_position(ax)[1], 2), _position(ax)[0]
    row = [o for o in figure.axes if round(_position(o)[1], 2) == top and o.bbox.height == ax.bbox.height]
    return [ax, *sorted((o for o in row if _position(o)[0] < left), key=lambda o: _position(o)[0])]


def _column_axes(ax: Axes, figure: Figure) -> list[Axes]:
    """Return the axes and those below in its column: the lowest has the words."""
    left, top = round(_position(ax)[0], 2), _position(ax)[1]
    return [ax, *(o for o in figure.axes if round(_position(o)[0], 2) == left and _position(o)[1] < top)]


def _first_text(words: Iterable[str]) -> str:
    return next(filter(None, words), "")
