"""clearance-mj twin: gap, contact stiffness and damping along a record, with alarms where they change."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path

from ..core.errors import ClearanceError
from ..identify import twin
from ..io.formats import read_record
from ..model import LAW_FILE, Model
from ..report.twin import write_twin
from .command import Options, Result, command, flag, option, provenance
from .options import MODEL_FOLDER, RECORDS, reading, seconds


@command(
    "twin",
    option("record", "file with one record: .uff, .csv, .mat, .nc or .h5; with the excitation, the rig's "
           "accelerometers and a displacement probe at every clearance", Path),
    option("--rig", MODEL_FOLDER, Path, required=True),
    option("--law", "law file, whose kinds of contact and grease are tracked (default: the folder's; else the "
           "likeliest)", Path),
    option("--window", "s between two values", seconds, 2.0, metavar="S"),
    option("--learn", "s of the record to which rig and law are fitted", seconds, 10.0, metavar="S"),
    flag("--rig-exact", "take the rig file for exact instead of correcting it first"),
    *RECORDS,
    writes=("index.html", "twin.csv", "twin.nc", "twin.json"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Follow gap, contact stiffness and damping along a record, with alarms where they change."""
    model = Model.load(options.rig, options.law)
    given = model if options.law or (options.rig / LAW_FILE).is_file() else None  # else the likeliest family
    if options.record.is_dir():
        raise ClearanceError(f"{options.record} is a folder; give the file of one record, such as level_5_a.uff in it")
    record = read_record(options.record, model.rig, "identify", **reading(options))
    record = dataclasses.replace(record, provenance={"file": str(options.record)} | record.provenance)
    start = time.perf_counter()
    result = twin(record, given, options.window, options.learn, options.rig_exact, not options.quiet)
    took = time.perf_counter() - start
    data = write_twin(result, record, given.law if given else None, options.new, provenance(options))
    words = [*result.words(), f"{len(result.alarms)} alarms" if result.alarms else "no alarm"]
    words += [*(f"alarm: {alarm}" for alarm in result.alarms), *(f"warning: {each}" for each in result.warnings)]
    return Result(data, [*words, f"{record.duration:.4g} s of record in {took:.3g} s"])
