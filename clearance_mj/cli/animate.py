"""clearance-mj animate: the shaft rattling in its bushings, in slow motion."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from .command import command, inputs, out_file, provenance, say
from .options import add_simulation, excitation, level, load_model, seconds


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_simulation(parser, duration=6.0)
    option(
        "--rms", type=level, default="5", help="m/s², or N of a force shaker, or such as 0.5g (default: %(default)s)"
    )
    option("--start", type=seconds, help="s (default: the strongest contact is in the middle)")
    option("--seconds", type=seconds, default=0.15, help="of motion that are shown (default: %(default)s)")
    option("--slow", type=float, default=60.0, help="how many times slower (default: %(default)s)")
    option("--exaggeration", type=float, help="of lifts and gaps (default: what fills the picture)")
    words = "pictures per second; of a .gif, 100 over a whole number (default: %(default)s)"
    option("--rate", type=float, default=20.0, help=words)
    option("--renderer", default="auto", help="mujoco, matplotlib, or auto: MuJoCo where it can draw (default)")


@command(
    "animate", "show the shaft rattling in its bushings, in slow motion and exaggerated", _options,
    out=Path("rattle.gif"), out_help="file, .gif or (with ffmpeg) .mp4 (default: %(default)s)",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..core.provenance import is_marked
    from ..report.animation import check, write
    from ..report.clip import clip

    check(options.out, options.renderer)
    out_file(options.out, (options.out.suffix.lower(),), inputs(options), is_marked)
    model = load_model(options)
    kind = model.rig.shaker.kind
    response = model.simulate(excitation(options, kind, options.rms(kind)), options.engine)
    cut = {"seconds": options.seconds, "slow": options.slow, "rate": options.rate}
    in_space = model.rig.moves_across
    shown = clip(model.rig, response, options.start, exaggeration=options.exaggeration, **cut)
    comment = json.dumps(provenance(options))
    if reason := write(shown, options.out, options.renderer, not options.quiet, comment):
        say(f"drawn by matplotlib: {reason}")
    print(f"animation: {options.out}")
    return {
        "out": str(options.out),
        "renderer": "matplotlib" if reason or in_space or options.renderer == "matplotlib" else "mujoco",
        "start": float(shown.time[0]), "end": float(shown.time[-1]), "pictures": int(shown.time.size),
        "exaggeration": shown.exaggeration, "peak_contact_force": abs(shown.trace).max(axis=0).tolist(),
    }  # fmt: skip
