"""clearance-mj update-rig: the linear rig out of records."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..identify import Diagnosis, RigUpdate
from ..identify.records.prepared import prepare
from ..identify.structure.examination import examine
from ..identify.structure.faults.diagnosis import diagnose
from ..identify.structure.updating import update_from
from ..io.dataset import Dataset
from ..report.updated_rig import draw
from .command import Options, Result, command, flag, option
from .options import parameter_words, plugin


@command(
    "update-rig",
    option("dataset", "dataset folder; only its records to identify from are opened", Path),
    flag("--as-drawn", "try no structure that the rig file does not draw"),
    plugin("a hypothesis"),
    out="results/updated_rig", writes=("rig.toml", "*.json", "*.png"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Correct the rig file by the records, and say how well it is known."""
    dataset = Dataset.load(options.dataset)
    records = prepare(dataset)
    if options.as_drawn:
        update = update_from(dataset.rig, records)
        diagnosis = diagnose(update)
    else:
        update, diagnosis = examine(dataset.rig, records, progress=not options.quiet)
    update.rig.copied(options.new / "structure").save(options.new / "rig.toml")
    data = update.to_dict() | {"diagnosis": list(diagnosis.words)}
    return Result(data, _report(update, diagnosis), drawings=[draw(update)])


def _report(update: RigUpdate, diagnosis: Diagnosis) -> Iterator[str]:
    for piece in update.misfit:
        yield f"record {piece.record}: misfit up to {100 * piece.relative_error.max():.1f} %"
    yield from parameter_words(update.estimates, 40, f"{'now':>11s}   std  (posterior over prior)")
    yield from (f"warning: {words}" for words in (*update.warnings, *diagnosis.words))
