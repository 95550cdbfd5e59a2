"""Figures, tables and page of runs with steering clearance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from ..core.files import to_json, write_text
from ..vehicle.controllers import CONTROLLERS, get_controller
from ..vehicle.experiment import Case, Outcome
from ..vehicle.manoeuvres import get_manoeuvre
from ..vehicle.run import SEGMENT, Run
from . import html
from .style import Drawing, canvas, key, tidy
from .tables import Column, Table, write_csv

__all__ = ["HISTORIES", "METRICS", "histories", "look", "write_report"]

CYCLE = ("#1b9e77", "#e7298a", "#7570b3", "#66a61e", "#a6761d", "#e6ab02")
"""Colours of controllers that are registered without one"""
SIDES = {"contact right": "#9e9e9e", "in the gap": "#f2f2f2", "contact left": "#2b2b2b"}


class QuantityFormat(NamedTuple):
    """Label, unit and format of a number."""

    label: str
    unit: str
    scale: float  # shown value over the stored one
    form: str = ".3g"


DEGREE = 180 / np.pi
HISTORIES = {
    "e_y": QuantityFormat("Lateral error", "mm", 1e3),
    "e_psi": QuantityFormat("Heading error", "°", DEGREE),
    "yaw_rate": QuantityFormat("Yaw rate", "°/s", DEGREE),
    "yaw_rate_error": QuantityFormat("Yaw rate error", "°/s", DEGREE),
    "lateral_acceleration": QuantityFormat("Lateral acc.", "m/s²", 1.0),
    "wheel_angle": QuantityFormat("Wheel angle", "°", DEGREE),
}
SHOWN = ("e_y", "e_psi", "yaw_rate", "lateral_acceleration", "wheel_angle")  # What the report of runs shows over time
METRICS = {
    **{f"{name.lower()}_e_y": QuantityFormat(f"{name} e_y", "mm", 1e3, ".1f") for name in ("Peak", "RMS", "P95")},
    **{f"{name.lower()}_e_psi": QuantityFormat(f"{name} e_ψ", "°", DEGREE, ".2f") for name in ("Peak", "RMS", "P95")},
    "peak_yaw_rate": QuantityFormat("Peak yaw rate", "°/s", DEGREE, ".2f"),
    "peak_yaw_rate_error": QuantityFormat("Peak yaw rate error", "°/s", DEGREE, ".2f"),
    "peak_lateral_acceleration": QuantityFormat("Peak a_y", "m/s²", 1.0, ".2f"),
    "peak_sideslip": QuantityFormat("Peak sideslip", "°", DEGREE, ".2f"),
    "peak_steer_rate": QuantityFormat("Peak steer rate", "°/s", DEGREE, ".1f"),
    "steer_variation": QuantityFormat("Steer variation", "°", DEGREE, ".1f"),
    "fast_wheel_rate": QuantityFormat("Wheel rate > 3 Hz", "°/s", DEGREE, ".2f"),
    "servo_rms_rate": QuantityFormat("RMS servo rate", "°/s", DEGREE, ".2f"),
    "servo_fast_rate": QuantityFormat("Servo rate > 3 Hz", "°/s", DEGREE, ".2f"),
    "servo_reversals": QuantityFormat("Servo reversals", "", 1.0, ".0f"),
    "contact_reversals": QuantityFormat("Contact reversals", "", 1.0, ".0f"),
}
UNITS = {
    "time": "s", "position": "m", "s": "m", "e_y": "m", "e_psi": "rad", "yaw_rate": "rad/s", "yaw_rate_error": "rad/s",
    "lateral_acceleration": "m/s2", "sideslip": "rad", "command": "rad", "servo_angle": "rad", "wheel_angle": "rad",
}  # fmt: skip


def look(controller: str) -> dict[str, Any]:
    """Return the colour, line style, width and label of a controller's lines, as its registration says."""
    known = get_controller(controller)
    without = [name for name, entry in CONTROLLERS.items() if entry.colour is None]
    colour = known.colour or CYCLE[without.index(controller) % len(CYCLE)]
    return {"color": colour, "ls": known.line, "lw": 1.1, "label": known.label}


def _label(outcome: Outcome) -> str:
    return get_controller(outcome.case.controller).label


