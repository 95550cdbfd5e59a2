"""clearance-mj sweep: many cases of a rig, and what their results depend on."""

from __future__ import annotations

from pathlib import Path

from ..files import replacing, to_json
from .command import add_command

__all__ = ["add"]


def add(commands):
    """Add the command.

    Parameters
    ----------
    commands : argparse subparsers
        Where to add it.
    """
    parser = add_command(
        commands, "sweep", _run, "simulate the cases of a plan; an interrupted sweep goes on where it stopped",
        default=Path("results/sweep"),
        help="folder for results.nc, figures and sensitivities (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("plan", type=Path, help="plan file (TOML)")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, help="processes on this machine (default: one for each core)")
    where.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster, such as tcp://10.0.0.1:8786")


def _run(options):
    from ..report.sweep import draw_results
    from ..sweep import load_plan, run_sweep

    plan = load_plan(options.plan)
    results = run_sweep(plan, options.out, options.workers, options.scheduler, not options.quiet)
    errors = {int(case): str(error) for case, error in zip(results["case"], results["error"].values) if error}
    summary = {"out": str(options.out), "cases": results.sizes["case"], "without_results": errors}
    if drawing := draw_results(results, plan.vary):
        _write(options.out, drawing)
    if not options.json:
        print(f"results: {options.out / 'results.nc'} ({results.sizes['case']} cases)")
        for case, error in list(errors.items())[:1]:
            print(f"{len(errors)} cases have no results; case {case}: {error}")
    if plan.design.method == "saltelli" and not errors:
        summary["sensitivity"] = _sensitivity(plan, results, options)
    return summary


def _sensitivity(plan, results, options) -> list[dict]:
    from ..report.sweep import draw_sensitivity
    from ..report.tables import write_csv
    from ..sweep.sensitivity import sensitivity

    found = sensitivity(results, plan.design.samples)
    rows = found.rows()
    with replacing(options.out / "sensitivity.json") as temporary:
        temporary.write_text(to_json(rows), encoding="utf-8")
    write_csv(options.out / "sensitivity.csv", rows)
    _write(options.out, draw_sensitivity(found))
    if not options.json:
        print("Sobol indices, first order / total")
        for row in rows:
            indices = f"{row['first_order']:6.3f} / {row['total_order']:.3f}"
            print(f"  {row['quantity']:28s} {row['parameter']:36s} {indices}")
    return rows


def _write(folder, drawing):
    with replacing(folder / f"{drawing.name}.png") as temporary:
        temporary.write_bytes(drawing.png())
