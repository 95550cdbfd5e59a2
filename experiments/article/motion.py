"""Motion control (Section 4.3): histories of one vehicle, and medians over many beside the article's tables."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
import scipy.stats

from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table
from clearance_mj.report.vehicle import METRICS, histories, look
from clearance_mj.statistics.intervals import Interval
from clearance_mj.vehicle.experiment import CONTROLLERS, GAP, LENGTH_FACTORS, REGIMES, Case, Outcome

from .inputs import Runs
from .published import Printed
from .result import FONT, Item, Result, panel, rounded, sheet, to_table

SEEDS, QUICK_SEEDS = 30, 6
COMPARED = ("smc", "smc-cm", "mpc", "mpc-cm", "smc-dob", "mpc-dob", "smc-inverse")
"""Others are in `experiments.steering.comparison`"""
QUICK_CONTROLLERS = ("smc", "smc-cm", "mpc")  # Those of the article
SHOWN = ("peak_e_y", "rms_e_y", "peak_e_psi", "peak_yaw_rate_error", "peak_yaw_rate", "peak_lateral_acceleration")
WIDE = 20  # Ratio of the largest to the smallest value from which an axis is logarithmic


def comparison(
    controllers: Sequence[str] | None = None, speeds: Sequence[float] = tuple(LENGTH_FACTORS), **settings
) -> list[Case]:
    """Return cases of controllers (default: `COMPARED`) at speeds in km/h in both regimes.

    Settings are fields of `Case`.
    """
    names = COMPARED if controllers is None else controllers
    return [Case(name, speed, regime=r, **settings) for speed in speeds for r in REGIMES for name in names]


class Median(NamedTuple):
    """Median over seeds."""

    value: float
    low: float  # 95 % confidence interval, distribution-free
    high: float


def median(values: Iterable[float]) -> Median:
    """Return the median, one value of each seed, with its exact 95 % confidence interval from order statistics."""
    values = np.asarray(values, dtype=float)
    interval = scipy.stats.quantile_test(values, q=np.median(values), p=0.5).confidence_interval(0.95)
    return Median(float(np.median(values)), float(interval.low), float(interval.high))


def setting(speed: float) -> str:
    """Return words on the manoeuvre at a speed in km/h."""
    case = Case("smc", speed)
    needed = case.task.path.needed_acceleration(case.task.speed)
    return (
        f"Double lane change at {speed:g} km/h that needs {needed:.1f} m/s², multi-body plant, half-gap "
        f"{np.degrees(GAP):.1f}° at the road wheel, preview {case.preview:g} s, white noise of sensors and road."
    )


def regimes() -> str:
    """Return words on the regimes and the tuning."""
    return (
        f"Torque-driven: trail {1e3 * REGIMES['torque'].trail:g} mm, no friction. Friction-driven: trail "
        f"{1e3 * REGIMES['friction'].trail:g} mm and {REGIMES['friction'].friction:g} N m of friction at the road "
        "wheel, more than the aligning moment. Controllers are tuned alike, with this clearance, on other lane changes."
    )


def prior_information(names: Sequence[str] = COMPARED) -> dict[str, str]:
    """Return the prior information of controllers, of those with the same one together."""
    of_clearance: dict[str, list[str]] = {}
    for name in names:
        of_clearance.setdefault(CONTROLLERS[name].prior, []).append(CONTROLLERS[name].label)
    common = {"all": "nominal vehicle, servo, steering's stiffness without clearance; of the clearance in addition:"}
    return common | {"; ".join(labels): prior for prior, labels in of_clearance.items()}


# Figures 11 to 13.


def histories_of(item: Item, runs: Runs, speed: float, controllers: Sequence[str], quantities: Sequence[str]) -> Result:
    """Draw quantities over time of some controllers at a speed in km/h."""
    by_case = {(o.case.controller, o.case.regime): o for o in runs(comparison(speeds=(speed,)))}
    drawings, data = [], {}
    for regime in REGIMES:
        outcomes = [by_case[name, regime] for name in controllers]
        drawing = histories(outcomes, f"{item.name}_{regime}", quantities)
        caption = f"{regime.capitalize()}-driven; bottom panel: side of the clearance in contact."
        drawings.append(replace(drawing, caption=caption))
        data[f"{item.name}_{regime}"] = _over_time(outcomes, quantities)
    data[f"{item.name}_metrics"] = pd.DataFrame(o.row() for o in by_case.values())
    return Result(
        method=f"{setting(speed)} {regimes()} Nominal vehicle, seed 0.",
        shows=_peaks_in_words(by_case, controllers, quantities), drawings=drawings, data=data,
        prior_information=prior_information(),
    )  # fmt: skip


def _over_time(outcomes: Sequence[Outcome], quantities: Sequence[str]) -> pd.DataFrame:
    n = min(o.run.time.size for o in outcomes)
    columns = {"time_s": outcomes[0].run.time[:n]}
    columns |= {f"{o.case.controller} {q}": getattr(o.run, q)[:n] for o in outcomes for q in quantities}
    return rounded(pd.DataFrame(columns), 7)


def _peaks_in_words(by_case: Mapping, controllers: Sequence[str], quantities: Sequence[str]) -> str:
    words = []
    for regime in REGIMES:
        for q in quantities:
            metric = METRICS[f"peak_{q}"]
            peaks = (
                f"{CONTROLLERS[c].label} {metric.scale * by_case[c, regime].run.metrics()[f'peak_{q}']:{metric.form}}"
                for c in controllers
            )
            words.append(f"{metric.label} ({metric.unit}, {regime}-driven): {', '.join(peaks)}.")
    return " ".join(words)


# Tables 3 to 5.


def beside_published(
    item: Item, runs: Runs, quick: bool, number: int, speed: float, metrics: Mapping[str, str]
) -> Result:
    """Put medians over vehicles and noises at a speed in km/h beside the article's table of that number.

    ``metrics`` has our metric for each of the article's quantities.
    """
    names = QUICK_CONTROLLERS if quick else COMPARED
    seeds = range(1, 1 + (QUICK_SEEDS if quick else SEEDS))
    cases = [case for seed in seeds for case in comparison(names, (speed,), spread=True, seed=seed)]
    rows, printed = pd.DataFrame(o.row() for o in runs(cases)), Printed.load(number).numbers
    return Result(
        method=f"{setting(speed)} Regimes and tuning as for Figure 11. {len(seeds)} vehicles (mass ± 10 %, cornering "
        "stiffness ± 15 %, friction 0.8 to 1 of nominal; controllers know the nominal ones) and noises, the same for "
        "each controller.",
        shows="A reduction whose interval excludes 0 is significant.",
        drawings=(_draw_spread(rows, item.name, list(metrics.values())),),
        data={item.name: rows},
        tables=(_beside(rows, printed, metrics, [name for name in ("smc", "mpc") if name in printed]),),
        details=(seeds_table(rows, f"{item.name}_seeds"),),
        prior_information=prior_information(names),
    )


def over_seeds(rows: pd.DataFrame, controller: str, regime: str, metric: str) -> np.ndarray:
    """Return the values of a metric, one of each seed, in the order of the seeds."""
    return rows.loc[(rows["controller"] == controller) & (rows["regime"] == regime), metric].to_numpy()


def reduction(rows: pd.DataFrame, new: str, old: str, regime: str, metric: str) -> np.ndarray:
    """Return by how much a controller's metric is below another's under the same seed, %."""
    return 100 * (1 - over_seeds(rows, new, regime, metric) / over_seeds(rows, old, regime, metric))


def seeds_table(rows: pd.DataFrame, name: str) -> Table:
    """Return the median and its 95 % interval of what the article reports, of each controller."""
    columns = [Column("Regime"), Column("Controller")]
    for q in (METRICS[metric] for metric in SHOWN):
        columns += [Column("median", q.unit, q.form, q.label), Column("95 % interval", "", "", q.label)]
    body = []
    for regime in REGIMES:
        for controller in rows["controller"].unique():
            cells = [regime, CONTROLLERS[controller].label]
            for metric in SHOWN:
                q = METRICS[metric]
                interval = median(q.scale * over_seeds(rows, controller, regime, metric))
                cells += [interval.value, f"{interval.low:{q.form}} to {interval.high:{q.form}}"]
            body.append(cells)
    n = rows["seed"].nunique()
    return to_table(name, f"Medians over {n} vehicles and noises, with 95 % intervals", columns, body)


def _beside(rows: pd.DataFrame, printed: pd.DataFrame, metrics: Mapping[str, str], others: list[str]) -> Table:
    names = ("smc-cm", *others)
    columns = [Column("Quantity"), Column("From")]
    columns += [Column(CONTROLLERS[n].label, "", ".3g") for n in names]
    columns += [Column(f"SMC-CM below {CONTROLLERS[n].label}", "%", ".1f") for n in others]
    body = []
    for quantity, metric in metrics.items():
        q = METRICS[metric]
        scale = 1e3 if metric.endswith("e_y") else 1.0
        values = [scale * abs(printed.at[quantity, n.replace("-", "_")]) for n in names]
        below = [100 * (1 - values[0] / v) for v in values[1:]]
        label = f"{q.label} ({q.unit})"
        body.append((label, "article", *values, *below))
        for regime in REGIMES:
            ours = [q.scale * float(np.median(over_seeds(rows, n, regime, metric))) for n in names]
            intervals = [median(reduction(rows, "smc-cm", n, regime, metric)) for n in others]
            body.append((label, f"ours, {regime}-driven", *ours, *(Interval(*m) for m in intervals)))
    caption = "The article's numbers and ours: medians over seeds, reductions with 95 % intervals"
    return to_table("beside", caption, columns, body)


def _draw_spread(rows: pd.DataFrame, item: str, metrics: Sequence[str]) -> Drawing:
    """Every seed of every controller, with the median; one row of panels per metric, one column per regime."""
    figure = sheet(2.3 * len(metrics) + 0.3)
    axes = figure.subplots(len(metrics), len(REGIMES), squeeze=False, sharey="row")
    jitter, names = np.random.default_rng(0), rows["controller"].unique()
    for line, metric in zip(axes, metrics):
        q = METRICS[metric]
        scale = "log" if rows[metric].max() > WIDE * rows[metric].min() else "linear"
        for ax, regime in zip(line, REGIMES):
            for i, controller in enumerate(names):
                values = q.scale * over_seeds(rows, controller, regime, metric)
                x = i + jitter.uniform(-0.25, 0.25, values.size)
                ax.plot(x, values, "o", ms=2.2, color=look(controller)["color"], alpha=0.7, mew=0)
                ax.plot([i - 0.35, i + 0.35], [np.median(values)] * 2, color="black", lw=1.4)
            panel(ax, f"{regime}-driven", "", f"{q.label} ({q.unit})" if regime == "torque" else "")
            ax.set_xticks(range(len(names)), [CONTROLLERS[n].label for n in names], rotation=35, ha="right")
            ax.tick_params(axis="x", labelsize=FONT - 1.5)
            ax.set_yscale(scale)
            ax.yaxis.set_major_formatter("{x:g}")
    caption = "Each mark is one vehicle and noise, the line the median of a controller."
    return Drawing(item, figure, caption, f"Spread of {', '.join(METRICS[m].label for m in metrics)} over seeds.")
