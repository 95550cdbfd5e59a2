"""clearance-mj identify: identify a model, rig and law, from records."""

from __future__ import annotations

import argparse
import shutil
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from ..identify import METHODS as METHODS_BY_NAME
from .command import command, inputs, out_folder, provenance, say, spelled
from .options import add_plugin, add_records, print_parameters, reading

if TYPE_CHECKING:
    from ..identify.registry import Identified
    from ..io.dataset import Dataset

DEFAULT, RIG_EXACT = "bench", "output-error"  # methods for a rig file that is not exact, and for one that is


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("records", type=Path, help="dataset folder, or a file with one record: .uff, .csv, .mat, .nc or .h5")
    names = ", ".join(METHODS_BY_NAME)
    option("--method", help=f"one of {names} (default: {DEFAULT}; all others take the rig file for exact)")
    option("--rig-exact", action="store_true", help=f"take the rig file for exact: as --method {RIG_EXACT}")
    add_plugin(parser, "a method")
    option("--rig", type=Path, help="rig file (TOML) of a single record; a dataset folder has its own")
    add_records(parser)
    option("--no-figures", action="store_true", help="draw none, and write no page")


@command(
    "identify", "identify a model, rig and law, from records, and show what it does and how well it is known", _options,
    out=Path("results/identified"),
    out_help="folder for rig.toml, law.json, identified.json and index.html (default: %(default)s)",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..core.output_folder import output_folder
    from ..study.laws import stored_law

    if options.rig_exact and options.method not in (None, RIG_EXACT):
        raise ClearanceError(f"--rig-exact is --method {RIG_EXACT}, and not --method {options.method}; give one")
    _check_folder(options)
    dataset, out = _dataset(options), options.out
    with output_folder(out, "identify", inputs(options)) as folder:
        folder.refuse_others("rig.toml", "law.json", "posterior.json", "identified.json", "index.html")
        name = options.method or (RIG_EXACT if options.rig_exact else DEFAULT)
        found = _found(options, dataset, name)
        failure = _written(found, dataset, folder.new, options)
        if not failure:  # a study does not find it again
            stored_law(folder.cache, name, dataset, lambda: found)
            folder.cache.drop_unused()
    _print(found, out)
    if failure:
        raise ClearanceError(f"{out}: what was found is kept, and drawing it failed: {failure}") from failure
    if not options.no_figures:
        print(f"report: {out / 'index.html'}")
    if len(found.unseen_gaps) < len(found.rig.bushings):
        print(f"next: {spelled('simulate', out, '--rms', 2, '--gap', 'x0.5')}: what half of the gap would do")
    if dataset.path and dataset.path.is_dir() and any(record.role == "validate" for record in dataset.records):
        print(f"next: {spelled('study', dataset.path)}: how well records that were kept back are predicted")
    return {"out": str(out), "law": found.law.to_dict()} | found.to_dict()


def _written(found: Identified, dataset: Dataset, new: Path, options: argparse.Namespace) -> Exception | None:
    """Write what was found, then draw it; return what made drawing fail, of which nothing then stays."""
    try:
        found.save(new, dataset, provenance(options))
        if not options.no_figures:
            from ..report.identification import write_identification

            write_identification(found, dataset, new, options.out, workers=None, progress=not options.quiet)
    except Exception as failure:
        if not (new / "law.json").exists():
            raise
        (new / "index.html").unlink(missing_ok=True)
        for name in ("figures", "tables"):
            shutil.rmtree(new / name, ignore_errors=True)
        return failure
    return None


def _check_folder(options: argparse.Namespace) -> None:
    """Refuse what cannot be the folder of a model."""
    out_folder(options.out)
    if options.out.suffix:
        raise ClearanceError(f"--out {options.out}: a folder is written, with rig.toml and law.json; give a folder")
    if options.out.resolve() in (options.records.resolve(), options.rig and options.rig.resolve().parent):
        raise ClearanceError(f"--out {options.out}: rig.toml would replace the records' own; give another folder")


def _found(options: argparse.Namespace, dataset: Dataset, name: str) -> Identified:
    """What the method finds; what it warns of is printed, also where it then fails."""
    from ..identify import identify

    said: list[str] = []
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_, **__: said.append(str(message))
        try:
            found = identify(dataset, name, not options.quiet)
            said += found.warnings
        finally:
            for words in dict.fromkeys(said):
                say(words, "warning")
    return found


def _print(found: Identified, out: Path) -> None:
    if found.estimates:
        print_parameters(found.estimates, 48, f"{'found':>11s}   std  (over that of before)")
    if families := found.pages.get("families", ()):
        print(f"{'family':71s} weight  misfit  held out")
    for family in families:
        numbers = f"{family.weight:6.3f} {family.misfit:7.3f} {family.held_out:9.3f}"
        print(f"bushing {family.bushing + 1}: {family.name:60s} {numbers}")
    print(found.model)
    print(f"rig and law: {out / 'rig.toml'}, {out / 'law.json'}")


def _dataset(options: argparse.Namespace) -> Dataset:
    """The dataset, or that of a single record."""
    from ..io.dataset import Dataset
    from ..io.formats import FORMATS, read_record
    from ..rig import Rig

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
