"""Audit of the article: every derived number recomputed from its published tables, and its equations checked.

The claims are the article's words; the numbers they are held against come from the tables and from calculation, and
the verdicts from comparing the two by the rules of `VERDICTS`.
"""

from collections.abc import Iterator
from dataclasses import replace

from ..published import FILES, Printed
from . import beam, control_tables, identification, model_tables
from .judge import VERDICTS, Claim
from .pages import to_html, to_markdown

__all__ = ["VERDICTS", "Claim", "audit", "to_html", "to_markdown"]


def audit(folder=None) -> tuple[Claim, ...]:
    """Recompute the article's derived numbers and check its equations, in the order of its tables.

    The folder holds other tables than the published ones; RecordError names file and cell if a number is missing.
    """
    tables = {number: Printed.load(number, folder) for number in FILES}
    claims = [
        *model_tables.table1(tables[1]), *model_tables.table2(tables[2]), *control_tables.table3(tables[3]),
        *control_tables.table4(tables[4]), *control_tables.table5(tables[5]), *beam.claims(), *identification.claims(),
    ]  # fmt: skip
    return tuple(_with_contradictions(claims))


def _with_contradictions(claims) -> Iterator[Claim]:
    """Claims of one text that are printed with other digits in another place say so."""
    for claim in claims:
        same = [other.printed for other in claims if (other.part, other.text) == (claim.part, claim.text)]
        others = sorted({printed for printed in same if not _agree(printed, claim.printed)})
        yield replace(claim, verdict="; ".join([claim.verdict, *(f"elsewhere {printed}" for printed in others)]))


def _agree(a, b) -> bool:
    """Return True if two printed numbers agree to the digits that both have."""
    a, b = a.removesuffix(" %"), b.removesuffix(" %")
    return a.startswith(b) or b.startswith(a)
