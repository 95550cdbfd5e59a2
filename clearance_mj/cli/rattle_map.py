"""clearance-mj rattle-map: where a rig rattles and jumps, over level, frequency and gap."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..core.errors import ClearanceError
from ..core.files import to_json, write_text
from .command import command, provenance
from .options import (
    MAX_NUMBERS,
    PERIODIC,
    add_periodic,
    add_periodic_kind,
    add_plugin,
    hertz,
    lengths,
    load_model,
    load_plugin,
    numbers,
    periodic_settings,
    settings,
)  # fmt: skip


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_periodic(parser)
    add_periodic_kind(parser)
    option(
        "--levels", type=numbers, default="0.5:10:20", metavar="A,...",
        help="amplitudes of a sine, m/s² of the base or N, or factors of the unbalances: a list, or a range "
        "FROM:TO:COUNT (default: %(default)s)",
    )  # fmt: skip
    option("--from", dest="start", type=hertz, default=5.0, metavar="HZ", help="(default: %(default)s)")
    option("--to", dest="stop", type=hertz, default=220.0, metavar="HZ", help="(default: %(default)s)")
    option("--steps", type=int, default=400, help="frequencies, evenly spaced (default: %(default)s)")
    option("--gaps", type=lengths, metavar="M,...", help="of all bushings, m or such as 0.1mm,5mil; list or range")
    option("--workers", type=int, help="processes (default: one for each core)")
    add_plugin(parser, "a contact or a grease")


@command(
    "rattle-map", "map where a rig rattles and jumps, over level and frequency, for several gaps", _options,
    out=Path("results/rattle_map"), out_help="folder for rattle_map.csv, .json and .png (default: %(default)s)",
    writes=("rattle_map.csv", "rattle_map.json", "rattle_map.png"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    import numpy as np

    from ..periodic import map_rattle
    from ..periodic.summaries import of_map
    from ..report.rattle_maps import draw, rows, words
    from ..report.tables import write_csv

    load_plugin(options.plugin)
    if not 2 <= options.steps <= MAX_NUMBERS:
        raise ClearanceError(f"--steps must be between 2 and {MAX_NUMBERS}, got {options.steps}")
    model = load_model(options)
    shared = {name: getattr(options, name) for name in ("kind", "workers", "gaps")} | periodic_settings(options)
    frequencies = np.linspace(options.start, options.stop, options.steps)
    found = map_rattle(model, options.levels, frequencies, **shared, progress=not options.quiet)
    result = settings(model) | {name: getattr(options, name) for name in PERIODIC} | of_map(found)
    result |= {"provenance": provenance(options)}
    text = to_json(result)
    drawing = draw(found)
    write_csv(options.new / "rattle_map.csv", rows(found))
    drawing.write(options.new)
    write_text(options.new / "rattle_map.json", text)
    print("\n  ".join(words(found)))
    print(f"rattle map: {options.out / 'rattle_map.png'}")
    return result | {"out": str(options.out)}
