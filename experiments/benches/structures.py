"""Benches whose structure is not as drawn: which class is named, and how well FRFs are predicted.

    python -m experiments.benches.structures --seeds 201 202 203 204 205 --sound 40 --page docs/benches.md

Every class of `structure.CLASSES`, what no rig file can name, pairs and sound benches, each with all other ignorance on
top, foreign physics and seeds that nothing was tuned on. Each bench is identified twice: from its rig file as drawn,
and from one in which its structure is written. Records to validate and truth.toml only judge. Benches without
displacement probes, with points or 20 mm as bushings in turn and behind anti-alias filters, are judged beside them.
What was judged already stays in --out.
"""

import itertools
import json
import sys
import tempfile
import time
import tomllib
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from clearance_mj import Dataset, estimate_frf, simulate
from clearance_mj.core.files import to_json, write_text
from clearance_mj.identify.methods.bench import BenchFit, fit_bench
from experiments.script import run
from experiments.tables import markdown_table, put_between_marks
from experiments.testrig.records import FS

from .bench import make_bench
from .coverage import RESOLUTION, exact, parameter_rows, repeats, rmse
from .records import write_bench
from .structure import CLASSES, HARD, written

HYPOTHESIS = {name: name for name in CLASSES} | {"time": "delay", "plane": "planes"}
HYPOTHESIS |= {"strip": "oscillator", "near_spring": "spring"}
"""Names of each class in identification"""
LENGTHS, FILTERED = (0.0, 0.02), 0.4
"""m, of the bushings of benches without probes; of the sampling rate, where their anti-alias filter begins"""
JUDGED = (".gap", ".offset", "beam.young_modulus", "1/beam.clamp.rotation")
"""Parameters whose intervals are judged, by how their names end"""


def judge(names: tuple[str, ...], seed: int, probes: bool = True) -> dict:
    """Make one bench, identify it and compare it with its truth and its records to validate."""
    length = {} if probes else {"bushing_length": LENGTHS[seed % len(LENGTHS)], "filtered": FILTERED}
    bench = make_bench(seed, structure=names, name=_name(names, seed, probes), probes=probes, **length)
    with tempfile.TemporaryDirectory() as folder:
        write_bench(bench, folder)
        dataset = Dataset.load(folder)
        truth = exact(tomllib.loads((Path(folder) / "truth.toml").read_text(encoding="utf-8")))
        start = time.perf_counter()
        fit = fit_bench(dataset)
        seconds, rows = time.perf_counter() - start, _frfs(fit, dataset)
        rig = written(bench.structure, bench.rig, FS)
        corrected = Dataset(rig, tuple(replace(r, rig=rig) for r in dataset.records), dataset.path)
        known = _frfs(fit_bench(corrected), dataset) if names else rows
    for row, best in zip(rows, known):
        row["known"] = best["rmse_db"]
    return {
        "bench": bench.name, "classes": [HYPOTHESIS[name] for name in names],
        "named": [one.name for one in fit.update.structure.accepted], "seconds": seconds, "frfs": rows,
        "parameters": list(parameter_rows(fit, truth, JUDGED)), "probes": probes,
        "families": {f"{j + 1}: {f.name}": f.weight for j, of_one in enumerate(fit.families) for f in of_one},
    }  # fmt: skip


def _name(names: tuple[str, ...], seed: int, probes: bool) -> str:
    words = "+".join(names) or ("sound" if probes else "")
    return " ".join(filter(None, (words, "" if probes else "no probes", str(seed))))


def _frfs(fit: BenchFit, dataset: Dataset) -> list[dict]:
    """Return RMSE in dB of each level, and that of the bench's repeat."""
    rows = []
    for level, first, second in repeats(dataset):
        model = simulate(fit.model, first.excitation(), engine="modal")
        test, repeat, ours = (
            estimate_frf(x, resolution=RESOLUTION) for x in (first.response(), second.response(), model)
        )
        rows.append({"level": level, "rmse_db": rmse(test, ours), "repeat": rmse(test, repeat)})
    return rows


