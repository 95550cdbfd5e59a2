"""What an item is and gives, and how its figures look: the library's colours, sheets of the documentation's width."""

import functools
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearance_mj.report.style import COLOURS, FAINT, FONT, REPEAT, TEST, Drawing
from clearance_mj.report.tables import Column, Table

BLACK, GREY = TEST, REPEAT
BLUE, VERMILION, _, GREEN, PURPLE, ORANGE, SKY, *_ = COLOURS
WIDTH = 6.5  # in


@dataclass(frozen=True, eq=False)
class Result:
    """A figure or a table of the article, computed again."""

    method: str
    """what was done here"""
    shows: str
    """what came out, with its numbers"""
    drawings: Sequence[Drawing] = ()
    """each becomes NAME.png and NAME.svg, by its own name, which starts with the item's"""
    data: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    """each becomes a CSV file, by its name without ".csv"; no timings: two runs give the same bytes"""
    tables: Sequence[Table] = ()
    """to read: published values beside ours"""
    prior_information: Mapping[str, str] = field(default_factory=dict)
    """of each model, by its name"""
    details: Sequence[Table] = ()
    """further tables, of the index page alone"""


def to_table(name: str, caption: str, columns: Iterable[Column], rows: pd.DataFrame | Iterable[Sequence]) -> Table:
    """Return a table to read: the columns of a frame, or of rows, under headings in the same order."""
    if isinstance(rows, pd.DataFrame):
        rows = rows.astype(object).itertuples(index=False, name=None)
    return Table(name, caption, tuple(columns), tuple(tuple(None if v is pd.NA else v for v in row) for row in rows))


def rounded(frame: pd.DataFrame, digits: int) -> pd.DataFrame:
    """Return a frame of numbers with so many significant digits."""
    return frame.map(lambda value: float(f"{value:.{digits}g}"))


@dataclass(frozen=True, eq=False)
class Item:
    """A figure, a table or another experiment."""

    name: str
    """such as "figure_02", also of its files"""
    title: str
    """heading of its page"""
    function: str
    """"module:function"; a module that begins with a dot is of this package"""
    needs: Sequence[str] = ()
    """properties of `Inputs` that the function takes, in this order, after the item"""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    """its further arguments"""

    def run(self, inputs: Any, **parameters: Any) -> Result:
        """Compute it; parameters replace those of the table."""
        module, function = self.function.split(":")
        compute = getattr(import_module(module, __package__), function)
        return compute(self, *(getattr(inputs, need) for need in self.needs), **{**self.parameters, **parameters})

    @property
    def texts(self) -> dict[str, str]:
        """The article ("article"), the differences ("differs") and references to other items, from ``texts.toml``."""
        return _texts().get(self.name, {})


@functools.cache
def _texts() -> dict[str, dict[str, str]]:
    return tomllib.loads(Path(__file__).with_name("texts.toml").read_text(encoding="utf-8"))


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


def legend(figure: Figure, ax: Axes, columns: int, smaller: float = 1) -> None:
    """Put the legend of a panel above all panels."""
    figure.legend(
        *ax.get_legend_handles_labels(), loc="outside upper center", ncols=columns, fontsize=FONT - smaller,
        frameon=False,
    )  # fmt: skip
