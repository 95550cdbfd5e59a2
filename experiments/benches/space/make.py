"""Make the records of a virtual bench in space.

python -m experiments.benches.space.make steering-3 --out results/benches/space/steering-3
python -m experiments.benches.space.make pump-17 --out results/benches/space/pump-17 --short
python -m experiments.benches.space.make rotor-2-housing --out results/benches/space/rotor-2-housing
"""

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from clearance_mj import ClearanceError
from experiments.benches.space.bench import IGNORANCES, Bench, make_bench
from experiments.benches.space.hidden import CLASSES
from experiments.benches.space.records import write_bench
from experiments.benches.space.rigs import KINDS
from experiments.script import run

NAMES = f"KIND-SEED, of the kinds {', '.join(KINDS)}, or KIND-SEED-STRUCTURE with {', '.join(CLASSES)}"


def find_bench(name: str, ignorance: Sequence[str] = IGNORANCES) -> Bench:
    """Return the bench KIND-SEED, or KIND-SEED-STRUCTURE: with a structure that its rig file does not draw."""
    kind, _, rest = name.partition("-")
    seed, *structure = rest.split("-")
    if kind not in KINDS or not seed.isdecimal() or not set(structure) <= set(CLASSES):
        raise ClearanceError(f"bench {name} is unknown; known: {NAMES}")
    return make_bench(int(seed), kind, ignorance, structure=structure)


def main(
    name: str, out: Path = Path("results/benches/made"), ignorance: Sequence[Literal[*IGNORANCES]] = IGNORANCES,
    short: bool = False,
) -> None:  # fmt: skip
    """Write a dataset with truth.toml; a ClearanceError for an unknown bench."""
    start, bench = time.perf_counter(), find_bench(name, ignorance)
    write_bench(bench, out, short)
    print(f"{out}: bench {bench.name}, {time.perf_counter() - start:.1f} s")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
