"""How far rigs updated to the quiet part of their records are from the benches that stand there.

    python -m experiments.benches.updating results/benches/all results/benches/linear

One row for each bench, then how often 90 % intervals hold the truth. truth.toml is read only to say so.
"""

from __future__ import annotations

import argparse
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import scipy.stats

from clearance_mj.beam import ritz_model
from clearance_mj.identify import update_rig
from clearance_mj.io.dataset import Dataset
from clearance_mj.rig import Rig

SHOWN = ("beam.young_modulus", "masses[0].mass", "1/beam.clamp.rotation")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("datasets", type=Path, nargs="+")
    half = scipy.stats.norm.ppf(0.95)
    inside: dict[str, list[bool]] = {}
    print("| bench | quiet, s | frequencies before, % | after, % | E | tip mass | clamp | time, s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for folder in parser.parse_args(arguments).datasets:
        dataset = Dataset.load(folder)
        truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
        start = time.process_time()
        found = update_rig(dataset)
        spent, fit = time.process_time() - start, found.estimates
        cells = []
        exact = _exact(truth)
        for p, value, std in zip(fit.parameters, fit.value, fit.varied_std):
            if p.name not in exact:
                continue
            z = (p._forward(value) - p._forward(exact[p.name])) / std
            inside.setdefault(p.name, []).append(bool(abs(z) < half))
            if p.name in SHOWN:
                beam = dataset.rig.beam
                assert beam
                clamp = f"{1e3 * beam.bending_stiffness * (value - exact[p.name]):+.1f} mm"
                cells.append(f"{clamp if '1/' in p.name else f'{value / exact[p.name] - 1:+.1%}'} ({z:+.1f} σ)")
        order = [1, 2, 0]
        quiet = max(m.duration for m in found.misfit)
        before, after = (_frequency_errors(rig, truth) for rig in (dataset.rig, found.rig))
        row = [folder.name, f"{quiet:.1f}", before, after, *(cells[i] for i in order), f"{spent:.1f}"]
        print(f"| {' | '.join(row)} |", flush=True)
    print("\n90 % intervals that hold the truth:")
    for name, held in inside.items():
        print(f"  {name:28s} {sum(held)} of {len(held)}")


def _exact(truth: dict) -> dict[str, float]:
    """Truth by the names of the parameters."""
    shaft = truth["shaft"]
    clamp = {"rotation": np.inf, "translation": np.inf} if shaft["clamp"] == "rigid" else shaft["clamp"]
    exact = {f"1/beam.clamp.{name}": 1 / clamp[name] for name in ("rotation", "translation")}
    exact |= {"beam.young_modulus": shaft["young_modulus"], "beam.density": shaft["density"]}
    exact["masses[0].mass"] = shaft["tip_mass"]
    last = len(shaft["damping"]) - 1
    exact |= {f"beam.damping_ratios[{i}]": shaft["damping"][min(i, last)] for i in range(8)}
    exact |= {f"bushings[{j}].position": b["position"] for j, b in enumerate(truth["bushings"])}
    for kind, name in (("sensors", "accelerometers"), ("probes", "probes")):
        for i, item in enumerate(truth[name]):
            exact |= {f"{kind}[{i}].{field}": item[field] for field in ("gain", "position")}
    return exact


def _frequency_errors(rig: Rig, truth: dict) -> str:
    """Of mode 1 / the largest of modes 2 to 5, without grease, in %."""
    real = np.array(truth["shaft"]["frequencies_without_grease"])
    error = 100 * (ritz_model(rig, 16).omega[: real.size] / (2 * np.pi) / real - 1)
    return f"{error[0]:+.2f} / {error[1:][np.argmax(np.abs(error[1:]))]:+.2f}"


if __name__ == "__main__":
    main()
