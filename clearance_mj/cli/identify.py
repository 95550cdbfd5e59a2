"""clearance-mj identify: identify rig and clearance from records, or the clearance alone."""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ..core.errors import ClearanceError, RecordError
from ..core.files import to_json, write_text
from ..identify import METHODS as LAWS
from .command import command, inputs, out_file, out_folder, provenance
from .options import add_columns, add_plugin, load_plugin, parse_columns

if TYPE_CHECKING:
    from ..identify.methods.bench import BenchFit
    from ..identify.registry import Identified, Method
    from ..io.dataset import Dataset
    from ..report.identified import Findings

DPI = 150
BENCH, RIG_EXACT = "bench", "output-error"
"""methods: of a rig that is not known exactly, and of one that is"""


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("records", type=Path, help="dataset folder, or a file with one record: .uff, .csv, .mat, .nc or .h5")
    option(
        "--method",
        help=f"one of {', '.join(LAWS)} (default: {BENCH}; all others take the rig file for exact and find a law)",
    )  # fmt: skip
    option("--rig-exact", action="store_true", help=f"take the rig file for exact: as --method {RIG_EXACT}")
    add_plugin(parser, "a method")
    option("--rig", type=Path, help="rig file (TOML) of a single record; a dataset folder has its own")
    add_columns(parser)
    option("--fs", type=float, help="samples per second of a CSV or MATLAB file without time")
    option("--figures", type=Path, help="folder of the figures of a law (default: beside its file)")
    option("--no-figures", action="store_true", help=f"draw none; of {BENCH}: no page either")


