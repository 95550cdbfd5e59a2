"""clearance-mj simulate: simulate a rig."""

from __future__ import annotations

from pathlib import Path

from ..errors import ClearanceError
from .command import add_command
from .drive import add_drive, excitation, load

__all__ = ["add"]

GOOD_BALANCE = 0.01


def add(commands):
    """Add the command.

    Parameters
    ----------
    commands : argparse subparsers
        Where to add it.
    """
    parser = add_command(
        commands, "simulate", _run, "simulate a rig under random or sinusoidal base or shaker excitation",
        default=Path("response.nc"), help="response file, NetCDF (default: %(default)s)",
    )  # fmt: skip
    add_drive(parser, duration=24.0, fs=2048.0)
    parser.add_argument("--rms", type=float, default=1.0, help="m/s², or N for a force shaker (default: %(default)s)")
    parser.add_argument(
        "--ledger", type=Path, metavar="FOLDER",
        help="keep account of energy and impacts: energy.csv, impacts.csv and ledger.png in this folder",
    )  # fmt: skip


def _run(options):
    from ..engines import simulate
    from ..io.results import save

    rig, law = load(options)
    if options.ledger and options.ledger.is_file():
        raise ClearanceError(f"--ledger {options.ledger} is a file; give a folder")
    case = rig, excitation(options, rig.shaker.kind, options.rms), law, options.engine
    response, kept = _with_ledger(options, case) if options.ledger else (simulate(*case), {})
    save(options.out, response)
    if not options.json:
        print(f"response: {options.out}")
    rms = dict(zip(response.responses, response.acceleration.std(axis=1).tolist()))
    return {"out": str(options.out), "acceleration_rms": rms} | kept


def _with_ledger(options, case):
    from ..engines.energy import keep_ledger
    from ..report.ledger import write

    response, ledger = keep_ledger(*case, progress=None if options.quiet else "ledger")
    write(options.ledger, ledger)
    if not options.json:
        _print(ledger)
        print(f"ledger: {options.ledger}")
    return response, {"ledger": ledger.summary() | {"out": str(options.ledger)}}


def _print(ledger):
    found = ledger.summary()
    for name, value in found["energy"].items():
        print(f"{name:16s}{value: .4e} J")
    print(f"impacts at each bushing: {', '.join(map(str, found['impacts']))}; up to {found['peak_force']:.3g} N")
    print(f"the energies balance within {100 * ledger.imbalance:.2g} % of what was put in")
    if ledger.imbalance > GOOD_BALANCE:
        print("that is more than 1 %: the engine's step is too long for contacts this stiff")
