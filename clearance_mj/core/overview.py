"""Overviews of objects in terminals and notebooks: a heading, facts, perhaps a table."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple

__all__ = ["HasOverview", "Overview", "few", "span"]

MAX_CHARACTERS = 100  # characters of a value
CELL = 'style="text-align:left;vertical-align:top"'


class Overview(NamedTuple):
    """A heading, facts by name, and a table with its head as first row."""

    title: str
    facts: dict[str, str]  # those that are empty are left out
    table: Sequence[Sequence[str]] = ()

    def text(self) -> str:
        """Return it as lines of text, free of characters that a terminal would obey."""
        facts = [(name, value) for name, value in self.facts.items() if value]
        width = max((len(name) for name, _ in facts), default=0)
        lines = [self.title, *(f"  {name:<{width}}  {_truncated(value)}" for name, value in facts)]
        table = [[_truncated(cell) for cell in row] for row in self.table]
        widths = [max(map(len, column)) for column in zip(*table)]
        lines += ["  " + "  ".join(f"{c:<{w}}" for c, w in zip(row, widths)).rstrip() for row in table]
        return "\n".join(map(_printable, lines))

    def html(self) -> str:
        """Return it as markup; all texts are escaped."""
        facts = "".join(
            f"<tr><th {CELL}>{escape(name)}</th><td {CELL}>{escape(_truncated(value))}</td></tr>"
            for name, value in self.facts.items()
            if value
        )
        head, *rows = self.table or [()]
        table = _row("th", head) + "".join(_row("td", row) for row in rows) if head else ""
        shown = [f"<table>{part}</table>" for part in (facts, table) if part]
        return f"<div><strong>{escape(self.title)}</strong>{''.join(shown)}</div>"


def _row(cell: str, values: Sequence[str]) -> str:
    return f"<tr>{''.join(f'<{cell} {CELL}>{escape(_truncated(value))}</{cell}>' for value in values)}</tr>"


class HasOverview(ABC):
    """Base of classes that print as their `Overview`; dataclasses need ``repr=False``."""

    @abstractmethod
    def _overview(self) -> Overview:
        """Return what it shows."""

    def __repr__(self) -> str:
        return self._overview().text()

    def _repr_html_(self) -> str:
        return self._overview().html()


def few(items: Sequence[object], most: int = 8) -> str:
    """Return the first of many things, separated by commas, and how many there are besides."""
    shown = ", ".join(map(str, items[:most]))
    return shown if len(items) <= most else f"{shown} and {len(items) - most} more"


def span(values: Iterable[float], unit: str = "", factor: float = 1.0) -> str:
    """Return the lowest and the highest of numbers with their unit, or the only one."""
    values = list(values)
    low, high = (f"{factor * float(value):.4g}" for value in (min(values), max(values)))
    return f"{low if low == high else f'{low} to {high}'} {unit}".rstrip()


def _truncated(value: str) -> str:
    return value if len(value) <= MAX_CHARACTERS else f"{value[: MAX_CHARACTERS - 3]}..."


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)
