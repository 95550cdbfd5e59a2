"""clearance-mj sweep: many cases of a rig, and what their results depend on."""

from __future__ import annotations

from pathlib import Path

from ..core.files import sha256, to_json, write_text
from ..core.provenance import made_from
from ..report.sweep import draw_frfs, draw_results, draw_sensitivity, write_page
from ..report.tables import write_csv
from ..sweep import Runner, load_plan, run_sweep
from ..sweep.run import PROVENANCE, SHOWN
from ..sweep.sensitivity import sensitivity
from .command import Options, Result, command, option
from .options import WHERE


@command(
    "sweep",
    option("plan", "plan file (TOML)", Path),
    WHERE,
    out="results/sweep", out_help="folder for results.nc, sweep.html, figures and sensitivities",
)  # fmt: skip
def run(options: Options) -> Result:
    """Simulate the cases of a plan; an interrupted sweep goes on where it stopped."""
    plan, out = load_plan(options.plan), options.out
    results = run_sweep(plan, out, Runner(options.workers, options.scheduler, progress=not options.quiet))
    errors = {int(case): str(error) for case, error in zip(results["case"], results["error"].values) if error}
    data = {"cases": results.sizes["case"], "without_results": errors}
    drawings = [drawing for drawing in (draw_results(results, plan.vary), draw_frfs(results)) if drawing]
    words = [f"results: {out / 'results.nc'} ({results.sizes['case']} cases)"]
    for case, error in list(errors.items())[:1]:
        words += [f"{len(errors)} cases have no results; case {case}: {error}"]
    if plan.design.method == "saltelli" and not errors:
        sobol = sensitivity(results, plan.design.samples)
        data["sensitivity"] = rows = sobol.rows()
        write_text(out / "sensitivity.json", to_json(rows))
        write_csv(out / "sensitivity.csv", rows)
        drawings.append(draw_sensitivity(sobol))
        words += ["Sobol indices, first order / total"]
        for row in rows:
            indices = f"{row['first_order']:6.3f} / {row['total_order']:.3f}"
            words += [f"  {row['quantity']:28s} {row['parameter']:36s} {indices}"]
    for drawing in drawings:
        drawing.write(out)
    if drawings:
        words += [f"report: {write_page(drawings, out, results.sizes['case'])}"]
    # Versions, and the digests of what the sweep was made from and of what is shown of it.
    files = {name: sha256(out / name) for name in sorted(SHOWN) if (out / name).is_file()}
    write_text(out / PROVENANCE, to_json(made_from(plan.files, "sweep") | {"files": files}))
    return Result(data, words)
