"""The shaft in motion: slow motion of the rattle, phase portraits, Poincaré sections, waterfalls, for three cases."""

import argparse
import sys
from pathlib import Path

import clearance_mj as cm
from clearance_mj.core.errors import ClearanceError
from clearance_mj.core.files import replacing
from clearance_mj.report import animation, clip, motion

FS, LEVELS = 8192.0, (0.5, 1.0, 2.0, 5.0, 8.0)
SINE, DRY_SINE = 12.0, 30.0  # Hz
DRY = cm.ConstantLaw(2e5, 2.0, grease=cm.Grease(200.0, 0.2))
"""A made-up rig, for contrast: stiff contact, hardly any grease"""


def animate(rig, law, engine, renderer, path):
    response = cm.simulate(rig, cm.excitation.random(6.0, FS, rms=5.0), law, engine)
    shown = clip.clip(rig, response)
    reason = animation.write(shown, path, renderer, progress=True)
    peak = abs(shown.trace).max(axis=0)
    print(f"{path}: drawn {shown.exaggeration:g} times larger, peak forces {peak.round(2)} N. {reason}")


def motions(rig, law, engine, frequency, out, name):
    if frequency:
        excitations = [cm.excitation.stepped_sine(12.0, FS, frequency, 2**0.5 * level) for level in LEVELS]
    else:
        excitations = [cm.excitation.random(24.0, FS, rms=level) for level in LEVELS]
    found = dict(zip(LEVELS, cm.simulate_batch(rig, excitations, law, engine, progress=True)))
    for drawing in motion.drawings(rig, found, frequency, 6.0):
        with replacing(out / f"see_it_{name}_{drawing.name}.png") as temporary:
            temporary.write_bytes(drawing.png())


def run(options):
    rig = cm.Rig.load(options.data / "rig.toml")
    law = cm.load_law(options.law) if options.law else cm.identify.law(cm.Dataset.load(options.data))
    animate(rig, law, options.engine, options.renderer, options.out / "see_it_rattle.gif")
    animate(rig, DRY, options.engine, "matplotlib", options.out / "see_it_dry.gif")
    for name, of, frequency in (("random", law, None), ("sine", law, SINE), ("dry", DRY, DRY_SINE)):
        motions(rig, of, options.engine, frequency, options.out, name)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path(__file__).parent.parent / "data" / "table1_rig")
    parser.add_argument("--law", type=Path, help="law file (default: identified from the data, a minute)")
    parser.add_argument("--engine", default="links")
    parser.add_argument("--renderer", default="auto")
    parser.add_argument("--out", type=Path, default=Path("results/see_it"))
    options = parser.parse_args()
    try:
        run(options)
    except ClearanceError as error:
        sys.exit(print(f"see_it.py: {error}", file=sys.stderr) or 2)
