"""Figures of shafts in space, on docs/structures.md and docs/rotors.md: ``python -m experiments.rotors``."""

import sys
from pathlib import Path

import numpy as np

import clearance_mj as cm
from clearance_mj import Bushing, Contact, Grease, Rig, Sensor
from clearance_mj.core.files import replacing
from clearance_mj.report.animation import write
from clearance_mj.report.clip import clip
from clearance_mj.report.figures import rig_drawing
from clearance_mj.report.whirl import draw_over_speed
from clearance_mj.rig import Spin
from clearance_mj.rotors import campbell, running_clearance, synchronous_rub, unbalance_response, whirl
from clearance_mj.signals.orbit_figures import full_spectrum_figure, orbit_figure
from clearance_mj.structure import Disc, Material, Section, Shaft, Support
from experiments.script import run

ROOT = Path(__file__).resolve().parents[1]
STEEL = Material(2.1e11, 7800.0)
FS = 4096.0
SPEEDS = {"touches below": 180.0, "bounces": 255.0, "rubs all around": 320.0}  # rad/s


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


def at_one_speed(rig, spin):
    """Return the whirl of a rig at a constant spin, rad/s, to which it ran up, once it is steady."""
    rig = rig.replace(spin=Spin(spin - 80.0, 20.0, spin))
    return whirl(rig, cm.simulate(rig, cm.excitation.still(10.0, FS), engine="modal")).between(6.0)


def seen(rig):
    """Return figures of a rotor at three speeds, and over its run-up, and the animation of it."""
    steady = {words: at_one_speed(rig, spin) for words, spin in SPEEDS.items()}
    gaps = dict.fromkeys(steady, rig.bushings[0].gap)
    response = cm.simulate(rig, cm.excitation.still(13.0, FS), engine="modal")
    operating = 190.0, 400.0
    criterion = running_clearance(rig, np.linspace(10.0, 440.0, 1001), operating)
    scaled = criterion.scaled_rig.replace(spin=Spin(10.0, rate=43.0, until=440.0))
    run_up = whirl(scaled, cm.simulate(scaled, cm.excitation.still(10.0, FS), engine="modal"))
    waterfall, bode = draw_over_speed(whirl(rig, response), 2.0)
    drawn = {
        "rig": rig_drawing(rig).figure,
        "orbits": orbit_figure({words: response.orbits(0).last(10) for words, response in steady.items()}, gaps),
        "full_spectrum": full_spectrum_figure({"bounces": steady["bounces"].full_spectrum(0)}, SPEEDS["bounces"]),
        "unbalance": unbalance_response(rig, np.linspace(0.0, 600.0, 1001), operating).plot(),
        "running_clearance": criterion.plot(run_up), "waterfall": waterfall.figure, "bode": bode.figure,
    }  # fmt: skip
    return drawn, clip(rig, response, start=6.2, seconds=0.1, slow=50.0)


def column():
    """Return the drawing of the steering column, and how it moves under the force of its motor and the road."""
    rig = Rig.load(ROOT / "models" / "column.toml")
    worm, road = (cm.excitation.random(2.0, FS, (5.0, 200.0), rms, seed, kind)
                  for rms, seed, kind in ((40.0, 0, "force"), (3.0, 1, "base")))  # fmt: skip
    response = cm.simulate(rig, cm.excitation.together(worm, road), engine="modal")
    return rig_drawing(rig).figure, clip(rig, response, start=1.0, seconds=0.1, slow=50.0)


def main(out: Path = ROOT / "docs") -> None:
    out.mkdir(parents=True, exist_ok=True)
    drawn = {
        "campbell": campbell(overhung(), np.linspace(0.0, 2000.0, 81), n=4).plot(),
        "rub": synchronous_rub(between_supports(), np.linspace(20.0, 300.0, 1200), 0.5, 6e-5, friction=0.02).plot(),
    }
    figures, shown = seen(Rig.load(ROOT / "models" / "rotor.toml"))
    column_rig, rattling = column()
    named = {f"rotor_{name}": figure for name, figure in (drawn | figures).items()} | {"column_rig": column_rig}
    for name, figure in named.items():
        with replacing(out / f"{name}.png") as temporary:
            figure.savefig(temporary, format="png", dpi=110)
    write(shown, out / "rotor_whirl.gif")
    write(rattling, out / "column.gif")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
