"""Errors of identified benches, and how often 90 % intervals hold the truth.

    python -m experiments.benches.coverage results/benches/200 results/benches/201 --out results/benches/coverage.csv

One row for each parameter and for the FRFs of each level of each bench. truth.toml and the records to validate are read
only to judge. Benches that the table already holds are not identified again.
"""

import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import scipy.stats

from clearance_mj import FRF, Dataset, Record, Rig, compare, estimate_frf, linear_model
from clearance_mj.identify.methods.bench import BenchFit, fit_bench
from clearance_mj.statistics.frf_bands import frf_band, inside
from experiments.script import run
from experiments.tables import judged, markdown_table

CONFIDENCE = 0.9
WIDEST = scipy.stats.norm.ppf(0.5 + CONFIDENCE / 2)  # standard deviations of an interval to each side
DRAWN = 12
RESOLUTION = 0.5


def judge(folder: Path) -> pd.DataFrame:
    """Identify one bench and compare it with its truth and its records to validate."""
    dataset = Dataset.load(folder)
    truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
    start = time.perf_counter()
    fit = fit_bench(dataset)
    rows = [*parameter_rows(fit, exact(truth)), *_frequencies(fit.rig, truth), *_frfs(fit, dataset)]
    return pd.DataFrame(rows).assign(seconds=round(time.perf_counter() - start, 1))


def parameter_rows(fit: BenchFit, truth: dict[str, float], endings: tuple[str, ...] = ("",)) -> Iterator[dict]:
    """Yield value, truth and distance in standard deviations of each parameter, and whether its interval holds."""
    estimates = fit.estimates
    for p, value, std in zip(estimates.parameters, estimates.value.tolist(), estimates.varied_std.tolist()):
        if p.name in truth and p.name.endswith(endings):
            z = float((p.to_varied(value) - p.to_varied(truth[p.name])) / std)
            row = {"what": p.name, "value": value, "truth": truth[p.name], "std": std, "z": z}
            yield row | {"held": float(abs(z) < WIDEST)}


def repeats(dataset: Dataset) -> Iterator[tuple[float, Record, Record]]:
    """Yield each level to validate on with its two records."""
    for level in sorted({r.level for r in dataset.validate if r.level is not None}):
        yield level, *(r for r in dataset.validate if r.level == level)


def _frequencies(rig: Rig, truth: dict) -> Iterator[dict]:
    """Without grease."""
    real = truth["shaft"]["frequencies_without_grease"]
    for i, (value, exact) in enumerate(zip(linear_model(rig, 16).omega / (2 * np.pi), real)):
        yield {"what": f"frequency {i + 1}", "value": value, "truth": exact}


def _frfs(fit: BenchFit, dataset: Dataset) -> Iterator[dict]:
    """Of each level's first record: ``value`` is the RMSE in dB, ``truth`` that of the repeat, ``held`` a share."""
    for level, first, second in repeats(dataset):
        band = frf_band(fit.model, first.excitation(), fit.draw(DRAWN), resolution=RESOLUTION, misfit=fit.misfit)
        band = replace(band, confidence=CONFIDENCE)
        test, repeat = (estimate_frf(r.response(), resolution=RESOLUTION) for r in (first, second))
        held = inside(band.limits, test)
        error, floor = (rmse(test, other) for other in (band.fitted, repeat))
        yield {"what": f"FRF at {level:g} m/s²", "value": error, "truth": floor, "held": held}


def rmse(test: FRF, model: FRF) -> float:
    """Return the RMSE in dB."""
    return float(compare(test, model).summary()["rmse_db"])


def exact(truth: dict) -> dict[str, float]:
    """Truth by the names of the parameters."""
    shaft = truth["shaft"]
    clamp = {"rotation": np.inf, "translation": np.inf} if shaft["clamp"] == "rigid" else shaft["clamp"]
    known = {f"1/beam.clamp.{name}": 1 / clamp[name] for name in ("rotation", "translation")}
    known |= {"beam.young_modulus": shaft["young_modulus"], "beam.density": shaft["density"]}
    known["masses[0].mass"] = shaft["tip_mass"]
    last = len(shaft["damping"]) - 1
    known |= {f"beam.damping_ratios[{i}]": shaft["damping"][min(i, last)] for i in range(8)}
    for j, bushing in enumerate(truth["bushings"]):
        known |= {f"bushings[{j}].{name}": bushing[name] for name in ("position", "gap", "offset")}
    for kind, name in (("sensors", "accelerometers"), ("probes", "probes")):
        for i, item in enumerate(truth[name]):
            known |= {f"{kind}[{i}].{field}": item[field] for field in ("gain", "position")}
    return known


def markdown(rows: pd.DataFrame) -> str:
    """Return a line for each parameter: error, distance in standard deviations, and how often the interval held."""
    rows = rows.assign(kind=rows["what"].str.replace(r"\[\d+\]", "", regex=True))
    lines = [("quantity", "number", "RMS error", "RMS z", "true value in the 90 % interval, %")]
    for kind, of in rows.groupby("kind", sort=False):
        error = f"{_rms(of['value'] - of['truth']):.3g}"
        if kind.startswith("FRF"):
            error = f"{of['value'].mean():.2f} dB (repeat {of['truth'].mean():.2f})"
        elif (of["truth"] > 0).all() and not kind.startswith("1/"):
            error = f"{_rms(of['value'] / of['truth'] - 1):.2%}"
        z = f"{_rms(of['z']):.2f}" if of["z"].notna().any() else ""
        lines.append((kind, len(of), error, z, f"{100 * of['held'].mean():.0f}" if of["held"].notna().any() else ""))
    return markdown_table(lines)


def _rms(values: pd.Series) -> float:
    return np.sqrt(np.mean(values**2))


def by_bench(rows: pd.DataFrame) -> str:
    """Return a line for each bench: worst errors of gaps, offsets and frequencies, RMSE of FRFs and repeat by level."""
    levels = sorted({w for w in rows["what"] if w.startswith("FRF")}, key=lambda w: float(w.split()[2]))
    heads = (level.removeprefix("FRF at ") for level in levels)
    lines = [("bench", "gap, %", "offset, µm", "mode 1 / modes 2 to 5, %", *heads)]
    for name, of in rows.groupby("bench", sort=False):
        error = of.set_index("what").eval("value / truth - 1")
        far = of[of["what"].str.endswith(".offset")].eval("value - truth").abs().max()
        first, *modes = (100 * error[f"frequency {i + 1}"] for i in range(5))
        cells = [f"{100 * error[error.index.str.endswith('.gap')].abs().max():.1f}", f"{1e6 * far:.1f}"]
        at = of.set_index("what")
        frfs = (f"{at.at[w, 'value']:.2f} ({at.at[w, 'truth']:.2f})" if w in at.index else "" for w in levels)
        lines.append((name, *cells, f"{first:+.2f} / {max(modes, key=abs):+.2f}", *frfs))
    return markdown_table(lines)


def main(datasets: Sequence[Path], out: Path = Path("results/benches/coverage.csv")) -> None:
    """Judge benches that the table does not hold yet, write it, print the summary."""
    folders = {folder.name: folder for folder in datasets}
    rows = judged(out, "bench", folders, lambda name: judge(folders[name]))
    print(by_bench(rows), markdown(rows), sep="\n")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
