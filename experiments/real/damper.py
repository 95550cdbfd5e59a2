"""Friction damper with backlash: its force under an earthquake's motion, predicted from characterisation records only.

Five elements are fitted to the sinusoidal records. Each record is predicted from the other four; the element that does
so best predicts KocaeliDBE, whose force plays no part in that choice.

    python -m experiments.real.damper --out results/real_damper
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from clearance_mj.core.tasks import run_tasks
from experiments.joints.hysteresis import bouc_wen
from experiments.real.band_brake import BandBrakeFit, band_brake, speed, travel_since_reversal

from .records import DamperRecord, read_damper
from .script import run

CHARACTERISATION = (
    "0.5Hz30lbtension1amplitude", "1Hz30lbtension0.5amplitude", "1Hz30lbtension1amplitude",
    "1Hz30lbtension1.5amplitude", "2Hz30lbtension0.5amplitude",
)  # fmt: skip
PREDICT = "KocaeliDBE"
EVERY = 4  # samples: the elements are fitted at 256 Hz, the prediction is made at the record's own rate
REVERSAL = 5e-4  # m, by which a reversal of the motion is left before it counts
SPEED_OVER = 0.015  # s, to each side
FIRST_PULLS = 7.7  # s, when the first two large pulls of the earthquake are over
BLOCK = 1.0  # s, of the bootstrap
DRAWS = 2000
NO_CHARGE = {"start_pull": 1.0, "start_push": 1.0, "rise_pull": 1.0, "rise_push": 1.0, "charge_travel": 1e-3,
             "charge": 0.5}  # fmt: skip
BRAKES: dict[str, dict[str, float]] = {
    "band brake, no damper": {"damping": 0.0}, "band brake, no charge": NO_CHARGE, "band brake": {},
}  # fmt: skip
BOUC_WEN: dict[str, dict[str, Any]] = {
    "Bouc-Wen, no gap": {"gap": 0.0}, "Bouc-Wen, re-opening gap": {"dead_travel": "reopening"},
}  # fmt: skip
ELEMENTS = (*BOUC_WEN, *BRAKES)
COLORS = {"Bouc-Wen, re-opening gap": "#56b4e9", "band brake": "#d55e00"}


@dataclass(frozen=True, eq=False)
class Task:
    """One element to fit."""

    element: str
    records: Sequence[DamperRecord]  #: to fit
    targets: Sequence[DamperRecord]  #: to predict
    reach: float  #: m, travel since a reversal up to which samples count


def fit_and_predict(task: Task) -> tuple[Any, list[np.ndarray]]:
    """Fit an element; it and the targets' forces. Of a target's force only the first sample is used, for the start."""
    time, x, f = ([getattr(r, name)[::EVERY] for r in task.records] for name in ("time", "displacement", "force"))
    if task.element in BRAKES:
        use = [travel_since_reversal(each, REVERSAL) <= task.reach for each in x]
        brake = band_brake(time, x, f, use, SPEED_OVER, BRAKES[task.element])
        return brake, [brake.force(r.time, r.displacement, r.force[0]) for r in task.targets]
    fit = bouc_wen(time, x, f, **BOUC_WEN[task.element])
    reopening = fit.dead_travel == "reopening"
    starts = [fit.offset_of(r.displacement[0], r.force[0]) if reopening else None for r in task.targets]
    return fit, [fit.force(r.time, r.displacement, s) for r, s in zip(task.targets, starts)]


def nrmse(predicted, measured) -> float:
    """RMS error over the standard deviation of the measured force."""
    return float(np.sqrt(np.mean((predicted - measured) ** 2)) / np.std(measured))


def block_bootstrap(predictions: dict, record: DamperRecord, seed: int = 0) -> dict:
    """(draws,) NRMSE of each prediction over the same drawn blocks, so that differences are paired."""
    length = round(BLOCK * record.fs)
    count = record.force.size // length
    measured = record.force[: count * length].reshape(count, length)
    draws = np.random.default_rng(seed).integers(count, size=(DRAWS, count))
    mean, power = measured.mean(axis=1), (measured**2).mean(axis=1)
    variance = power[draws].mean(axis=1) - mean[draws].mean(axis=1) ** 2
    errors = {n: ((p[: count * length].reshape(count, length) - measured) ** 2).mean(axis=1)
              for n, p in predictions.items()}  # fmt: skip
    return {n: np.sqrt(e[draws].mean(axis=1) / variance) for n, e in errors.items()}


def motion(record: DamperRecord) -> dict[str, float]:
    """Largest travel since a reversal (m) and largest speed (m/s)."""
    v = speed(record.time, record.displacement, SPEED_OVER)
    travel = travel_since_reversal(record.displacement, REVERSAL)
    return {"travel": float(travel.max()), "speed": float(np.abs(v).max())}


def error_shares(predicted, record: DamperRecord) -> tuple[dict, float]:
    """Shares of the squared error, by phase and until the first large pulls are over.

    Phases: dead travel (force below 10 % of peak), and as a pull or push grows or falls.
    """
    squared = (predicted - record.force) ** 2
    v = speed(record.time, record.displacement, SPEED_OVER)
    early = record.time < FIRST_PULLS
    small = np.abs(record.force) < 0.1 * np.abs(record.force).max()
    pull, loading = record.force > 0, record.force * v > 0
    parts = {"dead travel": small,
             "pull, loading": ~small & pull & loading, "pull, unloading": ~small & pull & ~loading,
             "push, loading": ~small & ~pull & loading, "push, unloading": ~small & ~pull & ~loading}  # fmt: skip
    shares = {name: float(squared[at].sum() / squared.sum()) for name, at in parts.items()}
    return shares, float(squared[early].sum() / squared.sum())


def doubts(brake: BandBrakeFit, target: DamperRecord) -> dict:
    """Return the NRMSE of predictions over what the records leave open.

    "drawn": 95 % limits over parameters drawn from their covariance; "uncharged" and "charged": with the band at the
    start as slid in full to push or to pull, which the first force does not tell.
    """
    values = brake.estimates.draw(200, seed=0)
    uncharged, charged = brake.value, brake.value
    uncharged[-1], charged[-1] = 0.0, 1.0
    motion_and_start = target.time, target.displacement, target.force[0]
    brakes = [BandBrakeFit.of(value, brake.speed_over) for value in (uncharged, charged, *values)]
    errors = [nrmse(each.force(*motion_and_start), target.force) for each in brakes]
    return {"drawn": np.percentile(errors[2:], (2.5, 97.5)).tolist(), "uncharged": errors[0], "charged": errors[1]}


def left_out(records: Sequence[DamperRecord], reach: float) -> dict[str, dict[str, tuple[float, float]]]:
    """NRMSE of each record predicted from the others, by element: within reach of a reversal, and of all of it."""
    tasks = [Task(e, [r for r in records if r is not out], [out], reach) for e in ELEMENTS for out in records]
    errors: dict[str, dict[str, tuple[float, float]]] = {e: {} for e in ELEMENTS}
    for task, (_, (force,)) in run_tasks(fit_and_predict, tasks):
        (out,) = task.targets
        near = travel_since_reversal(out.displacement, REVERSAL) <= reach
        name = next(n for n, r in zip(CHARACTERISATION, records) if r is out)
        errors[task.element][name] = nrmse(force[near], out.force[near]), nrmse(force, out.force)
    return errors


def analyse(folder: Path) -> dict:
    """Return the results of this experiment."""
    records = [read_damper(folder / "backlash_damper" / f"{n}.json.gz") for n in CHARACTERISATION]
    target = read_damper(folder / "backlash_damper" / f"{PREDICT}.json.gz")
    motions = {name: motion(r) for name, r in zip((*CHARACTERISATION, PREDICT), (*records, target))}
    reach = motions[PREDICT]["travel"]
    errors = left_out(records, reach)
    means = {e: np.mean([errors[e][n] for n in CHARACTERISATION], axis=0) for e in ELEMENTS}
    chosen = min(ELEMENTS, key=lambda e: means[e][0])
    results = {t.element: done for t, done in run_tasks(
        fit_and_predict, [Task(e, records, [target, *records], reach) for e in ELEMENTS])}  # fmt: skip
    predictions = {e: results[e][1][0] for e in ELEMENTS}
    draws = block_bootstrap(predictions, target)
    rows = []
    for name in ELEMENTS:
        low, high = np.percentile(draws[name], (2.5, 97.5))
        more, most = np.percentile(draws[name] - draws[chosen], (2.5, 97.5))
        rows.append({"element": name, "left_out": means[name][0], "left_out_whole": means[name][1],
                     "nrmse": nrmse(predictions[name], target.force), "low": low, "high": high,
                     "above_chosen_low": more, "above_chosen_high": most})  # fmt: skip
    shares, early = error_shares(predictions[chosen], target)
    return {"records": records, "target": target, "motions": motions, "left_out": errors, "chosen": chosen,
            "found": results, "rows": rows, "shares": shares, "share_of_first_pulls": early,
            "doubts": doubts(results["band brake"][0], target)}  # fmt: skip


def draw(result) -> Figure:
    figure = Figure(figsize=(11, 9), layout="constrained")
    over_time, below = figure.subfigures(2, 1, height_ratios=(1, 1.1))
    ax, target = over_time.subplots(), result["target"]
    part = (target.time > 5) & (target.time < 14)
    ax.plot(target.time[part], target.force[part] / 1e3, "k", lw=1.2, label="measured")
    for name, color in COLORS.items():
        ax.plot(target.time[part], result["found"][name][1][0][part] / 1e3, color=color, lw=0.9, label=name)
    ax.set(title=f"{PREDICT}, predicted", xlabel="time (s)", ylabel="force (kN)")
    ax.legend(ncols=3, fontsize=8)
    shown = ((target, PREDICT, "predicted", 0), (result["records"][0], "0.5 Hz, 1 in", "fitted", 1),
             (result["records"][4], "2 Hz, 0.5 in", "fitted", 5))  # fmt: skip
    for ax, (record, title, how, place) in zip(below.subplots(1, 3), shown):
        ax.plot(1e3 * record.displacement, record.force / 1e3, "k", lw=0.5)
        for name, color in COLORS.items():
            ax.plot(1e3 * record.displacement, result["found"][name][1][place] / 1e3, color=color, lw=0.8)
        ax.set(title=f"{title}, {how}", xlabel="displacement (mm)", ylabel="force (kN)")
    return figure


def summary(result: dict) -> dict:
    """Plain data for the JSON file."""
    brake = result["found"][result["chosen"]][0].estimates
    parameters = [
        {"name": n, "unit": p.unit, "value": float(v), "std": float(s)}
        for n, p, v, s in zip(brake.names, brake.parameters, brake.value, brake.std)
    ]
    folds = [{"element": e, "record": n, "within_reach": near, "whole": whole}
             for e, by in result["left_out"].items() for n, (near, whole) in sorted(by.items())]  # fmt: skip
    return {"chosen": result["chosen"], "rows": result["rows"], "left_out": folds, "motions": result["motions"],
            "shares_of_squared_error": result["shares"], "share_of_first_pulls": result["share_of_first_pulls"],
            "doubts": result["doubts"], "parameters": parameters}  # fmt: skip


def write(result: dict, out: Path) -> None:
    """Write the table, the figure and the numbers into a folder and print what was found."""
    out.mkdir(parents=True, exist_ok=True)
    numbers = summary(result)
    pd.DataFrame(result["rows"]).to_csv(out / "damper.csv", index=False)
    (out / "damper.json").write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    draw(result).savefig(out / "damper.png", dpi=120)
    for row in result["rows"]:
        print(
            f"{row['element']}: left-out records {row['left_out']:.3f} (all samples {row['left_out_whole']:.3f}); "
            f"{PREDICT} NRMSE {row['nrmse']:.3f} (95 % {row['low']:.3f} to {row['high']:.3f}), above the chosen by "
            f"{row['above_chosen_low']:.3f} to {row['above_chosen_high']:.3f}"
        )
    print(f"chosen by left-out records: {result['chosen']}")
    print(", ".join(f"{p['name']} {p['value']:.3g} ± {p['std']:.1g} {p['unit']}" for p in numbers["parameters"]))
    print("its squared error:", {n: round(s, 2) for n, s in result["shares"].items()})
    print(
        f"its share until {FIRST_PULLS} s: {result['share_of_first_pulls']:.2f}; NRMSE, what is open:", result["doubts"]
    )
    for name, m in result["motions"].items():
        print(f"{name}: up to {1e3 * m['travel']:.1f} mm from a reversal, {1e3 * m['speed']:.0f} mm/s")


def main(arguments=None) -> int:
    return run(analyse, write, __doc__, "the damper's data set", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
