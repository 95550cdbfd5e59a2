"""clearance-mj motion: phase portraits, Poincaré sections and a waterfall over level."""

from __future__ import annotations

from ..core.errors import ClearanceError
from ..engines import simulate_batch
from ..report.motion import drawings
from .command import Options, Result, command, option, settings
from .options import WORKERS, excitation, levels, load_model, seconds, simulation


@command(
    "motion", *simulation(24.0),
    option("--levels", "m/s² or such as 0.1g,1g, or N for a force shaker", levels, "0.5,1,2,5,8", metavar="RMS,..."),
    option("--drop", "s left out until the motion is steady (default: a quarter)", seconds),
    WORKERS,
    out_help="folder of the figures and motion.json",
    writes=("*.json", "phase_portraits.png", "poincare_sections.png"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Draw phase portraits, Poincaré sections and FRFs (sine: spectra) over level."""
    drop = options.duration / 4 if options.drop is None else options.drop
    if not 0 <= drop < options.duration:
        raise ClearanceError(f"--drop {drop:g}: must be in 0 to less than --duration, {options.duration:g} s")
    model = load_model(options)
    rig = model.rig
    if not rig.bushings:
        raise ClearanceError(f"{options.rig}: the rig has no bushings whose motion could be drawn")
    kind = rig.shaker.kind
    excitations = [excitation(options, kind, level) for level in options.levels(kind)]
    simulated = simulate_batch(model, excitations, None, options.engine, options.workers, not options.quiet)
    responses = dict(zip(options.levels(kind), simulated))
    peaks = {f"{level:g}": abs(r.displacement).max(axis=1).tolist() for level, r in responses.items()}
    data = settings(model) | {"peak_displacement": peaks, "engine": options.engine}
    return Result(data, drawings=drawings(rig, responses, options.sine, drop))
