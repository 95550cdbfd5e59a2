"""The verification page: what the tests measured, beside its target and the source of that."""

import re
from typing import NamedTuple

import pytest

HEAD = """# Verification

Each figure was measured by a test: against a closed form, a published case, a method that shares no code with the model
or the truth behind a simulated record that an identification did not know, or on measured records. It fails when the
figure is outside what is allowed; "used" is the share of that which it takes. An error's target is 0.
`make verification` runs the tests and writes this page.

"""
COLUMNS = "| what | target | measured | allowed | used | source |\n|---|---:|---:|---:|---:|---|\n"
SUMMARY = "| subject | cases | most used | by |\n|---|---:|---:|---|\n"
ABSENT = "The records were not there when this page was written.\n"
KEPT = "The records were not there when this page was written: these rows are of the last run that had them.\n\n"
RELATIVE = {"rel": " relative", "abs": ""}


class Row(NamedTuple):
    what: str
    target: str
    measured: str
    allowed: str
    source: str
    used: float  #: Share of what is allowed


class Measured:
    """Asserts that a figure is what it should be, and keeps it for the page."""

    def __init__(self, rows: list[Row]):
        self.rows = rows

    def equal(self, what, value, target, source, **tolerance):
        """Assert that a value is the target within ``rel`` or ``abs``."""
        ((kind, limit),) = tolerance.items()
        used = abs(value - target) / (limit * abs(target) if kind == "rel" else limit)
        allowed = f"± {limit:g}{RELATIVE[kind]}"
        self.rows.append(Row(what, f"{target:.10g}", f"{value:.10g}", allowed, source, used))
        assert value == pytest.approx(target, **tolerance)

    def below(self, what, value, limit, source, unit=""):
        """Assert that an error, which should be zero, is below a limit."""
        self.rows.append(Row(what, "0", f"{value:.3g} {unit}", f"< {limit:.3g} {unit}", source, value / limit))
        assert value < limit

    def above(self, what, value, limit, source):
        """Assert that a value, such as an order of convergence, is above a limit."""
        self.rows.append(Row(what, "", f"{value:.3g}", f"> {limit:g}", source, limit / value))
        assert value > limit


def page(groups: dict[str, list[Row]], before: str = "") -> str:
    """Summary, then one table for each group in the order of the tests.

    A group without rows could not be measured: its rows on the page as it was ``before`` stay, and are not counted.
    """
    measured = {title: rows for title, rows in groups.items() if rows}
    total = sum(map(len, measured.values()))
    summary = "".join(_summary(title, rows) for title, rows in measured.items())
    absent = "".join(f"| {title} | not run | | |\n" for title in groups if title not in measured)
    tables = (_section(title, rows, before) for title, rows in groups.items())
    return f"{HEAD}{total} cases.\n\n{SUMMARY}{summary}{absent}\n" + "\n".join(tables)


def _summary(title, rows):
    worst = max(rows, key=lambda row: row.used)
    return f"| {title} | {len(rows)} | {worst.used:.0%} | {worst.what} |\n"


def _section(title, rows, before):
    if rows:
        return f"## {title}\n\n{COLUMNS}{''.join(map(_line, rows))}"
    last = re.search(rf"^## {re.escape(title)}\n[^|]*((?:\|.*\n)+)", before, re.MULTILINE)
    return f"## {title}\n\n{KEPT + last[1] if last else ABSENT}"


def _line(row) -> str:
    cells = (row.what, row.target, row.measured, row.allowed, f"{row.used:.1%}", row.source)
    return f"| {' | '.join(map(str.strip, cells))} |\n"
