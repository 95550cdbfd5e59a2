"""clearance-mj running-clearance: orbits under unbalance beside the clearances, after API Standard 617."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .campbell import RPM, add_over_speed, over_speed
from .command import command, results_of, settings, write_results
from .options import seconds

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..model import Model
    from ..rotors import RunningClearance, Whirl

FS = 4096.0
TRIP = 1.1  # times a rig's largest spin, at which it is switched off if it does not say when


def _options(parser: argparse.ArgumentParser) -> None:
    add_over_speed(parser, 1001, TRIP)
    parser.add_argument("--run-up", type=seconds, metavar="SECONDS", help="also simulate a run-up, with contact")


@command(
    "running-clearance", "orbits under unbalance beside three quarters of the clearances (API 617)", _options,
    **results_of("running_clearance"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    import numpy as np

    from ..report.style import Drawing
    from ..report.tables import long_table
    from ..rotors import running_clearance

    model, rig, spins, between = over_speed(options)
    operating = between or (0.0, 0.0)
    found = running_clearance(rig, np.union1d(spins, operating), operating, options.modes)
    touching = None if options.run_up is None else _run_up(model, found, options)
    result = _summary(found)
    caption = (
        f"Major axes of rig “{model.rig.name}” under {found.scale:.3g} times its unbalances: of 0.5 to 6 the factor "
        f"at which a probe moves by {1e6 * found.limit:.3g} µm, peak to peak, at operating speeds (API 617)."
    )
    drawing = Drawing("running_clearance", found.plot(touching), caption, caption)
    axes = {"major_axis_m": found.scale * found.major, "allowed_m": np.repeat(found.allowed, found.speed.size)}
    table = long_table("bushing", range(1, len(found.major) + 1), "spin_rad_s", found.speed, **axes)
    write_results(options, "running_clearance", settings(model) | result, table, drawing)
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
    return {
        "vibration_limit": found.limit,
        "scale": found.scale,
        "allowed": found.allowed.tolist(),
        "used": found.used.max(axis=1).tolist(),
        "at_speed": found.speed[found.used.argmax(axis=1)].tolist(),
        "holds": found.holds.tolist(),
    }


def _print(found: RunningClearance) -> None:
    print(f"vibration limit {1e6 * found.limit:.3g} µm p-p: {found.scale:.3g} times the rig's unbalances")
    for j, (used, holds) in enumerate(zip(found.used, found.holds)):
        at, met = RPM * found.speed[used.argmax()], "met" if holds else "not met"
        print(f"bushing {j + 1}: {100 * used.max():.0f} % of what is allowed at {at:.0f} rev/min: {met}")
