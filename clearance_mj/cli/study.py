"""clearance-mj study: compare laws on engines with validation records."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..identify import METHODS as LAWS
from .command import command
from .options import add_plugin


def _options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("dataset", type=Path, help="dataset folder: rig.toml, dataset.toml, one .uff per record")
    words = "comma-separated (default: links,modal; modal alone where links cannot)"
    parser.add_argument("--engines", help=words)
    usual = "(default: those of nominal,constant,amplitude,bench that the records allow)"
    parser.add_argument("--methods", help=f"comma-separated, of {', '.join(LAWS)} {usual}")
    add_plugin(parser, "a method, an engine, a contact, a grease or a section of the report")
    words = "folder of identify: what it found in the same records is not found again (default: %(default)s)"
    parser.add_argument("--identified", type=Path, default=Path("results/identified"), help=words)
    parser.add_argument("--workers", type=int, help="threads (default: one for each processor)")


@command(
    "study", "compare laws on engines with a dataset's validation records", _options,
    out=Path("results/study"), out_help="folder of the report (default: %(default)s)",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..report import report_study

    engines, methods = (None if names is None else names.split(",") for names in (options.engines, options.methods))
    study = report_study(
        options.dataset, options.out, engines, methods, options.workers, not options.quiet, options.identified
    )
    taken_over = list(study.cache.taken_over) if study.cache else []
    if taken_over:
        print(f"taken over from {options.identified}: {', '.join(taken_over)}")
    print(f"report: {options.out / 'report.html'}")
    return {"out": str(options.out), "left_out": study.left_out, "taken_over": taken_over, "results": study.rows()}
