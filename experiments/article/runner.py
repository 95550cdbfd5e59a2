"""Compute items and write what they give; an item whose inputs have not changed is taken as it is."""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from clearance_mj.cache import code
from clearance_mj.errors import ClearanceError
from clearance_mj.files import replacing, to_json
from clearance_mj.report.html import Section
from clearance_mj.report.tables import write_csv

from .context import DATASET, Context
from .pages import index, markdown, section
from .published import FOLDER
from .registry import ITEMS, get_item, select

__all__ = ["main", "reproduce"]

PACKAGE = Path(__file__).parents[1]


def reproduce(
    names: Sequence[str] = (), out="results/reproduce", dataset=DATASET, quick: bool = False, progress: bool = True
) -> list[dict]:
    """Compute items of the article.

    Parameters
    ----------
    names : sequence of str
        Such as "figure_02"; none or "all": every item.
    out : str or Path
        Folder for NAME.png, .svg, .csv, .md and .json, and for index.html.
    dataset : str or Path
        Folder of the test records.
    quick : bool
        Take fewer noises, the laws that need no search, and the fastest engine.
    progress : bool
        Show a progress bar.

    Returns
    -------
    list of dict
        Of each item: name, title, files with their SHA-256.

    Raises
    ------
    ClearanceError
        For an unknown name, or if ``out`` is a file.
    """
    names, out = select(names), Path(out)
    if out.exists() and not out.is_dir():
        raise ClearanceError(f"--out {out} is a file; give a folder")
    digest = _digest(Path(dataset), quick)
    with tqdm(names, unit="item", disable=not progress) as bar:
        context = Context(dataset, quick, bar.set_postfix_str)
        records = []
        for name in bar:
            bar.set_description(name)
            kept = _kept(out, name, digest)
            records.append(kept or _compute(name, context, out, digest))
    _write_index(out, quick, digest)
    return [{key: r[key] for key in ("name", "title", "files")} for r in records]


def main(name: str, **parameters):
    """Compute one item from a script of its own: ``--out``, ``--dataset`` and ``--quick`` come from the command line.

    Parameters
    ----------
    name : str
        The item.
    **parameters
        Handed to its ``run``.
    """
    parser = argparse.ArgumentParser(description=f"{name} of the article, computed again")
    parser.add_argument("--out", type=Path, default=Path("results/reproduce"), help="folder (default: %(default)s)")
    parser.add_argument("--dataset", type=Path, default=DATASET, help="test records (default: %(default)s)")
    parser.add_argument("--quick", action="store_true", help="fewer noises, laws and engines")
    options = parser.parse_args()
    with tqdm(total=1, desc=name, unit="item") as bar:
        try:
            result = get_item(name)(Context(options.dataset, options.quick, bar.set_postfix_str), **parameters)
        except ClearanceError as error:
            bar.close()
            parser.error(str(error))
        _write(name, result, _draw(result), options.out)
        bar.update()
    print(result.shows)


def _compute(name, context, out, digest) -> dict:
    result = get_item(name)(context)
    context.stage("drawing")
    images = _draw(result)
    files = _write(name, result, images, out)
    hashes = {file: _hash(out / file) for file in files}
    record = {"name": name, "title": result.title, "inputs": digest, "files": hashes}
    with replacing(out / f"{name}.json") as temporary:
        temporary.write_text(to_json(record | {"section": section(result, images)}), encoding="utf-8")
    return record


def _draw(result) -> dict[str, bytes]:
    """Figures as PNG and SVG, by the file's name."""
    png = {f"{drawing.name}.png": drawing.png() for drawing in result.drawings}
    return png | {f"{drawing.name}.svg": drawing.svg() for drawing in result.drawings}


def _write(name, result, images, out) -> list[str]:
    """Write what an item gives; the names of the files."""
    for file, data in images.items():
        with replacing(out / file) as temporary:
            temporary.write_bytes(data)
    for file, rows in result.data.items():
        write_csv(out / f"{file}.csv", rows)
    with replacing(out / f"{name}.md") as temporary:
        temporary.write_text(markdown(name, result), encoding="utf-8")
    return [*images, *(f"{file}.csv" for file in result.data), f"{name}.md"]


def _kept(out, name, digest) -> dict | None:
    """What is known of an item that is whole and was computed from the same inputs."""
    path = out / f"{name}.json"
    if not path.exists():
        return None
    record = json.loads(path.read_text(encoding="utf-8"))
    whole = all((out / file).exists() and _hash(out / file) == known for file, known in record["files"].items())
    return record if whole and record["inputs"] == digest else None


def _hash(path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _write_index(out, quick, digest):
    """The page of every item that is there, computed now or before from the same inputs."""
    records = [record for name in ITEMS if (record := _kept(out, name, digest))]
    sections = [Section(r["name"], r["title"], r["section"]) for r in records]
    with replacing(out / "index.html") as temporary:
        temporary.write_text(index(sections, quick), encoding="utf-8")


def _digest(dataset: Path, quick) -> str:
    """Of all that the items are computed from: this package and its libraries, the article's tables, the records."""
    digest = hashlib.sha256(f"{code()} {quick}".encode())
    files = [
        *PACKAGE.rglob("*.py"),
        *PACKAGE.rglob("*.toml"),
        *FOLDER.glob("*.csv"),
    ]
    files += [file for file in dataset.glob("*") if file.is_file()]
    for file in sorted(files):
        digest.update(file.name.encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
