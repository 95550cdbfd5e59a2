"""Judge orbits on virtual benches: the gaps identified from them alone, and the twin where a gap or the oil changes.

python -m experiments.benches.space.orbits gaps --kinds rotor pump steering --seeds 1 2 3 4 5 6
python -m experiments.benches.space.orbits twin
"""

import math
import sys
import time
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

import clearance_mj as cm
from clearance_mj.rig import Spin
from experiments.script import run
from experiments.testrig.records import FS, convert

from .bench import Bench, make_bench
from .records import KEYPHASOR_NODE, Motion, keyphasor, probe_signals, simulate, turned, write_bench
from .rigs import KINDS

CASES = (
    ("rotor", 1, 1950, {"gap": 0.5}, "a rub begins"), ("rotor", 1, 2400, {"gap": 1.1}, "the gap wears"),
    ("pump", 1, 2400, {"gap": 1.2}, "the seal wears"), ("pump", 1, 2400, {"viscosity": 0.6}, "the oil thins"),
    ("rotor", 2, 2400, {}, "nothing changes"), ("pump", 2, 2400, {}, "nothing changes"),
)  # fmt: skip
"""Kind, seed, rev/min, factors on what changes, in words"""


def main(
    part: Literal["gaps", "twin"], kinds: Sequence[Literal[*KINDS]] = tuple(KINDS), seeds: Sequence[int] = range(1, 7),
    folder: Path = Path("results/benches/orbits"), seconds: float = 40.0,
) -> None:  # fmt: skip
    """Print what orbits tell of each bench's gap, or the twin of each case in records of some seconds."""
    if part == "twin":
        follow(folder, seconds)
        return
    print(f"{'bench':12s} {'true':>7s} {'found':>7s} {'error':>7s} {'95 %':>16s} holds  took")
    for kind in kinds:
        for seed in seeds:
            judge(kind, seed, folder)


def identified(bench: Bench, folder: Path) -> tuple[cm.identify.OrbitFit, list[dict]]:
    """Identify a bench from operation, slow roll and run-up, made unless they are there; return its holes, too."""
    folder = folder / f"{bench.kind}-{bench.seed}"
    if not (folder / "truth.toml").exists():
        write_bench(bench, folder, roles=("identify", "orbit"), kinds=("spin",))
    truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
    return cm.identify.orbits(cm.Dataset.load(folder)), truth["bushings"]


def judge(kind: str, seed: int, folder: Path) -> None:
    """Print a row for each bushing of a bench."""
    start = time.perf_counter()
    fit, holes = identified(make_bench(seed, kind), folder)
    took = time.perf_counter() - start
    for clearance, hole in zip(fit.clearances, holes):
        low, high = (1e6 * end for end in clearance.interval)
        true, gap = 1e6 * hole["gap"], 1e6 * clearance.gap
        shown = f"{gap:7.1f} {100 * (gap / true - 1):6.1f}%" if clearance.seen else f"{'not seen':>15s}"
        words = (
            f"{'yes' if low <= true <= high else 'NO':5s} {took:5.1f} s  {fit.misfit:.2f}, odds {clearance.odds:.3g}"
        )
        print(f"{kind}-{seed:<4d} {true:11.1f} {shown} {low:7.1f} {high:7.1f}  {words}", flush=True)


def changing(bench: Bench, speed: float, factors: dict[str, float], seconds: float) -> cm.Record:
    """Return a record at one speed, rad/s, in whose middle numbers of all bushings change by factors."""
    half = round(seconds / 2 * FS)
    holes = (replace(h, **{n: f * getattr(h, n) for n, f in factors.items()}) for h in bench.holes)
    later = replace(bench, holes=tuple(holes))
    first, second = Spin(speed), Spin(speed, angle=math.fmod(speed * half / FS, 2 * math.pi))
    parts = [simulate(bench, spin=first, size=half), simulate(later, spin=second, size=half)]
    moved = np.concatenate([p.displacement for p in parts], axis=2)
    # Both halves count from where the shaft rested at first.
    moved[:, :, half:] += (parts[1].rest - parts[0].rest)[:, :, None]
    angle = turned(first, np.arange(2 * half) / FS)
    signals = probe_signals(bench, Motion(np.empty((0, 2, 0)), moved, parts[0].rest), angle)
    signals.append(("keyphasor", KEYPHASOR_NODE, "S", "unknown", keyphasor(angle)))
    channels = convert(signals, FS, np.random.default_rng(bench.seed))
    return cm.Record("operation", "orbit", bench.rig, FS, channels, "spin", spin=first)


def follow(folder: Path, seconds: float) -> None:
    """Print values, alarms and speed of the twin in each case."""
    known: dict[tuple[str, int], cm.identify.OrbitFit] = {}
    for kind, seed, rpm, factors, words in CASES:
        bench = make_bench(seed, kind)
        if (kind, seed) not in known:
            known[kind, seed], _ = identified(bench, folder)
            print(*known[kind, seed].words(), sep="\n")
        record = changing(bench, rpm * math.pi / 30, factors, seconds)
        start = time.process_time()
        twin = cm.identify.follow_orbits(record, known[kind, seed])
        took = time.process_time() - start
        print(f"{kind}-{seed} at {rpm} rev/min, {words} at {seconds / 2:g} s: {factors or ''}")
        middle = np.searchsorted(twin.time, seconds / 2)
        for quantity, std in zip(twin.quantities, twin.std[:, -1]):
            for j, (before, end) in enumerate(zip(twin.value(quantity)[middle - 1], twin.value(quantity)[-1])):
                print(f"  bushings[{j}].{quantity}: {before:.4g} before, {end:.4g} at the end ± {100 * std[j]:.1f} %")
        print(f"  missed {np.median(twin.misfit[:middle]):.2f}", *(f"  {a}" for a in twin.alarms), sep="\n")
        print(f"  {seconds / took:.0f} times real time, on one core", flush=True)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
