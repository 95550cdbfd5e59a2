"""Tables in Markdown, and texts that a run puts into a page between marks such as <!-- lies --> and <!-- /lies -->."""

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from clearance_mj import ClearanceError
from clearance_mj.core.files import write_text


def markdown_table(rows: Iterable[Sequence[object]]) -> str:
    """Return rows, the first of which is the head, as a table in Markdown."""
    head, *body = rows
    return "".join(f"| {' | '.join(map(str, line))} |\n" for line in [head, ["---"] * len(head), *body])


def put_between_marks(page: Path, mark: str, text: str) -> None:
    """Replace what stands between the marks of a page, also "x: begin" and "x: end"; ClearanceError without them."""
    new, count = re.subn(
        rf"(<!-- {mark}(?:: begin)? -->\n).*?(<!-- (?:/{mark}|{mark}: end) -->)",
        lambda marks: marks[1] + text + marks[2], page.read_text(encoding="utf-8"), flags=re.DOTALL,
    )  # fmt: skip
    if not count:
        raise ClearanceError(f"{page}: has no marks <!-- {mark} --> and <!-- /{mark} -->")
    write_text(page, new)


def judged(
    path: Path, key: str, names: Iterable[Any], judge: Callable[[Any], pd.DataFrame], digits: str = "%.6g"
) -> pd.DataFrame:
    """Return the table of a CSV file after judging the names that its key column lacks; it is written after each."""
    rows = pd.read_csv(path, dtype={key: str}) if path.exists() else pd.DataFrame({key: []})
    for name in names:
        if str(name) not in set(rows[key]):
            rows = pd.concat([rows, judge(name).assign(**{key: str(name)})])
            path.parent.mkdir(parents=True, exist_ok=True)
            rows.to_csv(path, index=False, float_format=digits)
            print(f"{name}: {rows['seconds'].iloc[-1]:g} s", flush=True)
    return rows
