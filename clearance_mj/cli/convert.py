"""clearance-mj convert: time records and FRFs from one file format to another, or into a dataset."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from ..core.checks import naming
from ..core.errors import ClearanceError, RecordError
from ..core.files import sha256, to_json, write_text
from ..core.notes import note
from ..core.provenance import BESIDE, MARK, made_from
from ..core.units import si_value
from ..io import formats
from ..io.channels import Channel, channel_faults, require_one_time
from ..io.contents import FileContents, describe_part, pick_part
from ..io.dataset import Dataset, Record, write_dataset
from ..io.formats import Contents
from ..rig import BASE_NODE, Rig, Spin
from ..signals.ema import Modes
from ..signals.frf import FRF, estimate_frf
from ..signals.quantities import with_quantity
from ..signals.response import Response
from ..signals.spectra import Spectra
from ..structure.geometry import Geometry
from ..version import __version__
from .command import Options, Result, command, given, inform, option, out_file, spelled
from .options import FILES, WHAT, band, hertz, kind, level, read_file, reading

OF_DATASET = ("role", "level", "spin", "pulses", "leave_out")


@command(
    "convert",
    option("files", "IN OUT: the file to read and the one to write, by suffix; IN ... OUT: records, and their dataset "
           "folder", Path, nargs="+", metavar="FILE"),
    *FILES, WHAT,
    option("--quantity", 'of FRFs that do not say theirs, such as "acceleration/force [g/N]"', metavar="QUANTITY"),
    option("--rig", "rig file (TOML): of a new dataset; where the nodes are, for .uff; at which nodes displacements "
           "are", Path),
    option("--frf", "write a record's FRFs (H1) with lines this far apart: of the rig's sensors to its shaker, or "
           "without --rig of all accelerations to the column NAME=base or NAME=force", hertz, metavar="HZ"),
    option("--window", "of the segments of --frf (default: hann; of hits none, on segments that begin with them)",
           choices=("hann", "boxcar")),
    option("--reference", "of FRFs to several references write those to one, such as 5:+Z", metavar="DOF"),
    band("band of the excitation, Hz"),
    option("--role", "of the records of a dataset: identify, validate, sine or orbit (default: identify)"),
    kind("spin", default="as the rig's shaker, or the other input if that alone was recorded; of orbits spin"),
    option("--spin", "of the shaft in records of a dataset, such as 20Hz or 3000rpm (without a unit rad/s), or "
           "FROM:TO:SECONDS of a run-up, such as 20Hz:60Hz:20; < 0: from z to y (default: as the rig file)",
           metavar="SPEED"),
    option("--pulses", "of the keyphasor in a turn (default: 1, or as the rig file)", int, metavar="N"),
    option("--leave-out", "accelerometers that records of a dataset lack or cannot use, such as 3:+Z: the other "
           "records keep theirs", nargs="+", metavar="DOF"),
    option("--level", "RMS of the excitation of records that validate, m/s² or N, or such as 0.1g (default: as "
           "measured)", level),
    out_help="OUT, if it is not the last FILE",
)  # fmt: skip
def run(options: Options) -> Result:
    """Convert records, FRFs, spectra, modes: .uff .csv .mat .lvm .tdms .mf4 .nc .h5, a dataset."""
    inputs, out = options.files, options.out
    if out is None:
        *inputs, out = inputs
    if not inputs:
        raise ClearanceError(f"{out}: convert needs a file to read and one to write")
    if folders := [path for path in inputs if path.is_dir()]:
        raise ClearanceError(f"{folders[0]}: is a folder; convert reads files")
    if not out.is_dir() and out.suffix:
        data = _to_file(inputs, out, options)
        return Result(data, [f"{out}: {data['holds']}"])
    data = _into_dataset(inputs, out, options)
    following = spelled("orbit-gaps" if options.role == "orbit" else "identify", out, "--out", f"{out}_found")
    return Result(data, [f"{out}: {data['holds']}", f"next: {following}"])


def _to_file(inputs: list[Path], out: Path, options: Options) -> dict[str, Any]:
    if len(inputs) > 1:
        raise ClearanceError(f"{out}: one file is written from one; several go into a dataset folder (no suffix)")
    if of_dataset := given(options, *OF_DATASET):
        raise ClearanceError(f"{out}: {' and '.join(of_dataset)} are for a dataset folder (no suffix)")
    too = " and for a dataset folder (no suffix)"
    for name, fields in (("band", too), ("window", ""), ("kind", too)):
        if getattr(options, name) and not options.frf:
            raise ClearanceError(f"{out}: --{name} is for --frf{fields}")
    read = [*inputs, *([options.rig] if options.rig else [])]
    out_file(out, [*formats.format_of(out).suffixes], read, _is_readable)
    metadata_file = out.with_name(f"{out.name}{BESIDE}")
    out_file(metadata_file, (".json",), read)
    (path,) = inputs
    rig = Rig.load(options.rig) if options.rig else None
    obj: Contents
    if options.reference:
        obj = formats.read_frf(path, options.column, options.reference, options.what or "frf", options.units)
    else:
        obj = read_file(path, options, rig)
        if options.frf is not None and isinstance(obj, FileContents):
            with naming(path):
                obj = pick_part(obj, "channels")
    if options.quantity:
        obj = _with_quantity(path, obj, options.quantity)
    if isinstance(obj, list):
        note(path, channel_faults(obj))
    if options.frf is not None:
        obj = _read_frf(path, obj, rig, options)
    formats.write(out, obj, rig)
    write_text(metadata_file, to_json(made_from(read, "convert") | {"sha256": sha256(out)}))
    return {"in": str(path), "out": str(out), "holds": _report(obj, out, rig)}


def _with_quantity(path: Path, obj: Contents, text: str) -> FRF:
    """Return FRFs with the quantity that the user gives."""
    quantity, _, unit = text.partition("[")
    with naming(path):
        return with_quantity(pick_part(obj, "frf"), quantity.strip(), unit.strip(" ]"))


def _is_readable(path: Path) -> bool:
    """Return True if a file is of this program, readable without options, and so may be replaced."""
    try:
        formats.read(path)
    except ClearanceError:
        return False
    return True


def _read_frf(path: Path, obj: Contents, rig: Rig | None, options: Options) -> FRF:
    if isinstance(obj, FRF):
        raise RecordError(f"{path}: holds FRFs already; --frf is for time records")
    with naming(path):
        if isinstance(obj, list) and rig:
            kind = options.kind or formats.driving_kind(obj, rig)
            obj = Record("record", "identify", rig, obj[0].fs, obj, kind).response()
        elif isinstance(obj, list):
            obj = _response_without_rig(obj, options.kind)
        if not isinstance(obj, Response):
            raise RecordError("holds no time records, which --frf needs")
        return estimate_frf(obj, resolution=options.frf, band=options.band, window=options.window)


def _response_without_rig(channels: list[Channel], kind: str | None) -> Response:
    """Return motions and their excitation, without a rig that defines them."""
    placed = [c for c in channels if c.placed]
    kinds = {c: "force" for c in placed if c.quantity == "force"}
    kinds |= {c: "base" for c in placed if (c.quantity, c.node) == ("acceleration", BASE_NODE)}
    drives = [c for c, driven in kinds.items() if kind in (None, driven)]
    sensors = [c for c in placed if c not in kinds]
    if len(drives) != 1 or not sensors:
        raise RecordError(
            '--frf needs --rig, or one channel that drives ("NAME=base" or "NAME=force") and motions at '
            'their places ("NAME=acc:1 [g]")'
        )
    require_one_time([*drives, *sensors])
    motion, labels = np.array([c.value for c in sensors]), tuple(c.label for c in sensors)
    (drive,) = drives
    return Response(drive.fs, drive.value, motion, kind=kinds[drive], responses=labels, reference=drive.label,
                    quantities=tuple(c.quantity for c in sensors))  # fmt: skip


def _report(obj: Contents, out: Path, rig: Rig | None) -> str:
    """Return a report of what was written; warn on standard error of what could not be."""
    if isinstance(obj, FRF):
        return "; ".join(
            f"{count} FRFs, {obj.quantity} to {reference}, {obj.frequency.size} lines"
            for count, reference in zip(obj.measured.sum(axis=0), obj.references)
        )
    if isinstance(obj, FileContents):
        return ", ".join(obj.parts)
    if isinstance(obj, Spectra | Geometry | Modes):
        return describe_part(obj)
    if isinstance(obj, Response):
        if Response not in formats.format_of(out).holds and obj.displacement is not None and not rig:
            inform(f"{out}: left out: displacements (--rig says at which nodes)", "warning")
        obj = [*formats.to_channels(obj, rig), *formats.force_channels(obj, rig)]
    if isinstance(obj, list):
        return f"{len(obj)} channels, {obj[0].size} samples at {obj[0].fs:g} Hz"
    return type(obj).__name__


def _into_dataset(inputs: list[Path], out: Path, options: Options) -> dict[str, Any]:
    """Add records to a dataset, which is made if it is not there."""
    if options.frf is not None:
        raise ClearanceError(f"{out}: a dataset holds time records; --frf writes a file")
    if options.reference:
        raise ClearanceError(f"{out}: a dataset holds time records; --reference is for files of FRFs")
    known = Dataset.load(out) if (out / "dataset.toml").exists() else None
    if options.rig:
        rig = Rig.load(options.rig)
    elif known:
        rig = known.rig
    else:
        raise ClearanceError(f"{out}: a new dataset needs its rig: --rig rig.toml")
    if known and known.rig != rig:
        raise ClearanceError(f"{options.rig}: is another rig than that of the dataset {out}")
    records = [_make_record(path, rig, options) for path in inputs]
    write_dataset(out, rig, [*(known.records if known else ()), *records])
    names = [record.name for record in records]
    holds = f"record{'s' * (len(names) > 1)} {', '.join(names)} added with role {records[0].role}"
    levels = [record.level for record in records]
    return {"in": [*map(str, inputs)], "out": str(out), "records": names, "levels": levels, "holds": holds}


def _make_record(path: Path, rig: Rig, options: Options) -> Record:
    spin = _parse_spin(options.spin) or rig.spin
    if options.pulses is not None:
        if spin is None:
            raise ClearanceError("--pulses needs --spin, or a rig file that has a spin")
        spin = dataclasses.replace(spin, pulses=options.pulses)
    rms = options.level and options.level(options.kind or rig.shaker.kind)
    record = formats.read_record(
        path, rig, options.role or "identify", **reading(options), level=rms, band=options.band, kind=options.kind,
        left_out=tuple(options.leave_out or ()), spin=None if spin == rig.spin else spin,
    )  # fmt: skip
    faults: list[str] = []
    for channel in record.channels:
        sensor = (channel.label, channel.quantity) in [(s.label, s.quantity) for s in rig.sensors]
        if not (sensor and channel.label in record.left_out):
            way_out = f"; --leave-out {channel.label} leaves it out of this record alone" if sensor else ""
            faults += [f"{fault}{way_out}" for fault in channel_faults([channel])]
    note(path, faults)
    provenance_ = {"file": str(path), "sha256": sha256(path), MARK: __version__}
    record = dataclasses.replace(record, provenance=provenance_ | record.provenance)
    if record.role == "identify" or record.level is not None or record.excitation_kind == "spin":
        return record
    rms = float(np.std(record.excitation().value))
    inform(f"{path}: level {rms:.3g}, as measured; --level gives another")
    return dataclasses.replace(record, level=float(f"{rms:.3g}"))


def _parse_spin(text: str | None) -> Spin | None:
    """Return the spin of an option's text."""
    if text is None:
        return None
    form = "{}: {}; give SPEED or FROM:TO:SECONDS, such as 20Hz:60Hz:20"
    with naming(f"--spin {text}", (ClearanceError, ZeroDivisionError), ClearanceError, form):
        first, *ramp = text.split(":")
        if not ramp:
            return Spin(si_value(first, "spin"))
        last, seconds = si_value(ramp[0], "spin"), si_value(":".join(ramp[1:]), "time")
        return Spin(speed := si_value(first, "spin"), (last - speed) / seconds, last)
