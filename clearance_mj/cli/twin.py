"""clearance-mj twin: gap, contact stiffness and damping along a record, with alarms where they change."""

from __future__ import annotations

import argparse
import dataclasses
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, inputs, out_folder, provenance
from .options import add_records, reading, seconds

if TYPE_CHECKING:
    from ..identify import Twin
    from ..io.dataset import Record
    from ..rig import Rig


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option(
        "record", type=Path,
        help="file with one record: .uff, .csv, .mat, .nc or .h5; with the excitation, the rig's accelerometers and a "
        "displacement probe at every clearance",
    )  # fmt: skip
    words = "rig file (TOML), or a folder with rig.toml and, if one was identified, law.json"
    option("--rig", type=Path, required=True, help=words)
    words = "law file, whose kinds of contact and grease are tracked (default: the folder's; else the likeliest)"
    option("--law", type=Path, help=words)
    option("--window", type=seconds, default=2.0, metavar="S", help="s between two values (default: %(default)s)")
    words = "s of the record to which rig and law are fitted (default: %(default)s)"
    option("--learn", type=seconds, default=10.0, metavar="S", help=words)
    option("--rig-exact", action="store_true", help="take the rig file for exact instead of correcting it first")
    add_records(parser)


@command(
    "twin", "follow gap, contact stiffness and damping along a record, with alarms where they change", _options,
    out=Path("results/twin"), out_help="folder for index.html, twin.csv, twin.nc and twin.json (default: %(default)s)",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..core.output_folder import output_folder
    from ..identify import twin
    from ..model import LAW_FILE, Model
    from ..report.twin import write_twin

    out_folder(options.out)
    model = Model.load(options.rig, options.law)
    given = model if options.law or (options.rig / LAW_FILE).is_file() else None  # else the likeliest family
    record = _record(options, model.rig)
    with output_folder(options.out, "twin", inputs(options)) as folder:
        folder.refuse_others("index.html", "twin.csv", "twin.nc", "twin.json")
        start = time.perf_counter()
        found = twin(record, given, options.window, options.learn, options.rig_exact, not options.quiet)
        took = time.perf_counter() - start
        result = write_twin(found, record, given.law if given else None, folder.new, provenance(options))
    _print(found, record, took, options.out)
    return result | {"out": str(options.out)}


def _record(options: argparse.Namespace, rig: Rig) -> Record:
    from ..io.formats import read_record

    if options.record.is_dir():
        raise ClearanceError(f"{options.record} is a folder; give the file of one record, such as level_5_a.uff in it")
    record = read_record(options.record, rig, "identify", **reading(options))
    return dataclasses.replace(record, provenance={"file": str(options.record)} | record.provenance)


def _print(found: Twin, record: Record, took: float, out: Path) -> None:
    for words in found.words():
        print(words)
    print(f"{len(found.alarms)} alarms" if found.alarms else "no alarm")
    for alarm in found.alarms:
        print(f"alarm: {alarm}")
    for words in found.warnings:
        print(f"warning: {words}")
    print(f"{record.duration:.4g} s of record in {took:.3g} s")
    print(f"report: {out / 'index.html'}")
