"""Pages that need nothing else: no network, no script to read them. Templates are in the folder ``templates``.

A script in the page sorts tables, opens what a link leads to, and makes charts of figures with uPlot (MIT), which
is in the folder ``vendor`` as its authors published it. Templates escape text; what is markup already,
as all that these functions return, goes through the filter ``safe``.
"""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from ..rig import Rig
from ..rig.examples import example_words
from ..statistics.intervals import Interval
from .interactive import embedded
from .style import Drawing
from .tables import Table

__all__ = [
    "PageSection", "examples", "figure", "figures", "formula", "heading", "page", "paragraph", "render", "sentences",
    "table",
]  # fmt: skip

MISSING = "–"  # Shown for nan
_CHART = '<script type="application/json">'
_HEADING = re.compile(r'<h3 id="([^"]*)">(.*?)</h3>')


@dataclass(frozen=True)
class PageSection:
    """A part of the page with an entry in the table of contents; its headings ``<h3 id=...>`` have entries too."""

    anchor: str
    """name on the page"""
    title: str
    """heading"""
    body: str
    """markup"""


def paragraph(text: str, kind: str = "") -> str:
    """Return text, which may hold markup, as a paragraph of a CSS class such as "note" or "banner"."""
    return f'<p class="{kind}">{text}</p>\n' if kind else f"<p>{text}</p>\n"


def sentences(words: Iterable[str], kind: str = "") -> str:
    """Return plain sentences as paragraphs of a CSS class, each with a full stop at its end."""
    return "".join(paragraph(formula(f"{said.removesuffix('.')}."), kind) for said in words)


def formula(text: str) -> str:
    """Return plain text as markup, with H_t as a symbol with an index and φ^H as one with an exponent."""
    return re.sub(r"\^(\w)", r"<sup>\1</sup>", re.sub(r"([^\W_]+|Σ)_(\w+)", _index, str(escape(text))))


def _index(match: re.Match[str]) -> str:
    symbol, index = match.groups()
    is_word = len(symbol) > 1 or symbol == "Σ"
    return f"{symbol if is_word else f'<var>{symbol}</var>'}<sub>{index}</sub>"


def heading(anchor: str, title: str) -> str:
    """Return the heading of a part of a section, which the table of contents lists."""
    return f'<h3 id="{anchor}"><a href="#{anchor}">{escape(title)}</a></h3>\n'


def figure(drawing: Drawing, number: int, image: bytes) -> str:
    """Return a numbered figure with its caption and its image, SVG or PNG, inside; with a chart, the chart's data too.

    The image is what shows in print and where scripts are off.
    """
    kind = "png" if image.startswith(b"\x89PNG") else "svg+xml"
    source = f"data:image/{kind};base64,{base64.b64encode(image).decode('ascii')}"
    data = f"{_CHART}{embedded(drawing.figure)}</script>" if drawing.chart else ""
    return (
        f'<figure id="figure-{drawing.name}"><img src="{source}" alt="{escape(drawing.alt)}">\n'
        f"<figcaption><b>Figure {number}.</b> {escape(drawing.caption)}</figcaption>{data}</figure>\n"
    )


def figures(drawings: Iterable[Drawing]) -> str:
    """Return all figures of a page, numbered, as SVG where they are sharp."""
    return "".join(figure(d, number, d.svg() if d.sharp else d.png()) for number, d in enumerate(drawings, 1))


def examples(rig: Rig) -> str:
    """Return a banner that names the numbers of a rig that nobody gave; "" without any."""
    return paragraph(f"{escape(example_words(rig.examples))}.", "banner") if rig.examples else ""


def table(shown: Table, label: str = "", breaks: bool = False) -> str:
    """Return a table whose columns sort when the button in their heading is pressed: once upwards, again downwards.

    Its nan are shown as "–", its None as nothing; ``label`` stands before the caption, such as "Table 1."; ``breaks``
    draws a line where the first column changes.
    """
    by_group = groupby(enumerate(shown.columns), key=lambda item: item[1].group)
    groups = [{"name": name, "columns": list(columns)} for name, columns in by_group]
    return render("table.html.j2", shown=shown, label=label, breaks=breaks, groups=groups)


def page(title: str, sections: Sequence[PageSection], top: str = "") -> str:
    """Return the whole page: title, markup ``top``, table of contents and numbered sections."""
    charts = any(_CHART in section.body for section in sections)
    entries = [(section, _entries(section.body)) for section in sections]
    return render("page.html.j2", title=title, sections=entries, top=top, charts=charts)


def _entries(body: str) -> list[tuple[str, str]]:
    """Return anchors and words of a section's headings."""
    return [(anchor, re.sub(r"</?a\b[^>]*>", "", words)) for anchor, words in _HEADING.findall(body)]


def render(template: str, **values: object) -> str:
    """Return a template of this package filled in."""
    return _ENVIRONMENT.get_template(template).render(values)


def _number(value: float | None, form: str) -> str:
    if value is None:
        return ""
    return MISSING if math.isnan(value) else format(value, form)


_ENVIRONMENT = Environment(
    loader=ChoiceLoader([PackageLoader("clearance_mj.report", folder) for folder in ("templates", "vendor")]),
    undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    keep_trailing_newline=True, autoescape=lambda name: name is None or not name.endswith((".css", ".js")),
)  # fmt: skip
_ENVIRONMENT.tests.update(interval=lambda value: isinstance(value, Interval), finite=math.isfinite)
_ENVIRONMENT.filters.update({"number": _number, "repr": repr, "formula": lambda text: Markup(formula(text))})
_ENVIRONMENT.globals.update(
    heading=lambda anchor, title: Markup(heading(anchor, title)),
    table=lambda *args, **options: Markup(table(*args, **options)),
    zip=zip,
)
