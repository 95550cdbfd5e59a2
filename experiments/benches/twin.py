"""Errors and intervals of the twin of a bench, and the changes that it sees (docs/twin.md).

    python -m experiments.benches.twin --out results/bench_twin

Two kinds of synthetic benches, whose physics the package does not share: the virtual test rig, whose rig file is right
(30 records without a change, 20 with one), and virtual benches (`experiments/benches`) with everything drawn from what
rig files leave open, and other laws of contact and grease. Writes a row for each clearance, and the figure.
"""

import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from tqdm import tqdm

from clearance_mj import Record, Rig, excitation
from clearance_mj.identify import Twin, twin
from clearance_mj.report.tables import write_csv
from clearance_mj.report.twin import draw
from experiments.benches.bench import Bench, make_bench
from experiments.benches.records import measure_channels
from experiments.script import run
from experiments.testrig import RIGS, Truth, simulate_rig
from experiments.testrig.records import BAND, FS, acquire_channels

LEVELS = (2.0, 5.0, 8.0)
DURATION, CHANGED = 30.0, 60.0  # s, of a record without a change and with one
AT = 0.5  # of the duration, at which it happens
CHANGES = {
    "gap +20 %": (1.2, 1.0), "gap -20 %": (0.8, 1.0), "stiffness +20 %": (1.0, 1.2), "stiffness -20 %": (1.0, 0.8),
}  # fmt: skip
"""factors on gap and contact stiffness of one bushing"""
WEAR = 1.1  # factor on the gap, over the rest of a record with wear
QUANTITIES = ("gap", "stiffness", "damping")


def course(rig: Rig, truth: Truth, bushing: int, change: str) -> Callable[[float], tuple[Rig, Sequence[Truth]]]:
    """Return the true bushings as a function of time, with a change of one of them."""

    def now(t: float) -> tuple[Rig, Sequence[Truth]]:
        late = max(0.0, t / CHANGED - AT) / (1 - AT)
        gap, stiffness = CHANGES.get(change, (1 + (WEAR - 1) * late, 1.0)) if late > 0 else (1.0, 1.0)
        bushings, truths = list(rig.bushings), [truth] * len(rig.bushings)
        bushings[bushing] = replace(bushings[bushing], gap=gap * bushings[bushing].gap)
        truths[bushing] = replace(truth, contact_stiffness=stiffness * truth.contact_stiffness)
        return rig.replace(bushings=tuple(bushings)), truths

    return now


def shaken(seed: int, level: float, duration: float, change: str = "", bushing: int = 1) -> Record:
    """Record of the virtual test rig."""
    virtual = RIGS["table1"]()
    shake = excitation.random(duration, FS, band=BAND, rms=level, seed=seed, kind="base")
    when = course(virtual.rig, virtual.truth[0], bushing, change) if change else None
    channels = acquire_channels(virtual.rig, simulate_rig(virtual.rig, virtual.truth, shake, seed, when), seed)
    return Record(f"rig_{seed}", "identify", virtual.rig, FS, channels, level=level, seed=seed, band=BAND)


def bench_record(bench: Bench, level: float, duration: float) -> Record:
    """Record of a virtual bench."""
    shake = excitation.random(duration, FS, band=BAND, rms=level, seed=bench.seed, kind="base")
    channels = measure_channels(bench, shake.value, np.random.default_rng((bench.seed, 1)))
    return Record(f"bench_{bench.seed}", "identify", bench.rig, FS, channels, level=level, band=BAND)


def rows_of(estimates: Twin, truth: Callable[[int, float], tuple[float, float, float]], **about: object) -> list[dict]:
    """A row for each clearance whose gap is known at the end: errors, in % and in standard deviations."""
    rows = []
    for j, depth in enumerate(estimates.depth):
        if np.isnan(estimates.mean[0, -1, j]):
            continue
        doubted = any(words.startswith(f"bushings[{j}]: the likeliest law misses") for words in estimates.warnings)
        row: dict = about | {"bushing": j, "doubted": doubted, "alarms": sum(a.bushing == j for a in estimates.alarms)}
        for q, value, mean, std in zip(QUANTITIES, truth(j, depth), estimates.mean[:, -1, j], estimates.std[:, -1, j]):
            error = mean - math.log(value)
            row |= {f"{q}_error_%": 100 * error, f"{q}_std_%": 100 * std, f"{q}_z": error / std}
        rows.append(row)
    return rows


