"""The rattle map of the Table-1 rig for three gaps, and how long it takes."""

import argparse
import time
from pathlib import Path

import numpy as np

import clearance_mj as cm

ROOT = Path(__file__).parents[2]
LAW = cm.ConstantLaw(7.8e3, 4.0)
LEVELS, FREQUENCIES = np.linspace(0.4, 20.0, 50), np.linspace(5.0, 220.0, 400)  # m/s² and Hz
GAPS = (2e-4, 3e-4, 4.5e-4)  # m


def main() -> None:
    """Make the figure of docs/periodic.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "rattle_map.png", help="the figure")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    args = parser.parse_args()
    rig = cm.Rig.load(ROOT / "models" / "table1_rig.toml")
    begun = time.perf_counter()
    found = cm.periodic.map_rattle(cm.Model(rig, LAW), LEVELS, FREQUENCIES, GAPS, workers=args.workers)
    seconds = time.perf_counter() - begun
    cells = found.vibrations.size
    print(f"{cells} cells in {seconds:.1f} s on {args.workers} processes, {found.unknown:.2%} unknown")
    for words in found.ended:
        print(words)
    found.plot().savefig(args.out, dpi=90)


if __name__ == "__main__":
    main()
