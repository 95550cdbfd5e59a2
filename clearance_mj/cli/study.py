"""clearance-mj study: compare laws on engines with validation records."""

from __future__ import annotations

from pathlib import Path

from ..identify import METHODS
from ..report import report_study
from .command import Options, Result, command, option
from .options import WORKERS, plugin

USUAL = "(default: those of nominal,constant,amplitude,bench that the records allow)"


@command(
    "study",
    option("dataset", "dataset folder: rig.toml, dataset.toml, one .uff per record", Path),
    option("--engines", "comma-separated (default: links,modal; modal alone where links cannot)"),
    option("--methods", f"comma-separated, of {', '.join(METHODS)} {USUAL}"),
    plugin("a method, an engine, a contact, a grease or a section of the report"),
    option("--identified", "folder of identify: what it found in the same records is not found again", Path,
           Path("results/identified")),
    WORKERS,
    out="results/study", out_help="folder of the report",
)  # fmt: skip
def run(options: Options) -> Result:
    """Compare laws on engines with a dataset's validation records."""
    engines, methods = (None if names is None else names.split(",") for names in (options.engines, options.methods))
    study = report_study(
        options.dataset, options.out, engines, methods, options.workers, not options.quiet, options.identified
    )
    taken_over = list(study.cache.taken_over) if study.cache else []
    words = [f"taken over from {options.identified}: {', '.join(taken_over)}"] if taken_over else []
    data = {"left_out": study.left_out, "taken_over": taken_over, "results": study.rows()}
    return Result(data, [*words, f"report: {options.out / 'report.html'}"])
