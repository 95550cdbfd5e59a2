"""clearance-mj running-clearance: orbits under unbalance against the clearances, after API Standard 617."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..core.errors import ClearanceError
from ..engines import simulate
from ..model import Model
from ..report.style import Drawing
from ..report.tables import long_table
from ..rig import Spin
from ..rotors import RunningClearance, Whirl, running_clearance, whirl
from ..signals.excitation import still
from .campbell import RPM, over_speed, spins_of
from .command import RESULTS, Options, Result, command, option, settings
from .options import seconds

FS = 4096.0
TRIP = 1.1  # times a rig's largest spin, at which it is switched off if it does not say when


@command(
    "running-clearance", *over_speed(1001, TRIP),
    option("--run-up", "also simulate a run-up, with contact", seconds, metavar="SECONDS"), writes=RESULTS,
)  # fmt: skip
def run(options: Options) -> Result:
    """Orbits under unbalance beside three quarters of the clearances (API 617)."""
    model, rig, spins, between = spins_of(options, TRIP)
    operating = between or (0.0, 0.0)
    check = running_clearance(rig, np.union1d(spins, operating), operating, options.modes)
    touching = None if options.run_up is None else _run_up(model, check, options)
    caption = (
        f"Major axes of rig “{model.rig.name}” under {check.scale:.3g} times its unbalances: of 0.5 to 6 the factor "
        f"at which a probe moves by {1e6 * check.limit:.3g} µm, peak to peak, at operating speeds (API 617)."
    )
    drawing = Drawing("running_clearance", check.plot(touching), caption, caption)
    axes = {"major_axis_m": check.scale * check.major, "allowed_m": np.repeat(check.allowed, check.speed.size)}
    table = long_table("bushing", range(1, len(check.major) + 1), "spin_rad_s", check.speed, **axes)
    data = {
        "vibration_limit": check.limit, "scale": check.scale, "allowed": check.allowed.tolist(),
        "used": check.used.max(axis=1).tolist(), "at_speed": check.speed[check.used.argmax(axis=1)].tolist(),
        "holds": check.holds.tolist(),
    }  # fmt: skip
    return Result(settings(model) | data, _report(check), table, [drawing])


def _run_up(model: Model, check: RunningClearance, options: Options) -> Whirl:
    """Return a run-up through the speeds, with contact, under the scaled unbalances."""
    seconds = options.run_up
    if not seconds > 0:
        raise ClearanceError(f"--run-up {seconds:g} s: must be positive")
    first, last = map(float, check.speed[[0, -1]])
    rig = model.rig.replace(
        unbalances=check.scaled_rig.unbalances, spin=Spin(first, rate=(last - first) / seconds, until=last)
    )
    return whirl(rig, simulate(rig, still(seconds, FS), model.law, engine="modal", progress=not options.quiet))


def _report(check: RunningClearance) -> Iterator[str]:
    yield f"vibration limit {1e6 * check.limit:.3g} µm p-p: {check.scale:.3g} times the rig's unbalances"
    for j, (used, holds) in enumerate(zip(check.used, check.holds)):
        at, met = RPM * check.speed[used.argmax()], "met" if holds else "not met"
        yield f"bushing {j + 1}: {100 * used.max():.0f} % of what is allowed at {at:.0f} rev/min: {met}"
