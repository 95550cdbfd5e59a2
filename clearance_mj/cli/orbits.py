"""clearance-mj orbits: how a shaft whirls in its round clearances."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, settings, write_results
from .options import add_plugin, add_simulation, excitation, hertz, level, load_model, seconds

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..rig import Rig
    from ..rotors import Whirl
    from ..signals.response import Response

RESPONSES = (".nc", ".h5", ".hdf5")
READ_MODEL = ("law", "gap")  # options that do nothing beside a response


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_simulation(parser, duration=10.0, fs=4096.0)
    rig = next(action for action in parser._actions if action.dest == "rig")
    rig.help = (
        "spatial rig (TOML), which is simulated, or a response of one (.nc, .h5) that clearance-mj simulate wrote"
    )
    option("--rms", type=level, default="0", help="of an excitation, m/s² or N (default: gravity and unbalance alone)")
    option("--drop", type=seconds, help="s left out at the start (default: a quarter, of a run at one speed)")
    option("--turns", type=int, default=8, help="last turns that are drawn (default: %(default)s)")
    option("--resolution", type=hertz, default=1.0, help="distance of a spectrum's lines, Hz (default: %(default)s)")
    add_plugin(parser, "a contact or a grease")


@command(
    "orbits", "draw how a shaft whirls in its bushings: orbits, full spectra; over speed: waterfall, 1X", _options,
    out=Path("results/orbits"), out_help="folder of the figures and orbits.json (default: %(default)s)",
    writes=("orbits.json", "orbits.png", "full_spectra.png", "waterfall.png", "bode.png"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..report.whirl import draw_orbits, draw_over_speed, draw_spectra, of_orbits
    from ..rotors import whirl

    if options.turns < 1:
        raise ClearanceError(f"--turns {options.turns}: must be at least 1")
    if not options.resolution > 0:
        raise ClearanceError(f"--resolution {options.resolution:g} Hz: must be above 0")
    rig, response, used = _read(options) if options.rig.suffix.lower() in RESPONSES else _simulated(options)
    found = _without_start(whirl(rig, response), options.drop)
    end = found.ending(1 / options.resolution, options.turns)
    drawings = [draw_orbits(end, options.turns), draw_spectra(end, options.resolution)]
    if not found.is_steady:
        drawings += draw_over_speed(found, 2 * options.resolution)
    result: dict[str, Any] = {"bushings": of_orbits(end, options.turns), "figures": []}
    for drawing in drawings:
        path = options.out / drawing.write(options.new).name
        result["figures"].append(str(path))
        print(f"figure: {path}\n  {drawing.caption}")
    for of in result["bushings"]:
        print(_words(of))
    write_results(options, "orbits", used | result)
    return result


def _read(options: argparse.Namespace) -> tuple[Rig, Response, dict[str, Any]]:
    """A response of a file, and the rig that its provenance holds."""
    from ..io.results import load
    from ..rig import Rig
    from ..signals.response import Response

    if given := [name for name in READ_MODEL if getattr(options, name)]:
        raise ClearanceError(f"--{given[0]}: {options.rig} is a response, simulated already; leave it out")
    response = load(options.rig)
    if not isinstance(response, Response):
        raise ClearanceError(f"{options.rig}: holds {type(response).__name__}; needs a response of a simulation")
    if "rig" not in response.provenance:
        raise ClearanceError(f"{options.rig}: does not say which rig it is of; give one that simulate wrote")
    rig = Rig.from_dict(response.provenance["rig"], options.rig.parent)
    return rig, response, {"response": response.provenance}


def _simulated(options: argparse.Namespace) -> tuple[Rig, Response, dict[str, Any]]:
    from ..rotors import require_round

    model = load_model(options)
    require_round(model.rig)
    kind = model.rig.shaker.kind
    response = model.simulate(excitation(options, kind, options.rms(kind)), options.engine)
    return model.rig, response, settings(model) | {"engine": options.engine}


def _without_start(found: Whirl, drop: float | None) -> Whirl:
    if drop is None:
        drop = (found.time[-1] - found.time[0]) / 4 if found.is_steady else 0.0
    if not 0 <= drop < found.time[-1]:
        raise ClearanceError(
            f"--drop {drop:g}: must be in 0 to less than {found.time[-1]:g} s, where the response ends"
        )
    return found.between(drop) if drop else found


def _words(of: dict[str, Any]) -> str:
    y, z = (1e6 * value for value in of["mean"])
    said = f"{of['bushing']}: about y = {y:.4g}, z = {z:.4g} µm, up to {of['largest_radius_over_gap']:.3g} of the gap"
    if "forward" not in of:
        return said
    return f"{said}; 1X forward {1e6 * of['forward']:.4g}, backward {1e6 * of['backward']:.4g} µm"
