"""clearance-mj campbell: natural frequencies of a turning shaft over its spin."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from ..clearance.modelled import rig_in_gap
from ..core.errors import ClearanceError
from ..model import Model
from ..report.style import Drawing
from ..report.tables import long_table, write_csv
from ..rig import Rig
from ..rotors import Campbell, UnbalanceResponse, campbell
from ..rotors.diagram import whirl_names
from .command import RESULTS, Option, Options, Result, command, option, settings
from .options import RIG, load_model, plugin, speeds

RPM = 30 / math.pi
BEYOND = 1.5  # times the largest spin; the margins that API 617 requires reach to 1.26


def over_speed(points: int, beyond: float = BEYOND) -> tuple[Option, ...]:
    """Return the options of a command that looks at a shaft up to ``beyond`` times its largest spin, see `spins_of`."""
    fastest = f"0 to {beyond:g} times the rig's largest or, if it is faster, the operating speed"
    words = "minimum operating speed and maximum continuous speed, from which separation margins (API 617) count"
    return (
        *RIG,
        speeds("--speeds", "spins that are looked at", fastest),
        speeds("--operating", words, "the rig's largest spin"),
        option("--points", "spins that are computed", int, points),
        option("--modes", "of each plane in the reduction", int, 16),
        plugin("a contact or a grease"),
    )


def spins_of(options: Options, beyond: float = BEYOND) -> tuple[Model, Rig, np.ndarray, tuple[float, float] | None]:
    """Return the model, its rig in the gap, spins and operating speeds (rad/s) of the options of `over_speed`."""
    for name in {"n", "modes"} & vars(options).keys():
        if getattr(options, name) < 1:
            raise ClearanceError(f"--{name} {getattr(options, name)}: must be at least 1")
    model = load_model(options)
    largest = model.rig.spin.fastest if model.rig.spin else 0.0
    operating = options.operating or ((largest, largest) if largest else None)
    if not (options.speeds or operating):
        raise ClearanceError(f"rig {model.rig.name!r} does not say how fast it turns; give --speeds FROM TO")
    first, last = options.speeds or (0.0, beyond * max(largest, *(operating or ())))
    if not 0 <= first < last:
        raise ClearanceError(f"--speeds {first:g} {last:g} rad/s: must rise, from 0 on")
    if options.points < 2:
        raise ClearanceError(f"--points {options.points}: must be at least 2")
    return model, rig_in_gap(model.rig, model.law), np.linspace(first, last, options.points), operating


def speed_result(
    options: Options, model: Model, diagram: Campbell | UnbalanceResponse, caption: str, table: pd.DataFrame
) -> Result:
    """Return a command's results over the speed, and write its critical speeds."""
    critical, threshold = diagram.criticals, diagram.shaft.threshold(diagram.speed)
    data = {"speed": diagram.speed[[0, -1]].tolist(), "operating": diagram.operating}
    data |= {"threshold": threshold, "critical_speeds": critical.to_dict("records")}
    write_csv(options.new / "critical_speeds.csv", critical)
    words = [f"critical speeds up to {RPM * diagram.speed[-1]:.5g} rev/min:{'' if len(critical) else ' none'}"]
    if len(critical):
        words += [critical.drop(columns="spin_rad_s").to_string(index=False, float_format="{:.4g}".format)]
    above = "at none of these speeds" if threshold is None else f"above {RPM * threshold:.5g} rev/min"
    words += [f"the shaft whirls by itself {above}"]
    return Result(settings(model) | data, words, table, [Drawing(options.command, diagram.plot(), caption, caption)])


@command(
    "campbell", *over_speed(101), option("--n", "natural frequencies that are followed", int, 8),
    writes=(*RESULTS, "critical_speeds.csv"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Draw natural frequencies of a turning shaft over its spin; critical speeds, margins, onset of whirl."""
    model, rig, spins, operating = spins_of(options)
    diagram = campbell(rig, spins, options.n, options.modes, operating)
    of_each = {"frequency_hz": diagram.frequency, "damping_ratio": diagram.damping_ratio, "sense": diagram.sense}
    of_each["whirl"] = whirl_names(diagram.sense)
    table = long_table("mode", range(1, len(diagram.frequency) + 1), "spin_rad_s", diagram.speed, **of_each)
    caption = f"Natural frequencies of rig “{rig.name}” over its spin, its bushings filled and not in contact."
    return speed_result(options, model, diagram, caption, table)
