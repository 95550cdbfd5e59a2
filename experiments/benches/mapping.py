"""Channels of drawn benches that `map_channels` maps, with names, order, signs and units that say little.

    python -m experiments.benches.mapping --benches 60 --page docs/first_hour.md

Benches are simulated with physics of their own, see `experiments.benches.physics`; their rig files are wrong in
everything. Signs count relative to the base's.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from clearance_mj import map_channels
from clearance_mj.io.channel_map import UNDECIDED
from experiments.benches.logger import as_logged, drawn_bench, measured
from experiments.script import run
from experiments.tables import markdown_table, put_between_marks


@dataclass(frozen=True)
class Mapped:
    """Outcome for the channels of one bench."""

    seed: int
    channels: int
    wrong: tuple[str, ...]  #: mapped to something else, without a question
    asked: tuple[str, ...]


def map_drawn_bench(seed: int) -> Mapped:
    """Map the channels of one drawn bench."""
    bench = drawn_bench(seed)
    logged, truth = as_logged([*measured(bench).values()], seed)
    channels = map_channels(logged, bench.rig).channels
    asked = tuple(name for name in truth if channels[name] == UNDECIDED)
    wrong = tuple(name for name, what in truth.items() if channels[name] not in (what, UNDECIDED))
    return Mapped(seed, len(truth), wrong, asked)


def rows(mapped: Sequence[Mapped]) -> Iterator[tuple[str, ...]]:
    """Return the table's head and its row."""
    channels = sum(one.channels for one in mapped)
    yield "benches", "channels", "mapped wrongly without a question", "benches without any question"
    free, wrong = sum(not one.asked for one in mapped), sum(len(one.wrong) for one in mapped)
    yield str(len(mapped)), str(channels), str(wrong), f"{free} ({100 * free / len(mapped):.0f} %)"


def main(benches: int = 60, first: int = 1, page: Path | None = None) -> None:
    """Map drawn benches from a first seed on and print, or write into a page, how well that went."""
    results = [map_drawn_bench(seed) for seed in tqdm(range(first, first + benches), desc="map")]
    for result in results:
        for name in result.wrong:
            print(f"bench {result.seed}: {name} is wrong")
        for name in result.asked:
            print(f"bench {result.seed}: {name} is asked for")
    table = markdown_table(rows(results))
    print(table)
    if page:
        put_between_marks(page, "mapping", table)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
