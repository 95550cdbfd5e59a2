"""clearance-mj show: what a file holds, function by function, as a table or a picture."""

from __future__ import annotations

import argparse
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from ..core.files import replacing
from .command import command, out_file, spelled
from .options import add_columns, add_map, add_plugin, add_rate, add_units, load_map, load_plugin, parse_columns

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..io.inventory import Item

PICTURES = (".png", ".svg", ".pdf")
WIDEST = 34  # characters of a cell
HEAD = ("kind", "name", "place", "quantity", "unit", "samples", "rate", "RMS", "peak", "course")


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("files", nargs="+", type=Path, metavar="FILE", help="files of any format, or dataset folders")
    option("--what", help='of a file that holds several things: channels, frf, "frf 2", spectra, modes, geometry')
    add_rate(parser)
    add_units(parser)
    add_columns(parser)
    add_map(parser)
    add_plugin(parser, "a file format")


@command(
    "show", "show what a file holds: names, places, quantities, units, rates, levels", _options,
    out_help=f"picture to write of one file ({', '.join(PICTURES)})",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..core.provenance import is_marked
    from ..io.formats import read, read_channels

    load_plugin(options.plugin)
    if options.out is not None:
        if len(options.files) > 1:
            raise ClearanceError(f"--out {options.out}: one picture is drawn of one file, got {len(options.files)}")
        out_file(options.out, PICTURES, options.files, is_marked)
    columns, channel_map = dict(parse_columns(options.column)), load_map(options)
    found = {}
    for path in options.files:
        obj: Any = read(path, columns, options.fs, None, options.what, options.units, options.resample)
        if channel_map and options.what in (None, "channels"):
            obj = read_channels(path, columns, options.fs, None, options.units, channel_map, options.resample)
        found[str(path)] = _shown(path, obj)
    if options.out is not None:
        _draw(obj, options.files[0], options.out)
        print(options.out)
    return {"files": found} | ({"out": str(options.out)} if options.out else {})


def _shown(path: Path, obj: object) -> dict[str, Any]:
    """Print what one file holds, and return it as plain data."""
    from ..io.channels import channel_faults
    from ..io.inventory import inventory

    items = inventory(obj)
    if not items:
        print(f"{path}: {obj!r}")
        return {"holds": type(obj).__name__, "overview": repr(obj)}
    counts: dict[str, int] = {}
    for item in items:
        counts[item.kind] = counts.get(item.kind, 0) + 1
    words = ", ".join(f"{count} x {kind}" for kind, count in counts.items())
    print(f"{path}: {words}")
    rows = [HEAD, *map(_row, items)]
    widths = [max(map(len, column)) for column in zip(*rows)]
    kept = [i for i in range(len(HEAD)) if any(row[i] for row in rows[1:])]
    for row in rows:
        print("  " + "  ".join(f"{row[i]:<{widths[i]}}" for i in kept).rstrip())
    hint, faults = _hint(path, items), channel_faults(obj) if isinstance(obj, list) else []
    print(*faults, *[hint] * bool(hint), sep="\n", end="\n" if hint or faults else "")
    return {"holds": counts, "functions": [i.summary() for i in items], "faults": faults, "hint": hint or None}


def _row(item: Item) -> tuple[str, ...]:
    from ..io.inventory import sparkline

    texts = (item.kind, item.name, item.place, item.quantity, item.unit, str(item.size), item.rate)
    numbers = ("" if value is None else f"{value:.4g}" for value in (item.rms, item.peak))
    cut = (text if len(text) <= WIDEST else f"{text[: WIDEST - 1]}…" for text in texts)
    return (*cut, *numbers, sparkline(item.course))


def _hint(path: Path, items: list[Item]) -> str:
    """What to do where a file does not say what was measured, or where."""
    if any(i.kind == "time record" and (i.quantity == "unknown" or not i.place) for i in items):
        return f"what is unknown or without a place: {spelled('map', path, '--rig', 'RIG')}"
    if any(i.kind == "FRF" and "unknown" in i.quantity for i in items):
        command = spelled("convert", path, "NEW", "--quantity", "acceleration/force [g/N]")
        return f"FRFs of unknown quantity: {command}"
    return ""


def _draw(obj: object, path: Path, out: Path) -> None:
    from ..core.provenance import MARK
    from ..report.contents_figure import contents_figure

    try:
        figure = contents_figure(obj)
    except ClearanceError as error:
        raise type(error)(f"{path}: {error}") from None
    kind = out.suffix[1:].lower()
    name = {"png": "Software", "svg": "Title", "pdf": "Subject"}[kind]
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, dpi=150, metadata={name: f"{MARK} show"})
    with replacing(out) as temporary:
        temporary.write_bytes(buffer.getvalue())