def _situation(outcome: Outcome) -> str:
    case = outcome.case
    return (
        f"{case.speed:g} km/h, half-gap {np.degrees(case.half_gap):.3g}° at the road wheel, {case.regime}-driven, "
        f"{case.plant} plant, seed {case.seed}"
    )


def _manoeuvre(case: Case) -> str:
    if case.manoeuvre is None:
        return f"Double lane change, lengths × {case.task.path.name.split()[-1]}"
    return get_manoeuvre(case.manoeuvre).label


def histories(outcomes: Sequence[Outcome], name: str, quantities: Sequence[str] = SHOWN) -> Drawing:
    """Draw `HISTORIES` over time, controllers on one manoeuvre overlaid, and below them the contact state of each."""
    n, strip = len(quantities), 0.16 * len(outcomes) + 0.1
    figure = canvas(1.25 * n + strip + 1.0)
    axes = figure.subplots(n + 1, 1, sharex=True, height_ratios=[1.25] * n + [strip])
    for ax, letter, quantity in zip(axes, "abcdefgh", quantities):
        shown = HISTORIES[quantity]
        for outcome in outcomes:
            ax.plot(outcome.run.time, shown.scale * getattr(outcome.run, quantity), **look(outcome.case.controller))
        tidy(ax, f"({letter})", f"{shown.label} ({shown.unit})")
    _contact_strip(axes[-1], outcomes)
    sides_as_lines = axes[-1].twinx()  # of the page's chart, which has no strips
    for outcome in outcomes:
        sides_as_lines.plot(outcome.run.time, outcome.run.contact, **look(outcome.case.controller))
    sides_as_lines.set(visible=False, ylim=(-1.2, 1.2), ylabel="Contact (−1 right, 1 left)", xlabel="Time (s)")
    figure.align_ylabels(axes[:-1])
    sides = [Patch(color=colour, label=label) for label, colour in SIDES.items()]
    key(figure, [*axes[0].get_legend_handles_labels()[0], *sides])
    words = ", ".join(HISTORIES[q].label.lower() for q in quantities)
    caption = f"Over time: {words}; at the bottom the side of the clearance in contact. {_situation(outcomes[0])}."
    return Drawing(name, figure, caption, f"Histories of {len(outcomes)} controllers: {words}.", chart=True)


def _contact_strip(ax: Axes, outcomes: Sequence[Outcome]) -> None:
    look_of_sides: dict[str, Any] = {"cmap": ListedColormap(list(SIDES.values())), "vmin": -1, "vmax": 1}
    for row, outcome in enumerate(outcomes):
        time = outcome.run.time
        extent = (time[0], time[-1], row + 0.42, row - 0.42)
        ax.imshow(outcome.run.contact[None], aspect="auto", extent=extent, interpolation="none", **look_of_sides)
    tidy(ax, "", "", "Time (s)")
    ax.set_yticks(range(len(outcomes)), [_label(o) for o in outcomes])
    ax.set(ylim=(len(outcomes) - 0.5, -0.5), xlim=(outcomes[0].run.time[0], max(o.run.time[-1] for o in outcomes)))
    ax.grid(False)


def _draw_paths(outcomes: Sequence[Outcome]) -> Drawing:
    figure = canvas(2.4)
    ax = figure.subplots()
    path = outcomes[0].case.task.path
    ax.plot(*path.position(np.linspace(0, path.length, 500)), color="black", lw=2.2, alpha=0.35, label="path")
    for outcome in outcomes:
        ax.plot(*outcome.run.position.T, **look(outcome.case.controller))
    tidy(ax, "", "Y (m)", "X (m)")
    key(figure, ax.get_legend_handles_labels()[0])
    caption = f"Paths of the vehicle; Y is drawn larger than X. {_situation(outcomes[0])}."
    ahead = all((np.diff(outcome.run.position[:, 0]) >= 0).all() for outcome in outcomes)
    return Drawing("paths", figure, caption, f"Paths of {len(outcomes)} controllers on the X-Y plane.", chart=ahead)


