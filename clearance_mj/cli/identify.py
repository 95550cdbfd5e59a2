"""clearance-mj identify: identify the clearance from records."""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import ClearanceError, RecordError
from ..identify import METHODS as LAWS
from .command import command
from .options import add_columns, add_plugin, load_plugin, parse_columns

if TYPE_CHECKING:
    from ..io.dataset import Dataset
    from ..report.identified import Findings

DPI = 150


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("records", type=Path, help="dataset folder, or a file with one record: .uff, .csv, .mat, .nc or .h5")
    option("--method", default="output-error", help=f"one of {', '.join(LAWS)} (default: %(default)s)")
    add_plugin(parser, "a method")
    option("--rig", type=Path, help="rig file (TOML) of a single record; a dataset folder has its own")
    add_columns(parser)
    option("--fs", type=float, help="samples per second of a CSV or MATLAB file without time")
    option("--figures", type=Path, help="folder of the figures (default: beside the law file)")
    option("--no-figures", action="store_true", help="draw none")


@command(
    "identify", "identify the clearance's law from records, and draw what they show of it", _options,
    out=Path("law.json"), out_help="law file, which simulate takes (default: %(default)s)",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..identify import get_method
    from ..report.identified import Findings

    load_plugin(options.plugin)
    method, dataset = get_method(options.method), _dataset(options)
    warned: list[str] = []
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_, **__: _warn(str(message), warned)
        found = method.run(dataset, None if options.quiet else options.method)
        found.law.save(options.out)
        result: dict[str, Any] = {"out": str(options.out), "law": found.law.to_dict(), "warnings": warned}
        if method.shortest:  # it was given the records
            findings = Findings(dataset, found, options.method)
            result["parameters"] = findings.parameters()
            result |= {} if options.no_figures else _draw(findings, options)
    _print(result)
    return result


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


def _draw(findings: Findings, options: argparse.Namespace) -> dict[str, Any]:
    """Write the figures; say which the records do not allow."""
    from tqdm import tqdm

    from ..files import replacing

    folder, drawn, missing = options.figures or options.out.with_name(f"{options.out.stem}_figures"), [], {}
    for name, draw in tqdm(findings.figures().items(), desc="figures", disable=options.quiet):
        try:
            figure = draw()
        except RecordError as error:
            missing[name] = str(error)
            continue
        with replacing(folder / f"{name}.png") as temporary:
            figure.savefig(temporary, dpi=DPI)
        drawn.append(str(folder / f"{name}.png"))
    return {"figures": drawn, "not_drawn": missing}


def _print(result: dict[str, Any]) -> None:
    print(f"law: {result['out']}")
    for row in result.get("parameters", []):
        spread = f"± {row['std']:.2g}" if row["std"] < float("inf") else "not identifiable from the records"
        print(f"  {row['name']:28s} {row['value']:12.5g} {row['unit']:5s} {spread}")
    for path in result.get("figures", []):
        print(f"figure: {path}")
    for name, reason in result.get("not_drawn", {}).items():
        print(f"not drawn: {name}: {reason}")
