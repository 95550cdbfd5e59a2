"""clearance-mj motion: phase portraits, Poincaré sections and a waterfall over level."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import ClearanceError
from ..files import replacing
from .command import add_command
from .drive import add_drive, excitation, load

__all__ = ["add"]


def add(commands):
    """Add the command.

    Parameters
    ----------
    commands : argparse subparsers
        Where to add it.
    """
    parser = add_command(
        commands, "motion", _run, "draw phase portraits, Poincaré sections and FRFs (sine: spectra) over level",
        default=Path("results/motion"), help="folder of the figures (default: %(default)s)",
    )  # fmt: skip
    add_drive(parser, duration=24.0)
    parser.add_argument(
        "--levels", type=_levels, default=(0.5, 1.0, 2.0, 5.0, 8.0), metavar="RMS,...",
        help="m/s², or N for a force shaker (default: 0.5,1,2,5,8)",
    )  # fmt: skip
    parser.add_argument("--drop", type=float, help="s left out until the motion is steady (default: a quarter)")
    parser.add_argument("--workers", type=int, help="threads (default: one for each processor)")


def _levels(text):
    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        found = ()
    if not found or not all(0 < level < float("inf") for level in found):
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of levels above 0, such as 0.5,1,2")
    return found


def _run(options):
    from ..engines import simulate_batch
    from ..report.motion import drawings

    drop = options.duration / 4 if options.drop is None else options.drop
    if not 0 <= drop < options.duration:
        raise ClearanceError(f"--drop {drop:g}: must be in 0 to less than --duration, {options.duration:g} s")
    if options.out.is_file():
        raise ClearanceError(f"--out {options.out} is a file; give a folder")
    rig, law = load(options)
    if not rig.bushings:
        raise ClearanceError(f"{options.rig}: the rig has no bushings whose motion could be drawn")
    excitations = [excitation(options, rig.shaker.kind, level) for level in options.levels]
    progress = None if options.quiet else "levels"
    found = simulate_batch(rig, excitations, law, options.engine, options.workers, progress)
    responses = dict(zip(options.levels, found))
    drawn = drawings(rig, responses, options.sine, drop)
    paths = [options.out / f"{drawing.name}.png" for drawing in drawn]
    for path, drawing in zip(paths, drawn):
        with replacing(path) as temporary:
            temporary.write_bytes(drawing.png())
        if not options.json:
            print(f"figure: {path}\n  {drawing.caption}")
    peaks = {f"{level:g}": abs(r.displacement).max(axis=1).tolist() for level, r in responses.items()}
    return {"figures": [str(path) for path in paths], "peak_displacement": peaks}