def _draw_spectra(outcomes: Sequence[Outcome]) -> Drawing:
    figure = canvas(4.2)
    servo, wheel = figure.subplots(2, 1, sharex=True)
    for outcome in outcomes:
        for ax, spectrum in ((servo, outcome.run.servo_rate_spectrum()), (wheel, outcome.run.wheel_rate_spectrum())):
            ax.semilogy(spectrum.frequency[1:], DEGREE**2 * spectrum.density[1:], **look(outcome.case.controller))
    tidy(servo, "(a)", "Servo rate ((°/s)²/Hz)")
    tidy(wheel, "(b)", "Wheel rate ((°/s)²/Hz)", "Frequency (Hz)")
    wheel.set_xlim(0, 30)
    key(figure, servo.get_legend_handles_labels()[0])
    caption = (
        "Spectra of the rates of servo and road wheel, between which the clearance and the road's moment are: Welch's "
        f"method, Hann windows of {SEGMENT} samples. {_situation(outcomes[0])}."
    )
    return Drawing("spectra", figure, caption, f"Steering-rate spectra of {len(outcomes)} controllers.", chart=True)


def _metrics_table(outcomes: Sequence[Outcome]) -> Table:
    columns = [Column("Controller"), *(Column(q.label, q.unit, q.form) for q in METRICS.values())]
    metrics = [(_label(o), o.run.metrics()) for o in outcomes]
    rows = [(label, *(q.scale * values[key] for key, q in METRICS.items())) for label, values in metrics]
    return Table("metrics", "Metrics of each run", tuple(columns), tuple(rows))


def _timing_table(outcomes: Sequence[Outcome]) -> Table:
    columns = (Column("Controller"), Column("Median", "ms", ".3f"), Column("Worst", "ms", ".2f"))
    rows = [(_label(o), *(1e3 * value for value in o.run.timing().values())) for o in outcomes]
    return Table("timing", "Computing time of a command, on the machine that made this page", columns, tuple(rows))


def write_report(
    outcomes: Sequence[Outcome], folder: str | Path, provenance: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Write ``report.html``, ``figures/*.png``, ``histories_NAME.csv``, ``metrics.csv`` and ``summary.json``.

    Returns the runs of ``summary.json``, which also says what they come from, and the timings, which differ from run to
    run.
    """
    folder = Path(folder)
    drawings = (_draw_paths(outcomes), histories(outcomes, "histories"), _draw_spectra(outcomes))
    for drawing in drawings:
        drawing.write(folder / "figures")
    for outcome in outcomes:
        write_csv(folder / f"histories_{outcome.case.controller}.csv", _write_history(outcome.run))
    rows = [outcome.row() for outcome in outcomes]
    write_csv(folder / "metrics.csv", rows)
    write_text(folder / "summary.json", to_json({"runs": rows, "provenance": provenance}))
    write_text(folder / "report.html", _page_sections(outcomes, drawings))
    return {"runs": rows, "timing": {o.case.controller: o.run.timing() for o in outcomes}}


def _write_history(run: Run) -> pd.DataFrame:
    columns = {f"{name}_{unit.replace('/', '_')}": getattr(run, name) for name, unit in UNITS.items()}
    x, y = columns.pop("position_m").T
    columns = {"time_s": columns.pop("time_s"), "x_m": x, "y_m": y} | columns | {"contact": run.contact}
    return pd.DataFrame(columns, dtype=float)


def _page_sections(outcomes: Sequence[Outcome], drawings: Sequence[Drawing]) -> str:
    case = outcomes[0].case
    known = [get_controller(outcome.case.controller) for outcome in outcomes]
    priors = "".join(f"<dt>{escape(law.label)}</dt><dd>{escape(law.prior)}</dd>\n" for law in known)
    about = html.paragraph(
        f"{escape(_manoeuvre(case))}, {escape(_situation(outcomes[0]))}. Followed exactly it needs "
        f"{case.task.path.needed_acceleration(case.task.speed):.1f} m/s². All vehicles, sensors and roads are "
        "simulated."
    )
    about += "<h3>Prior information of each controller</h3>\n" + html.paragraph(
        "All: the nominal vehicle, the steering servo, the steering's stiffness without clearance, and the road "
        f"for {case.preview:g} s ahead. Of the clearance:"
    )
    tables = html.table(_metrics_table(outcomes)) + html.table(_timing_table(outcomes))
    sections = (
        html.PageSection("about", "What was run", f"{about}<dl>{priors}</dl>\n"),
        html.PageSection("metrics", "Metrics", tables),
        html.PageSection("figures", "Figures", html.figures(drawings)),
    )
    return html.page("Motion control with steering clearance", sections)
