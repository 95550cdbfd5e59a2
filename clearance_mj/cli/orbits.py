"""clearance-mj orbits: how a shaft whirls in its round clearances."""

from __future__ import annotations

from typing import Any

from ..core.errors import ClearanceError
from ..io.results import load
from ..report.whirl import draw_orbits, draw_over_speed, draw_spectra, orbit_rows
from ..rig import Rig
from ..rotors import Whirl, require_round, whirl
from ..signals.response import Response
from .command import Options, Result, command, given, option, settings
from .options import excitation, hertz, level, load_model, plugin, seconds, simulation

RESPONSES = (".nc", ".h5", ".hdf5")
READ_MODEL = ("law", "gap")  # options without effect on a response
OF_RIG = "spatial rig (TOML), which is simulated, or a response of one (.nc, .h5) that clearance-mj simulate wrote"


@command(
    "orbits", *simulation(10.0, 4096.0, rig=OF_RIG),
    option("--rms", "of an excitation, m/s² or N (default: gravity and unbalance alone)", level, "0"),
    option("--drop", "s left out at the start (default: a quarter, of a run at one speed)", seconds),
    option("--turns", "last turns that are drawn", int, 8),
    option("--resolution", "distance of a spectrum's lines, Hz", hertz, 1.0),
    plugin("a contact or a grease"),
    out_help="folder of the figures and orbits.json",
    writes=("*.json", "orbits.png", "full_spectra.png", "waterfall.png", "bode.png"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Draw how a shaft whirls in its bushings: orbits, full spectra; over speed: waterfall, 1X."""
    if options.turns < 1:
        raise ClearanceError(f"--turns {options.turns}: must be at least 1")
    if not options.resolution > 0:
        raise ClearanceError(f"--resolution {options.resolution:g} Hz: must be above 0")
    rig, response, used = _read_response(options) if options.rig.suffix.lower() in RESPONSES else _simulate(options)
    motion = _without_start(whirl(rig, response), options.drop)
    end = motion.ending(1 / options.resolution, options.turns)
    drawings = [draw_orbits(end, options.turns), draw_spectra(end, options.resolution)]
    if not motion.is_steady:
        drawings += draw_over_speed(motion, 2 * options.resolution)
    bushings = orbit_rows(end, options.turns)
    return Result(used | {"bushings": bushings}, map(_report, bushings), drawings=drawings)


def _read_response(options: Options) -> tuple[Rig, Response, dict[str, Any]]:
    """Return the response of a file, and the rig of its provenance."""
    if of_model := given(options, *READ_MODEL):
        raise ClearanceError(f"{of_model[0]}: {options.rig} is a response, simulated already; leave it out")
    response = load(options.rig)
    if not isinstance(response, Response):
        raise ClearanceError(f"{options.rig}: holds {type(response).__name__}; needs a response of a simulation")
    if "rig" not in response.provenance:
        raise ClearanceError(f"{options.rig}: does not say which rig it is of; give one that simulate wrote")
    rig = Rig.from_dict(response.provenance["rig"], options.rig.parent)
    return rig, response, {"response": response.provenance}


def _simulate(options: Options) -> tuple[Rig, Response, dict[str, Any]]:
    model = load_model(options)
    require_round(model.rig)
    kind = model.rig.shaker.kind
    response = model.simulate(excitation(options, kind, options.rms(kind)), options.engine)
    return model.rig, response, settings(model) | {"engine": options.engine}


def _without_start(motion: Whirl, drop: float | None) -> Whirl:
    if drop is None:
        drop = (motion.time[-1] - motion.time[0]) / 4 if motion.is_steady else 0.0
    if not 0 <= drop < motion.time[-1]:
        raise ClearanceError(
            f"--drop {drop:g}: must be in 0 to less than {motion.time[-1]:g} s, where the response ends"
        )
    return motion.between(drop) if drop else motion


def _report(row: dict[str, Any]) -> str:
    y, z = (1e6 * value for value in row["mean"])
    text = f"{row['bushing']}: about y = {y:.4g}, z = {z:.4g} µm, up to {row['largest_radius_over_gap']:.3g} of the gap"
    if "forward" not in row:
        return text
    return f"{text}; 1X forward {1e6 * row['forward']:.4g}, backward {1e6 * row['backward']:.4g} µm"
