"""The audit as Markdown and as HTML."""

import itertools
from collections.abc import Iterator, Sequence

from clearance_mj.report import html
from clearance_mj.report.tables import Column, Table

from .judge import VERDICTS, Claim

_INTRODUCTION = (
    "Every derived number of the article is recomputed from its published tables, and its equations are checked by "
    "calculation. The article is *Prediction of Clearance Vibration for Intelligent Vehicles Motion Control* "
    "(Sustainability 14, 6698)."
)
_ALL = (
    "The tables list the others; `python -m experiments.article.audit --out audit.html` writes all of them, also as "
    "`.csv`."
)
_COLUMNS = ("where", "text", "printed", "recomputed", "verdict")
_HEADINGS = ("Where", "Claim", "Printed", "Recomputed", "Verdict")


def to_markdown(claims: Sequence[Claim]) -> str:
    """Return the audit as a page of Markdown, with the claims that do not hold."""
    lines = ["# Audit of the article", "", _INTRODUCTION, "", f"{_summary(claims)} {_ALL}", ""]
    for part, members in _parts(claims):
        doubted = [claim for claim in members if not claim.holds]
        lines += [f"## {part}", "", _summary(members), ""]
        if doubted:
            lines += [_row(_HEADINGS), _row(["---"] * len(_HEADINGS))]
            lines += [_row(getattr(claim, name) for name in _COLUMNS) for claim in doubted] + [""]
    lines += ["## Verdicts", "", "The first that applies:", ""]
    return "\n".join([*lines, *(f"- {verdict}: {meaning}." for verdict, meaning in VERDICTS.items())]) + "\n"


def to_html(claims: Sequence[Claim]) -> str:
    """Return the audit as one HTML file that needs nothing else."""
    columns = tuple(Column(heading) for heading in _HEADINGS)
    sections = [
        html.PageSection(f"part-{i}", part, html.table(
            Table(f"part-{i}", "", columns, tuple(tuple(getattr(c, n) for n in _COLUMNS) for c in members))))
        for i, (part, members) in enumerate(_parts(claims), 1)
    ]  # fmt: skip
    rules = "".join(f"<li>{html.formula(f'{verdict}: {meaning}')}</li>\n" for verdict, meaning in VERDICTS.items())
    sections.append(html.PageSection("rules", "Verdicts", f"<ul>\n{rules}</ul>\n"))
    introduction = html.paragraph(_INTRODUCTION.replace("*", "")) + html.paragraph(_summary(claims), "verdict")
    return html.page("Audit of the article", sections, introduction)


def _parts(claims) -> Iterator[tuple[str, list[Claim]]]:
    for part, members in itertools.groupby(claims, key=lambda claim: claim.part):
        yield part, list(members)


def _summary(claims) -> str:
    return f"{sum(claim.holds for claim in claims)} of {len(claims)} claims hold."


def _row(cells) -> str:
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"
