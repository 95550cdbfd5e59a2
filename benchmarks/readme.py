"""Put the last study and benchmark into docs/results.md and docs/benchmarks.md: ``python -m benchmarks.readme``."""

import csv
import json
import re
import shutil
from pathlib import Path

from clearance_mj.core.files import replacing

from . import figures, tables

RESULTS, PAGE = Path("docs/results.md"), Path("docs/benchmarks.md")
LINKS = Path("docs/benchmarks_links.csv")
STUDY, BENCH = Path("results/study"), Path("results/bench.json")


def main():
    bench = json.loads(BENCH.read_text()) if BENCH.exists() else {}
    if (STUDY / "summary.json").exists():
        _put(RESULTS, {"study": tables.study(json.loads((STUDY / "summary.json").read_text()))})
        shutil.copyfile(STUDY / "figures" / "frf_bushings_level_2.png", "docs/frf_bushings.png")
    blocks = {"bench": tables.speed(bench["speed"])} if "speed" in bench else {}
    for part in bench.keys() - {"speed", "options"}:
        if table := getattr(tables, part, None):
            blocks |= table(bench[part])
    _put(PAGE, blocks)
    if "options" in bench:
        write_table(LINKS, tables.links(bench["options"]))
    if "alternatives" in bench:
        _save(figures.alternatives(bench["alternatives"]), "alternatives")
    if "scaling" in bench:
        _save(figures.scaling(bench["scaling"]), "scaling")
    if "drives" in bench:
        _save(figures.drives(bench["drives"]), "drives")
    if {"alternatives", "scaling"} <= set(bench):
        _save(figures.steps(bench["scaling"], bench["alternatives"]), "steps")


def _put(path, blocks):
    """Replace what stands between the two comments of each name."""
    text = path.read_text(encoding="utf-8")
    for name, block in blocks.items():
        if block:
            pattern = re.compile(f"(<!-- {name} -->\n).*?(<!-- /{name} -->)", re.DOTALL)
            text = pattern.sub(lambda match, block=block: f"{match[1]}\n{block}\n{match[2]}", text)
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_table(path, rows):
    """Write rows of text as CSV."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def _save(figure, name):
    with replacing(Path(f"docs/benchmark_{name}.png")) as temporary:
        figure.savefig(temporary, format="png", dpi=150)


if __name__ == "__main__":
    main()
