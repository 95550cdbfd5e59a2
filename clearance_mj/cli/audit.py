"""clearance-mj audit: recompute the article's derived numbers."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from ..errors import RecordError
from ..files import replacing
from .command import add_command

__all__ = ["add"]

FORMATS = (".md", ".html", ".csv")


def add(commands):
    """Add the command.

    Parameters
    ----------
    commands : argparse subparsers
        Where to add it.
    """
    parser = add_command(
        commands, "audit", _run, "recompute every derived number of the article from its published tables",
        default=None, help=f"also write the audit to this file, {', '.join(FORMATS)}",
    )  # fmt: skip
    parser.add_argument("--tables", type=Path, help="folder of other tables than the published ones")


def _run(options):
    from experiments.article.audit import audit

    if options.out and options.out.suffix not in FORMATS:
        raise RecordError(f"{options.out}: an audit is written as {', '.join(FORMATS)}")
    claims = audit(options.tables)
    if options.out:
        _write(options.out, claims)
    if not options.json:
        _print(claims)
    return {"claims": [dataclasses.asdict(claim) | {"holds": claim.holds} for claim in claims]}


def _write(path, claims):
    from experiments.article.audit import to_html, to_markdown

    from ..report.tables import write_csv

    if path.suffix == ".csv":
        write_csv(path, map(dataclasses.asdict, claims))
        return
    text = to_markdown(claims) if path.suffix == ".md" else to_html(claims)
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _print(claims):
    for claim in claims:
        if not claim.holds:
            print(f"{claim.where}: {claim.text}\n    {claim.printed}; recomputed {claim.recomputed}: {claim.verdict}")
    print(f"{sum(claim.holds for claim in claims)} of {len(claims)} claims hold")
