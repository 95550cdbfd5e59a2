"""clearance-mj campbell: natural frequencies of a turning shaft over its spin."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, results_of, write_results
from .options import add_plugin, add_rig, add_speeds, load_model, settings, speeds

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..rotors import Campbell

RPM = 30 / math.pi


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_rig(parser)
    add_speeds(parser, "--speeds", "spins between which the diagram is drawn")
    option("--points", type=int, default=101, help="spins that are computed (default: %(default)s)")
    option("--n", type=int, default=8, help="natural frequencies that are followed (default: %(default)s)")
    option("--modes", type=int, default=16, help="of each plane in the shaft's reduction (default: %(default)s)")
    add_plugin(parser, "a contact or a grease")


@command(
    "campbell", "draw natural frequencies of a turning shaft over its spin; critical speeds, threshold of whirl",
    _options, **results_of("campbell"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..clearance.modelled import rig_in_gap
    from ..report.style import Drawing
    from ..rotors import campbell

    spins = speeds(options)
    for name in ("n", "modes"):
        if getattr(options, name) < 1:
            raise ClearanceError(f"--{name} {getattr(options, name)}: must be at least 1")
    model = load_model(options)
    shaft = rig_in_gap(model.rig, model.law)
    found = campbell(shaft, spins, options.n, options.modes)
    result = _summary(found)
    caption = f"Natural frequencies of rig “{model.rig.name}” over its spin, its bushings filled and not in contact."
    drawing = Drawing("campbell", found.plot(), caption, caption)
    write_results(options, "campbell", settings(model) | result, _rows(found), drawing)
    _print(found)
    print(f"campbell diagram: {options.out}")
    return result | {"out": str(options.out)}


def _summary(found: Campbell) -> dict[str, Any]:
    return {
        "speed": found.speed[[0, -1]].tolist(),
        "frequency_hz": found.frequency[:, [0, -1]].tolist(),
        "critical_speeds": found.critical_speeds.tolist(),
        "threshold": found.threshold,
    }


def _rows(found: Campbell) -> Any:
    """A row for each mode and spin."""
    import numpy as np
    import pandas as pd

    modes, speeds = found.frequency.shape
    columns = {
        "mode": np.repeat(np.arange(1, modes + 1), speeds),
        "spin_rad_s": np.tile(found.speed, modes),
        "frequency_hz": found.frequency.ravel(),
        "damping_ratio": found.damping_ratio.ravel(),
        "sense": found.sense.ravel(),
    }
    return pd.DataFrame(columns)


def _print(found: Campbell) -> None:
    critical = [f"{RPM * speed:.5g}" for speed in found.critical_speeds]
    words = f"{', '.join(critical)} rev/min" if critical else "none"
    print(f"critical speeds up to {RPM * found.speed[-1]:.5g} rev/min: {words}")
    if found.threshold is None:
        print("the shaft whirls by itself at none of these speeds")
    else:
        print(f"above {RPM * found.threshold:.5g} rev/min the shaft whirls by itself")
