"""clearance-mj animate: the shaft rattling in its bushings, in slow motion."""

from __future__ import annotations

import json

from ..report.animation import check, write
from ..report.clip import clip
from .command import Options, Result, command, inform, option, provenance
from .options import excitation, level, load_model, seconds, simulation


@command(
    "animate", *simulation(6.0),
    option("--rms", "m/s², or N of a force shaker, or such as 0.5g", level, "5"),
    option("--start", "s (default: the strongest contact is in the middle)", seconds),
    option("--seconds", "of motion that are shown", seconds, 0.15),
    option("--slow", "how many times slower", float, 60.0),
    option("--exaggeration", "of lifts and gaps (default: what fills the picture)", float),
    option("--rate", "pictures per second; of a .gif, 100 over a whole number", float, 20.0),
    option("--renderer", "mujoco, matplotlib, or auto: MuJoCo where it can draw", default="auto"),
    out="rattle.gif", out_help="file, .gif or (with ffmpeg) .mp4", suffixes=(".gif", ".mp4"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Show the shaft rattling in its bushings, in slow motion and exaggerated."""
    check(options.out, options.renderer)
    model = load_model(options)
    kind, in_space = model.rig.shaker.kind, model.rig.moves_across
    response = model.simulate(excitation(options, kind, options.rms(kind)), options.engine)
    cut = {"seconds": options.seconds, "slow": options.slow, "rate": options.rate}
    shown = clip(model.rig, response, options.start, exaggeration=options.exaggeration, **cut)
    comment = json.dumps(provenance(options))
    if reason := write(shown, options.out, options.renderer, not options.quiet, comment):
        inform(f"drawn by matplotlib: {reason}")
    data = {
        "renderer": "matplotlib" if reason or in_space or options.renderer == "matplotlib" else "mujoco",
        "start": float(shown.time[0]), "end": float(shown.time[-1]), "pictures": int(shown.time.size),
        "exaggeration": shown.exaggeration, "peak_contact_force": abs(shown.trace).max(axis=0).tolist(),
    }  # fmt: skip
    return Result(data, [f"animation: {options.out}"])
