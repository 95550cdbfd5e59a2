"""clearance-mj identify: identify a model, rig and law, from records."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Iterator
from pathlib import Path

from ..core.errors import ClearanceError
from ..core.output_folder import output_folder
from ..identify import METHODS, identify
from ..identify.registry import Identified
from ..io.dataset import Dataset
from ..io.formats import FORMATS, read_record
from ..report.identification import write_identification
from ..rig import Rig
from ..study.laws import stored_law
from .command import Options, Result, command, flag, inform, inputs, option, provenance, spelled
from .options import RECORDS, parameter_words, plugin, reading

DEFAULT, RIG_EXACT = "bench", "output-error"  # methods for a rig file that is not exact, and for one that is


@command(
    "identify",
    option("records", "dataset folder, or a file with one record: .uff, .csv, .mat, .nc or .h5", Path),
    option("--method", f"one of {', '.join(METHODS)} (default: {DEFAULT}; all others take the rig file for exact)"),
    flag("--rig-exact", f"take the rig file for exact: as --method {RIG_EXACT}"),
    plugin("a method"),
    option("--rig", "rig file (TOML) of a single record; a dataset folder has its own", Path),
    *RECORDS, flag("--no-figures", "draw none, and write no page"),
    out="results/identified", out_help="folder for rig.toml, law.json, identified.json and index.html",
)  # fmt: skip
def run(options: Options) -> Result:
    """Identify a model, rig and law, from records, and show what it does and how well it is known."""
    if options.rig_exact and options.method not in (None, RIG_EXACT):
        raise ClearanceError(f"--rig-exact is --method {RIG_EXACT}, and not --method {options.method}; give one")
    if options.out.suffix:
        raise ClearanceError(f"--out {options.out}: a folder is written, with rig.toml and law.json; give a folder")
    if options.out.resolve() in (options.records.resolve(), options.rig and options.rig.resolve().parent):
        raise ClearanceError(f"--out {options.out}: rig.toml would replace the records' own; give another folder")
    dataset, out = _load_dataset(options), options.out
    with output_folder(out, "identify", inputs(options)) as folder:
        folder.refuse_others("rig.toml", "law.json", "posterior.json", "identified.json", "index.html")
        name = options.method or (RIG_EXACT if options.rig_exact else DEFAULT)
        identified = _identify(options, dataset, name)
        failure = _write(identified, dataset, folder.new, options)
        if not failure:  # a study does not find it again
            stored_law(folder.cache, name, dataset, lambda: identified)
            folder.cache.drop_unused()
    words = [*_report(identified, out)]
    if failure:
        print("\n".join(words))
        raise ClearanceError(f"{out}: what was found is kept, and drawing it failed: {failure}") from failure
    if not options.no_figures:
        words += [f"report: {out / 'index.html'}"]
    if len(identified.unseen_gaps) < len(identified.rig.bushings):
        words += [f"next: {spelled('simulate', out, '--rms', 2, '--gap', 'x0.5')}: what half of the gap would do"]
    if dataset.path and dataset.path.is_dir() and any(record.role == "validate" for record in dataset.records):
        words += [f"next: {spelled('study', dataset.path)}: how well records that were kept back are predicted"]
    return Result({"law": identified.law.to_dict()} | identified.to_dict(), words)


def _write(identified: Identified, dataset: Dataset, new: Path, options: Options) -> Exception | None:
    """Write the model, then draw it; return the error that made drawing fail, whose files are removed."""
    try:
        identified.save(new, dataset, provenance(options))
        if not options.no_figures:
            write_identification(identified, dataset, new, options.out, workers=None, progress=not options.quiet)
    except Exception as failure:
        if not (new / "law.json").exists():
            raise
        (new / "index.html").unlink(missing_ok=True)
        for name in ("figures", "tables"):
            shutil.rmtree(new / name, ignore_errors=True)
        return failure
    return None


def _identify(options: Options, dataset: Dataset, name: str) -> Identified:
    """Return the method's result; its warnings are printed, even if it fails after them."""
    said: list[str] = []
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_, **__: said.append(str(message))
        try:
            identified = identify(dataset, name, not options.quiet)
            said += identified.warnings
        finally:
            for words in dict.fromkeys(said):
                inform(words, "warning")
    return identified


def _report(identified: Identified, out: Path) -> Iterator[str]:
    if identified.estimates:
        yield from parameter_words(identified.estimates, 48, f"{'found':>11s}   std  (over that of before)")
    if families := identified.pages.get("families", ()):
        yield f"{'family':71s} weight  misfit  held out"
    for family in families:
        numbers = f"{family.weight:6.3f} {family.misfit:7.3f} {family.held_out:9.3f}"
        yield f"bushing {family.bushing + 1}: {family.name:60s} {numbers}"
    yield str(identified.model)
    yield f"rig and law: {out / 'rig.toml'}, {out / 'law.json'}"


def _load_dataset(options: Options) -> Dataset:
    """Return the dataset, or one of a single record."""
    path = options.records
    if path.is_dir() or not (path.is_file() or path.suffix.lower() in FORMATS):
        if options.rig or options.column or options.fs or options.map or options.resample:
            raise ClearanceError(
                f"{path}: --rig, --column, --map, --fs and --resample are for the file of one record (.uff or .csv)"
            )
        return Dataset.load(path)
    if not options.rig:
        raise ClearanceError(f"{path}: is a single record, which needs its rig too: --rig rig.toml")
    rig = Rig.load(options.rig)
    return Dataset(rig, (read_record(path, rig, "identify", **reading(options)),), path)
