"""Friction damper with backlash: its force under an earthquake's motion, predicted from characterisation records only.

Four elements are fitted to the sinusoidal records and then predict KocaeliDBE: Kelvin-Voigt with gap, Bouc-Wen without
gap, Bouc-Wen with a gap that stays where it is, and Bouc-Wen with dead travel that starts anew at each reversal.

    python -m experiments.real.damper --out results/real_damper
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import scipy.optimize
from matplotlib.figure import Figure

from clearance_mj.clearance import gap as penetration
from clearance_mj.identify import bouc_wen

from .records import DamperRecord, read_damper
from .script import run

CHARACTERISATION = (
    "0.5Hz30lbtension1amplitude", "1Hz30lbtension0.5amplitude", "1Hz30lbtension1amplitude",
    "1Hz30lbtension1.5amplitude", "2Hz30lbtension0.5amplitude",
)  # fmt: skip
PREDICT = "KocaeliDBE"
EVERY = 4
"""samples: the loops are fitted at 256 Hz, the prediction is made at the record's own rate"""
BLOCK = 1.0
"""s, of the bootstrap"""
DRAWS = 2000
COLORS = {"Kelvin-Voigt, gap": "#8c8c8c", "Bouc-Wen, no gap": "#56b4e9", "Bouc-Wen, fixed gap": "#e69f00",
          "Bouc-Wen, re-opening gap": "#d55e00"}  # fmt: skip


@dataclass(frozen=True)
class KelvinVoigtGap:
    """f = k g + c ġ while in contact, with g the penetration beyond ± gap around offset."""

    k: float
    c: float
    gap: float
    offset: float

    def force(self, record: DamperRecord) -> np.ndarray:
        """(n,) N."""
        g, rate = _gap_motion(record, self.gap, self.offset)
        return self.k * g + self.c * rate


def _gap_motion(record, gap, offset):
    g = penetration(record.displacement - offset, gap)
    return g, np.where(g != 0, np.gradient(record.displacement, record.time), 0.0)


def fit_kelvin_voigt(records) -> KelvinVoigtGap:
    """Least squares: k and c >= 0 are linear, gap and offset searched for from several starts."""
    force = np.concatenate([r.force for r in records])
    speed = max(np.abs(np.gradient(r.displacement, r.time)).max() for r in records)
    reach = max(np.abs(r.displacement).max() for r in records)

    def linear(theta):
        motion = [np.concatenate(m) for m in zip(*(_gap_motion(r, abs(theta[0]), theta[1]) for r in records))]
        (k, c), residual = scipy.optimize.nnls(np.column_stack((motion[0] / reach, motion[1] / speed)), force)
        return residual, k / reach, c / speed

    starts = [(share * reach, 0.0) for share in (0.005, 0.02, 0.05, 0.1, 0.3)]
    best = min((scipy.optimize.minimize(lambda t: linear(t)[0], s, method="Nelder-Mead") for s in starts),
               key=lambda s: s.fun)  # fmt: skip
    _, k, c = linear(best.x)
    return KelvinVoigtGap(float(k), float(c), abs(float(best.x[0])), float(best.x[1]))


def predict(records, target) -> dict:
    """Fit the four elements to records; {name: (element, predicted force of the target)}."""
    channels = [[getattr(r, name)[::EVERY] for r in records] for name in ("time", "displacement", "force")]
    kelvin = fit_kelvin_voigt(records)
    found = {"Kelvin-Voigt, gap": (kelvin, kelvin.force(target))}
    options = {"Bouc-Wen, no gap": {"gap": 0.0}, "Bouc-Wen, fixed gap": {},
               "Bouc-Wen, re-opening gap": {"dead_travel": "reopening"}}  # fmt: skip
    for name, option in options.items():
        fit = bouc_wen(*channels, **option)
        # of the target only the first sample's force is used: it says at which end of the dead travel the slider stood
        reopening = fit.dead_travel == "reopening"
        start = fit.offset_of(target.displacement[0], target.force[0]) if reopening else None
        found[name] = (fit, fit.force(target.time, target.displacement, start))
    return found


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


