"""Make the records of a virtual bench in space.

python -m experiments.benches.space.make steering-3 --out results/benches/space/steering-3
python -m experiments.benches.space.make pump-17 --out results/benches/space/pump-17 --short
python -m experiments.benches.space.make rotor-2-housing --out results/benches/space/rotor-2-housing
"""

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from experiments.benches.space.bench import IGNORANCES, Bench, make_bench
from experiments.benches.space.hidden import CLASSES
from experiments.benches.space.records import write_bench
from experiments.benches.space.rigs import KINDS

NAMES = f"KIND-SEED, of the kinds {', '.join(KINDS)}, or KIND-SEED-STRUCTURE with {', '.join(CLASSES)}"


def find_bench(name: str, ignorance: Sequence[str] = IGNORANCES) -> Bench:
    """Return the bench KIND-SEED, or KIND-SEED-STRUCTURE: with a structure that its rig file does not draw."""
    kind, _, rest = name.partition("-")
    seed, *structure = rest.split("-")
    if kind not in KINDS or not seed.isdecimal() or not set(structure) <= set(CLASSES):
        raise ValueError(f"bench {name} is unknown; known: {NAMES}")
    return make_bench(int(seed), kind, ignorance, structure=structure)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write a dataset with truth.toml; status 2 for an unknown bench."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("bench", help=NAMES)
    parser.add_argument("--out", type=Path, required=True, help="folder of the dataset")
    parser.add_argument("--ignorance", nargs="*", choices=IGNORANCES, default=IGNORANCES, help="default: all")
    parser.add_argument("--short", action="store_true", help="one level, and half of the time")
    options = parser.parse_args(arguments)
    start = time.perf_counter()
    try:
        bench = find_bench(options.bench, options.ignorance)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    write_bench(bench, options.out, options.short)
    print(f"{options.out}: bench {bench.name}, {time.perf_counter() - start:.1f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
