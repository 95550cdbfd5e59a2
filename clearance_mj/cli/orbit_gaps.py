"""clearance-mj orbit-gaps: the clearances of a machine in operation, from its orbits alone."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from ..core.errors import RecordError
from ..core.files import to_json, write_text
from ..identify import follow_orbits, orbits
from ..io.dataset import Dataset
from ..model import Model
from ..report.style import Drawing
from ..report.twin import draw
from .command import Options, Result, command, option, provenance, spelled


@command(
    "orbit-gaps",
    option("records", "dataset folder, with records of a shaft that turns alone, with probes and keyphasor", Path),
    option("--rig", "rig file (TOML) or folder of a model instead of the dataset's rig, as identified before", Path),
    option("--follow", "names of later records: no gap is found from them; they are followed, with alarms where a rub "
           "begins, a gap wears or oil thins", nargs="+", default=(), metavar="RECORD"),
    out_help="folder for rig.toml, law.json, orbits.json, orbits.png and, of each record "
    "that is followed, followed_RECORD.json and .png",
    base="orbits", writes=("rig.toml", "law.json", "*.json", "*.png"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Find the clearances of a machine in operation from orbits alone: probes and keyphasor."""
    given = Model.load(options.rig).rig if options.rig else None
    dataset = Dataset.load(options.records)
    records = {r.name: r for r in (*dataset.identify, *dataset.orbits)}
    if unknown := [name for name in options.follow if name not in records]:
        raise RecordError(f"--follow {unknown[0]}: {options.records} has no such record; it has {', '.join(records)}")
    later = [records.pop(name) for name in dict.fromkeys(options.follow)]
    gaps = orbits(list(records.values()), given or dataset.rig)
    gaps.model.save(options.new, provenance(options))
    caption = f"Orbits in the bushings of rig “{gaps.rig.name}”, about the middle of the wall that they tell."
    words = [*gaps.words(), *(f"warning: {each}" for each in gaps.warnings)]
    drawings, said_of = [Drawing("orbits", gaps.plot(), caption, caption)], {}
    for twin in (follow_orbits(record, gaps) for record in later):
        name = f"followed_{twin.record}"
        alarms = [alarm.to_dict() | {"words": str(alarm)} for alarm in twin.alarms]
        content = {"record": twin.record, "windows": twin.rows(), "alarms": alarms, "provenance": provenance(options)}
        write_text(options.new / f"{name}.json", to_json(content))
        drawings.append(dataclasses.replace(draw(twin), name=name))
        words += [f"{twin.record}: {said}" for said in twin.alarms or ("no alarm",)]
        said_of[twin.record] = [str(alarm) for alarm in twin.alarms]
    words += [f"next: {spelled('unbalance', options.out)}: critical speeds under the unbalance that was found"]
    return Result(gaps.to_dict() | {"clearances": gaps.rows(), "alarms": said_of}, words, drawings=drawings)
