"""clearance-mj campbell: natural frequencies of a turning shaft over its spin."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, results_of, settings, write_results
from .options import add_plugin, add_rig, add_speeds, load_model, speeds

if TYPE_CHECKING:  # a command imports what it needs when it runs
    import numpy as np
    import pandas as pd

    from ..model import Model
    from ..rig import Rig
    from ..rotors import Campbell, UnbalanceResponse

RPM = 30 / math.pi


def add_over_speed(parser: argparse.ArgumentParser, points: int, beyond: float = 1.5) -> None:
    """Add the options of a command that looks at a shaft up to ``beyond`` times its largest spin, see `over_speed`."""
    parser.set_defaults(beyond=beyond)  # the margins that API 617 requires reach to 1.26
    add_rig(parser)
    fastest = f"0 to {beyond:g} times the rig's largest or, if it is faster, the operating speed"
    add_speeds(parser, "--speeds", "spins that are looked at", fastest)
    words = "minimum operating speed and maximum continuous speed, from which separation margins (API 617) count"
    add_speeds(parser, "--operating", words, "the rig's largest spin")
    parser.add_argument("--points", type=int, default=points, help="spins that are computed (default: %(default)s)")
    parser.add_argument("--modes", type=int, default=16, help="of each plane in the reduction (default: %(default)s)")
    add_plugin(parser, "a contact or a grease")


def over_speed(options: argparse.Namespace) -> tuple[Model, Rig, np.ndarray, tuple[float, float] | None]:
    """Return the model, its rig in the gap, spins and operating speeds (rad/s) of the options of `add_over_speed`."""
    from ..clearance.modelled import rig_in_gap

    for name in {"n", "modes"} & vars(options).keys():
        if getattr(options, name) < 1:
            raise ClearanceError(f"--{name} {getattr(options, name)}: must be at least 1")
    model = load_model(options)
    largest = model.rig.spin.fastest if model.rig.spin else 0.0
    operating = options.operating or ((largest, largest) if largest else None)
    if not (options.speeds or operating):
        raise ClearanceError(f"rig {model.rig.name!r} does not say how fast it turns; give --speeds FROM TO")
    options.speeds = options.speeds or (0.0, options.beyond * max(largest, *(operating or ())))
    return model, rig_in_gap(model.rig, model.law), speeds(options), operating


def write_over_speed(
    options: argparse.Namespace, model: Model, found: Campbell | UnbalanceResponse, caption: str, table: pd.DataFrame
) -> dict[str, Any]:
    """Write what a command found over the speed, and its critical speeds, which are printed, too."""
    from ..report.style import Drawing
    from ..report.tables import write_csv

    name, critical, threshold = options.command, found.criticals, found.shaft.threshold(found.speed)
    result = {"speed": found.speed[[0, -1]].tolist(), "operating": found.operating}
    result |= {"threshold": threshold, "critical_speeds": critical.to_dict("records")}
    write_csv(options.new / "critical_speeds.csv", critical)
    write_results(options, name, settings(model) | result, table, Drawing(name, found.plot(), caption, caption))
    print(f"critical speeds up to {RPM * found.speed[-1]:.5g} rev/min:{'' if len(critical) else ' none'}")
    if len(critical):
        print(critical.drop(columns="spin_rad_s").to_string(index=False, float_format="{:.4g}".format))
    above = "at none of these speeds" if threshold is None else f"above {RPM * threshold:.5g} rev/min"
    print(f"the shaft whirls by itself {above}")
    print(f"{name}: {options.out}")
    return result | {"out": str(options.out)}


def _options(parser: argparse.ArgumentParser) -> None:
    add_over_speed(parser, 101)
    parser.add_argument("--n", type=int, default=8, help="natural frequencies that are followed (default: %(default)s)")


@command(
    "campbell", "draw natural frequencies of a turning shaft over its spin; critical speeds, margins, onset of whirl",
    _options, **results_of("campbell", "critical_speeds.csv"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..report.tables import long_table
    from ..rotors import campbell
    from ..rotors.diagram import whirl_names

    model, rig, spins, operating = over_speed(options)
    found = campbell(rig, spins, options.n, options.modes, operating)
    of_each = {"frequency_hz": found.frequency, "damping_ratio": found.damping_ratio, "sense": found.sense}
    of_each["whirl"] = whirl_names(found.sense)
    table = long_table("mode", range(1, len(found.frequency) + 1), "spin_rad_s", found.speed, **of_each)
    caption = f"Natural frequencies of rig “{rig.name}” over its spin, its bushings filled and not in contact."
    return write_over_speed(options, model, found, caption, table)