@command(
    "identify", "identify a rig and its clearance's law from records, and draw what they show of it", _options,
    out_help=f"of {BENCH}: folder for rig.toml, law.json, identified.json and index.html (default: "
    "results/identified); else: law file, which simulate takes (default: law.json)",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..identify import get_method

    load_plugin(options.plugin)
    if options.rig_exact and options.method not in (None, RIG_EXACT):
        raise ClearanceError(f"--rig-exact is --method {RIG_EXACT}, and not --method {options.method}; give one")
    name = options.method or (RIG_EXACT if options.rig_exact else BENCH)
    method = get_method(name)
    if name != BENCH:
        return _law(options, name, method)
    _check_folder(options)
    return _bench(options, method)


def _found(options: argparse.Namespace, name: str, method: Method, dataset: Dataset) -> tuple[Identified, list[str]]:
    """What a method finds, and what it warned of."""
    warned: list[str] = []
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_, **__: _warn(str(message), warned)
        return method.run(dataset, None if options.quiet else name), warned


def _law(options: argparse.Namespace, name: str, method: Method) -> dict[str, Any]:
    from ..core.provenance import is_marked
    from ..report.identified import Findings

    out = options.out or Path("law.json")
    out_file(out, (".json",), inputs(options), is_marked)
    dataset = _dataset(options)
    found, warned = _found(options, name, method, dataset)
    write_text(out, to_json(found.law.to_dict() | {"provenance": provenance(options)}))
    result: dict[str, Any] = {"out": str(out), "law": found.law.to_dict(), "warnings": warned}
    if method.shortest:  # it was given the records
        findings = Findings(dataset, found, name)
        result["parameters"] = findings.parameters()
        result |= {} if options.no_figures else _draw(findings, out, options)
    _print(result)
    return result


def _check_folder(options: argparse.Namespace) -> None:
    """Refuse what cannot be the folder of a rig and a law."""
    out_folder(options.out)
    if options.figures:
        raise ClearanceError(f"--figures is for a law alone; method {BENCH} draws into the folder --out")
    if options.out is None:
        return
    if options.out.suffix:
        raise ClearanceError(
            f"--out {options.out}: method {BENCH} writes a folder with rig.toml and law.json; give a folder, or "
            "--rig-exact for a law file"
        )
    if options.out.resolve() in (options.records.resolve(), options.rig and options.rig.resolve().parent):
        raise ClearanceError(f"--out {options.out}: rig.toml would replace the records' own; give another folder")


def _bench(options: argparse.Namespace, method: Method) -> dict[str, Any]:
    from ..core.output_folder import output_folder
    from ..report.bench import write_bench, write_page

    dataset, out = _dataset(options), options.out or Path("results/identified")
    with output_folder(out, "identify", inputs(options)) as folder:
        folder.refuse_others("rig.toml", "law.json", "identified.json", "index.html")
        found, warned = _found(options, BENCH, method, dataset)
        fit = cast("BenchFit", found)
        write_bench(fit, dataset, folder.new, provenance(options))
        if not options.no_figures:
            write_page(fit, dataset, folder.new, out, not options.quiet)
    _print_bench(fit, out)
    if not options.no_figures:
        print(f"report: {out / 'index.html'}")
    stored = fit.to_dict()
    return {"out": str(out), "law": fit.law.to_dict()} | stored | {"warnings": warned + stored["warnings"]}


def _print_bench(fit: BenchFit, out: Path) -> None:
    print(f"{'parameter':48s} {'before':>11s} {'found':>11s}   std  (over that of before)")
    for row in fit.estimates.beside_priors():
        print("{name:48s} {before:11.5g} {value:11.5g} ± {std:.2g} {unit} ({posterior_over_prior:.2f})".format(**row))
    print(f"{'family':58s} weight  misfit  held out")
    for family in fit.families:
        print(f"{family.name:58s} {family.weight:6.3f} {family.misfit:7.3f} {family.held_out:9.3f}")
    for words in fit.warnings:
        print(f"warning: {words}")
    print(f"rig and law: {out / 'rig.toml'}, {out / 'law.json'}")


def _warn(message: str, warned: list[str]) -> None:
    if message not in warned:
        warned.append(message)
        print(f"clearance-mj: warning: {message}", file=sys.stderr)


def _dataset(options: argparse.Namespace) -> Dataset:
    """The dataset, or that of a single record."""
    from ..io.dataset import Dataset
    from ..io.formats import FORMATS, read_record
    from ..rig import Rig

    path = options.records
    if path.is_dir() or not (path.is_file() or path.suffix.lower() in FORMATS):
        if options.rig or options.column or options.fs:
            raise ClearanceError(f"{path}: --rig, --column and --fs are for the file of a single record (.uff or .csv)")
        return Dataset.load(path)
    if not options.rig:
        raise ClearanceError(f"{path}: is a single record, which needs its rig too: --rig rig.toml")
    rig = Rig.load(options.rig)
    record = read_record(path, rig, "identify", dict(parse_columns(options.column)), options.fs)
    return Dataset(rig, (record,), path)


def _draw(findings: Findings, out: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Write the figures; say which the records do not allow."""
    from tqdm import tqdm

    from ..core.output_folder import output_folder

    shown, drawn, missing = options.figures or out.with_name(f"{out.stem}_figures"), {}, {}
    for name, draw in tqdm(findings.figures().items(), desc="figures", disable=options.quiet):
        try:
            drawn[f"{name}.png"] = draw()
        except RecordError as error:
            missing[name] = str(error)
    if drawn:
        with output_folder(shown, "identify --figures", inputs(options)) as folder:
            for name, figure in drawn.items():
                figure.savefig(folder.new / name, dpi=DPI)
    return {"figures": [str(shown / name) for name in drawn], "not_drawn": missing}


def _print(result: dict[str, Any]) -> None:
    print(f"law: {result['out']}")
    for row in result.get("parameters", []):
        spread = f"± {row['std']:.2g}" if row["std"] < float("inf") else "not identifiable from the records"
        print(f"  {row['name']:28s} {row['value']:12.5g} {row['unit']:5s} {spread}")
    for path in result.get("figures", []):
        print(f"figure: {path}")
    for name, reason in result.get("not_drawn", {}).items():
        print(f"not drawn: {name}: {reason}")
