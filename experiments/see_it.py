"""The shaft in motion: slow motion of the rattle, phase portraits, Poincaré sections, waterfalls, for three cases."""

import sys
from pathlib import Path

import clearance_mj as cm
from clearance_mj.core.files import replacing
from clearance_mj.report import animation, clip, motion
from experiments.script import run

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
    responses = dict(zip(LEVELS, cm.simulate_batch(rig, excitations, law, engine, progress=True)))
    for drawing in motion.drawings(rig, responses, frequency, 6.0):
        with replacing(out / f"see_it_{name}_{drawing.name}.png") as temporary:
            temporary.write_bytes(drawing.png())


def main(
    data: Path = Path(__file__).parents[1] / "data" / "table1_rig", law: Path | None = None, engine: str = "links",
    renderer: str = "auto", out: Path = Path("results/see_it"),
) -> None:  # fmt: skip
    """Draw all cases; without a law file one is identified from the data, which takes a minute."""
    rig = cm.Rig.load(data / "rig.toml")
    identified = cm.load_law(law) if law else cm.identify.law(cm.Dataset.load(data))
    animate(rig, identified, engine, renderer, out / "see_it_rattle.gif")
    animate(rig, DRY, engine, "matplotlib", out / "see_it_dry.gif")
    for name, case, frequency in (("random", identified, None), ("sine", identified, SINE), ("dry", DRY, DRY_SINE)):
        motions(rig, case, engine, frequency, out, name)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
