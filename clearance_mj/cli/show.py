"""clearance-mj show: what a file holds, function by function, as a table or a picture."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from ..core.checks import naming
from ..core.errors import ClearanceError
from ..core.files import replacing
from ..core.provenance import MARK
from ..io.channels import channel_faults
from ..io.inventory import Item, inventory, sparkline
from ..report.contents_figure import contents_figure
from .command import Options, Result, command, option, spelled
from .options import FILES, WHAT, read_file

PICTURES = (".png", ".svg", ".pdf")
WIDEST = 34  # characters of a cell
HEAD = ("kind", "name", "place", "quantity", "unit", "samples", "rate", "RMS", "peak", "course")


@command(
    "show",
    option("files", "files of any format, or dataset folders", Path, nargs="+", metavar="FILE"),
    WHAT, *FILES,
    out_help=f"picture to write of one file ({', '.join(PICTURES)})",
    suffixes=PICTURES,
)  # fmt: skip
def run(options: Options) -> Result:
    """Show what a file holds: names, places, quantities, units, rates, levels."""
    if options.out is not None and len(options.files) > 1:
        raise ClearanceError(f"--out {options.out}: one picture is drawn of one file, got {len(options.files)}")
    result, words = {}, []
    for path in options.files:
        obj = read_file(path, options)
        result[str(path)], said = _describe(path, obj)
        words += said
    if options.out is not None:
        _draw(obj, options.files[0], options.out)
        words.append(str(options.out))
    return Result({"files": result}, words)


def _describe(path: Path, obj: object) -> tuple[dict[str, Any], list[str]]:
    """Return the contents of a file, as plain data and in words."""
    if not (items := inventory(obj)):
        return {"holds": type(obj).__name__, "overview": repr(obj)}, [f"{path}: {obj!r}"]
    counts = Counter(item.kind for item in items)
    rows = [HEAD, *map(_table_row, items)]
    widths = [max(map(len, column)) for column in zip(*rows)]
    kept = [i for i in range(len(HEAD)) if any(row[i] for row in rows[1:])]
    words = [f"{path}: {', '.join(f'{count} x {kind}' for kind, count in counts.items())}"]
    words += ["  " + "  ".join(f"{row[i]:<{widths[i]}}" for i in kept).rstrip() for row in rows]
    hint, faults = _hint(path, items), channel_faults(obj) if isinstance(obj, list) else []
    data = {"holds": counts, "functions": [i.summary() for i in items], "faults": faults, "hint": hint or None}
    return data, [*words, *faults, *[hint] * bool(hint)]


def _table_row(item: Item) -> tuple[str, ...]:
    texts = (item.kind, item.name, item.place, item.quantity, item.unit, str(item.size), item.rate)
    numbers = ("" if value is None else f"{value:.4g}" for value in (item.rms, item.peak))
    cut = (text if len(text) <= WIDEST else f"{text[: WIDEST - 1]}…" for text in texts)
    return (*cut, *numbers, sparkline(item.course))


def _hint(path: Path, items: list[Item]) -> str:
    """Return advice where a file does not say what was measured, or where."""
    if any(i.kind == "time record" and (i.quantity == "unknown" or not i.place) for i in items):
        return f"what is unknown or without a place: {spelled('map', path, '--rig', 'RIG')}"
    if any(i.kind == "FRF" and "unknown" in i.quantity for i in items):
        command = spelled("convert", path, "NEW", "--quantity", "acceleration/force [g/N]")
        return f"FRFs of unknown quantity: {command}"
    return ""


def _draw(obj: object, path: Path, out: Path) -> None:
    with naming(path, ClearanceError):
        figure = contents_figure(obj)
    kind = out.suffix[1:].lower()
    name = {"png": "Software", "svg": "Title", "pdf": "Subject"}[kind]
    with replacing(out) as temporary:
        figure.savefig(temporary, format=kind, dpi=150, metadata={name: f"{MARK} show"})
