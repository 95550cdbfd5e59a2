"""Judge identification from orbits alone on virtual benches.

python -m experiments.benches.space.orbits --kinds rotor pump steering --seeds 1 2 3 4 5 6
"""

import sys
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import clearance_mj as cm
from experiments.benches.space.bench import make_bench
from experiments.benches.space.records import write_bench
from experiments.benches.space.rigs import KINDS
from experiments.script import run


def main(
    kinds: Sequence[Literal[*list(KINDS)]] = tuple(KINDS),
    seeds: Sequence[int] = tuple(range(1, 7)),
    folder: Path = Path("results/benches/orbits"),
) -> None:
    """Make the records of operation, slow roll and run-up of each bench, and print what orbits tell of its gap."""
    print(f"{'bench':12s} {'true':>7s} {'found':>7s} {'error':>7s} {'95 %':>16s} holds  took")
    for kind in kinds:
        for seed in seeds:
            judge(kind, seed, folder / f"{kind}-{seed}")


def judge(kind: str, seed: int, folder: Path) -> None:
    """Print a row for each bushing of a bench, whose records are made unless they are there."""
    if not (folder / "truth.toml").exists():
        write_bench(make_bench(seed, kind), folder, roles=("identify", "orbit"), kinds=("spin",))
    truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
    start = time.perf_counter()
    found = cm.identify.orbits(cm.Dataset.load(folder))
    took = time.perf_counter() - start
    for clearance, hole in zip(found.clearances, truth["bushings"]):
        low, high = (1e6 * end for end in clearance.interval)
        true, gap = 1e6 * hole["gap"], 1e6 * clearance.gap
        said = f"{gap:7.1f} {100 * (gap / true - 1):6.1f}%" if clearance.seen else f"{'not seen':>15s}"
        holds = "yes" if low <= true <= high else "NO"
        words = f"{found.misfit:.2f}, odds {clearance.odds:.3g}"
        print(
            f"{kind}-{seed:<4d} {true:11.1f} {said} {low:7.1f} {high:7.1f}  {holds:5s} {took:5.1f} s  {words}",
            flush=True,
        )


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
