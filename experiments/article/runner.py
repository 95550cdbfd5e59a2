"""Compute items and write what they give; an item whose inputs have not changed is taken as it is."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from tqdm import tqdm

from clearance_mj.core.cache import code, digest
from clearance_mj.core.errors import ClearanceError
from clearance_mj.core.files import plain_file, sha256, to_json, write_text
from clearance_mj.core.output_folder import output_folder
from clearance_mj.report.html import PageSection

from .inputs import DATASET, Inputs
from .items import ITEMS, Item, select
from .pages import index, markdown, section
from .published import FOLDER
from .result import Result

SOURCES = Path(__file__).parent
CHANGED = ".changed"  # Suffix under which files are kept that were changed, or damaged, since they were written


def reproduce(
    names: Sequence[str] = (), out: str | Path = "results/reproduce", dataset: str | Path = DATASET,
    quick: bool = False, progress: bool = True,
) -> list[dict]:  # fmt: skip
    """Compute items of the article.

    Parameters
    ----------
    names : sequence of str
        Such as "figure_02"; none or "all": every item.
    out : str or Path
        Folder for NAME.png, .svg, .csv, .md and .json, for index.html, and for the folder ``cache`` of laws and cases.
    dataset : str or Path
        Folder of the test records.
    quick : bool
        Take fewer noises, the laws that need no search, and the fastest engine.
    progress : bool
        Show progress bars.

    Returns
    -------
    list of dict
        Of each item: name, title, files with their SHA-256.

    Raises
    ------
    ClearanceError
        For an unknown name, or if ``out`` is a file.
    """
    items, out = select(names), Path(out)
    if out.exists() and not out.is_dir():
        raise ClearanceError(f"--out {out} is a file; give a folder")
    inputs, digests, records = Inputs(dataset, quick, out / "cache", progress), _digests(Path(dataset), quick), []
    computed = 0
    with tqdm(items, unit="item", disable=not progress) as bar:
        for item in bar:
            bar.set_description(item.name)
            kept = _kept(out, item.name, digests)
            computed += kept is None
            records.append(kept or _compute(out, item, inputs, digests[item.name]))
    if computed == len(ITEMS):
        inputs.cache.drop_unused()
    _write_index(out, Path(dataset), quick, digests)
    return [{key: r[key] for key in ("name", "title", "files")} for r in records]


def _compute(out: Path, item: Item, inputs: Inputs, inputs_digest: str) -> dict:
    result = item.run(inputs)
    images = {f"{drawing.name}.png": drawing.png() for drawing in result.drawings}
    images |= {f"{drawing.name}.svg": drawing.svg() for drawing in result.drawings}
    with output_folder(out, f"reproduce {item.name}", [inputs.path], aside=CHANGED) as folder:
        hashes = {file: sha256(folder.new / file) for file in _write(folder.new, item, result, images)}
        record = {"name": item.name, "title": item.title, "inputs": inputs_digest, "files": hashes}
        write_text(folder.new / f"{item.name}.json", to_json(record | {"section": section(item, result, images)}))
    return record


def _write(out: Path, item: Item, result: Result, images: dict[str, bytes]) -> list[str]:
    """Write what an item gives; the names of the files."""
    content = {**images, **{f"{name}.csv": table.to_csv(index=False).encode() for name, table in result.data.items()}}
    content[f"{item.name}.md"] = markdown(item, result).encode()
    for file, data in content.items():
        (out / file).write_bytes(data)
    return [*content]


def _kept(out: Path, name: str, digests: Mapping[str, str]) -> dict | None:
    """Return what is stored of a complete item that was computed from the same inputs; None if there is none."""
    path = out / f"{name}.json"
    try:
        record = json.loads(plain_file(path).read_text(encoding="utf-8"))
        whole = all(sha256(plain_file(out / file)) == known for file, known in record["files"].items())
        return record if whole and record["inputs"] == digests[name] else None
    except (OSError, ValueError, LookupError, TypeError, AttributeError):  # not there, damaged, or somebody else's
        return None


def _write_index(out: Path, dataset: Path, quick: bool, digests: Mapping[str, str]) -> None:
    """The page of every item that is there, computed now or before from the same inputs."""
    records = [record for name in ITEMS if (record := _kept(out, name, digests))]
    sections = [PageSection(r["name"], r["title"], r["section"]) for r in records]
    with output_folder(out, "reproduce", [dataset], aside=CHANGED) as folder:
        write_text(folder.new / "index.html", index(sections, quick))


def _digests(dataset: Path, quick: bool) -> dict[str, str]:
    """Of all that each item is computed from: package, libraries, these sources, the article's tables, the records."""
    sources = [*SOURCES.rglob("*.py"), SOURCES / "texts.toml", *FOLDER.glob("*.csv")]
    data, records = (
        sorted((file.name, sha256(file)) for file in files if file.is_file()) for files in (sources, dataset.glob("*"))
    )
    return {
        item.name: digest(code(()), item.name, quick, data, records if {"rig", "study"} & set(item.needs) else [])
        for item in ITEMS.values()
    }
