"""Figures of the items on motion control."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearance_mj.report.figures import Drawing
from clearance_mj.report.vehicle import METRICS, look
from clearance_mj.vehicle.experiment import CONTROLLERS, REGIMES

from .style import FONT, panel, sheet

__all__ = ["curves", "spread_figure"]

WIDE = 20
"""Ratio of the largest to the smallest value from which an axis is logarithmic"""


def spread_figure(rows, item: str, metrics) -> Drawing:
    """Every seed of every controller, with the median; one row of panels per metric, one column per regime.

    Parameters
    ----------
    rows : sequence of dict
        Of `Outcome.row`.
    item : str
        Name of the figure.
    metrics : sequence of str
        Of `METRICS`.
    """
    figure = sheet(2.3 * len(metrics) + 0.3)
    axes = figure.subplots(len(metrics), len(REGIMES), squeeze=False, sharey="row")
    jitter, names = np.random.default_rng(0), list(dict.fromkeys(r["controller"] for r in rows))
    for line, metric in zip(axes, metrics):
        q = METRICS[metric]
        everything = [r[metric] for r in rows]
        scale = "log" if max(everything) > WIDE * min(everything) else "linear"
        for ax, regime in zip(line, REGIMES):
            for place, controller in enumerate(names):
                values = q.scale * np.array(
                    [r[metric] for r in rows if (r["controller"], r["regime"]) == (controller, regime)]
                )
                x = place + jitter.uniform(-0.25, 0.25, values.size)
                ax.plot(x, values, "o", ms=2.2, color=look(controller)["color"], alpha=0.7, mew=0)
                ax.plot([place - 0.35, place + 0.35], [np.median(values)] * 2, color="black", lw=1.4)
            panel(ax, f"{regime}-driven", "", f"{q.label} ({q.unit})" if regime == "torque" else "")
            ax.set_xticks(range(len(names)), [CONTROLLERS[n].label for n in names], rotation=35, ha="right")
            ax.tick_params(axis="x", labelsize=FONT - 1.5)
            ax.set_yscale(scale)
            ax.yaxis.set_major_formatter("{x:g}")
    caption = "Each mark is one vehicle and noise, the line their median."
    return Drawing(item, figure, caption, f"Spread of {', '.join(METRICS[m].label for m in metrics)} over seeds.")


def curves(rows: Sequence[dict], name: str, abscissa: str, label: str, caption: str, scale: float = 1.0) -> Drawing:
    """Peak lateral error of each controller over one field of the cases, one panel per speed and regime.

    Parameters
    ----------
    rows : sequence of dict
        Of `Outcome.row`, and the abscissa.
    name, caption : str
        Of the figure.
    abscissa : str
        Key of the rows.
    label : str
        Of the abscissa, with its unit.
    scale : float
        Shown over stored abscissa.
    """
    panels = sorted({(r["speed"], r["regime"]) for r in rows}, key=lambda p: (p[0], p[1] != "torque"))
    columns = min(2, len(panels))
    lines = -(-len(panels) // columns)
    figure = sheet(2.1 * lines + 0.5)
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True)
    for ax, letter, (speed, regime) in zip(axes.flat, "abcdefgh", panels):
        here = [r for r in rows if (r["speed"], r["regime"]) == (speed, regime)]
        for controller in dict.fromkeys(r["controller"] for r in here):
            points = sorted((scale * r[abscissa], 1e3 * r["peak_e_y"]) for r in here if r["controller"] == controller)
            ax.plot(*np.transpose(points), marker="o", ms=3, **look(controller))
        panel(ax, f"({letter}) {speed:g} km/h, {regime}-driven")
        ax.set_ylim(bottom=0)
    for ax in axes[:, 0]:
        ax.set_ylabel("Peak |e_y| (mm)", fontsize=FONT)
    for ax in axes[-1]:
        ax.set_xlabel(label, fontsize=FONT)
    handles, _ = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=FONT - 0.5, frameon=False)
    return Drawing(name, figure, caption, caption)
