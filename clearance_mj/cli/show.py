"""clearance-mj show: what a file holds, function by function, as a table or a picture."""

from __future__ import annotations

import argparse
import io
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.checks import naming
from ..core.errors import ClearanceError
from ..core.files import replacing
from .command import command, out_file, spelled
from .options import add_files, reading

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..io.inventory import Item

PICTURES = (".png", ".svg", ".pdf")
WIDEST = 34  # characters of a cell
HEAD = ("kind", "name", "place", "quantity", "unit", "samples", "rate", "RMS", "peak", "course")


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("files", nargs="+", type=Path, metavar="FILE", help="files of any format, or dataset folders")
    option("--what", help='of a file that holds several things: channels, frf, "frf 2", spectra, modes, geometry')
    add_files(parser)


@command(
    "show", "show what a file holds: names, places, quantities, units, rates, levels", _options,
    out_help=f"picture to write of one file ({', '.join(PICTURES)})",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..core.provenance import is_marked
    from ..io.formats import read, read_channels

    if options.out is not None:
        if len(options.files) > 1:
            raise ClearanceError(f"--out {options.out}: one picture is drawn of one file, got {len(options.files)}")
        out_file(options.out, PICTURES, options.files, is_marked)
    given = reading(options)
    plain = {name: value for name, value in given.items() if name != "channel_map"}
    found = {}
    for path in options.files:
        obj: Any = read(path, what=options.what, **plain)
        if options.map and options.what in (None, "channels"):
            obj = read_channels(path, **given)
        found[str(path)] = _shown(path, obj)
    if options.out is not None:
        _draw(obj, options.files[0], options.out)
        print(options.out)
    return {"files": found} | ({"out": str(options.out)} if options.out else {})


def _shown(path: Path, obj: object) -> dict[str, Any]:
    """Print what one file holds, and return it as plain data."""
    from ..io.channels import channel_faults
    from ..io.inventory import inventory

    if not (items := inventory(obj)):
        print(f"{path}: {obj!r}")
        return {"holds": type(obj).__name__, "overview": repr(obj)}
    counts = Counter(item.kind for item in items)
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

    with naming(path, ClearanceError):
        figure = contents_figure(obj)
    kind = out.suffix[1:].lower()
    name = {"png": "Software", "svg": "Title", "pdf": "Subject"}[kind]
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, dpi=150, metadata={name: f"{MARK} show"})
    with replacing(out) as temporary:
        temporary.write_bytes(buffer.getvalue())
