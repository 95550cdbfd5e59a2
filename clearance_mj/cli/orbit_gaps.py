"""clearance-mj orbit-gaps: the clearances of a machine in operation, from its orbits alone."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from .command import command, provenance, spelled, write_results


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option(
        "records", type=Path, help="dataset folder, with records of a shaft that turns alone, with probes and keyphasor"
    )
    words = "rig file (TOML) or folder of a model instead of the dataset's rig, as identified before"
    option("--rig", type=Path, help=words)
    option(
        "--follow", nargs="+", default=[], metavar="RECORD",
        help="names of later records: no gap is found from them; they are followed, with alarms where a rub begins, a "
        "gap wears or oil thins",
    )  # fmt: skip


@command(
    "orbit-gaps", "find the clearances of a machine in operation from orbits alone: probes and keyphasor", _options,
    out=Path("results/orbit_gaps"), out_help="folder for rig.toml, law.json, orbits.json, orbits.png and, of each "
    "record that is followed, followed_RECORD.json and .png (default: %(default)s)",
    writes=("rig.toml", "law.json", "orbits.json", "orbits.png"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..core.errors import RecordError
    from ..identify import follow_orbits, orbits
    from ..io.dataset import Dataset
    from ..model import Model
    from ..report.style import Drawing
    from ..report.twin import draw

    given = Model.load(options.rig).rig if options.rig else None
    dataset = Dataset.load(options.records)
    records = {r.name: r for r in (*dataset.identify, *dataset.orbits)}
    if unknown := [name for name in options.follow if name not in records]:
        raise RecordError(f"--follow {unknown[0]}: {options.records} has no such record; it has {', '.join(records)}")
    later = [records.pop(name) for name in dict.fromkeys(options.follow)]
    found = orbits(list(records.values()), given or dataset.rig)
    caption = f"Orbits in the bushings of rig “{found.rig.name}”, about the middle of the wall that they tell."
    found.model.save(options.new, provenance(options))
    write_results(options, "orbits", found.to_dict(), None, Drawing("orbits", found.plot(), caption, caption))
    for words in (*found.words(), *(f"warning: {each}" for each in found.warnings)):
        print(words)
    followed = [follow_orbits(record, found) for record in later]
    for twin in followed:
        name, drawing = f"followed_{twin.record}", draw(twin)
        alarms = [alarm.to_dict() | {"words": str(alarm)} for alarm in twin.alarms]
        told = {"record": twin.record, "windows": twin.rows(), "alarms": alarms}
        write_results(options, name, told, None, dataclasses.replace(drawing, name=name))
        for said in twin.alarms or ("no alarm",):
            print(f"{twin.record}: {said}")
    print(f"results: {options.out}")
    print(f"next: {spelled('unbalance', options.out)}: critical speeds under the unbalance that was found")
    said_of = {twin.record: [str(alarm) for alarm in twin.alarms] for twin in followed}
    return {"clearances": found.rows(), "alarms": said_of, "out": str(options.out)}
