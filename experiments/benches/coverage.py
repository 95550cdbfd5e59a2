"""How near identified benches are to what stands there, and how often 90 % intervals hold the truth.

    python -m experiments.benches.coverage results/benches/200 results/benches/201 --out results/benches/coverage.csv

One row for each parameter and for the FRFs of each level of each bench. truth.toml and the records to validate are read
only to judge. Benches that the table already holds are not identified again.
"""

import dataclasses
import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import scipy.stats

from clearance_mj import FRF, Dataset, Rig, compare, estimate_frf, linear_model
from clearance_mj.identify.methods.bench import BenchFit, fit_bench
from clearance_mj.statistics.frf_bands import frf_band, inside
from experiments.script import run

CONFIDENCE = 0.9
DRAWN = 12
RESOLUTION = 0.5


def judge(folder: Path) -> pd.DataFrame:
    """Identify one bench and compare it with its truth and its records to validate."""
    dataset = Dataset.load(folder)
    truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
    start = time.perf_counter()
    found = fit_bench(dataset)
    rows = [*_parameters(found, exact(truth)), *_frequencies(found.rig, truth), *_frfs(found, dataset)]
    return pd.DataFrame(rows).assign(bench=folder.name, seconds=round(time.perf_counter() - start, 1))


def _parameters(found: BenchFit, truth: dict[str, float]) -> Iterator[dict]:
    fit = found.estimates
    for p, value, std in zip(fit.parameters, fit.value, fit.varied_std):
        if p.name in truth:
            z = (p.to_varied(value) - p.to_varied(truth[p.name])) / std
            held = abs(z) < scipy.stats.norm.ppf(0.5 + CONFIDENCE / 2)
            yield {"what": p.name, "value": value, "truth": truth[p.name], "z": z, "held": float(held)}


def _frequencies(rig: Rig, truth: dict) -> Iterator[dict]:
    """Without grease."""
    real = truth["shaft"]["frequencies_without_grease"]
    for i, (value, exact) in enumerate(zip(linear_model(rig, 16).omega / (2 * np.pi), real)):
        yield {"what": f"frequency {i + 1}", "value": value, "truth": exact}


def _frfs(found: BenchFit, dataset: Dataset) -> Iterator[dict]:
    """Of each level's first record: ``value`` is the RMSE in dB, ``truth`` that of the repeat, ``held`` a share."""
    for level in sorted({r.level for r in dataset.validate if r.level is not None}):
        first, second = (r for r in dataset.validate if r.level == level)
        band = frf_band(found.model, first.excitation(), found.draw(DRAWN), resolution=RESOLUTION, misfit=found.misfit)
        band = dataclasses.replace(band, confidence=CONFIDENCE)
        test, repeat = (estimate_frf(r.response(), resolution=RESOLUTION) for r in (first, second))
        held = inside(band.limits, test)
        rmse, floor = (_rmse(test, other) for other in (band.fitted, repeat))
        yield {"what": f"FRF at {level:g} m/s²", "value": rmse, "truth": floor, "held": held}


def _rmse(test: FRF, model: FRF) -> float:
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
    """A line for each parameter: error, distance in standard deviations, and how often the interval held."""
    rows = rows.assign(kind=rows["what"].str.replace(r"\[\d+\]", "", regex=True))
    lines = ["| quantity | number | RMS error | RMS z | true value in the 90 % interval, % |", "| --- " * 5 + "|"]
    for kind, of in rows.groupby("kind", sort=False):
        error = np.sqrt(np.mean((of["value"] - of["truth"]) ** 2))
        cells = [f"{error:.3g}"]
        if kind.startswith("FRF"):
            cells = [f"{of['value'].mean():.2f} dB (repeat {of['truth'].mean():.2f})"]
        elif (of["truth"] > 0).all() and not kind.startswith("1/"):
            cells = [f"{np.sqrt(np.mean((of['value'] / of['truth'] - 1) ** 2)):.2%}"]
        cells.append(f"{np.sqrt(np.mean(of['z'] ** 2)):.2f}" if of["z"].notna().any() else "")
        cells.append(f"{100 * of['held'].mean():.0f}" if of["held"].notna().any() else "")
        lines.append(f"| {kind} | {len(of)} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def by_bench(rows: pd.DataFrame) -> str:
    """A line for each bench: worst errors of gaps, offsets and frequencies, RMSE of FRFs and repeat by level."""
    levels = sorted({w for w in rows["what"] if w.startswith("FRF")}, key=lambda w: float(w.split()[2]))
    names = ["bench", "gap, %", "offset, µm", "mode 1 / modes 2 to 5, %", *(w.removeprefix("FRF at ") for w in levels)]
    lines = [f"| {' | '.join(names)} |", "| --- " * len(names) + "|"]
    for name, of in rows.groupby("bench", sort=False):
        error = of.set_index("what").eval("value / truth - 1")
        far = of[of["what"].str.endswith(".offset")].eval("value - truth").abs().max()
        modes = [100 * error[f"frequency {i + 1}"] for i in range(5)]
        cells = [f"{100 * error[error.index.str.endswith('.gap')].abs().max():.1f}", f"{1e6 * far:.1f}"]
        cells.append(f"{modes[0]:+.2f} / {max(modes[1:], key=abs):+.2f}")
        at = of.set_index("what")
        cells += [f"{at.at[w, 'value']:.2f} ({at.at[w, 'truth']:.2f})" if w in at.index else "" for w in levels]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main(datasets: Sequence[Path], out: Path = Path("results/benches/coverage.csv")) -> None:
    """Judge benches that the table does not hold yet, write it, print the summary."""
    rows = pd.read_csv(out, dtype={"bench": str}) if out.exists() else pd.DataFrame({"bench": []})
    for folder in datasets:
        if folder.name not in set(rows["bench"]):
            rows = pd.concat([rows, judge(folder)])
            out.parent.mkdir(parents=True, exist_ok=True)
            rows.to_csv(out, index=False, float_format="%.6g")
            print(f"{folder.name}: {rows['seconds'].iloc[-1]:g} s", flush=True)
    print(by_bench(rows), markdown(rows), sep="\n")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
