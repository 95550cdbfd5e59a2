"""clearance-mj running-clearance: orbits under unbalance beside the clearances, after API Standard 617."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, write_results
from .options import add_plugin, add_rig, add_speeds, load_model, seconds, settings, speeds

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..model import Model
    from ..rotors import RunningClearance, Whirl

RPM = 30 / math.pi
FS = 4096.0


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_rig(parser)
    add_speeds(parser, "--speeds", "spins that are looked at, up to the trip speed")
    add_speeds(parser, "--operating", "minimum operating speed and maximum continuous speed")
    option("--points", type=int, default=1001, help="spins that are computed (default: %(default)s)")
    option("--run-up", type=seconds, metavar="SECONDS", help="also simulate a run-up with contact, of so many seconds")
    add_plugin(parser, "a contact or a grease")


@command(
    "running-clearance", "orbits under unbalance beside three quarters of the clearances (API 617)", _options,
    out=Path("results/running_clearance"), out_help="folder for csv, json and png (default: %(default)s)",
    writes=("running_clearance.csv", "running_clearance.json", "running_clearance.png"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..clearance.modelled import rig_in_gap
    from ..report.style import Drawing
    from ..rotors import running_clearance

    spins = speeds(options)
    model = load_model(options)
    found = running_clearance(rig_in_gap(model.rig, model.law), spins, options.operating)
    touching = None if options.run_up is None else _run_up(model, found, options)
    result = _summary(found)
    caption = (
        f"Major axes of rig “{model.rig.name}” under {found.scale:.3g} times its unbalances: of 0.5 to 6 the factor "
        f"at which a probe moves by {1e6 * found.limit:.3g} µm, peak to peak, at operating speeds (API 617)."
    )
    drawing = Drawing("running_clearance", found.plot(touching), caption, caption)
    write_results(options, "running_clearance", settings(model) | result, _rows(found), drawing)
    _print(found)
    print(f"running clearances: {options.out}")
    return result | {"out": str(options.out)}


def _run_up(model: Model, found: RunningClearance, options: argparse.Namespace) -> Whirl:
    """A run-up through the speeds, with contact, under the scaled unbalances."""
    from ..engines import simulate
    from ..rig import Spin
    from ..rotors import whirl
    from ..signals.excitation import still

    seconds = options.run_up
    if not seconds > 0:
        raise ClearanceError(f"--run-up {seconds:g} s: must be positive")
    first, last = map(float, found.speed[[0, -1]])
    rig = model.rig.replace(
        unbalances=found.scaled_rig.unbalances, spin=Spin(first, rate=(last - first) / seconds, until=last)
    )
    return whirl(rig, simulate(rig, still(seconds, FS), model.law, engine="modal", progress=not options.quiet))


def _summary(found: RunningClearance) -> dict[str, Any]:
    import numpy as np

    worst = np.argmax(found.used, axis=1)
    return {
        "vibration_limit": found.limit,
        "scale": found.scale,
        "allowed": found.allowed.tolist(),
        "used": found.used.max(axis=1).tolist(),
        "at_speed": found.speed[worst].tolist(),
        "holds": found.holds.tolist(),
    }


def _rows(found: RunningClearance) -> Any:
    """A row for each bushing and spin."""
    import numpy as np
    import pandas as pd

    n, speeds = found.major.shape
    columns = {
        "bushing": np.repeat(np.arange(1, n + 1), speeds),
        "spin_rad_s": np.tile(found.speed, n),
        "major_axis_m": found.scale * found.major.ravel(),
        "allowed_m": np.repeat(found.allowed, speeds),
    }
    return pd.DataFrame(columns)


def _print(found: RunningClearance) -> None:
    print(f"vibration limit {1e6 * found.limit:.3g} µm p-p: {found.scale:.3g} times the rig's unbalances")
    for j, (used, holds) in enumerate(zip(found.used, found.holds)):
        rpm = RPM * found.speed[used.argmax()]
        print(
            f"bushing {j + 1}: {100 * used.max():.0f} % of what is allowed at {rpm:.0f} rev/min: "
            f"{'met' if holds else 'not met'}"
        )
