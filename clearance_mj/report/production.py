"""Productions: how many touch, exceed a limit or may jump, as figures, rows and words, and the page around them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..periodic.axes import level_axis
from ..statistics.sobol import Sensitivity
from ..tolerance import Designs, Production, Tightening
from ..tolerance.shares import SHARES
from . import html
from .random_production import Hours
from .style import COLOURS, FONT, Drawing, canvas, colour_bar, frequency_ends, tidy
from .sweep import draw_sensitivity
from .tables import Column, Table
from .tightening import draw_tightening, tightening_table, tightening_words
from .writer import ReportWriter

__all__ = ["draw_over_level", "draw_shares", "rows", "words", "write_production"]

CONTOURS = (0.01, 0.1, 0.5, 0.9)


def _said(found: Production) -> dict[str, str]:
    """What the designs of each share do."""
    limited = {"exceeding": found.limit.words} if found.limit else {}
    return {"contact": "can touch", "from_rest": "touch if raised from rest"} | limited


def draw_shares(found: Production) -> Drawing:
    """Draw the shares that can touch, touch from rest, exceed the limit and may jump over frequency and level."""
    panels = _said(found) | {"several": "may jump"}
    figure = canvas(2.6)
    axes = np.ravel(figure.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False))
    for i, (ax, (name, title)) in enumerate(zip(axes, panels.items())):
        share = getattr(found, name)
        image = ax.pcolormesh(
            found.frequency, found.level, share, cmap="YlOrRd", vmin=0, vmax=1, shading="nearest", rasterized=True
        )
        if min(share.shape) > 1 and share.max() > CONTOURS[0]:
            lines = ax.contour(found.frequency, found.level, share, CONTOURS, colors="black", linewidths=0.6)
            ax.clabel(lines, fmt=lambda value: f"{100 * value:.0f} %", fontsize=FONT - 2)
        tidy(ax, title, level_axis(found.kind).title if i == 0 else "", "")
        ax.grid(False)
        frequency_ends(ax, found.frequency, "Frequency (Hz)", True)
    colour_bar(figure, image, axes, "Share of the designs (1)", pad=0.01, aspect=30)
    caption = (
        f"Shares of {found.designs} designs of rig “{found.nominal.rig.name}” over frequency and amplitude of a sine, "
        "of the largest of the vibrations that coexist; raised from rest: of that to which a level leads that is "
        "raised slowly. May jump: there is more than one vibration."
    )
    return Drawing("production", figure, caption, "Maps of the shares of designs over frequency and level.", False)


def draw_over_level(found: Production) -> Drawing:
    """Draw the share that can touch, touches from rest, or exceeds the limit, at any of the frequencies, over level."""
    figure = canvas(2.4)
    ax = figure.subplots()
    for colour, (what, label) in zip(COLOURS, _said(found).items()):
        share = found.over_level(what)
        low, high = found.interval(share)
        ax.plot(found.level, 100 * share, "--" if what == "from_rest" else "-", color=colour, lw=1.2, label=label)
        ax.fill_between(found.level, 100 * low, 100 * high, color=colour, alpha=0.2, lw=0)
    tidy(ax, "", "Share of the designs (%)", level_axis(found.kind).title)
    ax.set_ylim(-2, 102)
    ax.legend(fontsize=FONT, frameon=False)
    ends = f"{found.frequency[0]:g} to {found.frequency[-1]:g} Hz"
    caption = (
        f"Share of the designs that do so at any frequency of {ends}; bands: 95 % intervals of {found.designs} designs."
    )
    return Drawing("production_over_level", figure, caption, "Curves of shares of the designs over level.")


def rows(found: Production) -> pd.DataFrame:
    """Return a row for each level and frequency, SI units."""
    level, frequency = np.meshgrid(found.level, found.frequency, indexing="ij")
    unit = level_axis(found.kind).symbol
    columns = {"level": level.ravel(), "level_unit": unit, "frequency_hz": frequency.ravel()}
    for name in (*SHARES, "unknown"):
        columns[f"share_{name}"] = getattr(found, name).ravel()
    low, high = found.interval(found.contact)
    return pd.DataFrame(columns | {"share_contact_low": low.ravel(), "share_contact_high": high.ravel()})


def words(found: Production) -> list[str]:
    """Say how many designs do what, at the middle and the largest level."""
    unit = level_axis(found.kind).unit
    said = [f"{found.designs} designs at {found.frequency.size} frequencies and {found.level.size} levels"]
    for i in sorted({found.level.size // 2, found.level.size - 1}):
        parts = []
        for what, label in _said(found).items():
            share = float(found.over_level(what)[i])
            low, high = found.interval(share)
            parts.append(f"{100 * share:.3g} % {label} ({100 * low:.3g} to {100 * high:.3g} %)")
        said.append(f"at {found.level[i]:g} {unit}: {', '.join(parts)}")
    return [*said, *(f"note: {note}" for note in found.notes)]


def write_production(
    designs: Designs, folder: Path, found: Production | None = None, sensitivity: Sensitivity | None = None,
    tightenings: dict[str, Tightening] | None = None, hours: Hours | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Write ``index.html`` and figures, and return what they hold as plain data.

    Parameters
    ----------
    designs : Designs
        What was drawn.
    folder : Path
        Gets the files.
    found : Production, optional
        What sines do.
    sensitivity : Sensitivity, optional
        Of the level at which designs rattle.
    tightenings : dict of str to Tightening, optional
        What each tolerance may be, by names of figures and files: "tightening", of sines, "tightening_random".
    hours : Hours, optional
        What random excitation does.
    """
    result: dict[str, Any] = {
        "designs": len(designs),
        "numbers": {
            name: {"mean": float(column.mean()), "std": float(column.std())}
            for name, column in zip(designs.names, designs.values.T)
        },
    }
    writer, sections = ReportWriter(folder), []
    if found:
        result |= {
            "kind": found.kind, "limit": found.limit.words if found.limit else None,
            "level": found.level.tolist(), "over_level": found.over_level("contact").tolist(),
            "from_rest_over_level": found.over_level("from_rest").tolist(), "notes": found.notes,
        }  # fmt: skip
        if found.limit:
            result["exceeding_over_level"] = found.over_level("exceeding").tolist()
        body = html.sentences(words(found)) + writer.figure(draw_over_level(found)) + writer.figure(draw_shares(found))
        sections.append(html.Section("production", "How many rattle", body))
    if hours:
        result["random"] = hours.rows()
        body = html.sentences(hours.words()) + writer.figure(hours.draw())
        sections.append(html.Section("random", "Under random excitation", body))
    if sensitivity:
        result["sensitivity"] = sensitivity.rows()
        sections.append(html.Section("sensitivity", "What it depends on", writer.figure(draw_sensitivity(sensitivity))))
    for name, each in (tightenings or {}).items():
        result[name] = tightening_table(each)
        body = html.sentences(tightening_words(each)) + writer.figure(draw_tightening(each, name))
        sections.append(html.Section(name, f"Which tolerance to tighten: {each.what}", body))
    sections.append(html.Section("numbers", "What scatters", _numbers(designs)))
    rig = designs.nominal.rig
    writer.page(f"Production of rig “{rig.name}”", sections, html.examples(rig))
    return result


def _numbers(designs: Designs) -> str:
    if not designs.names:
        return html.paragraph("The designs are draws from what records left open of the model.")
    table = tuple(
        (name, column.mean(), column.std(), column.min(), column.max())
        for name, column in zip(designs.names, designs.values.T)
    )
    heads = (Column("Number"), *(Column(each, "SI", ".4g") for each in ("Mean", "Std", "Lowest", "Highest")))
    caption = f"What scatters, of {len(designs)} designs as they were drawn."
    return html.table(Table("numbers", caption, heads, table))
