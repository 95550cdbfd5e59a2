"""clearance-mj map: which channel of a logger's files is which sensor of the rig."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from ..core.errors import ClearanceError
from ..core.files import read_lines
from .command import command, spelled
from .options import add_columns, add_kind, add_plugin, add_rate, hertz, parse_columns


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("files", nargs="+", type=Path, metavar="FILE", help="records of one set-up, with the same channels in each")
    option("--rig", type=Path, required=True, help="rig file (TOML); clearance-mj new writes one")
    add_columns(parser)
    add_plugin(parser, "a file format")
    add_kind(parser)
    add_rate(parser)
    option("--band", type=hertz, nargs=2, metavar=("LO", "HI"), help="band of excitation, Hz (default: as measured)")


@command(
    "map", "find which channel of a logger's files is which sensor of the rig, with sign and unit", _options,
    out=Path("map.toml"), out_help="file for the map, which other commands take by --map (default: %(default)s)",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..identify import map_channels
    from ..io.formats import read_channels
    from ..rig import Rig

    out, decided = options.out, parse_columns(options.column)
    if out.suffix != ".toml":
        raise ClearanceError(f"--out {out}: give a name that ends in .toml")
    rig = Rig.load(options.rig)
    files = {str(path): read_channels(path, fs=options.fs, resample=options.resample) for path in options.files}
    names = {channel.name for channels in files.values() for channel in channels}
    if unknown := sorted(decided.keys() - names):
        raise ClearanceError(f'--column: {options.files[0]} has no channel "{unknown[0]}"')
    band = tuple(options.band) if options.band else None
    found = map_channels(files, rig, options.kind, band, not options.quiet)
    reasons = {**found.reasons, **dict.fromkeys(decided, "as you said")}
    found = dataclasses.replace(found, channels={**found.channels, **decided}, reasons=reasons)
    if out.exists() and read_lines(out) != found.to_toml().splitlines():
        raise ClearanceError(f"--out {out}: is there and says otherwise; give another name, or remove it")
    found.save(out)
    print(found)
    if asked := ", ".join(f'"{name}"' for name in found.undecided):
        print(f'{out}: to be decided: {asked}; write what each is instead of "?", such as "acc:3 [g]" or "skip"')
    print(f"next: {spelled('convert', *options.files, 'bench', '--rig', options.rig, '--map', out)}")
    return {
        "channels": dict(found.channels),
        "reasons": dict(found.reasons),
        "notes": list(found.notes),
        "undecided": list(found.undecided),
        "out": str(out),
    }
