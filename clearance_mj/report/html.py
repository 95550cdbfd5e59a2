"""How the report is written as one HTML file that needs nothing else: no network, no script to read it.

A script of its own sorts tables and opens what a link leads to.
"""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from itertools import groupby

from ..statistics.intervals import Interval
from .tables import Column, Table

__all__ = ["Picture", "Section", "details", "figure", "formula", "note", "page", "paragraph", "subsection", "table"]

MISSING = "–"
"""Shown for nan"""


@dataclass(frozen=True)
class Picture:
    """A figure ready to be put into the page."""

    name: str
    """anchor on the page"""
    number: int
    """of the figure"""
    data: bytes
    """the file"""
    kind: str
    """MIME type of the data"""
    caption: str
    """what it shows, in words"""
    alt: str
    """text for those who cannot see it"""

    @property
    def anchor(self) -> str:
        """Where links to the figure go."""
        return f"figure-{self.name}"


@dataclass(frozen=True)
class Section:
    """A part of the page with an entry in the table of contents."""

    anchor: str
    """name on the page"""
    title: str
    """heading"""
    body: str
    """markup"""


def paragraph(text: str, kind: str = "") -> str:
    """Return text, which may hold markup, as a paragraph of a CSS class.

    Parameters
    ----------
    text : str
        May hold markup.
    kind : str
        CSS class; none if empty.
    """
    return f'<p class="{kind}">{text}</p>\n' if kind else f"<p>{text}</p>\n"


def formula(text: str) -> str:
    """Return plain text as markup, with H_t as a symbol with an index and φ^H as one with an exponent.

    Parameters
    ----------
    text : str
        Plain text.
    """
    text = re.sub(r"([^\W_]+|Σ)_(\w+)", _indexed, escape(text))
    return re.sub(r"\^(\w)", r"<sup>\1</sup>", text)


def _indexed(match) -> str:
    symbol, index = match.groups()
    is_word = len(symbol) > 1 or symbol == "Σ"
    return f"{symbol if is_word else f'<var>{symbol}</var>'}<sub>{index}</sub>"


def note(text: str) -> str:
    """Return text, which may hold markup, as a note.

    Parameters
    ----------
    text : str
        May hold markup.
    """
    return paragraph(text, "note")


def subsection(anchor: str, title: str) -> str:
    """Return the heading of a part of a section, which the table of contents lists.

    Parameters
    ----------
    anchor : str
        Name on the page.
    title : str
        Heading.
    """
    return f'<h3 id="{anchor}">{_link(anchor, escape(title))}</h3>\n'


def details(anchor: str, summary: str, body: str) -> str:
    """Return a part that is folded away until the reader opens it.

    Parameters
    ----------
    anchor : str
        Where links to it go.
    summary : str
        What is seen while it is folded.
    body : str
        Markup.
    """
    return f'<details id="{anchor}"><summary>{escape(summary)}</summary>\n{body}</details>\n'


def figure(picture: Picture) -> str:
    """Return a numbered figure with its caption and its image inside.

    Parameters
    ----------
    picture : Picture
        The figure.
    """
    data = base64.b64encode(picture.data).decode("ascii")
    return (
        f'<figure id="{picture.anchor}"><img src="data:{picture.kind};base64,{data}" alt="{escape(picture.alt)}">\n'
        f"<figcaption><b>Figure {picture.number}.</b> {escape(picture.caption)}</figcaption></figure>\n"
    )


def table(shown: Table, label: str = "", breaks: bool = False) -> str:
    """Return a table whose columns sort when the button in their heading is pressed: once upwards, again downwards.

    Parameters
    ----------
    shown : Table
        Its nan are shown as "–" and its None as nothing.
    label : str
        What stands before the caption, such as "Table 1."
    breaks : bool
        Draw a line where the first column changes.
    """
    label = f"<b>{escape(label)}</b> " if label else ""
    head = f"<caption>{label}{escape(shown.caption)}</caption>\n<thead>\n{_headings(shown.columns)}</thead>\n"
    rows, previous = [], None
    for row in shown.rows:
        starts = breaks and previous is not None and row[0] != previous
        cells = "".join(_cell(value, column, i == 0) for i, (value, column) in enumerate(zip(row, shown.columns)))
        rows.append(f'<tr class="break">{cells}</tr>\n' if starts else f"<tr>{cells}</tr>\n")
        previous = row[0]
    return f'<div class="scroll"><table class="sortable">{head}<tbody>\n{"".join(rows)}</tbody></table></div>\n'


