"""clearance-mj update-rig: the linear rig out of records."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .command import command, write_results
from .options import add_plugin, print_parameters

if TYPE_CHECKING:
    from ..identify import Diagnosis, RigUpdate


def _options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("dataset", type=Path, help="dataset folder; only its records to identify from are opened")
    parser.add_argument("--as-drawn", action="store_true", help="try no structure that the rig file does not draw")
    add_plugin(parser, "a hypothesis")


@command(
    "update-rig", "correct the rig file by the records, and say how well it is known", _options,
    out=Path("results/updated_rig"),
    out_help="folder for rig.toml, updated_rig.json and updated_rig.png (default: %(default)s)",
    writes=("rig.toml", "updated_rig.json", "updated_rig.png"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..identify.records.prepared import prepare
    from ..identify.structure.examination import examine
    from ..identify.structure.faults.diagnosis import diagnose
    from ..identify.structure.updating import update_from
    from ..io.dataset import Dataset
    from ..report.updated_rig import draw

    dataset = Dataset.load(options.dataset)
    records = prepare(dataset)
    if options.as_drawn:
        found = update_from(dataset.rig, records)
        diagnosis = diagnose(found)
    else:
        found, diagnosis = examine(dataset.rig, records, progress=not options.quiet)
    found.rig.copied(options.new / "structure").save(options.new / "rig.toml")
    stored = found.to_dict() | {"diagnosis": list(diagnosis.words)}
    _print(found, diagnosis, options.out)
    return write_results(options, "updated_rig", stored, None, draw(found))


def _print(found: RigUpdate, diagnosis: Diagnosis, out: Path) -> None:
    for piece in found.misfit:
        print(f"record {piece.record}: misfit up to {100 * piece.share.max():.1f} %")
    print_parameters(found.estimates, 40, f"{'now':>11s}   std  (posterior over prior)")
    for words in (*found.warnings, *diagnosis.words):
        print(f"warning: {words}")
    print(f"rig: {out / 'rig.toml'}")
