"""Gaps and offsets of drawn benches without displacement probes, and how often their 90 % intervals hold.

    python -m experiments.benches.without_probes 1 40 --out results/benches/without_probes

Each seed draws a bench of foreign physics with an ignorant rig file: 4 to 8 accelerometers, a shaft that grease centres
well or hardly, records at 1, 2 or 4 levels, 8 to 24 s long, at 1 to 4 kHz, with 0.3 to 3 % of noise, some with a sweep
or with hits beside them. Benches that the table already holds are not identified again.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import tomli_w

from clearance_mj import Dataset, Excitation, Grease, Record, Rig, excitation, write_dataset
from clearance_mj.identify.methods.bench import fit_bench
from experiments.script import run
from experiments.tables import judged, markdown_table
from experiments.testrig.records import BAND

from .bench import Bench, make_bench, other_rig, table1_rig
from .coverage import exact, parameter_rows
from .records import STREAM, measure_channels

DRAWS = 41  # third word of the seeds
STIFFNESS = 200.0, 6000.0  # N/m, of grease: hardly and well centred
LEVELS = (3.0,), (1.0, 5.0), (0.5, 1.5, 3.0, 6.0)  # m/s² RMS
RATES = 1024.0, 2048.0, 4096.0


def drawn_bench(seed: int) -> tuple[Bench, list[tuple[str, Excitation, float | None]], float]:
    """Return a bench, its records as name, excitation and level, and the noise of its channels over their RMS."""
    rng = np.random.default_rng((seed, STREAM, DRAWS))
    rig = _with_grease(table1_rig(f"without probes {seed}") if rng.random() < 0.7 else other_rig("other"), rng)
    fewer = np.sort(rng.permutation(len(rig.sensors))[: rng.integers(4, len(rig.sensors) + 1)])
    rig = rig.replace(sensors=tuple(rig.sensors[i] for i in fewer))
    levels, fs, seconds = LEVELS[rng.integers(3)], float(rng.choice(RATES)), float(rng.uniform(8, 24))
    more, noise = rng.integers(3), float(np.exp(rng.uniform(*np.log([0.003, 0.03]))))
    taken: list[tuple[str, Excitation, float | None]] = [
        (f"level_{level:g}", excitation.random(seconds, fs, BAND, rms=level, seed=int(rng.integers(2**31))), level)
        for level in levels
    ]
    if more == 1:
        taken.append(("sweep", excitation.sweep(seconds, fs, BAND, amplitude=levels[-1]), None))
    if more == 2:
        hits = tuple(np.arange(0.5, seconds - 2, 4.0).tolist())
        peaks = tuple(np.geomspace(8, 140, len(hits)).tolist())
        taken.append(("hammer", excitation.hammer(seconds, fs, peak=peaks, width=0.006, times=hits), None))
    return make_bench(seed, rig=rig, probes=False), taken, noise


def _with_grease(rig: Rig, rng: np.random.Generator) -> Rig:
    stiffness = float(np.exp(rng.uniform(*np.log(STIFFNESS))))
    return rig.replace(bushings=tuple(replace(b, grease=Grease(stiffness, b.grease.damping)) for b in rig.bushings))


def write(seed: int, folder: Path) -> None:
    """Simulate a drawn bench, and write dataset and truth."""
    bench, taken, noise = drawn_bench(seed)
    records = []
    for i, (name, shaken, level) in enumerate(taken):
        rng = np.random.default_rng((seed, STREAM, DRAWS, i))
        channels = measure_channels(bench, shaken.value, rng, shaken.fs, noise)
        records.append(Record(name, "identify", bench.rig, shaken.fs, channels, level=level, band=shaken.band))
    write_dataset(folder, bench.rig, records)
    (folder / "truth.toml").write_text(tomli_w.dumps(bench.truth()), encoding="utf-8")


def judge(seed: int, out: Path) -> pd.DataFrame:
    """Return a row for each gap and offset of a drawn bench."""
    bench, taken, noise = drawn_bench(seed)
    folder = out / str(seed)
    if not (folder / "truth.toml").exists():
        write(seed, folder)
    start = time.process_time()
    fit = fit_bench(Dataset.load(folder))
    return pd.DataFrame(parameter_rows(fit, exact(bench.truth()), (".gap", ".offset"))).assign(
        seconds=round(time.process_time() - start, 1),
        stiffness=bench.rig.bushings[0].grease.stiffness, records=" ".join(name for name, *_ in taken),
        fs=taken[0][1].fs, duration=taken[0][1].value.size / taken[0][1].fs, noise=noise,
        sensors=len(bench.rig.sensors), structure=" ".join(each.name for each in fit.update.structure.accepted),
        widening=fit.misfit.widening,
    )  # fmt: skip


def markdown(rows: pd.DataFrame) -> str:
    """Return a line for gaps and one for offsets: error, and how often the interval held."""
    lines = [("quantity", "number", "median error", "RMS z", "true value in the 90 % interval, %")]
    for kind, of in rows.groupby(rows["what"].str.rpartition(".")[2]):
        error = (of["value"] - of["truth"]).abs()
        typical = f"{(error / of['truth']).median():.2%}" if kind == "gap" else f"{1e6 * error.median():.1f} µm"
        z = np.sqrt(np.mean(of["z"] ** 2))
        lines.append((kind, len(of), typical, f"{z:.2f}", f"{100 * of['held'].mean():.0f}"))
    return markdown_table(lines)


def main(first: int, last: int, out: Path = Path("results/benches/without_probes")) -> None:
    """Judge benches of seeds that the table does not hold yet, write it, print the summary."""
    seeds = range(first, last + 1)
    print(markdown(judged(out / "without_probes.csv", "seed", seeds, lambda seed: judge(seed, out))))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
