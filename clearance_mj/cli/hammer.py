"""clearance-mj hammer: from records of hammer hits to FRFs, coherence and modes."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.checks import naming
from ..core.errors import ClearanceError, RecordError
from .command import command, say, spelled, write_results
from .options import add_files, hertz, reading, seconds

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..io.channels import Channel
    from ..rig import Rig
    from ..signals.response import Response

WRITTEN = ("frf.uff", "hammer.json", "hits.png", "frf.png")
MAX_DRAWN = 24  # functions in a figure
SETTINGS = ("estimator", "block", "force_window", "exponential", "trigger", "pre_trigger")


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("records", nargs="+", type=Path, metavar="FILE", help="records with one hit or several each")
    option("--hammer", metavar="CHANNEL", help="the hammer's channel (default: the rig's, or the only force)")
    where = "such as 3:+Z: one for all files, or one for each (it roves)"
    option("--at", nargs="+", default=[], metavar="DOF", help=f"where and along what the hammer pushes, {where}")
    option("--sensor-at", nargs="+", default=[], metavar="DOF", help=f"where the only accelerometer is, {where}")
    option("--rig", type=Path, help="rig file (TOML) that says which channels are the hammer and the sensors")
    option("--estimator", choices=("H1", "H2", "Hv"), default="H1", help="of the averages (default: %(default)s)")
    option("--block", type=seconds, metavar="S", help="s of each hit, 1 / resolution (default: as the hits are apart)")
    option("--band", type=hertz, nargs=2, metavar=("LO", "HI"), help="Hz (default: until the force falls by 20 dB)")
    option("--trigger", type=float, default=0.1, help="of the largest hit: what is a hit (default: %(default)s)")
    option("--pre-trigger", type=seconds, default=0.0, metavar="S", help="of a block, s (default: two touches)")
    option("--force-window", type=seconds, default=0.0, metavar="S", help="s of force kept after a touch (default: 0)")
    words = "what the exponential window falls to in a block, 1: none (default: 1, or as slow decays need)"
    option("--exponential", type=float, metavar="END", help=words)
    option("--modes", type=int, default=10, help="most modes to find, 0: none (default: %(default)s)")
    add_files(parser)


@command(
    "hammer", "hammer test: FRFs, coherence and modes of records with hits", _options, out=Path("hammer"),
    out_help=f"folder for {', '.join(WRITTEN)} (default: %(default)s)", writes=WRITTEN,
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..io.formats import write
    from ..report.style import Drawing
    from ..rig import Rig
    from ..signals.ema import NO_MODES, extract_modes
    from ..signals.hammer import hammer_frf

    rig, count = Rig.load(options.rig) if options.rig else None, len(options.records)
    if wrong := [given for given in (options.at, options.sensor_at) if len(given) not in (0, 1, count)]:
        raise ClearanceError(f"{' '.join(wrong[0])}: give one place, or one for each of the {count} files")
    both = (options.at, options.sensor_at)
    ats, places = (given * (count if len(given) == 1 else 1) or [None] * count for given in both)
    records = [_record(path, at, place, rig, options) for path, at, place in zip(options.records, ats, places)]
    with naming(", ".join(map(str, options.records)), ClearanceError):
        settings = {name: getattr(options, name) for name in SETTINGS}
        test = hammer_frf(records, band=tuple(options.band) if options.band else None, **settings)
        modes = extract_modes(test.frf, options.modes) if options.modes else NO_MODES
    for words in test.notes:
        say(words)
    frf, averaged, out = test.frf, len(test.blocks), options.out / "frf.uff"
    write(options.new / out.name, frf)
    figures = {"hits": test.plot(), "frf": frf.plot(range(min(MAX_DRAWN, len(frf.labels))))}
    hits = [asdict(hit) | {"record": str(options.records[hit.record])} for hit in test.hits]
    low, high = frf.frequency[[0, -1]].tolist()
    found = {"frequency": modes.frequency.tolist(), "damping": modes.damping.tolist()}
    result = {"hits": hits, "averaged": averaged, "band": [low, high], "lines": frf.frequency.size, **found}
    result |= {"window_rate": frf.window_rate, "notes": list(test.notes)}
    drawings = (Drawing(name, figure, name, name) for name, figure in figures.items())
    print(f"{averaged} of {len(hits)} hits averaged, {frf.frequency.size} lines from {low:.4g} to {high:.4g} Hz")
    print("mode  frequency (Hz)  damping (%)" if options.modes else "", end="\n" if options.modes else "")
    for i, (frequency, damping) in enumerate(zip(modes.frequency, modes.damping), 1):
        print(f"{i:4d}  {frequency:14.3f}  {100 * damping:11.3f}")
    print(f"{out}; next: {spelled('modes', out)}")
    return write_results(options, "hammer", result, None, *drawings)


def _record(path: Path, at: str | None, place: str | None, rig: Rig | None, options: argparse.Namespace) -> Response:
    """The force and the accelerations of a file."""
    import numpy as np

    from ..core.checks import check_dof
    from ..io.channels import require_one_time
    from ..io.formats import read_channels
    from ..signals.response import Response

    channels = read_channels(path, rig=rig, **reading(options))
    with naming(path):
        hammer = _hammer(channels, rig, options.hammer)
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


def _hammer(channels: list[Channel], rig: Rig | None, name: str | None) -> Channel:
    """The channel that is named, the one where the rig is driven, or the only force."""
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
