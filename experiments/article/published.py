"""The article's Tables 1 to 5 as printed: CSV files in ``data/article``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import pandas as pd

from clearance_mj.core.errors import RecordError

FOLDER = Path(__file__).parents[2] / "data" / "article"
FILES = {
    1: "table1_natural_frequency.csv", 2: "table2_frf_errors.csv", 3: "table3_72kmh.csv", 4: "table4_120kmh.csv",
    5: "table5_120kmh_peaks.csv",
}  # fmt: skip
MODELS = ("initial", "updated")  # Constant parameters, and parameters identified over time
IMPROVEMENTS = {
    **{f"MAC, mode {i}": percent for i, percent in enumerate((42.92, 31.08, 38.97, 50.74), 1)},
    **{"MRE": -27.67, "RMSE": -63.41, "FRAC": 15.79, "CSAC": 6.65, "CSF": 12.37},
}  # Of the updated over the initial model in the article's text, %; its conclusion has 6.55 for CSAC


@dataclass(frozen=True, eq=False)
class Printed:
    """A table by row and column, numbers with the digits they are printed with."""

    path: Path  #: its file
    cells: pd.DataFrame  #: texts; the first column names the rows

    @classmethod
    def load(cls, number: int, folder: str | Path | None = None) -> Printed:
        """Read a table, 1 to 5, from a folder (default: `FOLDER`); RecordError names the file if there is none."""
        path = Path(folder or FOLDER) / FILES[number]
        if not path.is_file():
            raise RecordError(f"{path}: the article's table is not there")
        try:
            return cls(path, pd.read_csv(path, index_col=0, dtype=str, keep_default_na=False))
        except (OSError, ValueError) as error:
            raise RecordError(f"{path}: cannot be read as a table: {error}") from None

    @property
    def numbers(self) -> pd.DataFrame:
        """The whole table as numbers, in double precision; columns of words are left out."""
        return self.cells.apply(pd.to_numeric, errors="coerce").dropna(axis=1, how="all")

    def text(self, row: str, column: str) -> str:
        """Return a cell; RecordError names table and cell if there is none."""
        try:
            return self.cells.at[row, column]
        except KeyError:
            raise RecordError(f"{self.path}: has no {column} of {row}") from None

    def number(self, row: str, column: str) -> Decimal:
        """Return a number with the digits it is printed with; RecordError if no change of it can be taken."""
        text = self.text(row, column)
        try:
            value = Decimal(text)
        except InvalidOperation:
            raise RecordError(f"{self.path}: {column} of {row} is {text!r}, not a number") from None
        if not value.is_normal() or abs(value.adjusted()) > 6:
            raise RecordError(f"{self.path}: {column} of {row} is {text}; changes need sizes from 1e-6 to 1e6")
        return value

    def column(self, name: str, rows: Iterable[str]) -> list[Decimal]:
        """Return the numbers of a column in some rows."""
        return [self.number(row, name) for row in rows]

    def row(self, index: int) -> str:
        """Name of a row by its position, for rows whose name is itself in question; RecordError if there are fewer."""
        if index >= len(self.cells):
            raise RecordError(f"{self.path}: has {len(self.cells)} rows, {index + 1} are needed")
        return str(self.cells.index[index])


def improvements() -> dict[str, float]:
    """Change from the initial to the updated model in percent of the initial model's value, from Tables 1 and 2."""
    modes, means = Printed.load(1).numbers, Printed.load(2).numbers.loc["mean"]
    changes = {f"MAC, mode {i}": row["updated_mac"] / row["initial_mac"] for i, row in modes.iterrows()}
    changes["frequency error"] = modes["updated_re_pct"].sum() / modes["initial_re_pct"].sum()
    changes |= {
        m.upper(): means[f"updated_{m}"] / means[f"initial_{m}"] for m in ("mre", "rmse", "frac", "csac", "csf")
    }
    return {quantity: 100 * (ratio - 1) for quantity, ratio in changes.items()}
