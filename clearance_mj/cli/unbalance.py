"""clearance-mj unbalance: what probes read under a rig's unbalances over its spin; critical speeds, margins."""

from __future__ import annotations

from ..report.tables import long_table
from ..rotors import unbalance_response
from .campbell import over_speed, speed_result, spins_of
from .command import RESULTS, Options, Result, command, inform


@command("unbalance", *over_speed(1001), out="results/unbalance", writes=(*RESULTS, "critical_speeds.csv"))
def run(options: Options) -> Result:
    """Draw amplitude and phase at probes over the spin under unbalance (Bode); critical speeds, margins."""
    model, rig, spins, operating = spins_of(options)
    response = unbalance_response(rig, spins, operating, options.modes)
    caption = f"Motion of rig “{rig.name}” under its unbalances over its spin, its bushings filled and not in contact."
    of_each = {"amplitude_um_pp": 1e6 * response.amplitude, "phase_lag_deg": response.phase_lag}
    table = long_table("probe", [*response.planes], "spin_rad_s", response.speed, **of_each)
    clearances = zip(rig.probe_labels, (2 * rig.bushings[j].gap for j in rig.bushing_of_row))
    read = dict(zip(response.planes, response.amplitude.max(axis=1)))
    if touching := [probe for probe, clearance in clearances if read.get(probe, 0.0) > clearance]:
        inform(
            f"{', '.join(touching)}: wider than the clearance: the shaft touches, which clearance-mj orbits simulates"
        )
    return speed_result(options, model, response, caption, table)
