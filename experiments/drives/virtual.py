"""Virtual gear drives with physics of their own, and how near identification from logs comes to what they are.

    python -m experiments.drives.virtual --first 100 --seeds 20 --out results/drives.csv
    python -m experiments.drives.virtual --first 100 --seeds 20 --side motor --out results/drives_motor_side.csv

Two inertias with teeth between them, integrated at 20 kHz: play and tooth stiffness, efficiency that depends on which
way power flows (smoothly over speed), Dahl's friction and drag at both ends, a servo that follows a sum of sines. All
numbers are drawn. Logs are four runs of 20 s under different loads, with noise; synthetic.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from clearance_mj.core.jit import jit
from clearance_mj.drives import DriveRecord, fit_drive, fit_motor_side
from clearance_mj.report.tables import write_csv
from experiments.script import run

FS, FINE = 500.0, 40  # Hz, and steps of the integration between samples
SECONDS = 20.0
LOADS = (0.0, 0.6, 1.5, -1.0)  # of the torque that is usual, in runs to identify
OTHER = 1.0  # in the run that is predicted
NOISE = 2e-3  # of the range of each channel
CONFIDENCE = 1.645  # standard deviations of a 90 % interval
TARGETS = {"play": 0.03, "stiffness": 0.1, "efficiency": 0.02}


@dataclass(frozen=True)
class Gear:
    """A drive as it really is; torques and angles of teeth and load at the load's end, SI."""

    ratio: float  #: the load's angle over the motor's
    play: float  #: rad, to either side
    stiffness: float  #: N m/rad
    efficiency: float
    usual: float  #: N m, torque of the load
    friction: tuple[float, float]  #: N m of Dahl's friction at motor and load
    presliding: tuple[float, float]  #: rad
    drag: tuple[float, float]  #: N m s/rad
    inertia: tuple[float, float]  #: kg m²

    @classmethod
    def drawn(cls, seed: int) -> Gear:
        """Draw a drive."""
        rng = np.random.default_rng((seed, 3611))

        def about(value: float, factor: float = 1.5) -> float:
            return float(value * factor ** rng.uniform(-1, 1))

        n, usual = about(0.1, 3.0), about(5.0, 3.0)
        at_motor = usual * n
        return cls(
            n, about(0.01, 2.0), about(60.0 * usual), float(rng.uniform(0.7, 0.95)), usual,
            (about(0.1 * at_motor), about(0.03 * usual)), (about(0.02 / n), about(0.005)),
            (about(2e-3 * at_motor * n), about(2e-3 * usual)), (about(2e-3 * at_motor * n), about(1e-3 * usual)),
        )  # fmt: skip

    def run(self, name: str, load: float, seed: int) -> DriveRecord:
        """Run it under a constant load and a weak spring, with noise."""
        rng = np.random.default_rng((seed, 77))
        at = np.arange(round(SECONDS * FS * FINE)) / (FS * FINE)
        rates, phases = 2 * np.pi * np.array([0.2, 0.33, 0.9]) * rng.uniform(0.8, 1.2, 3), rng.uniform(0, 6, 3)
        wanted = np.sum(np.array([0.5, 0.3, 0.05])[:, None] * np.sin(rates[:, None] * at + phases[:, None]), axis=0)
        motion = _march(
            wanted / self.ratio, 1 / (FS * FINE), FINE, self.ratio, self.play, self.stiffness, self.efficiency,
            load * self.usual, 0.5 * self.usual, *self.friction, *self.presliding, *self.drag, *self.inertia,
        )  # fmt: skip
        noise = NOISE * np.ptp(motion, axis=0) * rng.normal(size=motion.shape)
        return DriveRecord(name, FS, *(motion + noise).T)


