"""Figures of an identified model: restoring forces between the walls, and its misfit to the records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize

from ..identify.forces.restoring import RestoringForce
from ..identify.laws.law_misfit import TOO_FAR, LawMisfit
from ..identify.registry import Identified
from .style import COLOURS, FONT, TEST, Drawing, band_axes, canvas, colour_bar, key, of_curves, tidy

__all__ = ["draw_forces", "draw_misfit"]

LAW, WALL = COLOURS[0], COLOURS[1]
MM = 1e3
EVERY = 6  # points of the law, of which one is drawn: what was measured shows between them
DRAWN = 2000  # gaps and offsets, for the walls' intervals
INTERVAL = (2.5, 97.5)  # %
SHOWN_PERCENTILE = 99.9  # % of the forces between the walls that the right panels show
INSIDE = 1.15  # of the way to the walls: the right panels end there
PANELS = 6  # levels that are drawn
RATIOS = (0.0, 1.0, 2.0, TOO_FAR, 2 * TOO_FAR, 4 * TOO_FAR)
COLOURS_OF_RATIOS, COLOUR_BEYOND = ("#f7f7f7", "#d9d9d9", "#b3b3b3", "#e69f00", "#d55e00"), "#882255"
"""grey below what a warning needs, warm colours above"""


def draw_forces(identified: Identified, forces: Sequence[RestoringForce]) -> Drawing:
    """Draw the restoring force of every bushing over its displacement, measured and of the law, and both walls."""
    bushings = identified.rig.bushings
    figure = canvas(0.3 + 2.5 * len(bushings))
    axes = figure.subplots(len(bushings), 2, squeeze=False)
    laws = [force.force_of(identified.law) for force in forces]
    drawn = _draw_parameters(identified)
    for j, (line, bushing) in enumerate(zip(axes, bushings)):
        x, measured = (np.concatenate([getattr(f, n)[j, f.valid] for f in forces]) for n in ("displacement", "force"))
        law = np.concatenate([y[j, f.valid] for f, y in zip(forces, laws)])
        gap, offset = (drawn.get(f"bushings[{j}].{n}", getattr(bushing, n)) for n in ("gap", "offset"))
        places = (-np.inf, np.inf) if j in identified.unseen_gaps else bushing.walls
        walls = [w for w in zip(places, (-gap - offset, gap - offset)) if np.isfinite(w[0])]
        look: dict[str, Any] = {"ms": 1.5, "mew": 0, "rasterized": True}
        for ax in line:
            ax.plot(MM * x, measured, ".", color=TEST, alpha=0.35, label="measured", **look)
            ax.plot(MM * x[::EVERY], law[::EVERY], ".", color=LAW, alpha=0.5, label="law", **look)
            for wall, spread in walls:
                ax.axvspan(*(MM * np.percentile(spread, INTERVAL)), color=WALL, alpha=0.3, lw=0)
                ax.axvline(MM * wall, color=WALL, lw=1.0)
        along = "Displacement at the bushing’s middle (mm)" if j == len(bushings) - 1 else ""
        tidy(line[0], f"bushing {j + 1}: {_gap_words(identified, j)}", "Restoring force (N)", along)
        tidy(line[1], f"bushing {j + 1}, between the walls", "", along)
        _limit_between_walls(line[1], x, measured, places)
    dots = {name: {"color": colour, "ls": "none", "marker": "."} for name, colour in (("measured", TEST), ("law", LAW))}
    of_walls = {"walls, 95 % interval": {"color": WALL}} if len(identified.unseen_gaps) < len(bushings) else {}
    key(figure, of_curves(dots | of_walls), 3)
    names = ", ".join(f.name for f in forces)
    caption = (
        f"Restoring force of grease and contact over displacement, records {names}: measured on the model’s rig, and "
        "what the law gives under the same motion. The walls are where the shaft meets the bushing, at plus "
        "and minus the gap less the offset, shaded over their 95 % intervals; contact happens at the bushing’s ends, "
        "whose motion differs a little from that of the middle."
    )
    if slow := max(f.band[0] for f in forces):
        caption += f" Without probes, motion below {slow:g} Hz is not known, and not in the displacements."
    alt = "Restoring force over displacement of every bushing, bending where the shaft meets the walls."
    return Drawing("restoring_force", figure, caption, alt, sharp=False, chart=True)


def _draw_parameters(identified: Identified) -> dict[str, np.ndarray]:
    """Return random draws of the fitted gaps and offsets from their covariance."""
    estimates = identified.estimates
    if estimates is None or not any(name.endswith((".gap", ".offset")) for name in estimates.names):
        return {}
    return dict(zip(estimates.names, estimates.draw(DRAWN).T))


def _gap_words(identified: Identified, j: int) -> str:
    rows = {r["name"]: r for r in identified.estimates.beside_priors()} if identified.estimates else {}
    words = []
    for name in ("gap", "offset"):
        value = 1e6 * getattr(identified.rig.bushings[j], name)
        std = rows.get(f"bushings[{j}].{name}", {}).get("std", 0.0)
        is_unseen = name == "gap" and j in identified.unseen_gaps
        words.append("gap not seen" if is_unseen else f"{name} {value:.0f} ± {2e6 * std:.0f} µm")
    return ", ".join(words)


def _limit_between_walls(ax: Axes, x: np.ndarray, force: np.ndarray, walls: tuple[float, float]) -> None:
    lower, upper = (w if np.isfinite(w) else INSIDE * end for w, end in zip(walls, (x.min(), x.max())))
    inside = (x > lower) & (x < upper)
    ax.set_xlim(MM * INSIDE * lower, MM * INSIDE * upper)
    if inside.any():
        most = 1.5 * np.percentile(np.abs(force[inside]), SHOWN_PERCENTILE)
        ax.set_ylim(-most, most)


def draw_misfit(misfit: LawMisfit) -> Drawing | None:
    """Draw what rig and law miss by sensor, frequency and level, in dB and over its random error; None without FRFs."""
    if not misfit.stretches:
        return None
    stretches = [misfit.stretches[i] for i in np.unique(np.linspace(0, len(misfit.stretches) - 1, PANELS).astype(int))]
    figure = canvas(1.0 + 2 * (0.55 + 0.11 * len(misfit.sensors)), 8.5)
    axes = figure.subplots(2, len(stretches), squeeze=False, sharex=True, sharey=True)
    ratio = ListedColormap(COLOURS_OF_RATIOS).with_extremes(over=COLOUR_BEYOND)
    most = max(1.0, float(np.nanmax([s.missed for s in stretches])))
    rows = (
        (axes[0], "missed", "Missed (dB)", matplotlib.colormaps["cividis"], Normalize(0, most)),
        (axes[1], "ratio", "Over random error (1)", ratio, BoundaryNorm(RATIOS, ratio.N)),
    )
    for line, name, label, colours, norm in rows:
        for ax, stretch in zip(line, stretches):
            image = ax.pcolormesh(misfit.edges, np.arange(len(misfit.sensors) + 1), getattr(stretch, name), norm=norm,
                                  cmap=colours)  # fmt: skip
            title = f"{stretch.level:.2g} {misfit.unit}" if name == "missed" else ""
            band_axes(ax, title, misfit.edges, misfit.sensors)
        extend = "max" if name == "ratio" else "neither"
        colour_bar(figure, image, line, label, FONT - 1, pad=0.01, aspect=15, extend=extend)
    for ax in axes[0]:
        ax.tick_params(labelbottom=False)
        ax.set_xlabel("")
    caption = (
        "FRF magnitudes of the records to identify against those of the found rig and law under the same excitation, "
        f"in pieces of {stretches[0].duration:.2g} s: typical difference of each sensor (accelerometer) and band, and "
        f"that difference over its random error, in which noise is, and what rig and law miss without relation to the "
        f"excitation. Warm colours: beyond {TOO_FAR:g} times, which the warnings name."
    )
    alt = f"Heat maps of what the law misses by sensor and frequency at {len(stretches)} levels."
    return Drawing("misfit", figure, caption, alt)
