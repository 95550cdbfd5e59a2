"""The verification page: what the tests measured, beside its target and the source of that."""

from typing import NamedTuple

HEAD = """# Verification

Each of these figures was measured by a test in `tests/verification`, against a closed form, a published case, or a
method that shares no code with the model; the test fails when it is outside what is allowed. `make verification` runs
the tests and writes this page. An error's target is 0.

"""
COLUMNS = "| what | target | measured | allowed | source |\n|---|---:|---:|---:|---|\n"


class Row(NamedTuple):
    what: str
    target: str
    measured: str
    allowed: str
    source: str


def page(groups: dict[str, list[Row]]) -> str:
    """One table for each group, in the order of the tests."""
    tables = (f"## {title}\n\n{COLUMNS}{''.join(map(_line, rows))}" for title, rows in groups.items())
    return HEAD + "\n".join(tables)


def _line(row) -> str:
    return f"| {' | '.join(map(str.strip, row))} |\n"
