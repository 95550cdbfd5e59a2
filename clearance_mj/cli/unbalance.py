"""clearance-mj unbalance: what probes read under a rig's unbalances over its spin; critical speeds, margins."""

from __future__ import annotations

import argparse
from typing import Any

from .campbell import add_over_speed, over_speed, write_over_speed
from .command import command, results_of, say


@command(
    "unbalance", "draw amplitude and phase at probes over the spin under unbalance (Bode); critical speeds, margins",
    lambda parser: add_over_speed(parser, 1001), **results_of("unbalance", "critical_speeds.csv"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..report.tables import long_table
    from ..rotors import unbalance_response

    model, rig, spins, operating = over_speed(options)
    found = unbalance_response(rig, spins, operating, options.modes)
    caption = f"Motion of rig “{rig.name}” under its unbalances over its spin, its bushings filled and not in contact."
    of_each = {"amplitude_um_pp": 1e6 * found.amplitude, "phase_lag_deg": found.phase_lag}
    table = long_table("probe", [*found.planes], "spin_rad_s", found.speed, **of_each)
    clearances = zip(rig.probe_labels, (2 * rig.bushings[j].gap for j in rig.bushing_of_row))
    read = dict(zip(found.planes, found.amplitude.max(axis=1)))
    if touching := [probe for probe, clearance in clearances if read.get(probe, 0.0) > clearance]:
        say(f"{', '.join(touching)}: wider than the clearance: the shaft touches, which clearance-mj orbits simulates")
    return write_over_speed(options, model, found, caption, table)
