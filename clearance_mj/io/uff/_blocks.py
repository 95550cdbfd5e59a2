"""Data sets of text that describe the structure: one after another, by number."""

from __future__ import annotations

from dataclasses import dataclass

from ...errors import RecordError


@dataclass(frozen=True)
class Block:
    """A data set that is not 58: its records."""

    kind: int
    number: int
    """of the data set in the file, from 1"""
    lines: tuple[str, ...]
    """the records after the data set's type"""
    factors: tuple[float, float]
    """units of length and of force of the file in one SI unit"""

    def record(self, index: int) -> str:
        if index >= len(self.lines):
            raise RecordError(f"is cut short; needs {index + 1} records, has {len(self.lines)}")
        return self.lines[index]


def fields(line: str, width: int, count: int | None = None) -> list[str]:
    """Cut a record into fields of one width; without a count, as many as it fills."""
    line = line.rstrip()
    count = -(-len(line) // width) if count is None else count
    return [line[i * width : (i + 1) * width] for i in range(count)]
