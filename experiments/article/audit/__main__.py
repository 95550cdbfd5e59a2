"""``python -m experiments.article.audit``: every derived number of the article, recomputed from its tables."""

import argparse
import dataclasses
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from clearance_mj.core.errors import RecordError
from clearance_mj.core.files import write_text

from .. import command
from . import audit, to_html, to_markdown

FORMATS = {
    ".md": to_markdown,
    ".html": to_html,
    ".csv": lambda claims: pd.DataFrame(map(dataclasses.asdict, claims)).to_csv(index=False),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser("experiments.article.audit", description=__doc__)
    parser.add_argument("--tables", type=Path, help="folder of other tables than the published ones")
    parser.add_argument("--out", type=Path, help=f"also write the audit to this file, {', '.join(FORMATS)}")
    return command.run(parser, _run, arguments)


def _run(options: argparse.Namespace) -> dict:
    if options.out and options.out.suffix not in FORMATS:
        raise RecordError(f"{options.out}: an audit is written as {', '.join(FORMATS)}")
    claims = audit(options.tables)
    if options.out:
        write_text(options.out, FORMATS[options.out.suffix](claims))
    if not options.json:
        for claim in (claim for claim in claims if not claim.holds):
            print(f"{claim.where}: {claim.text}\n    {claim.printed}; recomputed {claim.recomputed}: {claim.verdict}")
        print(f"{sum(claim.holds for claim in claims)} of {len(claims)} claims hold")
    return {"claims": [asdict(claim) | {"holds": claim.holds} for claim in claims]}


if __name__ == "__main__":
    sys.exit(main())