def of_rig(factors: Sequence[tuple[float, float]]) -> Callable[[int, float], tuple[float, float, float]]:
    """Gap, stiffness and damping of the virtual test rig at a depth."""

    def values(j: int, depth: float) -> tuple[float, float, float]:
        t, (gap, factor) = Truth(), factors[j]
        force = factor * t.contact_stiffness * depth**t.contact_exponent
        return gap * 3e-4, force / depth, 1.5 * t.contact_dissipation * force  # Hunt and Crossley's α

    return values


def of_bench(bench: Bench) -> Callable[[int, float], tuple[float, float, float]]:
    """The same of a virtual bench, whose contact is (k δⁿ + k₃ δ³)(1 + α δ̇) + c δ̇."""

    def values(j: int, depth: float) -> tuple[float, float, float]:
        hole = bench.holes[j]
        k, n, cubic, loss, damping = hole.contact
        force = k * depth**n + cubic * depth**3
        return hole.gap, force / depth, loss * force + damping

    return values


def of_rigs(seeds: Sequence[int]) -> Iterator[dict]:
    """Rows of records of the virtual test rig without a change, with the rig taken for exact and corrected."""
    for seed in tqdm(seeds, desc="rigs"):
        record = shaken(seed, LEVELS[seed % 3], DURATION)
        for exact in (True, False):
            start = time.process_time()
            estimates = twin(record, rig_exact=exact)
            about = {"kind": "rig exact" if exact else "rig", "seed": seed, "level": LEVELS[seed % 3]}
            yield from rows_of(estimates, of_rig([(1.0, 1.0)] * 2), **about, cpu_s=time.process_time() - start)


def of_benches(seeds: Sequence[int]) -> Iterator[dict]:
    """Rows of records of virtual benches without a change."""
    for seed in tqdm(seeds, desc="benches"):
        bench, start = make_bench(seed), time.process_time()
        estimates = twin(bench_record(bench, LEVELS[seed % 3], DURATION))
        took = time.process_time() - start
        yield from rows_of(estimates, of_bench(bench), kind="bench", seed=seed, level=LEVELS[seed % 3], cpu_s=took)


def of_changes(seeds: Sequence[int], out: Path) -> Iterator[dict]:
    """Rows of records of the virtual test rig in which the second bushing changes; the first one is drawn."""
    kinds = [*CHANGES, "wear 10 %"]
    for i, seed in enumerate(tqdm(seeds, desc="changes")):
        change = kinds[i % len(kinds)]
        estimates = twin(shaken(seed, 5.0, CHANGED, change))
        seen = [a for a in estimates.alarms if a.bushing == 1]
        about = {"seed": seed, "change": change, "all_alarms": len(estimates.alarms)}
        about |= {"first": seen[0].time, "since": seen[0].since, "quantity": seen[0].quantity} if seen else {}
        about |= {"size_%": 100 * (seen[0].after / seen[0].before - 1)} if seen else {}
        yield from rows_of(estimates, of_rig([(1.0, 1.0), CHANGES.get(change, (WEAR, 1.0))]), **about)[-1:]
        if i == 0:
            draw(estimates).write(out)


def main(
    out: Path = Path("results/bench_twin"), first: int = 200, count: int = 30,
    only: Literal["rigs", "benches", "changes"] | None = None,
) -> None:  # fmt: skip
    """Write tables and figure."""
    seeds = range(first, first + count)
    tables = {"rigs": of_rigs, "benches": of_benches, "changes": lambda some: of_changes(some, out)}
    for name, make in tables.items():
        if only not in (None, name):
            continue
        rows: list[dict] = []
        for row in make(seeds):
            rows.append(row)
            write_csv(out / f"{name}.csv", rows)
        summary(pd.DataFrame(rows))


def summary(table: pd.DataFrame) -> None:
    """Print how often 95 % intervals hold the truth, typical errors, alarms."""
    if "kind" not in table:
        print(table.to_string())
        return
    table["kind"] += np.where(table["doubted"], ", law doubted", "")
    for kind, rows in table.groupby("kind"):
        for q in QUANTITIES:
            inside = np.mean(np.abs(rows[f"{q}_z"]) < 1.96)
            error, std = rows[f"{q}_error_%"].abs().median(), rows[f"{q}_std_%"].median()
            words = f"inside {100 * inside:.0f} %, |error| {error:.2f} %, std {std:.2f} %"
            print(f"{kind:22s} {q:10s} n {len(rows)} {words}")
        print(f"{kind:22s} alarms {rows['alarms'].sum()}, {rows['cpu_s'].median():.2f} s a record of {DURATION:g} s")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
