"""clearance-mj vehicle: run a manoeuvre with clearance in the steering."""

from __future__ import annotations

from typing import Any

from .command import Options, Result, command, option, provenance
from .options import SEED, kmh, plugin


@command(
    "vehicle",
    option("--manoeuvre", "lane-change, slalom, obstacle-40, ... (default: a double lane change)"),
    option("--speed", "km/h, or such as 50mph (default: the manoeuvre's, 120 of the double lane change)", kmh),
    option("--controller", "comma-separated, or all", default="smc,mpc,smc-cm"),
    plugin("a controller"),
    option("--gap", "half-gap: 0.2deg, 3.5mrad at the road wheel, or 0.15mm of the shaft", default="0.2deg"),
    option("--assumed-gap", "half-gap that controllers with a clearance model assume (default: --gap)"),
    option("--regime", "torque or friction", default="torque"),
    option("--plant", "multi-body or single-track", default="multi-body"),
    option("--sensors", "ideal, or car: those of a car, on its bus", default="ideal"),
    option("--length-factor", "of the lane change (default: 1.75 to 96 km/h, then 2.5)", float),
    SEED,
    out_help="folder of the report", writes=("report.html", "metrics.csv", "summary.json"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Run a manoeuvre with clearance in the steering."""
    # Help comes without the libraries of the extra, too.
    from ..report.vehicle import write_report
    from ..vehicle.controllers import CONTROLLERS
    from ..vehicle.experiment import Case, check, run_all
    from ..vehicle.manoeuvres import get_manoeuvre
    from ..vehicle.steering import parse_gap

    names = ("regime", "plant", "length_factor", "seed", "sensors", "manoeuvre")
    settings: dict[str, Any] = {name: getattr(options, name) for name in names} | {"half_gap": parse_gap(options.gap)}
    settings |= {"assumed_gap": parse_gap(options.assumed_gap)} if options.assumed_gap else {}
    usual = get_manoeuvre(options.manoeuvre).speed if options.manoeuvre else 120.0
    speed = usual if options.speed is None else options.speed
    chosen = CONTROLLERS if options.controller == "all" else dict.fromkeys(options.controller.split(","))
    cases = [Case(name.strip(), speed, **settings) for name in chosen]
    for case in cases:
        check(case)
    return Result(write_report(run_all(cases, progress=not options.quiet), options.new, provenance(options)))