def error_shares(predicted, record: DamperRecord) -> dict:
    """Shares of the squared error while pulling, while pushing and in the dead travel (force below 10 % of peak)."""
    squared = (predicted - record.force) ** 2
    small = np.abs(record.force) < 0.1 * np.abs(record.force).max()
    parts = {"dead travel": small, "pulling (f > 0)": ~small & (record.force > 0),
             "pushing (f < 0)": ~small & (record.force < 0)}  # fmt: skip
    return {name: float(squared[at].sum() / squared.sum()) for name, at in parts.items()}


def analyse(folder: Path) -> dict:
    """Everything this experiment finds."""
    records = [read_damper(folder / "backlash_damper" / f"{n}.json.gz") for n in CHARACTERISATION]
    target = read_damper(folder / "backlash_damper" / f"{PREDICT}.json.gz")
    found = predict(records, target)
    predictions = {name: force for name, (_, force) in found.items()}
    draws = block_bootstrap(predictions, target)
    best = "Bouc-Wen, re-opening gap"
    rows = []
    for name, force in predictions.items():
        low, high = np.percentile(draws[name], (2.5, 97.5))
        worse = np.percentile(draws[name] - draws[best], (2.5, 97.5))
        rows.append({"element": name, "nrmse": nrmse(force, target.force), "low": low, "high": high,
                     "above_reopening_low": worse[0], "above_reopening_high": worse[1]})  # fmt: skip
    return {"records": records, "target": target, "found": found, "rows": rows,
            "shares": error_shares(predictions[best], target)}  # fmt: skip


def draw(result) -> Figure:
    figure = Figure(figsize=(11, 9), layout="constrained")
    over_time, below = figure.subfigures(2, 1, height_ratios=(1, 1.1))
    ax, target = over_time.subplots(), result["target"]
    part = (target.time > 5) & (target.time < 14)
    ax.plot(target.time[part], target.force[part] / 1e3, "k", lw=1.2, label="measured")
    for name, (_, force) in result["found"].items():
        ax.plot(target.time[part], force[part] / 1e3, color=COLORS[name], lw=0.8, label=name)
    ax.set(title=f"{PREDICT}, predicted", xlabel="time (s)", ylabel="force (kN)")
    ax.legend(ncols=5, fontsize=8)
    loops = below.subplots(1, 3)
    shown = [
        (target, PREDICT),
        (result["records"][1], CHARACTERISATION[1]),
        (result["records"][2], CHARACTERISATION[2]),
    ]
    for ax, (record, title) in zip(loops, shown):
        ax.plot(1e3 * record.displacement, record.force / 1e3, "k", lw=0.5)
        for name in ("Bouc-Wen, fixed gap", "Bouc-Wen, re-opening gap"):
            fit, force = result["found"][name]
            force = force if record is target else fit.force(record.time, record.displacement)
            ax.plot(1e3 * record.displacement, force / 1e3, color=COLORS[name], lw=0.8)
        ax.set(title=title, xlabel="displacement (mm)", ylabel="force (kN)")
    return figure


def write(result: dict, out: Path) -> None:
    """Write the table and the figure into a folder and print what was found."""
    out.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(result["rows"]).to_csv(out / "damper.csv", index=False)
    draw(result).savefig(out / "damper.png", dpi=120)
    for row in result["rows"]:
        print(
            f"{row['element']}: NRMSE {row['nrmse']:.3f} (95 % {row['low']:.3f} to {row['high']:.3f}), above the "
            f"re-opening gap by {row['above_reopening_low']:.3f} to {row['above_reopening_high']:.3f}"
        )
    for name, (element, _) in result["found"].items():
        if isinstance(element, KelvinVoigtGap):
            print(name, element)
            continue
        fit = element.estimates
        values = ", ".join(f"{n} {v:.3g} ± {s:.1g}" for n, v, s in zip(fit.names, fit.value, fit.std))
        print(
            f"{name}: {values}; slides at {element.yield_force:.0f} N; unidentified: {element.unidentified or 'none'}"
        )
    print("squared error left by the re-opening gap:", {n: round(s, 2) for n, s in result["shares"].items()})


def main(arguments=None) -> int:
    return run(analyse, write, __doc__, "the damper's data set", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