@jit
def _march(wanted, step, fine, n, play, k, eta, load, spring, f_m, f_l, w_m, w_l, d_m, d_l, j_m, j_l):  # type: ignore[no-untyped-def]
    """Motor's angle and torque, load's angle and torque (n_t, 4), semi-implicit Euler."""
    out = np.empty((wanted.size // fine, 4))
    stiff = 2e3 * (f_m + n * abs(load)) / 0.5 * n + 50 * n * n * k
    lead = 2 * np.sqrt(stiff * j_m)
    x_m, v_m, x_l, v_l, z_m, z_l = wanted[0], 0.0, n * wanted[0], 0.0, 0.0, 0.0
    before = wanted[0]
    kept = np.zeros(4)
    for i in range(wanted.size):
        speed = (wanted[i] - before) / step
        before = wanted[i]
        u = stiff * (wanted[i] - x_m) + lead * (speed - v_m)
        lag, rate = n * x_m - x_l, n * v_m - v_l
        torque = 0.0
        if lag > play:
            torque = max(0.0, k * (lag - play) + 0.01 * k * rate)
        elif lag < -play:
            torque = min(0.0, k * (lag + play) + 0.01 * k * rate)
        way = np.tanh(torque * v_l / (abs(torque) + 1e-12) / 0.01)
        z_m += step * v_m * (1 - z_m / w_m * (1.0 if v_m > 0 else -1.0))
        z_l += step * v_l * (1 - z_l / w_l * (1.0 if v_l > 0 else -1.0))
        v_m += step / j_m * (u - f_m * z_m / w_m - d_m * v_m - n * torque * eta ** (-way))
        v_l += step / j_l * (torque - load - spring * x_l - f_l * z_l / w_l - d_l * v_l)
        x_m += step * v_m
        x_l += step * v_l
        kept[0] += x_m
        kept[1] += u
        kept[2] += x_l
        kept[3] += torque
        if i % fine == fine - 1:
            out[i // fine] = kept / fine
            kept[:] = 0.0
    return out


def judge(seed: int) -> list[dict]:
    """Rows of one drive: each number beside its truth, and errors of a run that it was not found from."""
    gear = Gear.drawn(seed)
    fit = fit_drive([gear.run(f"load {load:g}", load, 10 * seed + i) for i, load in enumerate(LOADS)])
    d, e = fit.drive, fit.estimates
    std, n = dict(zip(e.names, e.varied_std)), abs(d.ratio)

    def ratio_to(name: str, relative_std: float) -> float:
        """Return the relative standard deviation of efficiency over a number whose own is given, as they correlate."""
        rho = e.correlation[e.names.index(name)][e.names.index("efficiency")]
        return float(np.sqrt(relative_std**2 + std["efficiency"] ** 2 - 2 * rho * relative_std * std["efficiency"]))

    estimates = {
        "play": (n * d.backlash, gear.play, n * std.get("backlash", np.inf)),
        "stiffness": (
            d.efficiency / (n**2 * d.compliance) if d.compliance else np.inf, gear.stiffness,
            gear.stiffness * ratio_to("compliance", std["compliance"] / d.compliance if d.compliance else np.inf),
        ),
        "efficiency": (
            d.efficiency * np.exp(-d.capstan), gear.efficiency,
            gear.efficiency * ratio_to("capstan", std["capstan"]),
        ),
    }  # fmt: skip
    rows = [
        {"drive": seed, "what": what, "value": value, "truth": truth, "z": (value - truth) / spread,
         "held": abs(value - truth) < CONFIDENCE * spread, "parts": ", ".join(fit.parts)}
        for what, (value, truth, spread) in estimates.items()
    ]  # fmt: skip
    other = gear.run("other", OTHER, 10 * seed + 9)
    for what, error, channel in zip(("angle", "torque"), d.errors(other), (other.load_angle, other.load_torque)):
        rows.append({"drive": seed, "what": what, "value": error, "truth": NOISE * np.ptp(channel)})
    return rows


def judge_motor_side(seed: int) -> list[dict]:
    """Rows of one drive from logs of its motor alone: each number beside its truth, at the motor."""
    gear = Gear.drawn(seed)
    runs = [gear.run(f"load {load:g}", load, 10 * seed + i) for i, load in enumerate(LOADS)]
    begun = time.perf_counter()
    fit = fit_motor_side([DriveRecord(r.name, r.fs, r.motor_angle, r.motor_torque) for r in runs])
    seconds = time.perf_counter() - begun
    e = fit.estimates
    low, high = (dict(zip(e.names, end.tolist())) for end in e.interval(0.9))
    truths = {
        "play": gear.play / gear.ratio, "stiffness": gear.stiffness * gear.ratio**2, "efficiency": gear.efficiency,
    }  # fmt: skip
    return [
        {"drive": seed, "what": what, "value": fit.values[what], "truth": truth, "low": low[what], "high": high[what],
         "held": low[what] <= truth <= high[what], "seconds": seconds,
         "claimed": not any(words.startswith(f"{what} ") for words in fit.not_told)}
        for what, truth in truths.items()
    ]  # fmt: skip


def main(
    out: Path = Path("results/drives.csv"), first: int = 0, seeds: int = 20, side: Literal["both", "motor"] = "both"
) -> int:
    """Judge drives and print what is on target."""
    judged = judge_motor_side if side == "motor" else judge
    table = pd.DataFrame([row for i in range(seeds) for row in judged(first + i)])
    write_csv(out, table)
    for what, target in TARGETS.items():
        rows = table[table.what == what]
        if side == "motor":
            every, rows = rows, rows[rows.claimed]
            print(f"{what}: not claimed for {len(every) - len(rows)} of {len(every)} drives")
            if rows.empty:
                continue
        error = (rows.value - rows.truth).abs() / (1 if what == "efficiency" else rows.truth)
        print(
            f"{what}: median error {error.median():.3g}, largest {error.max():.3g}, within {target:g}: "
            f"{np.mean(error <= target):.0%}, 90 % intervals hold {rows.held.mean():.0%}"
        )
    if side == "motor":
        print(f"seconds of a fit: median {table.seconds.median():.3g}, largest {table.seconds.max():.3g}")
        return 0
    for what in ("angle", "torque"):
        rows = table[table.what == what]
        print(f"{what} of another load over noise: median {(rows.value / rows.truth).median():.2f}")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
