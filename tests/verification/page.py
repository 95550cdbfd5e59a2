"""The verification page: the case of each subject that is closest to its limit; a CSV file has every case."""

import csv
import io
from typing import NamedTuple

import pytest

HEAD = """# Verification

Each case is a quantity that a test measures and compares with a closed form, a published case, a method that shares no
code with the model, the true parameters of simulated records (which the identification did not use), or a measured
record. The test fails when the value is outside the allowed range. The fraction used is the error divided by the
allowed error; of a value that must exceed a lower bound it is the bound divided by the value. The target of an error
is 0.

{{download}}`verification.csv <{file}>` (UTF-8) lists the {count} cases: subject, quantity, target, measured value,
allowed range, fraction used in per cent, and source of the target. `make verification` runs the tests and writes this
page and the file.

"""
SUMMARY = """## Verified subjects

Each row shows the case of the subject that uses the largest fraction of what is allowed.

| subject | cases | case | target | measured | allowed | used | source |
|---|---:|---|---:|---:|---:|---:|---|
"""
ABSENT = """
The records of a subject that was not run were absent when this page was written. Its rows in the file, if it has any,
are those of the last run that had the records, and are not counted here.
"""
FIELDS = "subject", "quantity", "target", "measured", "allowed", "used (%)", "source"
RELATIVE = {"rel": " relative", "abs": ""}


class Row(NamedTuple):
    what: str
    target: str
    measured: str
    allowed: str
    source: str
    used: float  #: Fraction of what is allowed


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


def page(groups: dict[str, list[Row]], file: str) -> str:
    """Return the page: one row for each group in the order of the tests.

    A group without rows could not be measured. ``file`` is the name of the CSV file with every case.
    """
    return "".join([
        HEAD.format(file=file, count=sum(map(len, groups.values()))),
        SUMMARY,
        *(_summary(title, group) for title, group in groups.items()),
        "" if all(groups.values()) else ABSENT,
    ])  # fmt: skip


def cases(groups: dict[str, list[Row]], before: str = "") -> str:
    """Return every case as CSV; of a group without rows those in the CSV ``before`` stay."""
    kept = list(csv.reader(io.StringIO(before)))[1:]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(FIELDS)
    for title, rows in groups.items():
        writer.writerows([[title, *_cells(row)] for row in rows] or [line for line in kept if line[0] == title])
    return out.getvalue()


def _summary(title, rows):
    if not rows:
        return _line((title, "not run", *6 * [""]))
    *cells, used, source = _cells(max(rows, key=lambda row: row.used))
    return _line((title, str(len(rows)), *cells, f"{used}%", source))


def _cells(row) -> tuple[str, ...]:
    texts = (row.what, row.target, row.measured, row.allowed, f"{100 * row.used:.1f}", row.source)
    return tuple(map(str.strip, texts))


def _line(cells) -> str:
    return f"| {' | '.join(cells)} |\n"
