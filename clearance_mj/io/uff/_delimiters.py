"""The lines between which the data sets of a universal file stand."""

from __future__ import annotations

import re

from ...errors import RecordError

BLANK = re.compile(rb"\s*")
OPEN = re.compile(rb"-1[ \t]*\r?\n")
CLOSE = re.compile(rb"(?:\r?\n)? {4}-1[ \t]*(?:\r?\n|\Z)")
_CLOSING_LINE = re.compile(rb"^ {4}-1[ \t]*(?:\r?\n|\Z)", re.MULTILINE)
KIND = re.compile(rb" *(\d{1,6})([bB]?)")


def closing_line(data: bytes, begin: int) -> tuple[int, int]:
    """Return where the text of a data set ends and where the next data set begins."""
    closing = _CLOSING_LINE.search(data, begin)
    if not closing:
        raise RecordError("has no closing line '    -1'; the file is cut short")
    return closing.start(), closing.end()
