"""Make the records of a virtual bench.

python -m experiments.benches.make all --out results/benches/all
python -m experiments.benches.make 17 --out results/benches/17 --short
python -m experiments.benches.make cubic+maxwell-slip+4 --out results/benches/family
"""

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from clearance_mj import ClearanceError
from experiments.benches.bench import IGNORANCES, find_bench, make_bench
from experiments.benches.records import SINES, write_bench
from experiments.benches.structure import CLASSES, HARD
from experiments.script import run


def main(
    name: str, out: Path = Path("results/benches/made"), ignorance: Sequence[Literal[*IGNORANCES]] | None = None,
    short: bool = False, structure: Sequence[Literal[*CLASSES, *HARD]] = (), no_probes: bool = False,
    bushing_length: float | None = None, sine: Literal["", *SINES] = "", filtered: float = 0.0,
) -> None:  # fmt: skip
    """Write a dataset with truth.toml; a ClearanceError for an unknown bench.

    ``structure`` is what the rig file does not draw, ``bushing_length``, m, that of the real bushings, and ``filtered``
    where an anti-alias filter begins, of the sampling rate: all of a bench drawn from a seed.
    """
    start, drawn = time.perf_counter(), structure or no_probes or bushing_length is not None or filtered
    if drawn and not name.isdecimal():
        raise ClearanceError("structure, no-probes, bushing-length and filtered are of a bench drawn from a seed")
    bench = find_bench(name, ignorance)
    if drawn:
        unknown = IGNORANCES if ignorance is None else ignorance
        bench = make_bench(
            bench.seed, unknown, probes=not no_probes, structure=structure, bushing_length=bushing_length,
            filtered=filtered,
        )  # fmt: skip
    write_bench(bench, out, short, sine=sine)
    print(f"{out}: bench {bench.name}, {time.perf_counter() - start:.1f} s")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
