"""Families of contact and grease that method "bench" prefers, against those that benches were made with.

    python -m experiments.benches.families --out results/benches

Twenty benches, one row each: every second one differs from its rig file in everything (" ~"). Their records to identify
are made first, where they are not in the folder yet. truth.toml is read only to say what was found of gaps and offsets.
"""

import sys
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clearance_mj.identify import update_rig
from clearance_mj.identify.laws.comparison import FamilyFit, compare_families
from clearance_mj.identify.records.prepared import prepare
from clearance_mj.io.dataset import Dataset
from experiments.benches.bench import CONTACTS, GREASES, IGNORANCES, find_bench
from experiments.benches.records import write_bench
from experiments.script import run

FIRST = 401  # seed; families were tuned on others
COUNT = 20
WORDS = {
    "power": "power law", "cubic": "linear + cubic", "bouc-wen": "Bouc-Wen", "maxwell-slip": "Maxwell-slip",
}  # fmt: skip
"""Names in the package of families that a bench calls otherwise"""


def main(out: Path = Path("results/benches"), first: int = FIRST, count: int = COUNT) -> None:
    """Print the table, and how often the right families are preferred."""
    print("| clearance | preferred | weight | of the truth | held out | of the truth | gap, % | offset, µm | time, s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    right = []
    for seed in range(first, first + count):
        contact, grease = CONTACTS[(seed - FIRST) % 3], GREASES[(seed - FIRST) // 3 % 3]
        name, wrong = f"{contact}+{grease}+{seed}", (seed - FIRST) % 2 == 1
        folder = out / (name + "~" * wrong)
        if not folder.exists():
            write_bench(find_bench(name, IGNORANCES if wrong else None), folder, roles=("identify",))
        dataset, start = Dataset.load(folder), time.perf_counter()
        families = compare_families(prepare(dataset), update_rig(dataset, as_drawn=True))
        spent, best = time.perf_counter() - start, [of_one[0] for of_one in families]
        truth = WORDS.get(contact, contact), WORDS.get(grease, grease)
        for likeliest, of_one, *errors in zip(best, families, *_missed(best, folder)):
            true_family = next((f for f in of_one if (f.contact, f.grease) == truth), None)
            names = likeliest.contact, likeliest.grease
            right.append([names[0] == truth[0], names[1] == truth[1]])
            shown = " / ".join(f if r else f"**{f}**" for f, r in zip(names, right[-1]))
            row = [
                f"{name}{' ~' * wrong}, {likeliest.bushing + 1}", shown, f"{likeliest.weight:.2f}",
                f"{true_family.weight:.2f}" if true_family else "not tried", f"{likeliest.held_out:.3f}",
                f"{true_family.held_out:.3f}" if true_family else "", *errors, f"{spent:.0f}",
            ]  # fmt: skip
            print(f"| {' | '.join(row)} |", flush=True)
    contacts, greases = np.sum(right, axis=0)
    print(f"\nRight: contact {contacts}, grease {greases}, both {np.all(right, axis=1).sum()} of {len(right)}.")


def _missed(best: Sequence[FamilyFit], folder: Path) -> tuple[list[str], list[str]]:
    """Errors of the gaps and offsets of all bushings."""
    truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))["bushings"]
    pairs = [(family.fit.bushing, real) for family, real in zip(best, truth)]
    gaps = [f"{100 * (fitted.gap / real['gap'] - 1):+.1f}" for fitted, real in pairs]
    offsets = [f"{1e6 * (fitted.offset - real['offset']):+.1f}" for fitted, real in pairs]
    return gaps, offsets


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
