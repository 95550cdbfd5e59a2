"""Look of figures: colours, line styles, sizes, axes. Each is a separate `matplotlib.figure.Figure`: no state.

Black is the test, grey the test repeated with another seed; a law keeps its colour and an engine its line style from
figure to figure. What notebooks draw too is in `drawing`.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.image
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator, ScalarFormatter

from ..core.drawing import COLOURS, FAINT, FONT, REPEAT, TEST, WIDTH, canvas, decibel, key, of_curves, phase, tidy
from ..core.files import replacing
from ..core.output_folder import FIGURES
from ..rig import Rig
from ..rig.sensing import sensor_points

__all__ = [
    "COLOURS", "ENGINE_LINES", "FAINT", "FONT", "MARKERS", "REPEAT", "TEST", "WIDE", "WIDTH", "Drawing", "at_bushings",
    "band_axes", "canvas", "colour_bar", "decibel", "finite", "frequency_axis", "frequency_ends", "key",
    "letters", "level_axis", "of_curves", "phase", "sensor_title", "sheet", "tidy", "write_numbers",
]  # fmt: skip

DPI = 150
ENGINE_LINES = ("-", (0, (4, 1.5)), (0, (1, 1.2)))
MARKERS = ("o", "s", "^", "D")
LEGEND_COLUMNS = 5
FREQUENCIES = (5, 10, 20, 50, 100, 200)  # Hz, labelled on the frequency axis
WIDE = 3.0  # ratio of frequencies from which the axis of periodic vibrations is logarithmic
_POINT = re.compile(rb"\b([ML]) (-?[0-9.]+) (-?[0-9.]+) \n")


@dataclass(frozen=True, eq=False)
class Drawing:
    """A figure with the words that go with it."""

    name: str
    """also the name of its file"""
    figure: Figure
    """what is drawn"""
    caption: str
    """what it shows, in words"""
    alt: str
    """text for those who cannot see it"""
    sharp: bool = True
    """to be shown as SVG: the figures of the lesser levels are many and stay PNG"""
    chart: bool = False
    """to be an interactive chart on pages, by `interactive.chart`: its lines have labels then"""

    def png(self) -> bytes:
        """Return the figure as PNG with 150 dots per inch, in 16 shades of each colour: half the size."""
        self.figure.set_dpi(DPI)
        canvas = FigureCanvasAgg(self.figure)
        canvas.draw()
        shades = np.round(np.asarray(canvas.buffer_rgba())[..., :3] / 17.0).astype(np.uint8) * np.uint8(17)
        buffer = io.BytesIO()
        matplotlib.image.imsave(buffer, shades, format="png", dpi=DPI)
        return buffer.getvalue()

    def svg(self) -> bytes:
        """Return the figure as SVG, to a hundredth of a point; the same figure gives the same bytes."""
        buffer = io.BytesIO()
        with matplotlib.rc_context({"svg.hashsalt": self.name}):
            self.figure.savefig(buffer, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
        return _POINT.sub(lambda m: b"%c%.2f %.2f" % (m[1], float(m[2]), float(m[3])), buffer.getvalue())

    def pdf(self) -> bytes:
        """Return the figure as PDF, without a date."""
        buffer = io.BytesIO()
        self.figure.savefig(buffer, format="pdf", metadata={"CreationDate": None})
        return buffer.getvalue()

    def write(self, folder: Path) -> Path:
        """Write the figure as PNG, and in what `FIGURES` says too; return the path of the PNG."""
        for kind in ("png", *FIGURES.get()):
            with replacing(folder / f"{self.name}.{kind}") as temporary:
                temporary.write_bytes(getattr(self, kind)())
        return folder / f"{self.name}.png"


def sheet(
    height: float, handles: Sequence[Artist] = (), left: float = 0.58, right: float = 0.12, bottom: float = 0.42,
    titled: float = 0.26,
) -> Figure:  # fmt: skip
    """Return a figure of the report's width with a legend above its panels; their height and the margins in inches."""
    legend_rows = -(-len(handles) // LEGEND_COLUMNS)
    top = titled + 0.17 * legend_rows
    whole = bottom + height + top
    figure = Figure(figsize=(WIDTH, whole), facecolor="white")
    figure.subplots_adjust(left=left / WIDTH, right=1 - right / WIDTH, bottom=bottom / whole, top=1 - top / whole)
    if handles:
        figure.legend(
            handles=list(handles), loc="upper center", ncols=-(-len(handles) // legend_rows), fontsize=FONT - 0.5,
            frameon=False, handlelength=2.4, columnspacing=1.6, labelspacing=0.3, borderaxespad=0.1,
        )  # fmt: skip
    return figure


def frequency_axis(ax: Axes, band: tuple[float, float], labelled: bool) -> None:
    """Make x a logarithmic frequency axis over a band (Hz), ``labelled`` on the lowest panel."""
    ax.set(xscale="log", xlim=band, xticks=[f for f in FREQUENCIES if band[0] <= f <= band[1]])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.tick_params(axis="x", labelbottom=labelled)
    if labelled:
        ax.set_xlabel("Frequency (Hz)", fontsize=FONT)


def frequency_ends(ax: Axes, frequency: np.ndarray, title: str, labelled: bool) -> None:
    """Let the axis of periodic vibrations run over frequencies: on a logarithmic scale if they are far apart."""
    ends = float(frequency[0]), float(frequency[-1])
    if ends[1] >= WIDE * ends[0]:
        frequency_axis(ax, ends, labelled)
    else:
        ax.set_xlim(*ends)
        ax.tick_params(labelbottom=labelled)
    ax.set_xlabel(title if labelled else "", fontsize=FONT)


def band_axes(ax: Axes, title: str, edges: np.ndarray, names: Sequence[str]) -> None:
    """Give axes of bands of frequency (Hz) by channel their words: the bands' ends and middle, and the channels."""
    tidy(ax, title, "", "Frequency (Hz)")
    ax.grid(False)
    ax.set_xscale("log")
    ends = (edges[0], float(np.sqrt(edges[0] * edges[-1])), edges[-1])
    ax.set_xticks(ends, [f"{hz:.2g}" if hz < 1 else f"{hz:.0f}" for hz in ends], fontsize=FONT - 2)
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_yticks(np.arange(len(names)) + 0.5, names, fontsize=FONT - 2)


def colour_bar(
    figure: Figure, image: ScalarMappable, axes: Iterable[Axes], label: str, font: float = FONT, **look: Any
) -> None:
    """Add a colour bar next to axes, its words of a size."""
    bar = figure.colorbar(image, ax=list(axes), **look)
    bar.set_label(label, fontsize=font)
    bar.ax.tick_params(labelsize=font - 1)


def write_numbers(ax: Axes, matrix: np.ndarray, words: Callable[[float], str], on_dark: Callable[[Any], bool]) -> None:
    """Write the numbers of a matrix on its picture, in white on dark colours."""
    for (i, j), value in np.ndenumerate(matrix):
        colour = "white" if on_dark(value) else "black"
        ax.text(j, i, words(value), ha="center", va="center", fontsize=FONT - 1, color=colour)
    ax.grid(False)


def level_axis(ax: Axes, levels: Sequence[float]) -> None:
    """Make x a logarithmic axis with a tick at each level."""
    ax.set_xscale("log")
    ax.set_xticks(levels, [f"{level:g}" for level in levels])
    if len(levels) == 1:
        ax.set_xlim(levels[0] / 2, 2 * levels[0])
    ax.xaxis.set_minor_locator(NullLocator())


def letters(n: int) -> list[str]:
    """Return (a), (b) and so on for n panels."""
    return [f"({chr(ord('a') + i)})" if i < 26 else f"({i + 1})" for i in range(n)]


def finite(values: np.ndarray) -> np.ndarray:
    """Return the finite values, or a zero if there is none."""
    known = values[np.isfinite(values)]
    return known if known.size else np.zeros(1)


def at_bushings(rig: Rig) -> list[int]:
    """Return the rows of the sensors that sit in a bushing."""
    return [row for row, point in enumerate(sensor_points(rig)) if any(b.holds(point) for b in rig.bushings)]


def sensor_title(rig: Rig, row: int) -> str:
    """Return a sensor in words: its number, and its bushing or position."""
    sensor = rig.sensors[row]
    inside = [i + 1 for i, b in enumerate(rig.bushings) if b.holds(sensor_points(rig)[row])]
    at = sensor.position if isinstance(sensor.position, str) else f"{sensor.position:g} m"
    along = f" along {sensor.label[-1].lower()}" if rig.moves_across else ""
    return f"sensor {sensor.node}{along}" + (f", bushing {inside[0]}" if inside else f", {at}")
