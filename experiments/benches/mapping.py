"""How many channels of drawn benches `map_channels` finds, with names, order, signs and units that say little.

    python -m experiments.benches.mapping --benches 60 --page docs/first_hour.md

Benches are simulated with physics of their own, see `experiments.benches.physics`; their rig files are wrong in
everything. Signs count relative to the base's.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from clearance_mj import ClearanceError, map_channels
from clearance_mj.io.channel_map import UNDECIDED
from experiments.benches.logger import as_logged, drawn_bench, measured
from experiments.tables import markdown_table, put_between_marks


@dataclass(frozen=True)
class Mapped:
    """What became of the channels of one bench."""

    seed: int
    channels: int
    wrong: tuple[str, ...]  #: mapped to something else, without a question
    asked: tuple[str, ...]


def map_drawn_bench(seed: int) -> Mapped:
    """Map the channels of one drawn bench."""
    bench = drawn_bench(seed)
    logged, truth = as_logged([*measured(bench).values()], seed)
    found = map_channels(logged, bench.rig).channels
    asked = tuple(name for name in truth if found[name] == UNDECIDED)
    wrong = tuple(name for name, what in truth.items() if found[name] not in (what, UNDECIDED))
    return Mapped(seed, len(truth), wrong, asked)


def rows(found: Sequence[Mapped]) -> Iterator[tuple[str, ...]]:
    """Return the table's head and its row."""
    channels = sum(one.channels for one in found)
    yield "benches", "channels", "mapped wrongly without a question", "benches without any question"
    free, wrong = sum(not one.asked for one in found), sum(len(one.wrong) for one in found)
    yield str(len(found)), str(channels), str(wrong), f"{free} ({100 * free / len(found):.0f} %)"


def main(arguments: Sequence[str] | None = None) -> int:
    """Map drawn benches and print, or write into a page, how well that went."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--benches", type=int, default=60, help="how many (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the first (default: %(default)s)")
    parser.add_argument("--page", type=Path, help="page whose table between <!-- mapping --> marks is replaced")
    options = parser.parse_args(arguments)
    seeds = range(options.seed, options.seed + options.benches)
    found = [map_drawn_bench(seed) for seed in tqdm(seeds, desc="map")]
    for one in found:
        for name in one.wrong:
            print(f"bench {one.seed}: {name} is wrong")
        for name in one.asked:
            print(f"bench {one.seed}: {name} is asked for")
    table = [*rows(found)]
    for row in table:
        print(" | ".join(row))
    if options.page:
        try:
            put_between_marks(options.page, "mapping", markdown_table(table))
        except ClearanceError as error:
            print(error, file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
