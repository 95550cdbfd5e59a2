"""The same beam by every method at hand: error of the FRFs and time per simulated second, from coarse to fine."""

from functools import partial
from importlib.metadata import version
from importlib.util import find_spec

from tqdm import tqdm

import clearance_mj as cm

from .case import LAW, PULLING, REFERENCE, RIG, SECONDS, error, excitation, timed
from .modal_equations import lsoda, semi_implicit_euler
from .speed import driven_loop

ENOUGH = 0.5  # dB: methods are compared at the cheapest setting that comes as close


def measure():
    """Return the reference's convergence, and for each method its settings with times and errors."""
    drive, methods = excitation(), _methods()
    rows = []
    for method, settings in tqdm(methods.items(), desc="alternatives", unit="method"):
        for name, run in settings:
            run(excitation(0.5))  # compiles
            seconds, response = timed(partial(run, drive))
            off = error(response, PULLING if method.startswith("Exudyn") else LAW)
            rows.append({"method": method, "setting": name, "cost": seconds / SECONDS, "error": off})
    best = _best(rows)
    links, _, safety, *_ = best["links"]["setting"].split()
    loop, _ = timed(driven_loop(RIG, LAW, cm.Links(int(links), safety=float(safety)), drive))
    return {
        "rows": rows,
        "best": best,
        "raw_loop": {"setting": f"{links} links", "cost": loop / SECONDS},
        "reference": {"setting": "modal, 16 modes, 0.1 rad per step", "checks": _convergence(drive)},
        "skipped": {} if _has_exudyn() else {"Exudyn": "not installed; pip install 'clearance-mj[exudyn]'"},
        "exudyn": version("exudyn") if _has_exudyn() else None,
    }


def _has_exudyn():
    return find_spec("exudyn") is not None


def _methods():
    methods = {
        "links": [
            (f"{n} links, {s} of the stable step", _engine(cm.Links(n, safety=s)))
            for n, s in ((9, 0.8), (10, 0.8), (10, 0.6), (12, 0.6), (14, 0.6), (16, 0.6), (20, 0.6), (30, 0.6))
        ],
        "modal": [(f"{n} modes", _engine(cm.Modal(n))) for n in (3, 4, 6, 8, 12)],
        "numpy": [(f"{n} modes", partial(semi_implicit_euler, n)) for n in (3, 4, 5, 6)],
        "solve_ivp": [(f"4 modes, rtol {r:g}", partial(lsoda, 4, r)) for r in (1e-2, 1e-3, 1e-4)]
        + [(f"6 modes, rtol {r:g}", partial(lsoda, 6, r)) for r in (1e-4, 1e-6)],
    }
    if not _has_exudyn():
        return methods
    from . import exudyn_models as exudyn

    for name, shaft in (("Exudyn ANCF", exudyn.absolute_nodal), ("Exudyn FE", exudyn.finite_elements)):
        meshes = ((1, 1), (1, 2), (1, 3), (1, 5), (2, 5), (2, 10))
        methods[name] = [(f"{8 * s} elements, {f} steps", partial(exudyn.run, shaft, s, f)) for s, f in meshes]
    return methods


def _engine(engine):
    return lambda drive: cm.simulate(RIG, drive, LAW, engine)


def _best(rows):
    """Cheapest setting of each method that is close enough; none for a method that never is."""
    close = {}
    for row in rows:
        if row["error"] <= ENOUGH and row["cost"] < close.get(row["method"], {"cost": float("inf")})["cost"]:
            close[row["method"]] = row
    return close


def _convergence(drive):
    """Return the change of the FRFs when the reference is refined, or made by a method that shares no code with it."""
    others = {
        "half the step": _engine(cm.Modal(REFERENCE.modes, REFERENCE.resolution / 2)),
        "24 modes": _engine(cm.Modal(24, REFERENCE.resolution)),
        "solve_ivp, 8 modes, rtol 1e-8": partial(lsoda, 8, 1e-8, factor=16),
        "60 links": _engine(cm.Links(60)),
    }
    return {name: error(run(drive)) for name, run in others.items()}
