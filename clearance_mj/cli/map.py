"""clearance-mj map: which channel of a logger's files is which sensor of the rig."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from ..core.errors import ClearanceError
from ..core.files import read_lines
from ..identify import map_channels
from ..io.formats import read_channels
from ..rig import Rig
from .command import Options, Result, command, option, spelled
from .options import RATE, band, columns, kind, plugin


@command(
    "map",
    option("files", "records of one set-up, with the same channels in each", Path, nargs="+", metavar="FILE"),
    option("--rig", "rig file (TOML); clearance-mj new writes one", Path, required=True),
    columns(), plugin("a file format"), kind(), *RATE,
    band("band of excitation, Hz (default: as measured)"),
    out="map.toml", out_help="file for the map, which other commands take by --map",
)  # fmt: skip
def run(options: Options) -> Result:
    """Find which channel of a logger's files is which sensor of the rig, with sign and unit."""
    out, decided = options.out, options.column
    if out.suffix != ".toml":
        raise ClearanceError(f"--out {out}: give a name that ends in .toml")
    rig = Rig.load(options.rig)
    files = {str(path): read_channels(path, fs=options.fs, resample=options.resample) for path in options.files}
    names = {channel.name for channels in files.values() for channel in channels}
    if unknown := sorted(decided.keys() - names):
        raise ClearanceError(f'--column: {options.files[0]} has no channel "{unknown[0]}"')
    channel_map = map_channels(files, rig, options.kind, options.band, not options.quiet)
    reasons = {**channel_map.reasons, **dict.fromkeys(decided, "as you said")}
    channel_map = dataclasses.replace(channel_map, channels={**channel_map.channels, **decided}, reasons=reasons)
    if out.exists() and read_lines(out) != channel_map.to_toml().splitlines():
        raise ClearanceError(f"--out {out}: is there and says otherwise; give another name, or remove it")
    channel_map.save(out)
    words = [str(channel_map)]
    if unclear := ", ".join(f'"{name}"' for name in channel_map.undecided):
        words += [f'{out}: to be decided: {unclear}; write what each is instead of "?", such as "acc:3 [g]" or "skip"']
    words += [f"next: {spelled('convert', *options.files, 'bench', '--rig', options.rig, '--map', out)}"]
    data = {name: dict(getattr(channel_map, name)) for name in ("channels", "reasons")}
    return Result(data | {name: list(getattr(channel_map, name)) for name in ("notes", "undecided")}, words)