def _headings(columns: Sequence[Column]) -> str:
    if not any(c.group for c in columns):
        return "<tr>" + "".join(_heading(c, i, "") for i, c in enumerate(columns)) + "</tr>\n"
    upper, lower, i = [], [], 0
    for group, members in groupby(columns, key=lambda c: c.group):
        members = list(members)
        target = lower if group else upper
        if group:
            upper.append(f'<th scope="colgroup" colspan="{len(members)}">{escape(group)}</th>')
        target += [_heading(c, i + j, "" if group else ' rowspan="2"') for j, c in enumerate(members)]
        i += len(members)
    return f"<tr>{''.join(upper)}</tr>\n<tr>{''.join(lower)}</tr>\n"


def _heading(column, index, span) -> str:
    unit = f' <span class="unit">{escape(column.unit)}</span>' if column.unit else ""
    kind = ' class="number"' if column.form else ""
    button = f'<button type="button">{escape(column.label)}{unit}</button>'
    return f'<th scope="col" data-column="{index}"{kind}{span}>{button}</th>'


def _cell(value, column, first) -> str:
    if isinstance(value, Interval):
        return _interval_cell(value, column.form)
    words = isinstance(value, str)
    text = escape(value) if words else _number(value, column.form)
    kind = "" if words else ' class="number"'
    return f'<th scope="row"{kind}>{text}</th>' if first else f"<td{kind}>{text}</td>"


def _interval_cell(interval, form) -> str:
    """The value, which the column sorts by, and its limits below."""
    text = _number(interval.value, form)
    if math.isfinite(interval.low):
        low, high = (_number(x, form) for x in (interval.low, interval.high))
        between, mark = " to " if "+" in form else "–", "*" if interval.doubtful else ""
        text += f'<span class="interval">{low}{between}{high}{mark}</span>'
    return f'<td class="number" data-value="{interval.value!r}">{text}</td>'


def _number(value, form) -> str:
    if value is None:
        return ""
    return MISSING if math.isnan(value) else format(value, form)


def page(title: str, sections: Sequence[Section], top: str = "") -> str:
    """Return the whole page.

    Parameters
    ----------
    title : str
        Heading of the page and title of its window.
    sections : sequence of Section
        Its parts, numbered in their order.
    top : str
        Markup between the heading and the table of contents.
    """
    entries = "".join(f"<li>{_link(s.anchor, escape(s.title))}{_subentries(s)}</li>\n" for s in sections)
    body = "".join(
        f'<section id="{s.anchor}">\n<h2>{_link(s.anchor, f"{i}. {escape(s.title)}")}</h2>\n{s.body}</section>\n'
        for i, s in enumerate(sections, 1)
    )
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{escape(title)}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<style>{_CSS}</style>\n</head>\n<body>\n<header>\n<h1>{escape(title)}</h1>\n{top}</header>\n"
        f'<nav aria-label="Contents">\n<ol>\n{entries}</ol>\n</nav>\n'
        f"<main>\n{body}</main>\n<script>{_SCRIPT}</script>\n</body>\n</html>\n"
    )


def _link(anchor, markup) -> str:
    return f'<a href="#{anchor}">{markup}</a>'


def _subentries(section) -> str:
    found = re.findall(r'<h3 id="[^"]*">(.*?)</h3>', section.body)
    return f"\n<ul>{''.join(f'<li>{link}</li>' for link in found)}</ul>" if found else ""


