"""Figures of shafts that turn, on docs/structures.md: ``python -m experiments.rotors``."""

import argparse
from pathlib import Path

import numpy as np

from clearance_mj import Bushing, Contact, Grease, Rig, Sensor
from clearance_mj.core.files import replacing
from clearance_mj.rotors import campbell, synchronous_rub
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

ROOT = Path(__file__).resolve().parents[1]
STEEL = Material(2.1e11, 7800.0)


def overhung():
    """Return the rotor of the page: a disc beyond its second support, which is softer along y."""
    supports = Support(0.05, "pinned"), Support(0.35, translation=4e6, translation_y=2e6)
    disc = Disc(0.5, 3.0, 0.02, polar_inertia=0.03)
    shaft = Shaft((Section(0.5, (0.03, 0.03)),), supports, (disc,), STEEL, (1.0, 2e-5))
    return Rig("pump rotor", None, (), (Sensor(1, 0.5),), structure=shaft)


def between_supports():
    """Return a disc in the middle of a light shaft, in a bushing of 0.1 mm."""
    supports = Support(0.0, "pinned"), Support(1.0, "pinned")
    shaft = Shaft((Section(1.0, (0.0118, 0.0118)),), supports, (Disc(0.5, 3.0),), STEEL, (6.0, 0.0))
    bushing = Bushing(0.5, 1e-4, 0.0, Grease(0.0), Contact(2e5))
    return Rig("rotor in a bushing", None, (bushing,), (Sensor(1, 0.5),), structure=shaft)


def main():
    parser = argparse.ArgumentParser(prog="python -m experiments.rotors", description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "docs", help="folder of the figures")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    speeds = np.linspace(20.0, 300.0, 1200)
    drawn = {
        "campbell": campbell(overhung(), np.linspace(0.0, 2000.0, 81), n=4).plot(),
        "rub": synchronous_rub(between_supports(), speeds, 0.5, 6e-5, friction=0.02).plot(),
    }
    for name, figure in drawn.items():
        with replacing(given.out / f"rotor_{name}.png") as temporary:
            figure.savefig(temporary, format="png", dpi=110)


if __name__ == "__main__":
    main()
