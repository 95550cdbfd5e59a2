"""An item in words, figures and tables: as a section of the index page, and as a page of the documentation."""

import base64
import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from clearance_mj.report import html
from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Table
from clearance_mj.statistics.intervals import Interval

from .result import Item, Result

SVG_LIMIT = 600_000  # bytes, above which the index page shows the PNG
PRIOR = "Prior information"


def _words(item: Item, result: Result) -> list[tuple[str, str]]:
    """Headings and texts, in the order of reading."""
    parts = [
        ("The article", item.texts.get("article")),
        ("Method", " ".join(filter(None, (item.texts.get("method", result.method), item.texts.get("models"))))),
        ("Results", result.shows),
        ("Differences", item.texts.get("differs")),
    ]
    return [(heading, text) for heading, text in parts if text]


def section(item: Item, result: Result, images: Mapping[str, bytes]) -> str:
    """Return an item as a section's markup, which needs no other file; images are PNG and SVG by the file's name."""
    parts = [_figure(drawing, images) for drawing in result.drawings]
    parts += [f"<h3>{heading}</h3>\n{html.paragraph(escape(text))}" for heading, text in _words(item, result)]
    if result.prior_information and "models" not in item.texts:
        entries = "".join(
            f"<dt>{escape(model)}</dt><dd>{escape(text)}</dd>\n" for model, text in result.prior_information.items()
        )
        parts.append(f"<h3>{PRIOR}</h3>\n<dl>{entries}</dl>\n")
    parts += [html.table(table) for table in (*result.tables, *result.details)]
    files = ", ".join(f'<a href="{file}.csv">{file}.csv</a>' for file in result.data)
    return "".join(parts) + (html.paragraph(f"Numbers: {files}.", "note") if files else "")


def _figure(drawing: Drawing, images: Mapping[str, bytes]) -> str:
    png, svg = (images[f"{drawing.name}.{suffix}"] for suffix in ("png", "svg"))
    data, kind = (svg, "svg+xml") if len(svg) <= SVG_LIMIT else (png, "png")
    source = f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"
    caption = html.paragraph(escape(drawing.caption), "note")
    return f'<figure><img src="{source}" alt="{escape(drawing.alt)}">\n<figcaption>{caption}</figcaption></figure>\n'


def index(sections: Sequence[html.PageSection], quick: bool) -> str:
    """Return the index page, which says so if the items were computed in the quick way."""
    text = "The test here is a virtual rig: its records are <strong>synthetic</strong>, not measured."
    if quick:
        text += " Computed with --quick: fewer noises, laws and engines."
    return html.page("The article’s figures and tables, computed again", sections, html.paragraph(text, "banner"))


def markdown(item: Item, result: Result) -> str:
    """Return an item as a page in Markdown, with its figures beside it as PNG."""
    parts = [f"# {item.title}"]
    parts += [f"![{d.alt}]({d.name}.png)\n\n{d.caption}" for d in result.drawings]
    parts += [f"## {heading}\n\n{text}" for heading, text in _words(item, result)]
    if result.prior_information and "models" not in item.texts:
        parts.append(
            f"## {PRIOR}\n\n"
            + "\n".join(f"- **{model}**: {words}" for model, words in result.prior_information.items())
        )
    parts += [markdown_table(table) for table in result.tables]
    return "\n\n".join(parts) + "\n"


def markdown_table(table: Table) -> str:
    heads = [" ".join(filter(None, (c.group, c.label, f"({c.unit})" if c.unit else ""))) for c in table.columns]
    rows = [[_cell(value, c.form) for value, c in zip(row, table.columns)] for row in table.rows]
    rule = ["---:" if c.form else "---" for c in table.columns]
    return f"{table.caption}\n\n" + "\n".join(f"| {' | '.join(row)} |" for row in (heads, rule, *rows))


def _cell(value: Any, form: str) -> str:
    if isinstance(value, Interval):
        limits = f" ({_cell(value.low, form)} to {_cell(value.high, form)})" if math.isfinite(value.low) else ""
        return _cell(value.value, form) + limits
    if value is None or isinstance(value, str):
        return value or ""
    return html.MISSING if math.isnan(value) else format(value, form)