_CSS = """
:root { --ink: #1a1d21; --soft: #5b636e; --line: #d4d9df; --paper: #fff; --tint: #f4f6f8; --link: #0059a6; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e7ea; --soft: #a3acb6; --line: #3d444d; --paper: #16191d; --tint: #20252b; --link: #7db8f0; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem 1.2rem 4rem; max-width: 68rem; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .6rem; }
h2 { font-size: 1.3rem; margin: 2.6rem 0 .6rem; padding-top: .6rem; border-top: 2px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.8rem 0 .4rem; }
a { color: var(--link); }
h2 a, h3 a { color: inherit; text-decoration: none; } :is(h2, h3) a:hover { text-decoration: underline; }
p, li, dd { max-width: 50rem; }
nav ol { margin: 1rem 0; padding: .7rem 1rem .7rem 2.4rem; background: var(--tint); border-radius: 4px; columns: 2; }
nav ul { margin: 0; padding-left: 1.1rem; list-style: none; font-size: .88rem; } nav ol > li { break-inside: avoid; }
.banner { border-left: 6px solid #d55e00; background: #fdeee3; color: #1a1d21; padding: .6rem .9rem; max-width: none; }
.verdict { font-size: 1.15rem; border-left: 6px solid #0072b2; background: var(--tint); padding: .6rem .9rem; }
.note, figcaption, caption, .unit { color: var(--soft); }
.note, figcaption, caption { font-size: .88rem; }
.unit { font-weight: normal; }
figure { margin: 1.2rem 0; }
figure img { display: block; width: 100%; max-width: 60rem; height: auto; background: #fff; padding: 4px; }
figcaption { margin-top: .35rem; max-width: 50rem; }
.scroll { overflow-x: auto; margin: 1rem 0; }
.beside { display: flex; flex-wrap: wrap; gap: 0 2rem; align-items: flex-start; }
table { border-collapse: collapse; font-size: .86rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; padding: 0 0 .35rem; }
th, td { padding: .18rem .4rem; text-align: left; border-bottom: 1px solid var(--line); vertical-align: bottom; }
.number { text-align: right; }
.interval { display: block; color: var(--soft); font-size: .85em; line-height: 1.1; white-space: nowrap; }
thead th { border-bottom: 1.5px solid var(--soft); }
thead th[scope=colgroup] { text-align: center; border-left: 1px solid var(--line); }
tbody th { font-weight: normal; }
tbody tr.break > * { border-top: 2px solid var(--soft); }
tbody tr:hover { background: var(--tint); }
th button { all: unset; cursor: pointer; } th button:hover { text-decoration: underline; }
th button:focus-visible { outline: 2px solid var(--link); outline-offset: 2px; }
th[aria-sort=ascending] button::after { content: " ▲"; } th[aria-sort=descending] button::after { content: " ▼"; }
details { margin: .8rem 0; border: 1px solid var(--line); border-radius: 4px; padding: 0 .9rem; }
summary { cursor: pointer; padding: .5rem 0; font-weight: 600; }
code, pre { font: .88em/1.5 ui-monospace, Consolas, monospace; background: var(--tint); }
pre { padding: .7rem .9rem; overflow-x: auto; }
dt { font-weight: 600; margin-top: .7rem; } dd { margin: .1rem 0 0 1.2rem; }
sub, sup { font-size: .72em; line-height: 0; }
.formula { font-family: "Cambria Math", "STIX Two Math", Georgia, serif; font-size: 1.05em; }
@media (max-width: 40rem) { nav ol { columns: 1; } }
@media print {
  :root { --ink: #000; --soft: #444; --line: #bbb; --paper: #fff; --tint: #fff; --link: #000; }
  body { max-width: none; padding: 0; font-size: 10pt; } nav { display: none; }
  figure, tr, .beside table { break-inside: avoid; } h2, h3, caption, summary { break-after: avoid; }
  .scroll { overflow: visible; } .banner { border: 2px solid #d55e00; } details { border: 0; padding: 0; } }
"""

_SCRIPT = """
const words = new Intl.Collator("en", {numeric: true});
for (const button of document.querySelectorAll("th[data-column] button")) button.addEventListener("click", () => {
  const heading = button.parentElement, table = heading.closest("table"), body = table.tBodies[0];
  const up = heading.getAttribute("aria-sort") !== "ascending", sign = up ? 1 : -1;
  const key = row => {
    const cell = row.cells[heading.dataset.column], text = cell.dataset.value ?? cell.textContent;
    return cell.classList.contains("number") ? parseFloat(text) : text; };
  const missing = value => value === "" || Number.isNaN(value);  // last, whichever way
  const order = (a, b) => missing(a) || missing(b) ? missing(a) - missing(b)
    : typeof a === typeof b ? sign * (typeof a === "number" ? a - b : words.compare(a, b))
    : typeof a === "number" ? -1 : 1;
  for (const other of table.querySelectorAll("[aria-sort]")) other.removeAttribute("aria-sort");
  for (const row of table.querySelectorAll(".break")) row.classList.remove("break");
  heading.setAttribute("aria-sort", up ? "ascending" : "descending");
  body.append(...[...body.rows].sort((a, b) => order(key(a), key(b))));
});
const reveal = () => {
  for (let part = document.getElementById(location.hash.slice(1)); part; part = part.parentElement)
    if (part.tagName === "DETAILS") part.open = true; };
reveal();
addEventListener("hashchange", reveal);
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(part => part.open = true));
"""
