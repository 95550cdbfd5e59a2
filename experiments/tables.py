"""Tables in Markdown, and texts that a run puts into a page between marks such as <!-- lies --> and <!-- /lies -->."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from clearance_mj import ClearanceError
from clearance_mj.core.files import write_text


def markdown_table(rows: Iterable[Sequence[object]]) -> str:
    """Return rows, the first of which is the head, as a table in Markdown."""
    head, *body = rows
    return "".join(f"| {' | '.join(map(str, line))} |\n" for line in [head, ["---"] * len(head), *body])


def put_between_marks(page: Path, mark: str, text: str) -> None:
    """Replace what stands between the marks of a page; a ClearanceError says that it has none."""
    old = page.read_text(encoding="utf-8")
    new, count = re.subn(
        rf"(<!-- {mark} -->\n).*?(<!-- /{mark} -->)", lambda marks: marks[1] + text + marks[2], old, flags=re.DOTALL
    )
    if not count:
        raise ClearanceError(f"{page}: has no marks <!-- {mark} --> and <!-- /{mark} -->")
    write_text(page, new)
