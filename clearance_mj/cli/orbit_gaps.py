"""clearance-mj orbit-gaps: the clearances of a machine in operation, from its orbits alone."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..core.files import to_json, write_text
from .command import command, provenance


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option(
        "records", type=Path, help="dataset folder, with records of a shaft that turns alone, with probes and keyphasor"
    )
    option(
        "--rig",
        type=Path,
        help="rig file (TOML) or folder of a model instead of the dataset's rig, as identified before",
    )


@command(
    "orbit-gaps", "find the clearances of a machine in operation from orbits alone: probes and keyphasor", _options,
    out=Path("results/orbit_gaps"), out_help="folder for rig.toml, orbits.json and orbits.png (default: %(default)s)",
    writes=("rig.toml", "orbits.json", "orbits.png"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..identify import orbits
    from ..io.dataset import Dataset
    from ..model import Model
    from ..report.style import Drawing

    given = Model.load(options.rig).rig if options.rig else None
    found = orbits(Dataset.load(options.records), given)
    caption = f"Orbits in the bushings of rig “{found.rig.name}”, about the middle of the wall that they tell."
    Drawing("orbits", found.plot(), caption, caption).write(options.new)
    found.rig.save(options.new / "rig.toml")
    write_text(options.new / "orbits.json", to_json(found.to_dict() | {"provenance": provenance(options)}))
    for words in (*found.words(), *(f"warning: {each}" for each in found.warnings)):
        print(words)
    print(f"results: {options.out}")
    return {"clearances": found.rows(), "out": str(options.out)}
