"""Histories of gaps: a machine's clearances at times of its life, from a twin or a gauge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core.checks import naming
from ..core.errors import RecordError
from ..identify import Twin
from ..signals.arrays import ArrayData

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["GapHistory"]

COLUMNS = ("hours", "bushing", "gap_m", "std_m")
LEAST = 3  # points of a bushing
SHRINKS = 3.0  # standard errors of a straight line's slope below 0 beyond which a gap shrinks


@dataclass(frozen=True, eq=False, repr=False)
class GapHistory(ArrayData):
    """Gaps at times of a machine's life, with their standard deviations; nan where a bushing's is not known.

    Raises
    ------
    RecordError
        If times do not rise, a value is impossible, a bushing has one or two points, or its gap shrinks.
    """

    hours: np.ndarray
    """(n,) h in operation"""
    gap: np.ndarray
    """(n, n_bushings) m"""
    std: np.ndarray
    """(n, n_bushings) standard deviation of each, m"""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.hours.ndim != 1 or self.gap.ndim != 2 or not len(self.hours) == len(self.gap) == len(self.std):
            raise RecordError("a history is hours (n,) with gap and std (n, n_bushings)")
        if self.gap.shape != self.std.shape:
            raise RecordError(f"gap {self.gap.shape} and std {self.std.shape} of a history must have one shape")
        if not (np.isfinite(self.hours).all() and np.all(np.diff(self.hours) > 0)):
            raise RecordError("hours of a history must be finite and rise from point to point")
        for j in range(self.gap.shape[1]):
            self._require_possible(j)

    def _require_possible(self, j: int) -> None:
        hours, gap, std = self.of(j)
        if not hours.size:
            return
        if hours.size < LEAST:
            raise RecordError(f"the history of bushings[{j}] has {hours.size} points; give {LEAST} or more")
        if not np.all(gap > 0):
            raise RecordError(f"the history of bushings[{j}] has a gap of {np.min(gap):g} m; gaps are above 0")
        if not np.all(std > 0):
            raise RecordError(f"the history of bushings[{j}] has a standard deviation of 0 m; no gap is known exactly")
        weight = 1 / std**2
        middle = np.average(hours, weights=weight)
        spread = np.sum(weight * (hours - middle) ** 2)
        slope = np.sum(weight * (hours - middle) * gap) / spread
        if slope < -SHRINKS / np.sqrt(spread):
            raise RecordError(
                f"the history of bushings[{j}] shrinks by {-1e6 * slope:.3g} µm/h, beyond its errors, and "
                "what wears grows; was the machine repaired? begin the history there"
            )

    @property
    def known(self) -> tuple[int, ...]:
        """Numbers of the bushings that have a history."""
        return tuple(j for j in range(self.gap.shape[1]) if self.of(j)[0].size)

    def of(self, bushing: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return hours, gaps, m, and standard deviations, m, (m,) each, of a bushing where they are known.

        Parameters
        ----------
        bushing : int
            Its number.
        """
        is_known = np.isfinite(self.gap[:, bushing]) & np.isfinite(self.std[:, bushing])
        return self.hours[is_known], self.gap[is_known, bushing], self.std[is_known, bushing]

    def until(self, hours: float) -> GapHistory:
        """Return the part up to a time.

        Parameters
        ----------
        hours : float
            h.
        """
        is_before = self.hours <= hours
        return GapHistory(self.hours[is_before], self.gap[is_before], self.std[is_before])

    @classmethod
    def from_twins(cls, hours: Sequence[float], twins: Sequence[Twin]) -> GapHistory:
        """Return the history of the gaps that a twin estimates at the end of each of several records.

        Parameters
        ----------
        hours : sequence of float
            h in operation at which each record was taken.
        twins : sequence of Twin
            Results of `identify.twin` for each.

        Raises
        ------
        RecordError
            If the numbers of hours and twins differ, or the history is impossible.
        """
        if len(hours) != len(twins):
            raise RecordError(f"give one time for each of {len(twins)} twins, got {len(hours)}")
        gap = np.array([twin.value("gap")[-1] for twin in twins])
        return cls(np.array(hours, dtype=float), gap, gap * np.array([twin.std[0, -1] for twin in twins]))

    @classmethod
    def load(cls, path: str | Path, n_bushings: int) -> GapHistory:
        """Read a CSV file with a row for each time and bushing: hours, bushing, gap_m, std_m.

        Parameters
        ----------
        path : str or Path
            The file.
        n_bushings : int
            Number of bushings of the rig.

        Raises
        ------
        RecordError
            If the file or a column is missing, a value is no number, or the history is impossible.
        """
        import pandas as pd

        wrong = OSError, ValueError  # an empty or torn table is a ValueError
        with naming(f"{path}: cannot be read as CSV", wrong, RecordError, "{} ({})"):
            table = pd.read_csv(path)
        with naming(path):
            return cls._of_table(table, n_bushings)

    @classmethod
    def _of_table(cls, table: pd.DataFrame, n_bushings: int) -> GapHistory:
        import pandas as pd

        if missing := [name for name in COLUMNS if name not in table.columns]:
            raise RecordError(f"has no column {', '.join(missing)}; a history has {', '.join(COLUMNS)}")
        with naming("holds what is no number", (ValueError, TypeError), RecordError, "{} ({})"):
            rows = np.column_stack([pd.to_numeric(table[name]).to_numpy(float) for name in COLUMNS])
        bushings = rows[:, 1]
        if not np.all(np.isin(bushings, np.arange(n_bushings))):
            wrong = bushings[~np.isin(bushings, np.arange(n_bushings))][0]
            raise RecordError(f"has a bushing {wrong:g}; the rig's are 0 to {n_bushings - 1}")
        hours, row = np.unique(rows[:, 0], return_inverse=True)
        gap, std = np.full((2, hours.size, n_bushings), np.nan)
        gap[row, bushings.astype(int)], std[row, bushings.astype(int)] = rows[:, 2], rows[:, 3]
        return cls(hours, gap, std)
