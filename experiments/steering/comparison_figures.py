"""Figures of the comparison of steering controllers."""

import numpy as np
import pandas as pd

from clearance_mj.report.style import FONT, Drawing
from clearance_mj.report.vehicle import look
from clearance_mj.vehicle.experiment import CONTROLLERS, REGIMES
from clearance_mj.vehicle.manoeuvres import MANOEUVRES
from experiments.article.motion import median
from experiments.article.result import BLACK, legend, panel, sheet
from experiments.steering.comparison_statistics import Paired, names_of, values

WIDEST = 1000.0  # mm, end of the axes: what is beyond, or left the path, is drawn there
RATIOS = (0.5, 0.7, 1, 1.5, 2, 3, 5)
LARGEST = 4.0  # ratio, end of the axes
MARKERS = "osDvP"


def peaks(rows: pd.DataFrame, regime: str) -> Drawing:
    """Median peak error and its interval of every controller, one panel for each manoeuvre."""
    there, names = list(rows["manoeuvre"].unique()), names_of(rows)
    lines = -(-len(there) // 3)
    figure = sheet(lines * (0.17 * len(names) + 0.5) + 0.1)
    axes = figure.subplots(lines, 3, squeeze=False, sharey=True)
    for ax, manoeuvre in zip(axes.flat, there):
        for i, name in enumerate(names):
            interval = median(1e3 * values(rows, manoeuvre, regime, name, "peak_e_y"))
            value, low, high = (min(v, WIDEST) for v in interval)
            marker = "o" if interval.value < WIDEST else ">"
            ax.plot([low, high], [i, i], color=look(name)["color"], lw=1.6)
            ax.plot(value, i, marker=marker, color=look(name)["color"], ms=4)
        panel(ax, MANOEUVRES[manoeuvre].label)
        ax.set(xscale="log", xlim=(None, WIDEST * 1.1))
        ax.set_xticks([20, 50, 100, 200, 500, 1000], ["20", "50", "100", "200", "500", "1000"])
        ax.minorticks_off()
        ax.set_ylim(len(names) - 0.4, -0.6)
        ax.set_yticks(range(len(names)), [CONTROLLERS[n].label for n in names])
    for ax in axes.flat[len(there) :]:
        ax.set_visible(False)
    for ax in axes[-1]:
        ax.set_xlabel("Peak |e_y| (mm)", fontsize=FONT)
    caption = (
        f"Peak lateral error, {regime}-driven: median over {rows['seed'].nunique()} vehicles and its 95 % interval; "
        f"an arrow at {WIDEST:g} mm means more, or that half of the runs left the path."
    )
    return Drawing(
        f"vehicle_comparison_{regime}", figure, caption, f"Peak errors of {len(names)} controllers, {regime}-driven."
    )


def worth(comparisons: list[Paired]) -> Drawing:
    """Draw by how much each controller with the clearance model is below that with a disturbance observer."""
    pairs = list(dict.fromkeys((p.new, p.old) for p in comparisons))
    there = list(dict.fromkeys(p.manoeuvre for p in comparisons))
    figure = sheet(0.14 * len(pairs) * len(there) + 0.9)
    axes = figure.subplots(1, len(REGIMES), squeeze=False, sharey=True, sharex=True)[0]
    for ax, regime in zip(axes, REGIMES):
        for j, (new, old) in enumerate(pairs):
            here = [p for p in comparisons if (p.regime, p.new, p.old) == (regime, new, old)]
            y = np.arange(len(here)) + (j - (len(pairs) - 1) / 2) * 0.8 / len(pairs)
            value, low, high = np.clip([p.below for p in here], -100, 100).T
            label = f"{CONTROLLERS[new].label} below {CONTROLLERS[old].label}"
            ax.errorbar(
                value, y, xerr=[value - low, high - value], fmt="o", ms=3, lw=1.2, color=look(new)["color"], label=label
            )
        ax.axvline(0, color=BLACK, lw=0.8)
        panel(ax, f"{regime}-driven", "Reduction of the peak error (%)")
        ax.grid(False, axis="y")
        for boundary in np.arange(1, len(there)) - 0.5:
            ax.axhline(boundary, color=BLACK, lw=0.3)
        ax.set_ylim(len(there) - 0.5, -0.5)
        ax.set_yticks(range(len(there)), [MANOEUVRES[m].label for m in there])
    legend(figure, axes[0], 2, 0.5)
    caption = (
        "Peak error with the clearance model below that with a disturbance observer, on the same vehicle and noise: "
        "median and 95 % interval; right of zero the clearance model pays. Clipped at ± 100 %."
    )
    return Drawing(
        "vehicle_comparison_pairs", figure, caption, "Paired comparisons of clearance model and disturbance observer."
    )


def chatter(rows: pd.DataFrame) -> Drawing:
    """Error against steering effort, both over those of SMC on the same vehicles."""
    figure = sheet(3.9)
    axes = figure.subplots(1, len(REGIMES), sharey=True, sharex=True)
    index = ["manoeuvre", "regime", "seed"]
    base = rows[rows["controller"] == "smc"].set_index(index)
    for ax, regime in zip(axes, REGIMES):
        for i, name in enumerate(names_of(rows)):
            one = rows[(rows["controller"] == name) & (rows["regime"] == regime)].set_index(index)
            ratios = (one[m] / base[m].reindex(one.index) for m in ("servo_fast_rate", "peak_e_y"))
            fast, error = (float(np.median(ratio.fillna(1.0))) for ratio in ratios)
            marker = "^" if max(fast, error) > LARGEST else MARKERS[i % len(MARKERS)]
            look_of = {"color": look(name)["color"], "label": CONTROLLERS[name].label, "marker": marker}
            ax.plot(min(fast, LARGEST), min(error, LARGEST), ms=5, ls="none", **look_of)
        panel(ax, f"{regime}-driven", "Servo rate above 3 Hz over SMC's", "Peak error over SMC's" * (ax is axes[0]))
        ax.axhline(1, color=BLACK, lw=0.6)
        ax.axvline(1, color=BLACK, lw=0.6)
        ax.set(xscale="log", yscale="log")
        ax.set_xticks(RATIOS, [f"{v:g}" for v in RATIOS])
        ax.set_yticks(RATIOS, [f"{v:g}" for v in RATIOS])
        ax.minorticks_off()
    legend(figure, axes[0], 4)
    caption = (
        "Medians over all manoeuvres and vehicles of the ratio to SMC on the same run: below the horizontal line the "
        "error is smaller than SMC's, to the right of the vertical line the servo steers faster. Triangles: ratios "
        f"beyond {LARGEST:g}."
    )
    return Drawing("vehicle_comparison_effort", figure, caption, "Peak error over fast steering of every controller.")
