"""clearance-mj motion: phase portraits, Poincaré sections and a waterfall over level."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..core.errors import ClearanceError
from .command import command, settings, write_results
from .options import add_simulation, excitation, levels, load_model, seconds


def _options(parser: argparse.ArgumentParser) -> None:
    add_simulation(parser, duration=24.0)
    words = "m/s² or such as 0.1g,1g, or N for a force shaker (default: 0.5,1,2,5,8)"
    parser.add_argument("--levels", type=levels, default="0.5,1,2,5,8", metavar="RMS,...", help=words)
    parser.add_argument("--drop", type=seconds, help="s left out until the motion is steady (default: a quarter)")
    parser.add_argument("--workers", type=int, help="threads (default: one for each processor)")


@command(
    "motion", "draw phase portraits, Poincaré sections and FRFs (sine: spectra) over level", _options,
    out=Path("results/motion"), out_help="folder of the figures and motion.json (default: %(default)s)",
    writes=("motion.json", "phase_portraits.png", "poincare_sections.png"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..engines import simulate_batch
    from ..report.motion import drawings

    drop = options.duration / 4 if options.drop is None else options.drop
    if not 0 <= drop < options.duration:
        raise ClearanceError(f"--drop {drop:g}: must be in 0 to less than --duration, {options.duration:g} s")
    model = load_model(options)
    rig = model.rig
    if not rig.bushings:
        raise ClearanceError(f"{options.rig}: the rig has no bushings whose motion could be drawn")
    kind = rig.shaker.kind
    excitations = [excitation(options, kind, level) for level in options.levels(kind)]
    found = simulate_batch(model, excitations, None, options.engine, options.workers, not options.quiet)
    responses = dict(zip(options.levels(kind), found))
    drawn = drawings(rig, responses, options.sine, drop)
    paths = [str(options.out / drawing.write(options.new).name) for drawing in drawn]
    for path, drawing in zip(paths, drawn):
        print(f"figure: {path}\n  {drawing.caption}")
    peaks = {f"{level:g}": abs(r.displacement).max(axis=1).tolist() for level, r in responses.items()}
    result = {"figures": paths, "peak_displacement": peaks}
    write_results(options, "motion", settings(model) | result | {"engine": options.engine})
    return result
