"""Tables and figures of docs/vehicle_twin.md."""

import math

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from clearance_mj.report.vehicle import look
from clearance_mj.vehicle.controllers import get_controller
from clearance_mj.vehicle.experiment import GAP, REGIMES
from clearance_mj.vehicle.steering import LEVER_ARM, Steering
from experiments.steering.twin_drives import STARTS, WEAR, History
from experiments.tables import markdown_table

TIMES = (10.0, 30.0)  # s, at which the estimates are counted
REGIME_COLOURS = {"torque": "#0072b2", "friction": "#d55e00"}
START_STYLES = {0.5: "-", 1.5: (0, (4, 1.5))}


def counted(runs: list[tuple[str, int, float, History]]) -> pd.DataFrame:
    """One row for each twin and time: the errors of the half-gap and whether the 95 % intervals hold the truth."""
    rows = []
    for regime, seed, start, history in runs:
        true = np.array([GAP, Steering().lost_motion.stiffness, REGIMES[regime].friction])
        for at in TIMES:
            i = int(np.argmin(np.abs(history.time - at)))
            inside = (history.low[i, :3] <= true) & (true <= history.high[i, :3])
            rows.append(
                {"regime": regime, "seed": seed, "start": start, "time": at, "error": history.value[i, 0] / GAP - 1}
                | dict(zip(("gap", "stiffness", "friction"), inside))
            )
    return pd.DataFrame(rows)


def convergence_table(table: pd.DataFrame) -> str:
    """Return errors and coverage, as Markdown."""
    lines = [(
        "regime", "time, s", "median error of the half-gap, %", "mean", "worst", "fraction within 5 %, %",
        "within 10 %, %", "true value in the 95 % interval, %: half-gap", "stiffness", "friction",
    )]  # fmt: skip
    for (regime, at), here in table.groupby(["regime", "time"], sort=False):
        e = 100 * here["error"]
        fractions = [np.mean(np.abs(e) < 5), np.mean(np.abs(e) < 10), here["gap"].mean(), here["stiffness"].mean()]
        friction = f"{100 * here['friction'].mean():.0f}" if REGIMES[regime].friction else "none"
        errors = f"{e.abs().median():.1f}", f"{e.mean():+.1f}", f"{e.abs().max():.1f}"
        lines.append((f"{regime}-driven", f"{at:.0f}", *errors, *(f"{100 * one:.0f}" for one in fractions), friction))
    return markdown_table(lines)


def wear_table(runs: list[tuple[str, int, History]]) -> str:
    """Return rates of wear as the twin estimates them on the way, as Markdown."""
    times = runs[0][2].time[-1] / 60 * np.array([0.25, 0.5, 1.0])
    lines = [("regime", "vehicle", *(f"after {at:.0f} min" for at in times), "error of the half-gap, %")]
    for regime, seed, h in runs:
        cells = []
        for at in times:
            i = int(np.argmin(np.abs(h.time - 60 * at)))
            rate, low, high = (60e6 * LEVER_ARM * of[i, 3] for of in (h.value, h.low, h.high))
            cells.append(f"{rate:.2f} ({low:.2f}…{high:.2f})")
        error = 100 * (h.value[-1, 0] / (GAP + WEAR * h.time[-1]) - 1)
        lines.append((f"{regime}-driven", seed, *cells, f"{error:+.1f}"))
    return markdown_table(lines)


def control_table(table: pd.DataFrame) -> str:
    """Return median peak errors over vehicles, as Markdown."""
    lines = [("regime", "controller", *(f"{ratio:g} × half-gap" for ratio in table["told"].unique()))]
    for (regime, name), here in table.groupby(["regime", "controller"], sort=False):
        reference = table.query("regime == @regime and told == 1").set_index(["controller", "seed"])["second"]
        cells = []
        for _, group in here.groupby("told", sort=False):
            true = reference[name.replace("-twin", "-cm")].loc[group["seed"]].to_numpy()
            ratio = np.median(group["second"].to_numpy() / true)
            cells.append(f"{group['first'].median():.1f}/{group['second'].median():.1f} ({ratio:.2f})")
        lines.append((f"{regime}-driven", get_controller(name).label, *cells))
    return markdown_table(lines)


