"""Structure that a rig file lacks: the hypotheses tried, and by how much the misfit fell."""

from __future__ import annotations

import numpy as np
from markupsafe import escape
from matplotlib.colors import LogNorm

from ..identify.structure.accepted_parts import AcceptedParts
from ..identify.structure.misfit import RecordMisfit
from ..identify.structure.rig_update import RigUpdate
from . import html
from .style import FONT, Drawing, band_axes, canvas, colour_bar
from .tables import Column, Table
from .writer import ReportWriter

__all__ = ["draw_misfits", "structure_section"]

BANDS = 24  # of frequency, in which the misfit is drawn
SMALLEST, LARGEST = 0.3, 30.0  # % of a channel's level, ends of the colours


def structure_section(update: RigUpdate, writer: ReportWriter) -> str:
    """Return markup on the hypotheses tried on the rig file's structure, and those accepted.

    Parameters
    ----------
    update : RigUpdate
        The updated rig; nothing is returned where its structure was taken as it is drawn.
    writer : ReportWriter
        What writes figures and tables.
    """
    structure = update.structure
    if not structure.rounds:
        return ""
    words = "".join(html.paragraph(f"{escape(_capital(str(part)))}.") for part in structure.accepted)
    if not structure.accepted:
        words = html.paragraph(
            "No hypothesis of a structure that the rig file does not draw explains the records better."
        )
    drawn = writer.figure(draw_misfits(update)) if structure.accepted else ""
    return words + drawn + html.table(_hypothesis_table(structure))


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def _hypothesis_table(structure: AcceptedParts) -> Table:
    columns = (
        Column("Beside"), Column("Hypothesis"), Column("Gain", "ln evidence", ".1f"), Column("Fitted"),
        Column("Accepted"),
    )  # fmt: skip
    rows, before = [], "the rig file"
    for i, tried in enumerate(structure.rounds):
        best = structure.accepted[i] if i < len(structure.accepted) else None
        for each in tried:
            accepted = "yes" if best and each.name == best.name else ""
            rows.append((before, _capital(each.called), each.gain, "yes" if each.fitted else "", accepted))
        before += f" and {best.name}" if best else ""
    caption = (
        "Hypotheses tried beside the rig file’s structure, of each the best. Those that are not fitted gain too little "
        "by a score test, whose gain is given. The one that gains most is accepted if the piece of the records that no "
        "fit saw confirms it."
    )
    return Table("structures", caption, columns, tuple(rows))


def draw_misfits(update: RigUpdate) -> Drawing:
    """Draw the residual of each channel by frequency, of the rig as in its file and with the added structure.

    Parameters
    ----------
    update : RigUpdate
        An updated rig with added structure.
    """
    names, parts = update.channels, (update.structure.as_drawn, update.misfit)
    figure = canvas(1.1 + 0.16 * len(names), 8.5)
    axes = figure.subplots(1, 2, sharey=True)
    low, high = min(m.frequency[0] for m in update.misfit), max(m.frequency[-1] for m in update.misfit)
    edges = np.geomspace(low, high, BANDS + 1)
    for ax, title, misfits in zip(axes, ("as drawn", "with what was found"), parts):
        errors = 100 * _by_band(misfits, edges)
        image = ax.pcolormesh(edges, np.arange(len(names) + 1), errors, norm=LogNorm(SMALLEST, LARGEST), cmap="cividis")
        band_axes(ax, title, edges, names)
    colour_bar(figure, image, axes, "Misfit (% of the\nchannel’s level)", FONT - 1, pad=0.01, aspect=15, extend="both")
    caption = (
        "What the updated rig misses of each channel under the forces in its clearances that meet all sensors best, by "
        "frequency: with the structure as the rig file draws it, and with what was found beside it."
    )
    alt = f"Heat maps of the misfit of {len(names)} channels by frequency, before and after structures were found."
    return Drawing("structure", figure, caption, alt)


def _by_band(misfits: tuple[RecordMisfit, ...], edges: np.ndarray) -> np.ndarray:
    """Return the RMS of the misfit over that of the channel (n_channels, n_bands), all records; nan without lines."""
    band = np.concatenate([np.clip(np.digitize(m.frequency, edges) - 1, 0, BANDS - 1) for m in misfits])
    missed = np.concatenate([np.abs(m.fitted - m.measured) ** 2 for m in misfits], axis=1)
    level = np.concatenate([np.abs(m.measured) ** 2 for m in misfits], axis=1)
    bands = np.full((len(missed), BANDS), np.nan)
    for b in np.unique(band):
        inside = band == b
        bands[:, b] = np.sqrt(missed[:, inside].sum(axis=1) / level[:, inside].sum(axis=1))
    return bands
