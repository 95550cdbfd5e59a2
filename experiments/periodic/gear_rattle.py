"""The map of a loose gear at idle over its mean torques and the engine's ripple, and how long it takes."""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import clearance_mj as cm
from experiments.script import run

ROOT = Path(__file__).parents[2]
SOFTER = 1000  # as much as the mesh is softened, at the same share of critical damping
RIPPLES, LOADS = np.linspace(0.02, 2.0, 100), np.linspace(0.05, 3.0, 60)


def main(out: Path = ROOT / "docs" / "gear_rattle.png", workers: int = 2) -> None:
    """Make the figure of docs/gears.md."""
    rig = cm.Rig.load(ROOT / "models" / "gear_pair.toml")
    contact = rig.bushings[0].contact
    softer = cm.rig.Contact(contact.stiffness / SOFTER, contact.damping / SOFTER**0.5)
    model = cm.Model(rig.replace(bushings=(replace(rig.bushings[0], contact=softer),)))
    turns = [rig.spin.speed / (2 * np.pi)]
    begun = time.perf_counter()
    rattle = cm.periodic.map_impacts(model, RIPPLES, turns, LOADS, workers=workers)
    seconds = time.perf_counter() - begun
    print(f"{rattle.vibrations.size} cells in {seconds:.1f} s on {workers} processes, {rattle.unknown:.2%} unknown")
    rattle.plot().savefig(out, dpi=90)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
