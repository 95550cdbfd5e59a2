"""Where results wait until all are there: a table on disk, ``cases.npy``, with one row for each case.

It is made full of zeros before the first case runs. One process, which has locked the folder, writes; a row holds a
digest over the case's number and its results, and counts only if that is right. So none is stored twice, a row that a
kill or a power cut tore is computed again, a killed process loses at most the cases in flight, and finished cases are
never recomputed. When every row counts, ``results.nc`` is written from them, and only then the table is removed.
"""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import numpy as np

from ..core.errors import ClearanceError
from ..core.files import replacing

__all__ = ["Table"]

DIGEST = 8  # bytes
MESSAGE = 240  # bytes of the line that says why a case has no results


class Table:
    """Results on disk of n cases, with quantities of these shapes; made if the file is not there.

    A ClearanceError says if the file holds another table, or there is no room on the disk.
    """

    def __init__(self, path: Path, shapes: dict[str, tuple[int, ...]], n_cases: int):
        numbers = [(name, "<f8", shape) for name, shape in shapes.items()]
        self.path, self.row = path, np.dtype([("digest", f"V{DIGEST}"), ("error", f"S{MESSAGE}"), *numbers])
        if not path.exists():
            with replacing(path) as temporary:
                np.lib.format.open_memmap(temporary, "w+", self.row, (n_cases,)).flush()
        rows = self.rows()
        if rows.dtype != self.row or rows.shape != (n_cases,):
            raise ClearanceError(f"{path}: is not the table of this sweep; remove it to begin again")
        self._start = rows.offset

    def rows(self) -> np.memmap:
        """Return the table (n_cases,) as it is on disk: fields "error" and those of ``shapes``."""
        try:
            return np.lib.format.open_memmap(self.path, "r")
        except Exception as error:  # numpy raises whatever parsing a damaged header as Python leads to
            raise ClearanceError(f"{self.path}: is damaged ({error}); remove it to begin again") from None

    def finished(self) -> np.ndarray:
        """Return which cases (n_cases,) have results, or are known to have none."""
        return np.array([row["digest"].tobytes() == _digest(i, row) for i, row in enumerate(self.rows())], dtype=bool)

    def write(self, case: int, values: dict | str) -> None:
        """Store what came of a case: its results, or why it has none."""
        row = np.zeros((), self.row)
        if isinstance(values, str):
            row["error"] = values.encode()[:MESSAGE]
        for name in (self.row.names or ())[2:]:
            row[name] = math.nan if isinstance(values, str) else values[name]
        row["digest"] = np.void(_digest(case, row))
        try:
            with self.path.open("rb+") as file:
                file.seek(self._start + case * self.row.itemsize)
                file.write(row.tobytes())
        except OSError as error:
            raise ClearanceError(f"{self.path}: cannot be written ({error.strerror})") from None


def _digest(case: int, row: np.ndarray) -> bytes:
    return hashlib.blake2b(row.tobytes()[DIGEST:], digest_size=DIGEST, salt=case.to_bytes(16, "little")).digest()
