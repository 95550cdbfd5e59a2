"""clearance-mj drive: lost motion, stiffness and friction of a drive from logs of its two ends, or of its motor."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..core.errors import ClearanceError, RecordError
from ..core.validation import read_plain
from ..drives import DriveRecord, ServoLog, fit_drive, fit_held, fit_motor_side
from ..drives.record import QUANTITIES
from ..io.columns import SKIP
from ..io.tables.headers import split_header
from ..report.drive import write_drive, write_held, write_motor_side
from .command import Options, Result, command, option


@command(
    "drive",
    option("runs", "logs of both ends, or the motor's alone, with reversals: any format of records, Parquet, or joint "
           "states of ROS 2 in MCAP; or logs of servos of which some hold while two pull them to and fro, with columns "
           '"target pos (1)", "pos (1)", "load (1)" of each', Path, nargs="+", metavar="RUN"),
    option("--column", "column of time, motor_angle, motor_torque, load_angle or load_torque, such as "
           'motor_torque=-tau with a minus sign where it counts the other way round, or "motor_angle=pos '
           '[ticks/4096]"; units as in the header (deg, turn, ticks/4096, mN m, oz in ...), without one s, rad, N m',
           action="append", metavar="WHAT=COLUMN"),
    option("--map", "TOML file with a table [channels] of the logs' columns, such as \"motor [deg]\" = \"motor_angle\"",
           Path, metavar="MAP"),
    option("--predict", "logs that no drive is found from: their load's end is predicted from the motor's", Path,
           nargs="+", default=(), metavar="RUN"),
    out_help="folder for index.html, its figures and drive.json",
    writes=("index.html", "*.json"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Find lost motion, stiffness and friction of a drive from logs of its two ends, or its motor's."""
    if any(ServoLog.is_one(path) for path in options.runs):
        if options.column or options.map or options.predict:
            raise ClearanceError(
                "logs of servos that hold have their own columns: leave --column, --map, --predict away"
            )
        logs = [ServoLog.read(path) for path in options.runs]
        data = write_held({log.name: fit_held(log) for log in logs}, options.new)
        return Result(data, _report(data))
    columns = _channel_columns(options)
    runs, held_out = ([DriveRecord.read(path, columns) for path in paths] for paths in (options.runs, options.predict))
    if any(run.both_ends for run in runs):
        data = write_drive(fit_drive(runs, progress=not options.quiet), runs, held_out, options.new)
    elif held_out:
        raise ClearanceError("--predict needs logs of both ends to find a drive from; these have the motor's alone")
    else:
        data = write_motor_side(fit_motor_side(runs, progress=not options.quiet), options.new)
    return Result(data, _report(data))


def _report(data: dict[str, Any]) -> Iterator[str]:
    yield from (f"{name}: {value:.4g}" for name, value in data["table"].items())
    yield from data["not_told"]
    for row in data["predicted"]:
        errors = {"angle {:.3g} degrees": row["angle_rms_deg"], "torque {:.3g} N m": row["torque_rms_Nm"]}
        off = ", ".join(words.format(error) for words, error in errors.items() if not math.isnan(error))
        yield f"{row['run']}: {off} RMS off"


def _channel_columns(options: Options) -> dict[str, str]:
    """Return columns by channel; a map has them by column, as options of other commands do."""
    pairs = [*read_plain(options.map, RecordError).get("channels", {}).items()] if options.map else []
    for pair in options.column:
        header, equals, right = (part.strip() for part in pair.partition("="))
        if not (header and equals and right):
            raise ClearanceError(f'--column "{pair}": needs WHAT=COLUMN, such as "motor_torque=tau"')
        is_header = header not in QUANTITIES and split_header(right.removeprefix("-"))[0] in (SKIP, *QUANTITIES)
        pairs.append((header, right) if is_header or right == SKIP else (right, header))
    columns = {}
    for column, given in pairs:
        quantity, unit = split_header(given.removeprefix("-"))
        if given != SKIP:
            columns[quantity] = "-" * given.startswith("-") + column + (f" [{unit}]" if unit else "")
        elif column in QUANTITIES:
            columns[column] = SKIP
    return columns
