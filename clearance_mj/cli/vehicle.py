"""clearance-mj vehicle: drive a lane change with clearance in the steering."""

from __future__ import annotations

from pathlib import Path

from .command import add_command

__all__ = ["add"]


def add(commands):
    """Add the command.

    Parameters
    ----------
    commands : argparse subparsers
        Where to add it.
    """
    parser = add_command(
        commands, "vehicle", _run, "drive a double lane change with clearance in the steering",
        default=Path("results/vehicle"), help="folder of the report (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("--speed", type=float, default=120.0, help="km/h (default: %(default)s)")
    parser.add_argument(
        "--controller", default="smc,mpc,smc-cm",
        help="comma-separated: smc, smc-cm, mpc, mpc-cm, smc-inverse, smc-high-gain, super-twisting "
        "(default: %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--gap",
        default="0.2deg",
        help="half-gap with its unit: 0.2deg, 3.5mrad at the road wheel, or 0.15mm of the shaft",
    )
    parser.add_argument("--told-gap", help="half-gap that controllers with a clearance model are told (default: --gap)")
    parser.add_argument("--regime", default="torque", help="torque or friction (default: %(default)s)")
    parser.add_argument("--plant", default="multi-body", help="multi-body or single-track (default: %(default)s)")
    parser.add_argument("--length-factor", type=float, help="of the lane change (default: 1.75 to 96 km/h, then 2.5)")
    parser.add_argument("--seed", type=int, default=0, help="of the noise of sensors and road (default: %(default)s)")


def _run(options):
    from ..report.vehicle import write_report
    from ..vehicle.experiment import Case, check, run_all
    from ..vehicle.steering import parse_gap

    gap = parse_gap(options.gap)
    settings = {
        "half_gap": gap,
        "told_gap": parse_gap(options.told_gap) if options.told_gap else None,
        "regime": options.regime,
        "plant": options.plant,
        "length_factor": options.length_factor,
        "seed": options.seed,
    }
    names = dict.fromkeys(options.controller.split(","))
    cases = [Case(name.strip(), options.speed, **settings) for name in names]
    for case in cases:
        check(case)
    outcomes = run_all(cases, progress=None if options.quiet else "driving")
    found = write_report(outcomes, options.out)
    if not options.json:
        print(f"report: {options.out / 'report.html'}")
    return {"out": str(options.out), **found}