def convergence_figure(runs: list[tuple[str, int, float, History]]) -> Figure:
    """Half-gap over time: median and 5th to 95th percentile over the vehicles, from both starts."""
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    for ax, regime in zip(figure.subplots(1, 2, sharey=True), REGIMES):
        for start in STARTS:
            here = [h for r, _, s, h in runs if (r, s) == (regime, start)]
            length = min(h.time.size for h in here)
            ratio = np.array([h.value[:length, 0] for h in here]) / GAP
            t = here[0].time[:length]
            low, middle, high = np.percentile(ratio, [5, 50, 95], axis=0)
            color = REGIME_COLOURS[regime]
            ax.plot(t, middle, color=color, ls=START_STYLES[start], label=f"told {start:g} × the half-gap")
            ax.fill_between(t, low, high, color=color, alpha=0.2, lw=0)
        band = 0.05 if regime == "torque" else 0.1
        ax.axhspan(1 - band, 1 + band, color="grey", alpha=0.15, lw=0)
        ax.axhline(1, color="black", lw=0.8)
        ax.set(xlabel="Time (s)", title=f"{regime}-driven; grey: ±{100 * band:.0f} %", ylim=(0.4, 1.6))
        ax.grid(alpha=0.3)
        ax.legend(fontsize=8)
        if regime == "torque":
            ax.set_ylabel("Estimated half-gap over the true one")
    return figure


def wear_figure(runs: list[tuple[str, int, History]]) -> Figure:
    """Half-gap and its growth over a long drive, with the twin's own 95 % intervals."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    kinds = (
        (0, math.degrees(1), (0.17, 0.26), "Half-gap at the road wheel (°)"),
        (3, 60e6 * LEVER_ARM, (-2, 4), "Wear at the shaft (µm/min)"),
    )
    for row, (which, unit, limits, label) in zip(figure.subplots(2, 2, sharex=True, sharey="row"), kinds):
        for ax, regime in zip(row, REGIMES):
            for r, seed, h in runs:
                if r != regime:
                    continue
                t, low, high = h.time / 60, unit * h.low[:, which], unit * h.high[:, which]
                (line,) = ax.plot(t, unit * h.value[:, which], lw=0.9, label=f"vehicle {seed}")
                ax.fill_between(t, low, high, color=line.get_color(), alpha=0.15, lw=0)
            true = GAP + 60 * WEAR * t if which == 0 else np.full(t.size, WEAR)
            ax.plot(t, unit * true, color="black", lw=1.2, ls=(0, (4, 1.5)), label="true")
            if which == 3:
                ax.axhspan(0.8, 1.2, color="grey", alpha=0.2, lw=0)
            ax.set_ylim(*limits)
            ax.grid(alpha=0.3)
        row[0].set_ylabel(label)
        row[0].legend(fontsize=8)
        for ax, regime in zip(row, REGIMES):
            ax.set(xlabel="Time (min)") if which else ax.set(title=f"{regime}-driven")
    return figure


def control_figure(table: pd.DataFrame) -> Figure:
    """Peak errors of both passes."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    for ax, regime in zip(figure.subplots(1, 2, sharey=True), REGIMES):
        groups = list(table[table["regime"] == regime].groupby(["controller", "told"], sort=False))
        for row, ((name, _), here) in enumerate(groups):
            color = look(name)["color"]
            for column, marker, shift in (("first", "o", 0.12), ("second", "s", -0.12)):
                low, middle, high = here[column].quantile([0.25, 0.5, 0.75])
                ax.plot([low, high], [row + shift] * 2, color=color, lw=1)
                face = color if column == "second" else "none"
                ax.plot(middle, row + shift, marker=marker, color=color, mfc=face, ls="none")
        ax.set(title=f"{regime}-driven")
        ax.set_yticks(range(len(groups)), [f"{get_controller(n).label}, told {t:g} × gap" for (n, t), _ in groups])
        ax.set_xlim(left=0)
        ax.grid(alpha=0.3, axis="x")
    ax.invert_yaxis()
    figure.supxlabel(
        "Peak lateral error (mm); open: first pass, filled: second; lines: middle half of the vehicles", size=10
    )
    return figure
