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
from .random_production import RandomProduction
from .style import COLOURS, FONT, Drawing, canvas, colour_bar, frequency_ends, tidy
from .sweep import draw_sensitivity
from .tables import Column, Table
from .tightening import draw_tightening, tightening_table, tightening_words
from .writer import ReportWriter

__all__ = ["draw_over_level", "draw_shares", "rows", "summary_lines", "write_production"]

CONTOURS = (0.01, 0.1, 0.5, 0.9)


def _event_words(batch: Production) -> dict[str, str]:
    """Return the words for the event of each fraction of designs."""
    limited = {"exceeding": batch.limit.words} if batch.limit else {}
    return {"contact": "can touch", "from_rest": "touch if raised from rest"} | limited


def draw_shares(batch: Production) -> Drawing:
    """Draw the shares that can touch, touch from rest, exceed the limit and may jump over frequency and level."""
    panels = _event_words(batch) | {"several": "may jump"}
    figure = canvas(2.6)
    axes = np.ravel(figure.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False))
    for i, (ax, (name, title)) in enumerate(zip(axes, panels.items())):
        fraction = getattr(batch, name)
        image = ax.pcolormesh(
            batch.frequency, batch.level, fraction, cmap="YlOrRd", vmin=0, vmax=1, shading="nearest", rasterized=True
        )
        if min(fraction.shape) > 1 and fraction.max() > CONTOURS[0]:
            lines = ax.contour(batch.frequency, batch.level, fraction, CONTOURS, colors="black", linewidths=0.6)
            ax.clabel(lines, fmt=lambda value: f"{100 * value:.0f} %", fontsize=FONT - 2)
        tidy(ax, title, level_axis(batch.kind).title if i == 0 else "", "")
        ax.grid(False)
        frequency_ends(ax, batch.frequency, "Frequency (Hz)", True)
    colour_bar(figure, image, axes, "Share of the designs (1)", pad=0.01, aspect=30)
    caption = (
        f"Shares of {batch.designs} designs of rig “{batch.nominal.rig.name}” over frequency and amplitude of a sine, "
        "of the largest of the vibrations that coexist; raised from rest: of that to which a level leads that is "
        "raised slowly. May jump: there is more than one vibration."
    )
    return Drawing("production", figure, caption, "Maps of the shares of designs over frequency and level.", False)


def draw_over_level(batch: Production) -> Drawing:
    """Draw the fractions that can touch, touch from rest, or exceed the limit at any frequency, over level."""
    figure = canvas(2.4)
    ax = figure.subplots()
    for colour, (event, label) in zip(COLOURS, _event_words(batch).items()):
        fraction = batch.over_level(event)
        low, high = batch.interval(fraction)
        ax.plot(batch.level, 100 * fraction, "--" if event == "from_rest" else "-", color=colour, lw=1.2, label=label)
        ax.fill_between(batch.level, 100 * low, 100 * high, color=colour, alpha=0.2, lw=0)
    tidy(ax, "", "Share of the designs (%)", level_axis(batch.kind).title)
    ax.set_ylim(-2, 102)
    ax.legend(fontsize=FONT, frameon=False)
    ends = f"{batch.frequency[0]:g} to {batch.frequency[-1]:g} Hz"
    caption = (
        f"Share of the designs that do so at any frequency of {ends}; bands: 95 % intervals of {batch.designs} designs."
    )
    return Drawing("production_over_level", figure, caption, "Curves of shares of the designs over level.")


def rows(batch: Production) -> pd.DataFrame:
    """Return a row for each level and frequency, SI units."""
    level, frequency = np.meshgrid(batch.level, batch.frequency, indexing="ij")
    columns = {"level": level.ravel(), "level_unit": level_axis(batch.kind).symbol, "frequency_hz": frequency.ravel()}
    for name in (*SHARES, "unknown"):
        columns[f"share_{name}"] = getattr(batch, name).ravel()
    low, high = batch.interval(batch.contact)
    return pd.DataFrame(columns | {"share_contact_low": low.ravel(), "share_contact_high": high.ravel()})


