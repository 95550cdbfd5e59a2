"""A section of a study in space: once for each direction and spin, the main one open, the others folded away."""

from __future__ import annotations

import re
from collections.abc import Callable

from ...study import Study
from ..html import render

__all__ = ["by_part"]

_ANCHOR = re.compile(r'(id="|href="#)([^"]*)"')


def by_part(study: Study, write: Callable[[Study], str]) -> str:
    """Return what a function writes of a study, or of each of its parts under a heading; anchors differ then.

    Parameters
    ----------
    study : Study
        The study.
    write : callable
        Returns the markup of a study of one direction and spin.
    """
    if study.parts == (study,):
        return write(study)
    parts = sorted(study.parts, key=lambda part: part is not study.main_part)
    shown = [(part, _with_suffix(write(part), part.suffix)) for part in parts]
    return render("parts.html.j2", shown=shown) if shown else "<p>No record is driven by its base or a force.</p>\n"


def _with_suffix(body: str, end: str) -> str:
    """Return markup whose anchors, and the links to them, end with the part's suffix."""
    anchors = {anchor for kind, anchor in _ANCHOR.findall(body) if kind.startswith("id") and end not in anchor}

    def renamed(match: re.Match[str]) -> str:
        kind, anchor = match.groups()
        return f'{kind}{anchor}{end}"' if anchor in anchors else match.group()

    return _ANCHOR.sub(renamed, body)
