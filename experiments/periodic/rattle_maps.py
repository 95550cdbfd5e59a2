"""The rattle map of the Table-1 rig for three gaps, and how long it takes."""

import sys
import time
from pathlib import Path

import numpy as np

import clearance_mj as cm
from experiments.script import run

ROOT = Path(__file__).parents[2]
LAW = cm.ConstantLaw(7.8e3, 4.0)
LEVELS, FREQUENCIES = np.linspace(0.4, 20.0, 50), np.linspace(5.0, 220.0, 400)  # m/s² and Hz
GAPS = (2e-4, 3e-4, 4.5e-4)  # m


def main(out: Path = ROOT / "docs" / "rattle_map.png", workers: int = 2) -> None:
    """Make the figure of docs/periodic.md."""
    rig = cm.Rig.load(ROOT / "models" / "table1_rig.toml")
    begun = time.perf_counter()
    rattle_map = cm.periodic.map_rattle(cm.Model(rig, LAW), LEVELS, FREQUENCIES, GAPS, workers=workers)
    seconds = time.perf_counter() - begun
    cells = rattle_map.vibrations.size
    print(f"{cells} cells in {seconds:.1f} s on {workers} processes, {rattle_map.unknown:.2%} unknown")
    for words in rattle_map.ended:
        print(words)
    rattle_map.plot().savefig(out, dpi=90)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
