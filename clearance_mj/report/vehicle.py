"""Figures, tables and page of drives with steering clearance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..files import replacing, to_json
from ..vehicle.experiment import CONTROLLERS
from . import html
from .figures import FONT, WIDTH, Drawing, _tidy
from .tables import Column, Table, write_csv

if TYPE_CHECKING:
    from ..vehicle.experiment import Outcome

__all__ = ["COLOURS", "HISTORIES", "METRICS", "curves", "histories", "metrics_table", "paths", "write_report"]

COLOURS = dict(zip(CONTROLLERS, ("#d55e00", "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#8c8c8c")))
STYLES = dict(zip(CONTROLLERS, ("-", "-", (0, (4, 1.5)), (0, (4, 1.5)), (0, (1, 1.2)), (0, (1, 1.2)), "-.")))
SIDES = ("#9e9e9e", "#f2f2f2", "#2b2b2b")
"""Contact on the right, none, on the left"""


@dataclass(frozen=True)
class Quantity:
    """How a number is shown."""

    label: str
    unit: str
    scale: float
    """shown value over the stored one"""
    form: str = ".3g"


DEGREE = 180 / np.pi
HISTORIES = {
    "e_y": Quantity("Lateral error", "mm", 1e3),
    "e_psi": Quantity("Heading error", "°", DEGREE),
    "yaw_rate": Quantity("Yaw rate", "°/s", DEGREE),
    "yaw_rate_error": Quantity("Yaw rate error", "°/s", DEGREE),
    "lateral_acceleration": Quantity("Lateral acc.", "m/s²", 1.0),
    "wheel_angle": Quantity("Wheel angle", "°", DEGREE),
}
SHOWN = ("e_y", "e_psi", "yaw_rate", "lateral_acceleration", "wheel_angle")
"""What the report of drives shows over time"""
METRICS = {
    "peak_e_y": Quantity("Peak e_y", "mm", 1e3, ".1f"),
    "rms_e_y": Quantity("RMS e_y", "mm", 1e3, ".1f"),
    "p95_e_y": Quantity("P95 e_y", "mm", 1e3, ".1f"),
    "peak_e_psi": Quantity("Peak e_ψ", "°", DEGREE, ".2f"),
    "rms_e_psi": Quantity("RMS e_ψ", "°", DEGREE, ".2f"),
    "p95_e_psi": Quantity("P95 e_ψ", "°", DEGREE, ".2f"),
    "peak_yaw_rate": Quantity("Peak yaw rate", "°/s", DEGREE, ".2f"),
    "peak_yaw_rate_error": Quantity("Peak yaw rate error", "°/s", DEGREE, ".2f"),
    "peak_lateral_acceleration": Quantity("Peak a_y", "m/s²", 1.0, ".2f"),
    "peak_sideslip": Quantity("Peak sideslip", "°", DEGREE, ".2f"),
    "peak_steer_rate": Quantity("Peak steer rate", "°/s", DEGREE, ".1f"),
    "steer_variation": Quantity("Steer variation", "°", DEGREE, ".1f"),
    "contact_reversals": Quantity("Contact reversals", "", 1.0, ".0f"),
}


def _label(name) -> str:
    return CONTROLLERS[name].label


def _look(name) -> dict:
    return {"color": COLOURS[name], "ls": STYLES[name], "lw": 1.1, "label": _label(name)}


def _words(outcome) -> str:
    case = outcome.case
    return (
        f"{case.speed:g} km/h, half-gap {np.degrees(case.half_gap):.3g}° at the road wheel, {case.regime}-driven, "
        f"{case.plant} plant, seed {case.seed}"
    )


def histories(outcomes: Sequence[Outcome], name: str, quantities: Sequence[str] = SHOWN) -> Drawing:
    """Quantities over time, methods overlaid, and below them the contact state of each.

    Parameters
    ----------
    outcomes : sequence of Outcome
        Of different controllers on one manoeuvre.
    name : str
        Of the figure.
    quantities : sequence of str
        Of `HISTORIES`.
    """
    n, strip = len(quantities), 0.16 * len(outcomes) + 0.1
    figure = Figure(figsize=(WIDTH, 1.25 * n + strip + 1.0), layout="constrained", facecolor="white")
    axes = figure.subplots(n + 1, 1, sharex=True, height_ratios=[1.25] * n + [strip])
    for ax, letter, quantity in zip(axes, "abcdefgh", quantities):
        shown = HISTORIES[quantity]
        for outcome in outcomes:
            ax.plot(
                outcome.drive.time, shown.scale * getattr(outcome.drive, quantity), **_look(outcome.case.controller)
            )
        _tidy(ax, f"({letter})", f"{shown.label} ({shown.unit})")
    _contact_strip(axes[-1], outcomes)
    figure.align_ylabels(axes[:-1])
    handles, _ = axes[0].get_legend_handles_labels()
    sides = [Patch(color=c, label=text) for c, text in zip(SIDES, ("contact right", "in the gap", "contact left"))]
    figure.legend(handles=[*handles, *sides], loc="outside upper center", ncols=5, fontsize=FONT - 0.5, frameon=False)
    shown = ", ".join(HISTORIES[q].label.lower() for q in quantities)
    caption = f"Over time: {shown}; at the bottom the side of the clearance in contact. {_words(outcomes[0])}."
    return Drawing(name, figure, caption, f"Histories of {len(outcomes)} controllers: {shown}.")


def _contact_strip(ax, outcomes):
    colours = ListedColormap(SIDES)
    for row, outcome in enumerate(outcomes):
        time = outcome.drive.time
        extent = (time[0], time[-1], row + 0.42, row - 0.42)
        ax.imshow(
            outcome.drive.contact[None],
            aspect="auto",
            cmap=colours,
            vmin=-1,
            vmax=1,
            extent=extent,
            interpolation="none",
        )
    _tidy(ax, "", "", "Time (s)")
    ax.set_yticks(range(len(outcomes)), [_label(o.case.controller) for o in outcomes])
    ax.set_ylim(len(outcomes) - 0.5, -0.5)
    ax.set_xlim(outcomes[0].drive.time[0], max(o.drive.time[-1] for o in outcomes))
    ax.grid(False)


def paths(outcomes: Sequence[Outcome], name: str) -> Drawing:
    """Paths driven, and the path to follow.

    Parameters
    ----------
    outcomes : sequence of Outcome
        Of different controllers on one manoeuvre.
    name : str
        Of the figure.
    """
    figure = Figure(figsize=(WIDTH, 2.4), layout="constrained", facecolor="white")
    ax = figure.subplots()
    path = outcomes[0].case.task.path
    ax.plot(*path.position(np.linspace(0, path.length, 500)), color="black", lw=2.2, alpha=0.35, label="path")
    for outcome in outcomes:
        ax.plot(*outcome.drive.position.T, **_look(outcome.case.controller))
    _tidy(ax, "", "Y (m)", "X (m)")
    figure.legend(loc="outside upper center", ncols=5, fontsize=FONT - 0.5, frameon=False)
    caption = f"Paths driven; Y is drawn larger than X. {_words(outcomes[0])}."
    return Drawing(name, figure, caption, f"Paths of {len(outcomes)} controllers on the X-Y plane.")


def curves(rows: Sequence[dict], name: str, abscissa: str, label: str, caption: str, scale: float = 1.0) -> Drawing:
    """Peak lateral error of each controller over one field of the cases, one panel per speed and regime.

    Parameters
    ----------
    rows : sequence of dict
        Of `Outcome.row`, and the abscissa.
    name : str
        Of the figure.
    abscissa : str
        Key of the rows.
    label : str
        Of the abscissa, with its unit.
    caption : str
        Of the figure.
    scale : float
        Shown over stored abscissa.
    """
    panels = sorted({(r["speed"], r["regime"]) for r in rows}, key=lambda p: (p[0], p[1] != "torque"))
    columns = min(2, len(panels))
    lines = -(-len(panels) // columns)
    figure = Figure(figsize=(WIDTH, 2.1 * lines + 0.5), layout="constrained", facecolor="white")
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True)
    for ax, letter, (speed, regime) in zip(axes.flat, "abcdefgh", panels):
        here = [r for r in rows if (r["speed"], r["regime"]) == (speed, regime)]
        for controller in dict.fromkeys(r["controller"] for r in here):
            points = sorted((scale * r[abscissa], 1e3 * r["peak_e_y"]) for r in here if r["controller"] == controller)
            ax.plot(*np.transpose(points), marker="o", ms=3, **_look(controller))
        _tidy(ax, f"({letter}) {speed:g} km/h, {regime}-driven")
        ax.set_ylim(bottom=0)
    for ax in axes[:, 0]:
        ax.set_ylabel("Peak |e_y| (mm)", fontsize=FONT)
    for ax in axes[-1]:
        ax.set_xlabel(label, fontsize=FONT)
    handles, _ = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=FONT - 0.5, frameon=False)
    return Drawing(name, figure, caption, caption)


def metrics_table(outcomes: Sequence[Outcome], caption: str = "Metrics of each drive") -> Table:
    """Metrics of drives, one row for each.

    Parameters
    ----------
    outcomes : sequence of Outcome
        The drives.
    caption : str
        Of the table.
    """
    columns = [Column("Controller"), *(Column(q.label, q.unit, q.form) for q in METRICS.values())]
    rows = []
    for outcome in outcomes:
        metrics = outcome.drive.metrics()
        rows.append((_label(outcome.case.controller), *(q.scale * metrics[key] for key, q in METRICS.items())))
    return Table("metrics", caption, tuple(columns), tuple(rows))


def _timing_table(outcomes) -> Table:
    columns = (Column("Controller"), Column("Median", "ms", ".3f"), Column("Worst", "ms", ".2f"))
    rows = []
    for outcome in outcomes:
        timing = outcome.drive.timing()
        rows.append((_label(outcome.case.controller), 1e3 * timing["median"], 1e3 * timing["worst"]))
    return Table("timing", "Computing time of a command, on the machine that made this page", columns, tuple(rows))


def write_report(outcomes: Sequence[Outcome], folder) -> dict:
    """Write ``report.html``, ``figures/*.png``, ``histories_NAME.csv``, ``metrics.csv`` and ``summary.json``.

    Parameters
    ----------
    outcomes : sequence of Outcome
        Of different controllers on one manoeuvre.
    folder : str or Path
        Where to; made if needed.

    Returns
    -------
    dict
        What is in ``summary.json``, and the timings, which differ from run to run.
    """
    folder = Path(folder)
    drawings = (paths(outcomes, "paths"), histories(outcomes, "histories"))
    for drawing in drawings:
        with replacing(folder / "figures" / f"{drawing.name}.png") as temporary:
            temporary.write_bytes(drawing.png())
    for outcome in outcomes:
        write_csv(folder / f"histories_{outcome.case.controller}.csv", _history_rows(outcome.drive))
    rows = [outcome.row() for outcome in outcomes]
    write_csv(folder / "metrics.csv", rows)
    with replacing(folder / "summary.json") as temporary:
        temporary.write_text(to_json({"drives": rows}), encoding="utf-8")
    with replacing(folder / "report.html") as temporary:
        temporary.write_text(_page(outcomes, drawings), encoding="utf-8")
    return {"drives": rows, "timing": {o.case.controller: o.drive.timing() for o in outcomes}}


def _history_rows(drive) -> list[dict]:
    columns = {
        "time_s": drive.time, "x_m": drive.position[:, 0], "y_m": drive.position[:, 1], "s_m": drive.s,
        "e_y_m": drive.e_y, "e_psi_rad": drive.e_psi, "yaw_rate_rad_s": drive.yaw_rate,
        "yaw_rate_error_rad_s": drive.yaw_rate_error,
        "lateral_acceleration_m_s2": drive.lateral_acceleration, "sideslip_rad": drive.sideslip,
        "command_rad": drive.command, "wheel_angle_rad": drive.wheel_angle, "contact": drive.contact,
    }  # fmt: skip
    return [dict(zip(columns, map(float, values))) for values in zip(*columns.values())]


def _page(outcomes, drawings) -> str:
    case = outcomes[0].case
    pictures = [html.Picture(d.name, i, d.svg(), "image/svg+xml", d.caption, d.alt) for i, d in enumerate(drawings, 1)]
    knows = "".join(
        f"<dt>{escape(_label(o.case.controller))}</dt><dd>{escape(CONTROLLERS[o.case.controller].knows)}</dd>\n"
        for o in outcomes
    )
    about = html.paragraph(
        f"Double lane change, lengths × {case.task.path.name.split()[-1]}, {escape(_words(outcomes[0]))}. Followed "
        f"exactly it needs {case.task.path.needed_acceleration(case.task.speed):.1f} m/s². All vehicles, sensors and "
        "roads are simulated."
    )
    told = (
        "<h3>What each controller was told</h3>\n"
        + html.paragraph(
            "All: the nominal vehicle, the steering servo, the steering's stiffness without clearance, and the road "
            f"for {case.preview:g} s ahead. Of the clearance:"
        )
        + f"<dl>{knows}</dl>\n"
    )
    sections = (
        html.Section("about", "What was driven", about + told),
        html.Section("metrics", "Metrics", html.table(metrics_table(outcomes)) + html.table(_timing_table(outcomes))),
        html.Section("figures", "Figures", "".join(html.figure(picture) for picture in pictures)),
    )
    return html.page("Motion control with steering clearance", sections)
