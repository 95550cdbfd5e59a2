"""Writer of the figures and numbers of a report's sections."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import pandas as pd
from tqdm import tqdm

from ..core.files import write_text
from . import html
from .style import Drawing
from .tables import write_csv

__all__ = ["ReportWriter"]

SVG_LIMIT = 600_000  # bytes; the whole page is to stay below 8 MB


class ReportWriter:
    """Writes figures and tables into a folder, and numbers the figures in the order of the page.

    Parameters
    ----------
    folder : Path
        Gets ``figures/`` and ``tables/``.
    progress : bool
        Show a progress bar.
    """

    def __init__(self, folder: Path, progress: bool = False):
        self.folder, self.figures = folder, 0
        self._bar = tqdm(desc="drawing", unit="figure", disable=not progress)

    def figure(self, drawing: Drawing | None) -> str:
        """Write a figure as PNG and return it for the page: sharp as SVG, unless that is large or not wanted.

        Parameters
        ----------
        drawing : Drawing or None
            None gives nothing.
        """
        if drawing is None:
            return ""
        self.figures += 1
        self._bar.update()
        png = drawing.write(self.folder / "figures").read_bytes()
        svg = drawing.svg() if drawing.sharp else b""
        return html.figure(drawing, self.figures, svg if 0 < len(svg) <= SVG_LIMIT else png)

    def csv(self, name: str, rows: pd.DataFrame | Iterable[dict]) -> None:
        """Write rows as ``tables/NAME.csv``.

        Parameters
        ----------
        name : str
            Name of the file.
        rows : DataFrame, or iterable of dict
            As `write_csv` takes them.
        """
        write_csv(self.folder / "tables" / f"{name}.csv", rows)

    def page(self, title: str, sections: Sequence[html.PageSection], top: str = "", name: str = "index.html") -> None:
        """Write the page, and end the progress bar.

        Parameters
        ----------
        title, sections, top
            As `html.page` takes them.
        name : str
            Name of the file.
        """
        self._bar.close()
        write_text(self.folder / name, html.page(title, sections, top))
