"""Sections of a study's report: one registration each, in the order of their numbers.

A section is a function that takes the study and the `ReportWriter`, which writes its figures and CSV files, and
returns its markup, or "" where the study has nothing for it::

    @section("energy", "Energy balance", place=45)
    def energy(study, writer):
        return writer.figure(draw(study)) + paragraph("...")
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from typing import NamedTuple

from ...study import Study
from ..writer import ReportWriter

__all__ = ["SECTIONS", "RegisteredSection", "registered_sections", "section"]

SectionFunction = Callable[[Study, ReportWriter], str]


class RegisteredSection(NamedTuple):
    """A section and where it stands."""

    place: float
    """sections stand in the order of this number; those of the package have 10, 20 and so on"""
    title: str
    """heading"""
    write: SectionFunction
    """returns its markup"""


SECTIONS: dict[str, RegisteredSection] = {}
"""Sections by the anchor on the page"""


def section(anchor: str, title: str, place: float = 65) -> Callable[[SectionFunction], SectionFunction]:
    """Register a function as a section of every report; another one of the same anchor is replaced.

    Parameters
    ----------
    anchor : str
        Name on the page.
    title : str
        Heading of the section.
    place : float
        Place in the report, see `RegisteredSection`; by default before the definitions.
    """

    def register(write: SectionFunction) -> SectionFunction:
        SECTIONS[anchor] = RegisteredSection(place, title, write)
        return write

    return register


def registered_sections() -> list[tuple[str, RegisteredSection]]:
    """Return all sections in their order, those of the package included."""
    for module in pkgutil.iter_modules(__path__, f"{__name__}."):
        importlib.import_module(module.name)
    return sorted(SECTIONS.items(), key=lambda item: item[1].place)