def summary_lines(batch: Production) -> list[str]:
    """Return lines on the fractions of designs, at the middle and the largest level."""
    unit = level_axis(batch.kind).unit
    said = [f"{batch.designs} designs at {batch.frequency.size} frequencies and {batch.level.size} levels"]
    for i in sorted({batch.level.size // 2, batch.level.size - 1}):
        parts = []
        for event, label in _event_words(batch).items():
            fraction = float(batch.over_level(event)[i])
            low, high = batch.interval(fraction)
            parts.append(f"{100 * fraction:.3g} % {label} ({100 * low:.3g} to {100 * high:.3g} %)")
        said.append(f"at {batch.level[i]:g} {unit}: {', '.join(parts)}")
    return [*said, *(f"note: {note}" for note in batch.notes)]


def write_production(
    designs: Designs, folder: Path, batch: Production | None = None, sensitivity: Sensitivity | None = None,
    tightenings: dict[str, Tightening] | None = None, hours: RandomProduction | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Write ``index.html`` and figures, and return what they hold as plain data.

    Parameters
    ----------
    designs : Designs
        The designs drawn.
    folder : Path
        Gets the files.
    batch : Production, optional
        Fractions of designs under sines.
    sensitivity : Sensitivity, optional
        Of the level at which designs rattle.
    tightenings : dict of str to Tightening, optional
        What each tolerance may be, by names of figures and files: "tightening", of sines, "tightening_random".
    hours : Hours, optional
        Results under random excitation.
    """
    columns = zip(designs.names, designs.values.T)
    numbers = {name: {"mean": float(column.mean()), "std": float(column.std())} for name, column in columns}
    result: dict[str, Any] = {"designs": len(designs), "numbers": numbers}
    writer, sections = ReportWriter(folder), []
    if batch:
        result |= {
            "kind": batch.kind, "limit": batch.limit.words if batch.limit else None,
            "level": batch.level.tolist(), "over_level": batch.over_level("contact").tolist(),
            "from_rest_over_level": batch.over_level("from_rest").tolist(), "notes": batch.notes,
        }  # fmt: skip
        if batch.limit:
            result["exceeding_over_level"] = batch.over_level("exceeding").tolist()
        body = html.sentences(summary_lines(batch))
        body += writer.figure(draw_over_level(batch)) + writer.figure(draw_shares(batch))
        sections.append(html.PageSection("production", "How many rattle", body))
    if hours:
        result["random"] = hours.rows()
        body = html.sentences(hours.words()) + writer.figure(hours.draw())
        sections.append(html.PageSection("random", "Under random excitation", body))
    if sensitivity:
        result["sensitivity"] = sensitivity.rows()
        body = writer.figure(draw_sensitivity(sensitivity))
        sections.append(html.PageSection("sensitivity", "What it depends on", body))
    for name, each in (tightenings or {}).items():
        result[name] = tightening_table(each)
        body = html.sentences(tightening_words(each)) + writer.figure(draw_tightening(each, name))
        sections.append(html.PageSection(name, f"Which tolerance to tighten: {each.what}", body))
    sections.append(html.PageSection("numbers", "What scatters", _number_table(designs)))
    rig = designs.nominal.rig
    writer.page(f"Production of rig “{rig.name}”", sections, html.examples(rig))
    return result


def _number_table(designs: Designs) -> str:
    if not designs.names:
        return html.paragraph("The designs are draws from what records left open of the model.")
    columns = zip(designs.names, designs.values.T)
    table = tuple((name, values.mean(), values.std(), values.min(), values.max()) for name, values in columns)
    heads = (Column("Number"), *(Column(each, "SI", ".4g") for each in ("Mean", "Std", "Lowest", "Highest")))
    caption = f"What scatters, of {len(designs)} designs as they were drawn."
    return html.table(Table("numbers", caption, heads, table))
