"""clearance-mj sweep: many cases of a rig, and what their results depend on."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.files import sha256, to_json, write_text
from .command import command

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..report.style import Drawing


def _options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("plan", type=Path, help="plan file (TOML)")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, help="processes on this machine (default: one for each core)")
    where.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster, such as tcp://10.0.0.1:8786")


@command(
    "sweep", "simulate the cases of a plan; an interrupted sweep goes on where it stopped", _options,
    out=Path("results/sweep"),
    out_help="folder for results.nc, sweep.html, figures and sensitivities (default: %(default)s)",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..report.sweep import draw_frfs, draw_results, write_page
    from ..sweep import load_plan, run_sweep

    plan = load_plan(options.plan)
    results = run_sweep(plan, options.out, options.workers, options.scheduler, not options.quiet)
    errors = {int(case): str(error) for case, error in zip(results["case"], results["error"].values) if error}
    summary = {"out": str(options.out), "cases": results.sizes["case"], "without_results": errors}
    drawings = [drawing for drawing in (draw_results(results, plan.vary), draw_frfs(results)) if drawing]
    print(f"results: {options.out / 'results.nc'} ({results.sizes['case']} cases)")
    for case, error in list(errors.items())[:1]:
        print(f"{len(errors)} cases have no results; case {case}: {error}")
    if plan.design.method == "saltelli" and not errors:
        summary["sensitivity"], drawing = _sensitivity(plan, results, options)
        drawings.append(drawing)
    for drawing in drawings:
        drawing.write(options.out)
    if drawings:
        print(f"report: {write_page(drawings, options.out, results.sizes['case'])}")
    _write_provenance(options.out, plan)
    return summary


def _write_provenance(out: Path, plan: Any) -> None:
    """Versions, and the digests of what the sweep was made from and of what is shown of it."""
    from ..core.provenance import made_from
    from ..sweep.run import PROVENANCE, SHOWN

    files = {name: sha256(out / name) for name in sorted(SHOWN) if (out / name).is_file()}
    write_text(out / PROVENANCE, to_json(made_from(plan.files, "sweep") | {"files": files}))


def _sensitivity(plan: Any, results: Any, options: argparse.Namespace) -> tuple[list[dict], Drawing]:
    """Sobol indices, written and printed, and how they are drawn."""
    from ..report.sweep import draw_sensitivity
    from ..report.tables import write_csv
    from ..sweep.sensitivity import sensitivity

    found = sensitivity(results, plan.design.samples)
    rows = found.rows()
    write_text(options.out / "sensitivity.json", to_json(rows))
    write_csv(options.out / "sensitivity.csv", rows)
    print("Sobol indices, first order / total")
    for row in rows:
        indices = f"{row['first_order']:6.3f} / {row['total_order']:.3f}"
        print(f"  {row['quantity']:28s} {row['parameter']:36s} {indices}")
    return rows, draw_sensitivity(found)
