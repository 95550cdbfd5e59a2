"""What the items on motion control (Section 4.3) share: cases, tables and words about runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.stats

from clearance_mj.report.tables import Column, Table
from clearance_mj.report.vehicle import METRICS, histories
from clearance_mj.vehicle.experiment import CONTROLLERS, GAP, LENGTH_FACTORS, REGIMES, Case

from .context import Context
from .motion_figures import spread_figure
from .published import Printed
from .result import Result
from .texts import texts

__all__ = [
    "Median",
    "comparison",
    "drawn",
    "knows",
    "median",
    "over_seeds",
    "reduction",
    "seeds_table",
    "setting",
    "tabulated",
]

SEEDS, QUICK_SEEDS = 30, 6
QUICK_CONTROLLERS = ("smc", "smc-cm", "mpc")
"""Those of the article"""
SHOWN = ("peak_e_y", "rms_e_y", "peak_e_psi", "peak_yaw_rate_error", "peak_yaw_rate", "peak_lateral_acceleration")


def comparison(
    controllers: Sequence[str] | None = None, speeds: Sequence[float] = tuple(LENGTH_FACTORS), **settings
) -> list[Case]:
    """Cases of every controller at every speed in both regimes.

    Parameters
    ----------
    controllers : sequence of str, optional
        Of `CONTROLLERS`; default: all.
    speeds : sequence of float
        km/h.
    **settings
        Other fields of `Case`.
    """
    names = CONTROLLERS if controllers is None else controllers
    return [Case(name, speed, regime=r, **settings) for speed in speeds for r in REGIMES for name in names]


class Median(NamedTuple):
    """Median over seeds."""

    value: float
    low: float  # 95 % confidence interval, distribution-free
    high: float


def median(values) -> Median:
    """Median with its exact 95 % confidence interval from order statistics.

    Parameters
    ----------
    values : array_like
        One of each seed.
    """
    values = np.asarray(values, dtype=float)
    interval = scipy.stats.quantile_test(values, q=np.median(values), p=0.5).confidence_interval(0.95)
    return Median(float(np.median(values)), float(interval.low), float(interval.high))


def setting(speed: float) -> str:
    """Words on what is driven.

    Parameters
    ----------
    speed : float
        km/h.
    """
    case = Case("smc", speed)
    needed = case.task.path.needed_acceleration(case.task.speed)
    return (
        f"Double lane change at {speed:g} km/h that needs {needed:.1f} m/s², multi-body plant, half-gap "
        f"{np.degrees(GAP):.1f}° at the road wheel, noise of sensors and road. Torque-driven: "
        f"trail {1e3 * REGIMES['torque'].trail:g} mm, no friction; friction-driven: trail "
        f"{1e3 * REGIMES['friction'].trail:g} mm, as with a servo at the rack that carries the rest of the moment, and "
        f"{REGIMES['friction'].friction:g} N m of friction at the road wheel, more than the moment. Controllers are "
        "tuned alike on other lane changes without clearance and see the same "
        f"{case.preview:g} s of road ahead."
    )


def knows(names: Sequence[str] = tuple(CONTROLLERS)) -> dict[str, str]:
    """What each controller was told, by its label.

    Parameters
    ----------
    names : sequence of str
        Controllers.
    """
    nominal = "the nominal vehicle, the servo, the steering's stiffness without clearance"
    return {CONTROLLERS[n].label: f"{nominal}; of the clearance: {CONTROLLERS[n].prior}" for n in names}


def _spread(context, speed) -> list[dict]:
    """Rows of the controllers in both regimes over vehicles and noises; the same for each controller."""
    seeds = range(1, 1 + (QUICK_SEEDS if context.quick else SEEDS))
    names = QUICK_CONTROLLERS if context.quick else tuple(CONTROLLERS)
    cases = [case for seed in seeds for case in comparison(names, (speed,), spread=True, seed=seed)]
    return [outcome.row() for outcome in context.drives(cases)]


def over_seeds(rows, controller: str, regime: str, metric: str) -> np.ndarray:
    """Values of a metric, one of each seed, in the order of the seeds.

    Parameters
    ----------
    rows : sequence of dict
        Of `Outcome.row`.
    controller, regime, metric : str
        Which.
    """
    return np.array([r[metric] for r in rows if (r["controller"], r["regime"]) == (controller, regime)])


def reduction(rows, new: str, old: str, regime: str, metric: str) -> np.ndarray:
    """By how much a controller's metric is below another's under the same seed, %.

    Parameters
    ----------
    rows : sequence of dict
        Of `Outcome.row`.
    new, old, regime, metric : str
        Which.
    """
    return 100 * (1 - over_seeds(rows, new, regime, metric) / over_seeds(rows, old, regime, metric))


def seeds_table(rows, name: str) -> Table:
    """Median and its 95 % interval of what the article reports, of each controller.

    Parameters
    ----------
    rows : sequence of dict
        Of `Outcome.row`.
    name : str
        Of the table.
    """
    columns = [Column("Regime"), Column("Controller")]
    for metric in SHOWN:
        q = METRICS[metric]
        columns += [Column("median", q.unit, q.form, q.label), Column("95 % interval", "", "", q.label)]
    body = []
    for regime in REGIMES:
        for controller in dict.fromkeys(r["controller"] for r in rows):
            cells = [regime, CONTROLLERS[controller].label]
            for metric in SHOWN:
                q = METRICS[metric]
                found = median(q.scale * over_seeds(rows, controller, regime, metric))
                cells += [found.value, f"{found.low:{q.form}} to {found.high:{q.form}}"]
            body.append(tuple(cells))
    n = len({r["seed"] for r in rows})
    return Table(name, f"Medians over {n} vehicles and noises, with 95 % intervals", tuple(columns), tuple(body))


def drawn(context: Context, item: str, speed: float, controllers: Sequence[str], quantities: Sequence[str]) -> Result:
    """An item that is a figure of histories.

    Parameters
    ----------
    context : Context
        Says how much to do.
    item : str
        Its name.
    speed : float
        km/h.
    controllers, quantities : sequence of str
        What is drawn.
    """
    found = {(o.case.controller, o.case.regime): o for o in context.drives(comparison(speeds=(speed,)))}
    drawings, data = [], {}
    for regime in REGIMES:
        outcomes = [found[name, regime] for name in controllers]
        drawings.append(histories(outcomes, f"{item}_{regime}", quantities))
        data[f"{item}_{regime}"] = _history_rows(outcomes, quantities)
    data[f"{item}_metrics"] = [o.row() for o in found.values()]
    return Result(
        **texts(item),
        method=setting(speed) + " Nominal vehicle, seed 0.",
        shows=_shows(found, controllers, quantities),
        drawings=drawings,
        data=data,
        knows=knows(controllers),
    )


def _history_rows(outcomes, quantities):
    n = min(o.run.time.size for o in outcomes)
    columns = {"time_s": outcomes[0].run.time[:n]}
    columns |= {f"{o.case.controller} {q}": getattr(o.run, q)[:n] for o in outcomes for q in quantities}
    return [{key: float(f"{v:.7g}") for key, v in zip(columns, values)} for values in zip(*columns.values())]


def _shows(found, controllers, quantities):
    words = []
    for regime in REGIMES:
        for q in quantities:
            metric = METRICS[f"peak_{q}"]
            peaks = (
                f"{CONTROLLERS[c].label} {metric.scale * found[c, regime].run.metrics()[f'peak_{q}']:{metric.form}}"
                for c in controllers
            )
            words.append(f"{metric.label} ({metric.unit}, {regime}-driven): {', '.join(peaks)}.")
    return " ".join(words)


def tabulated(context: Context, item: str, source: int, speed: float, metrics: dict[str, str]) -> Result:
    """An item that is a table: the article's numbers beside medians over vehicles and noises.

    Parameters
    ----------
    context : Context
        Says how much to do.
    item : str
        Its name.
    source : int
        Number of the article's table.
    speed : float
        km/h.
    metrics : dict of str to str
        Our metric for each of the article's quantities.
    """
    rows, printed = _spread(context, speed), Printed.load(source).cells.to_dict("index")
    others = [name for name in ("smc", "mpc") if name in next(iter(printed.values()))]
    return Result(
        **texts(item),
        method=setting(speed)
        + f" {len({r['seed'] for r in rows})} vehicles (mass ± 10 %, cornering stiffness ± 15 %, friction 0.8 to 1 of "
        "nominal, which is all that controllers know) and noises, the same for each controller.",
        shows=_reductions(rows, others, metrics.values()),
        drawings=(spread_figure(rows, item, list(metrics.values())),),
        data={item: rows},
        tables=(_beside(rows, printed, metrics, others), seeds_table(rows, f"{item}_seeds")),
        knows=knows(tuple(dict.fromkeys(r["controller"] for r in rows))),
    )


def _beside(rows, printed, metrics, others) -> Table:
    names = ("smc-cm", *others)
    columns = [Column("Quantity"), Column("From")]
    columns += [Column(CONTROLLERS[n].label, "", ".3g") for n in names]
    columns += [Column(f"SMC-CM below {CONTROLLERS[n].label}", "%", ".1f") for n in others]
    columns += [Column("95 % interval", "%") for _ in others]
    body = []
    for quantity, metric in metrics.items():
        q, article = METRICS[metric], printed[quantity]
        scale = 1e3 if metric.endswith("e_y") else 1.0
        values = [scale * abs(float(article[n.replace("-", "_")])) for n in names]
        below = [100 * (1 - values[0] / v) for v in values[1:]]
        label = f"{q.label} ({q.unit})"
        body.append((label, "article", *values, *below, *["" for _ in others]))
        for regime in REGIMES:
            ours = [q.scale * float(np.median(over_seeds(rows, n, regime, metric))) for n in names]
            found = [median(reduction(rows, "smc-cm", n, regime, metric)) for n in others]
            limits = [f"{m.low:.1f} to {m.high:.1f}" for m in found]
            body.append((label, f"ours, {regime}-driven", *ours, *(m.value for m in found), *limits))
    return Table("beside", "The article's numbers and ours: medians over seeds", tuple(columns), tuple(body))


def _reductions(rows, others, metrics) -> str:
    words = []
    for regime in REGIMES:
        for other in others:
            parts = []
            for metric in metrics:
                found = median(reduction(rows, "smc-cm", other, regime, metric))
                parts.append(f"{METRICS[metric].label} {found.value:.0f} % ({found.low:.0f} to {found.high:.0f})")
            words.append(f"SMC-CM below {CONTROLLERS[other].label}, {regime}-driven: {', '.join(parts)}.")
    return " ".join(words)
