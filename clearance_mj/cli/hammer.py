"""clearance-mj hammer: from records of hammer hits to FRFs, coherence and modes."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from ..core.checks import check_dof, naming
from ..core.errors import ClearanceError, RecordError
from ..io.channels import Channel, require_one_time
from ..io.formats import read_channels, write
from ..report.style import Drawing
from ..rig import Rig
from ..signals.ema import NO_MODES, extract_modes
from ..signals.hammer import hammer_frf
from ..signals.response import Response
from .command import Options, Result, command, inform, option, spelled
from .options import FILES, band, reading, seconds

MAX_DRAWN = 24  # functions in a figure
SETTINGS = ("estimator", "block", "force_window", "exponential", "trigger", "pre_trigger")
WHERE = "such as 3:+Z: one for all files, or one for each (it roves)"


@command(
    "hammer",
    option("records", "records with one hit or several each", Path, nargs="+", metavar="FILE"),
    option("--hammer", "the hammer's channel (default: the rig's, or the only force)", metavar="CHANNEL"),
    option("--at", f"where and along what the hammer pushes, {WHERE}", nargs="+", metavar="DOF"),
    option("--sensor-at", f"where the only accelerometer is, {WHERE}", nargs="+", metavar="DOF"),
    option("--rig", "rig file (TOML) that says which channels are the hammer and the sensors", Path),
    option("--estimator", "of the averages", default="H1", choices=("H1", "H2", "Hv")),
    option("--block", "s of each hit, 1 / resolution (default: as the hits are apart)", seconds, metavar="S"),
    band("Hz (default: until the force falls by 20 dB)"),
    option("--trigger", "of the largest hit: what is a hit", float, 0.1),
    option("--pre-trigger", "of a block, s (default: two touches)", seconds, 0.0, metavar="S"),
    option("--force-window", "s of force kept after a touch (default: 0)", seconds, 0.0, metavar="S"),
    option("--exponential", "what the exponential window falls to in a block, 1: none (default: 1, or as slow decays "
           "need)", float, metavar="END"),
    option("--modes", "most modes to find, 0: none", int, 10),
    *FILES,
    out="hammer", writes=("frf.uff", "*.json", "hits.png", "frf.png"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Find FRFs, coherence and modes of a hammer test's records with hits."""
    rig, count = Rig.load(options.rig) if options.rig else None, len(options.records)
    positions = [options.at or [], options.sensor_at or []]
    if wrong := [given for given in positions if len(given) not in (0, 1, count)]:
        raise ClearanceError(f"{' '.join(wrong[0])}: give one place, or one for each of the {count} files")
    ats, places = (given * (count if len(given) == 1 else 1) or [None] * count for given in positions)
    records = [_read_record(path, at, place, rig, options) for path, at, place in zip(options.records, ats, places)]
    with naming(", ".join(map(str, options.records)), ClearanceError):
        test = hammer_frf(records, band=options.band, **{name: getattr(options, name) for name in SETTINGS})
        modes = extract_modes(test.frf, options.modes) if options.modes else NO_MODES
    for note in test.notes:
        inform(note)
    frf, averaged, out = test.frf, len(test.blocks), options.out / "frf.uff"
    write(options.new / out.name, frf)
    hits = [asdict(hit) | {"record": str(options.records[hit.record])} for hit in test.hits]
    low, high = frf.frequency[[0, -1]].tolist()
    data = {
        "hits": hits, "averaged": averaged, "band": [low, high], "lines": frf.frequency.size,
        "frequency": modes.frequency.tolist(), "damping": modes.damping.tolist(),
        "window_rate": frf.window_rate, "notes": list(test.notes),
    }  # fmt: skip
    words = [f"{averaged} of {len(hits)} hits averaged, {frf.frequency.size} lines from {low:.4g} to {high:.4g} Hz"]
    words += ["mode  frequency (Hz)  damping (%)"] if options.modes else []
    for i, (frequency, damping) in enumerate(zip(modes.frequency, modes.damping), 1):
        words += [f"{i:4d}  {frequency:14.3f}  {100 * damping:11.3f}"]
    words += [f"{out}; next: {spelled('modes', out)}"]
    figures = {
        "hits": (test.plot(), "Forces with their hits, blocks, and the spectrum of the force."),
        "frf": (frf.plot(range(min(MAX_DRAWN, len(frf.labels)))), "FRFs and their coherence."),
    }
    return Result(data, words, drawings=[Drawing(name, *drawn, drawn[1]) for name, drawn in figures.items()])


def _read_record(path: Path, at: str | None, place: str | None, rig: Rig | None, options: Options) -> Response:
    """Return the force and the accelerations of a file."""
    channels = read_channels(path, rig=rig, **reading(options))
    with naming(path):
        hammer = _hammer_channel(channels, rig, options.hammer)
        at = at or (hammer.label if hammer.placed else None)
        sensors = [c for c in channels if c.quantity == "acceleration" and (not rig or c.label in rig.sensor_labels)]
        if not sensors:
            raise RecordError('holds no acceleration; say which channel is one, such as --column "Accel 1=acc:1 [g]"')
        if at is None:
            raise RecordError(f'does not say where "{hammer.name}" pushes: give --at, such as --at 3:+Z')
        if place and len(sensors) > 1:
            raise RecordError(f"has {len(sensors)} accelerations; --sensor-at is for a single one")
        if raw := [c.name for c in sensors if not c.placed and not place]:
            raise RecordError(f'does not say where "{raw[0]}" is: give --sensor-at, or --column "{raw[0]}=acc:1 [g]"')
        require_one_time([hammer, *sensors])
        labels = (place,) if place else tuple(c.label for c in sensors)
        for label in (at, *labels):
            check_dof(label)
    motion = np.array([c.value for c in sensors])
    return Response(hammer.fs, hammer.value, motion, kind="force", responses=labels, reference=at)


def _hammer_channel(channels: list[Channel], rig: Rig | None, name: str | None) -> Channel:
    """Return the force channel that is named, the one where the rig is driven, or the only one."""
    forces = [c for c in channels if c.quantity == "force"]
    if name is not None:
        forces = [c for c in channels if name in (c.name, c.label)]
    elif rig:
        forces = [c for c in forces if c.label == rig.shaker.label("force")] or forces
    if len(forces) != 1:
        names = ", ".join(f'"{c.name}"' for c in channels)
        raise RecordError(f"{len(forces) or 'no'} channels may be the hammer's; say which with --hammer: {names}")
    if forces[0].quantity != "force":
        raise RecordError(f'"{name}" is no force: give its unit, such as --column "{name}=force:1 [N]"')
    return forces[0]
