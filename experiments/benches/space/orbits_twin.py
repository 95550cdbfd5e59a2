"""Judge the twin on orbits: a virtual bench whose gap or oil changes in the middle of a record.

python -m experiments.benches.space.orbits_twin --folder results/benches/orbits
"""

import argparse
import dataclasses
import math
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import clearance_mj as cm
from clearance_mj import Channel, Record
from clearance_mj.rig import Spin
from experiments.benches.space.bench import Bench, make_bench
from experiments.benches.space.records import (
    KEYPHASOR_NODE,
    Motion,
    keyphasor,
    probe_signals,
    simulate,
    turned,
    write_bench,
)
from experiments.testrig.records import FS, NOISE, digitise

CASES = (
    ("rotor", 1, 1950, {"gap": 0.5}, "a rub begins"), ("rotor", 1, 2400, {"gap": 1.1}, "the gap wears"),
    ("pump", 1, 2400, {"gap": 1.2}, "the seal wears"), ("pump", 1, 2400, {"viscosity": 0.6}, "the oil thins"),
    ("rotor", 2, 2400, {}, "nothing changes"), ("pump", 2, 2400, {}, "nothing changes"),
)  # fmt: skip
"""Kind, seed, rev/min, factors on what changes, in words"""


def changing(bench: Bench, speed: float, factors: dict[str, float], seconds: float) -> Record:
    """Return a record at one speed, rad/s, in whose middle numbers of all bushings change by factors."""
    half = round(seconds / 2 * FS)
    later = dataclasses.replace(
        bench,
        holes=tuple(dataclasses.replace(h, **{n: f * getattr(h, n) for n, f in factors.items()}) for h in bench.holes),
    )
    first, second = Spin(speed), Spin(speed, angle=math.fmod(speed * half / FS, 2 * math.pi))
    parts = [simulate(bench, spin=first, size=half), simulate(later, spin=second, size=half)]
    moved = np.concatenate([p.displacement for p in parts], axis=2)
    # Both halves count from where the shaft rested at first.
    moved[:, :, half:] += (parts[1].rest - parts[0].rest)[:, :, None]
    angle = turned(first, np.arange(2 * half) / FS)
    signals = probe_signals(bench, Motion(np.empty((0, 2, 0)), moved, parts[0].rest), angle)
    signals.append(("keyphasor", KEYPHASOR_NODE, "S", "unknown", keyphasor(angle)))
    rng = np.random.default_rng(bench.seed)
    channels = [
        Channel(
            name, node, axis, quantity, digitise(signal, NOISE, rng)[0], FS, unit="V" if quantity == "unknown" else ""
        )
        for name, node, axis, quantity, signal in signals
    ]
    return Record("operation", "orbit", bench.rig, FS, channels, "spin", spin=first)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print values, alarms and speed of the twin in each case."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--folder", type=Path, default=Path("results/benches/orbits"), help="of the datasets")
    parser.add_argument("--seconds", type=float, default=40.0, help="of each record")
    options = parser.parse_args(arguments)
    known: dict[tuple[str, int], cm.identify.OrbitFit] = {}
    for kind, seed, rpm, factors, words in CASES:
        bench, folder = make_bench(seed, kind), options.folder / f"{kind}-{seed}"
        if not (folder / "truth.toml").exists():
            write_bench(bench, folder, roles=("identify", "orbit"), kinds=("spin",))
        if (kind, seed) not in known:
            known[kind, seed] = cm.identify.orbits(cm.Dataset.load(folder))
            print(*known[kind, seed].words(), sep="\n")
        record = changing(bench, rpm * math.pi / 30, factors, options.seconds)
        start = time.process_time()
        twin = cm.identify.follow_orbits(record, known[kind, seed])
        took = time.process_time() - start
        print(f"{kind}-{seed} at {rpm} rev/min, {words} at {options.seconds / 2:g} s: {factors or ''}")
        middle = np.searchsorted(twin.time, options.seconds / 2)
        for quantity, std in zip(twin.quantities, twin.std[:, -1]):
            for j, (before, end) in enumerate(zip(twin.value(quantity)[middle - 1], twin.value(quantity)[-1])):
                print(f"  bushings[{j}].{quantity}: {before:.4g} before, {end:.4g} at the end ± {100 * std[j]:.1f} %")
        print(f"  missed {np.median(twin.misfit[:middle]):.2f}", *(f"  {a}" for a in twin.alarms), sep="\n")
        print(f"  {options.seconds / took:.0f} times real time, on one core", flush=True)


if __name__ == "__main__":
    main()