def _kind(row: dict) -> str:
    words = " + ".join(row["classes"]) or "sound"
    near = " near a bushing" if row["bench"].startswith("near") else ""
    return words + near + ("" if row.get("probes", True) else ", without probes")


def named_rightly(row: dict) -> bool:
    """Return True if the named parts are those of the bench, and no others; what does not bend of a strip is a mass."""
    excused = {"mass"} if "oscillator" in row["classes"] else set()
    return set(row["named"]) - excused == set(row["classes"])


def markdown(rows: Sequence[dict]) -> str:
    """A line for each kind of bench, one for intervals."""
    columns = (
        "bench", "number", "named correctly", "RMSE over repeat, worst",
        "RMSE over that with the structure known, worst", "gap within, %", "offset within, µm", "s",
    )  # fmt: skip
    lines: list[Sequence[str]] = [columns]
    for kind, group in itertools.groupby(rows, _kind):
        of = list(group)
        frfs, parameters = ([item for row in of for item in row[part]] for part in ("frfs", "parameters"))
        gaps = [100 * abs(p["value"] / p["truth"] - 1) for p in parameters if p["what"].endswith(".gap")]
        offsets = [1e6 * abs(p["value"] - p["truth"]) for p in parameters if p["what"].endswith(".offset")]
        cells = [kind, f"{len(of)}", f"{sum(map(named_rightly, of))}"]
        cells += [f"{max(f['rmse_db'] / f[other] for f in frfs):.2f}" for other in ("repeat", "known")]
        cells += [f"{max(gaps):.1f}", f"{max(offsets):.1f}", f"{np.mean([row['seconds'] for row in of]):.0f}"]
        lines.append(cells)
    words = [
        f"90 % intervals contain the true value {'with' if probes else 'without'} probes: {', '.join(_held(of))}."
        for probes in (True, False)
        if (of := [row for row in rows if row.get("probes", True) == probes])
    ]
    return f"\n{markdown_table(lines)}\n{' '.join(words)}\n\n"


def _held(rows: Sequence[dict]) -> list[str]:
    parameters = [p for row in rows for p in row["parameters"]]
    held = {ending: [p["held"] for p in parameters if p["what"].endswith(ending)] for ending in JUDGED}
    return [f"{ending.strip('.')} {100 * np.mean(values):.0f} %" for ending, values in held.items()]


def main(
    seeds: Sequence[int] = (201, 202, 203, 204, 205), hard: Sequence[int] = (211, 212, 213, 214, 215), sound: int = 40,
    pairs: int = 10, no_probes: int = 10, housings: int = 5, workers: int = 2, out: Path = Path("results/structures"),
    page: Path | None = None,
) -> None:  # fmt: skip
    """Judge benches that are not judged yet, write structures.json and the table of a page."""
    couples = list(itertools.combinations(CLASSES, 2))
    chosen = np.random.default_rng(5).permutation(len(couples))[:pairs]
    wanted = [((name,), seed, True) for name in CLASSES for seed in seeds]
    wanted += [((name,), seed, True) for name in HARD for seed in hard]
    wanted += [(couples[k], 301 + i, True) for i, k in enumerate(chosen.tolist())]
    wanted += [((), 401 + i, True) for i in range(sound)]
    wanted += [((), 501 + i, False) for i in range(no_probes)]
    wanted += [(("housing",), 521 + i, False) for i in range(housings)]
    path = out / "structures.json"
    known = {row["bench"]: row for row in json.loads(path.read_text(encoding="utf-8"))} if path.exists() else {}
    names = [_name(*each) for each in wanted]
    missing = [each for name, each in zip(names, wanted) if name not in known]
    with ProcessPoolExecutor(workers) as pool:
        for row in tqdm(pool.map(judge, *zip(*missing)) if missing else (), total=len(missing), unit="bench"):
            known[row["bench"]] = row
            write_text(path, to_json([known[name] for name in names if name in known]))
    table = markdown([known[name] for name in names])
    print(table)
    if page:
        put_between_marks(page, "structures", table)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
