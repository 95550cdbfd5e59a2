"""Make the records of a virtual bench.

python -m experiments.benches.make all --out results/benches/all
python -m experiments.benches.make 17 --out results/benches/17 --short
python -m experiments.benches.make cubic+maxwell-slip+4 --out results/benches/family
"""

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from experiments.benches.bench import CONTACTS, GREASES, IGNORANCES, NAMED, find_bench, make_bench
from experiments.benches.records import SINES, write_bench
from experiments.benches.structure import CLASSES, HARD


def main(arguments: Sequence[str] | None = None) -> int:
    """Write a dataset with truth.toml; status 2 for an unknown bench."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    families = f"CONTACT ({', '.join(CONTACTS)})+GREASE ({', '.join(GREASES)})+SEED"
    parser.add_argument("bench", help=f"{', '.join(NAMED)}; a seed; or {families}")
    parser.add_argument("--out", type=Path, required=True, help="folder of the dataset")
    parser.add_argument("--ignorance", nargs="*", choices=IGNORANCES, help="of a bench drawn from a seed; default: all")
    parser.add_argument("--short", action="store_true", help="two levels, and half of the time")
    parser.add_argument(
        "--structure", action="append", choices=sorted(CLASSES | HARD), default=[],
        help="what the rig file of a bench drawn from a seed does not draw; may be given again",
    )  # fmt: skip
    parser.add_argument("--no-probes", action="store_true", help="of a bench drawn from a seed: no displacement probes")
    parser.add_argument("--bushing-length", type=float, help="m, of the real bushings of a bench drawn from a seed")
    parser.add_argument("--sine", choices=SINES, default="", help="instead of random excitation and hits")
    parser.add_argument(
        "--filter", type=float, default=0.0, help="of the sampling rate: where an anti-alias filter begins"
    )
    options = parser.parse_args(arguments)
    drawn = options.structure or options.no_probes or options.bushing_length is not None or options.filter
    if drawn and not options.bench.isdecimal():
        print(
            "--structure, --no-probes, --bushing-length and --filter are of a bench drawn from a seed", file=sys.stderr
        )
        return 2
    start = time.perf_counter()
    try:
        bench = find_bench(options.bench, options.ignorance)
        if drawn:
            bench = make_bench(
                bench.seed, IGNORANCES if options.ignorance is None else options.ignorance,
                probes=not options.no_probes, structure=options.structure, bushing_length=options.bushing_length,
                filtered=options.filter,
            )  # fmt: skip
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    write_bench(bench, options.out, options.short, sine=options.sine)
    print(f"{options.out}: bench {bench.name}, {time.perf_counter() - start:.1f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
