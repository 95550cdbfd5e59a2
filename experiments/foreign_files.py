"""Contents that are read from files of other programs, file by file: ``python -m experiments.foreign_files``.

The files are in the folder that the environment variable CLEARANCE_FOREIGN_FILES names, or in ../shared/data/foreign
beside the project; they are not this project's to hand on. ``--page docs/files.md`` writes the table of that page anew,
which has a row for each folder of files.
"""

import itertools
import os
import re
import sys
import warnings
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import clearance_mj as cm
from clearance_mj.core.errors import RecordError
from clearance_mj.io.contents import FileContents
from clearance_mj.io.inventory import inventory
from clearance_mj.io.registry import FORMATS
from clearance_mj.universal import contents, scan
from clearance_mj.universal.fields import named_sets
from experiments.script import run
from experiments.tables import markdown_table, put_between_marks

ROOT = Path(__file__).parents[1]
FOLDER = Path(os.environ.get("CLEARANCE_FOREIGN_FILES", ROOT.parent / "shared" / "data" / "foreign"))
TABLE = re.compile(r"(<!-- foreign -->\n).*?(<!-- /foreign -->)", re.DOTALL)
WRITERS = {
    b"LMS Test.Lab": "LMS Test.Lab", b"catman": "HBM catman", b"VibControl": "VibControl", b"Tamara": "Tamara",
    b"AutoSpectrum": "HEAD Artemis", b"DT9837": "Data Translation", b".svd": "Polytec", b"SMESH": "SALOME",
    b"nxopen": "Simcenter", b"NX ": "Simcenter", b"artemis": "Artemis", b"oros": "Oros", b"LabVIEW": "LabVIEW",
}  # fmt: skip
"""Programs by a mark in the head or the name of a file"""
UNIVERSAL = (".uff", ".unv", ".uf", ".bunv", ".ufb")


def files(folder: Path = FOLDER) -> list[Path]:
    """Return the files of a folder of folders that a format of this package could read; none if it is not there."""
    return sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix.lower() in FORMATS)


def row(path: Path) -> tuple[str, str, str, str]:
    """Return name, writer, what a file holds, and what is read of it or said instead."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            read = _words(cm.read(path))
        except RecordError as error:
            read = str(error).removeprefix(f"{path}: ")
    notes = [str(warning.message).removeprefix(f"{path}: ") for warning in caught]
    said = "; ".join([read, *(f"said: {note}" for note in notes[:1])]).replace(f"{path.parent}{os.sep}", "")
    return f"{path.parent.name}/{path.name}", _writer(path), _held(path), said


def _writer(path: Path) -> str:
    head = path.read_bytes()[:3000]
    writers = [name for mark, name in WRITERS.items() if mark in head or mark in path.name.lower().encode()]
    return writers[0] if writers else ""


def _held(path: Path) -> str:
    """Data sets of a universal file, with the function types among them."""
    if path.suffix.lower() not in UNIVERSAL:
        return f"{path.suffix[1:].upper()}, {len(path.read_bytes())} bytes"
    file_contents = scan(contents(path), cm.universal.fields.SI)
    types = dict.fromkeys(f"{function.type_name} ({function.kind})" for function in file_contents.functions)
    sets = named_sets(block.kind for block in file_contents.blocks)
    return ", ".join(filter(None, [f"58: {', '.join(types)}" if types else "", sets]))


def _words(obj: object) -> str:
    if isinstance(obj, FileContents):
        return "; ".join(map(_words, obj.parts.values()))
    items = inventory(obj)
    first = items[0]
    if first.kind == "geometry":
        return f"geometry: {first.size} nodes, {first.rate}"
    kinds = f"{len(items)} {_plural(first.kind) if len(items) > 1 else first.kind}"
    unit = f" in {first.unit}" if first.unit else ""
    return f"{kinds}: {first.quantity}{unit}, {first.size} {'values' if first.kind == 'mode' else 'samples'}"


def summary(rows: Sequence[tuple[str, str, str, str]]) -> str:
    """Return rows of Markdown, one for each folder: files, programs, objects that are read, and files without any."""
    lines = [("source", "files", "programs", "objects read", "files without an object", "files refused")]
    for folder, group in itertools.groupby(rows, lambda each: each[0].partition("/")[0]):
        of = list(group)
        programs = ", ".join(sorted({writer for _, writer, _, _ in of if writer}))
        reads = [read.partition("; said: ")[0] for _, _, _, read in of]
        objects = sum(map(_objects, reads), Counter[str]())
        counted = ", ".join(f"{n} {_plural(kind) if n > 1 else kind}" for kind, n in objects.items())
        empty = sum("only; there is no" in read for read in reads)
        lines.append((f"`{folder}`", len(of), programs, counted, empty, sum(not _objects(r) for r in reads) - empty))
    return markdown_table(lines)


def _objects(read: str) -> Counter[str]:
    """Kinds of the objects that are read of a file, and how many there are of each."""
    matches = re.findall(r"(?:^|; )(?:(\d+) ([a-zA-Z ]+)|(geometry)): ", read)
    kinds = (re.sub("spectra$", "spectrum", kind).removesuffix("s") or other for _, kind, other in matches)
    return Counter({kind: int(number or 1) for kind, (number, _, _) in zip(kinds, matches)})


def _plural(kind: str) -> str:
    return re.sub("ys$", "ies", f"{kind}s").replace("spectrums", "spectra")


def main(folder: Path = FOLDER, page: Path | None = None) -> None:
    """Print the table of files, or write that of folders into a page."""
    rows = [row(path) for path in files(folder)]
    if not rows:
        raise RecordError(f"{folder}: no file is there; name the folder by CLEARANCE_FOREIGN_FILES")
    if page:
        put_between_marks(page, "foreign", f"\n{summary(rows)}\n")
        return
    heads = ("file", "writer", "holds", "what is read, or said instead")
    print(markdown_table([heads, *((f"`{name}`", *held, read.replace("|", "\\|")) for name, *held, read in rows)]))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
