"""The table of docs/robustness.md out of what a run has counted."""

import re
from pathlib import Path

from clearance_mj.files import replacing

COLUMNS = {
    "inputs": "inputs",
    "distinct": "distinct",
    "read": "read",
    "refused": "refused",
    "kinds_of_refusal": "kinds of refusal",
    "crashed": "crashed",
    "hung": "hung",
    "memory": "> 500 MB",
    "escaped": "other exception",
    "unclear": "unclear message",
    "memory_growth_mb": "growth of memory, MB",
}
_TABLE = re.compile(r"(<!-- fuzz -->\n).*?(<!-- /fuzz -->)", re.DOTALL)


def fill(path, summary):
    """Put the table between its marks."""
    path = Path(path)
    text = path.read_text(encoding="utf-8")
    if not _TABLE.search(text):
        raise SystemExit(f"{path}: has no <!-- fuzz --> ... <!-- /fuzz -->")
    with replacing(path) as temporary:
        temporary.write_text(_TABLE.sub(lambda marks: marks[1] + table(summary) + marks[2], text), encoding="utf-8")


def table(summary) -> str:
    """Rows of Markdown: one for each reader, then the sums."""
    rows = {name: [found[key] for key in COLUMNS] for name, found in summary["readers"].items()}
    sums = [sum(column) for column in zip(*rows.values())]
    sums[-1] = max(row[-1] for row in rows.values())
    lines = [f"| reader | {' | '.join(COLUMNS.values())} |", f"|---|{'---:|' * len(COLUMNS)}"]
    lines += [f"| {name} | {' | '.join(f'{v:,}' for v in row)} |" for name, row in (*rows.items(), ("sum", sums))]
    return "\n" + "\n".join(lines) + "\n\n"
