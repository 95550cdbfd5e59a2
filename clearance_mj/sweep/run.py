"""Run a plan into a folder, or resume an interrupted run.

Results are kept in the folder ``cases`` until all are complete, in files of one case or, of many cases, of several.
Each has a digest, and counts only if that is correct: files torn by a kill or a power cut are computed again, a killed
process loses at most the cases in progress, and finished cases are never recomputed. One process, which has locked the
folder, writes. When every case is complete, ``results.nc`` is written from them, and only then ``cases`` is removed.
"""

from __future__ import annotations

import contextlib
import functools
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..core.cache import code, code_outside, digest, file_lock
from ..core.errors import ClearanceError
from ..core.files import SEAL, is_sealed, plain_file, remove_leftovers, replacing, seal, write_text
from ..core.provenance import made_from
from ..core.runner import ALL_CORES, Runner
from ..core.tasks import workers_to_use
from ..model import Model
from ..version import __version__
from .plan import Plan

__all__ = ["CASES", "RESULTS", "labelled", "run_sweep"]

PLAN, CASES, RESULTS, LOCK, PROVENANCE = "plan.json", "cases", "results.nc", "lock", "provenance.json"
SHOWN = {RESULTS, "sweep.html", "sweep.png", "sweep_frf.png", "sensitivity.csv", "sensitivity.json", "sensitivity.png"}
"""Files of results and figures"""
FILES = {PLAN, CASES, LOCK, PROVENANCE, f"{RESULTS}{SEAL}", *SHOWN}  # all files of a sweep's folder
LARGEST = 2**32 - 8  # bytes of one variable in a netCDF-3 file with 64-bit offsets
MOST_FILES = 1000  # of finished cases: 100 000 cases are computed and kept a hundred at a time
TIMED, SHARE_TIMED = 64, 0.05  # cases that are timed, at most, to estimate the time of all
MESSAGE = 240  # characters of a case's error message


def run_sweep(plan: Plan, out: str | Path, runner: Runner = ALL_CORES) -> xr.Dataset:
    """Run a sweep, or resume an interrupted one.

    Parameters
    ----------
    plan : Plan
        The plan.
    out : str or Path
        Folder for the results: ``results.nc`` once all cases are done. Until then it also keeps finished cases,
        instead of the runner's folder.
    runner : Runner
        Workers of the cases.

    Returns
    -------
    xarray.Dataset
        Every result over ``case``, with ``parameter`` (case, varied) and ``error`` (case,): why a case has none.

    Raises
    ------
    ClearanceError
        If the folder holds another plan's sweep or something else, another sweep is writing there, or the workers are
        lost.
    """
    workers_to_use(runner.workers)
    out = Path(out)
    _check_folder(out)
    with file_lock(out / LOCK, "sweep"):
        _check_plan(plan, out / PLAN)
        remove_leftovers(out, FILES)
        results = out / RESULTS
        if not is_sealed(results):
            values = _compute_all(plan, replace(runner, kept=out / CASES))
            with replacing(results) as temporary:
                labelled(plan, values).to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
            seal(results)
        Runner(kept=out / CASES).drop_unused()
        with contextlib.suppress(OSError):  # it does not exist, or somebody put something else into it
            (out / CASES).rmdir()
    return xr.load_dataset(results, engine="scipy")


def _compute_all(plan: Plan, runner: Runner) -> dict[str, np.ndarray]:
    """Compute results of all cases, and the field "error": the reason if a case has none."""
    n = len(plan.points)
    model, at_once = Model(*plan.case(0)[:2]), plan.engine.at_once
    size = max(-(-n // MOST_FILES), at_once)
    key = digest(plan.to_dict(), model.content(), code_outside(plan.engine))
    parts = [range(first, min(first + size, n)) for first in range(0, n, size)]
    timed = np.random.default_rng(0).permutation(n)[: min(int(SHARE_TIMED * n), TIMED)].tolist()
    samples = [functools.partial(plan.evaluate, case) for case in timed if at_once == 1]
    if at_once > 1:  # one program, for which processes would compete
        runner = replace(runner, workers=1)
    compute = functools.partial(_compute_part, plan)
    results = runner.run("sweep", compute, parts, lambda part: (key, part.start, part.stop), samples, n)
    return {name: np.concatenate([part[name] for part in results]) for name in (*plan.shapes, "error")}


def _compute_part(plan: Plan, cases: range) -> dict[str, np.ndarray]:
    results = list(plan.evaluate_all(cases))
    missing = {name: np.full(shape, np.nan) for name, shape in plan.shapes.items()}
    rows = [missing if isinstance(each, str) else each for each in results]
    errors = [each[:MESSAGE] if isinstance(each, str) else "" for each in results]
    return {name: np.array([row[name] for row in rows], dtype=float) for name in missing} | {"error": np.array(errors)}


def _check_folder(out: Path) -> None:
    if out.exists() and not out.is_dir():
        raise ClearanceError(f"--out {out} is a file; give a folder")
    try:
        out.mkdir(parents=True, exist_ok=True)
        names = sorted(p.name for p in out.iterdir() if p.name[0] != ".")
    except OSError as error:
        raise ClearanceError(f"--out {out}: cannot be used ({error.strerror})") from None
    if others := [name for name in names if name not in FILES or not (_is_begun(out) or _is_lock(out, names))]:
        raise ClearanceError(f"--out {out} holds {others[0]!r}, which is not of a sweep; give another folder")


def _is_begun(out: Path) -> bool:
    """Return True if a folder holds the plan of a sweep, and none of its files is a link."""
    return "code" in _stored_plan(out / PLAN) and not any((out / name).is_symlink() for name in FILES)


def _is_lock(out: Path, names: list[str]) -> bool:
    """Return True if a folder holds nothing but the lock of a sweep that ended before it wrote its plan."""
    lock = out / LOCK
    is_alone = names == [LOCK] and lock.is_file() and not lock.is_symlink()
    return is_alone and re.fullmatch(rb"\d*", lock.read_bytes()) is not None


def _stored_plan(path: Path) -> dict[str, Any]:
    """Return the stored plan; empty if it is damaged or missing."""
    try:
        data = json.loads(plain_file(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return data if isinstance(data, dict) else {}


def _check_plan(plan: Plan, path: Path) -> None:
    """Store the plan, or raise a ClearanceError if another one was begun here."""
    data = json.loads(json.dumps({**plan.to_dict(), "code": code()}))
    for name, shape in plan.shapes.items():
        if (size := 8 * len(plan.points) * int(np.prod(shape))) > LARGEST:
            raise ClearanceError(
                f"{name} of {len(plan.points)} cases takes {size / 2**30:.1f} GiB, more than a netCDF file can hold in "
                "one variable; keep fewer sensors in outputs.frf"
            )
    if not path.exists():
        write_text(path, json.dumps(data, indent=1) + "\n")
        return
    if difference := _difference(_stored_plan(path), data):
        version, other = "begun with another version of clearance_mj", f"of another plan ({difference})"
        description = version if difference == "code" else other
        raise ClearanceError(f"{path.parent} holds a sweep {description}; give another folder")


def _difference(a: Any, b: Any, where: str = "") -> str:
    """Return the path at which nested plain data first differ; empty if they are equal."""
    if type(a) is type(b) and isinstance(a, dict | list) and len(a) == len(b):
        keys = a.keys() | b.keys() if isinstance(a, dict) else range(len(a))
        for key in sorted(keys):
            step = f"[{key}]" if isinstance(a, list) else f".{key}" if where else key
            inner = [part.get(key) if isinstance(part, dict) else part[key] for part in (a, b)]
            if difference := _difference(inner[0], inner[1], where + step):
                return difference
        return ""
    return "" if a == b else where or "plan"


# Results of a sweep as labelled arrays: every result over the cases, and the parameters of each case.

_RESULTS: dict[str, tuple[tuple[str, ...], dict[str, str]]] = {
    "natural_frequency": (
        ("mode",), {"units": "Hz", "long_name": "natural frequency of the linear rig within the gap"}
    ),
    "acceleration_rms": (("response",), {"units": "m s-2"}),
    "displacement_rms": (("bushing",), {"units": "m"}),
    "contact_share": (("bushing",), {"units": "1", "long_name": "share of the steps in contact, beyond the gap"}),
    "peak_frequency": (
        ("peak",), {"units": "Hz", "long_name": "frequency of the highest peak, root mean square over the sensors"}
    ),
    "peak_magnitude": (("peak",), {"long_name": "highest peak in the band, root mean square over the sensors"}),
    "rmse": (("compared",), {"units": "dB", "long_name": "RMSE of the FRF against the reference"}),
    "frf": (("kept", "frequency", "part"), {"long_name": "frequency response function, real and imaginary part"}),
}  # fmt: skip
"""Dimensions other than the case, and attributes"""


def labelled(plan: Plan, values: dict[str, np.ndarray]) -> xr.Dataset:
    """Return the results of all cases with names, units and labels."""
    variables: dict[str, Any] = {
        name: (("case", *_RESULTS[name][0]), values[name], _attributes(plan, name)) for name in plan.shapes
    }
    variables["parameter"] = (("case", "varied"), plan.points, {"long_name": "values of the varied parameters, SI"})
    variables["error"] = ("case", values["error"].tolist())
    coordinates = {
        "case": np.arange(len(plan.points), dtype=np.int32),
        "varied": plan.paths,
        "mode": np.arange(1, plan.outputs.natural_frequencies + 1, dtype=np.int32),
    }
    attributes = {"clearance_mj": "sweep", "version": __version__, "plan": json.dumps(plan.to_dict())}
    attributes["provenance"] = json.dumps(made_from(plan.files, "sweep"))
    return xr.Dataset(variables, coordinates | _labels(plan), attributes)


def _labels(plan: Plan) -> dict:
    if (observer := plan.observer) is None:
        return {}
    responses = plan.rig.sensor_labels
    labels = {
        "response": responses,
        "bushing": np.arange(len(plan.rig.bushings), dtype=np.int32),
        "band": ("peak", [f"{low:g}-{high:g} Hz" for low, high in observer.peaks]),
    }
    if observer.reference is not None:
        labels["compared"] = [responses[row] for row in observer.compared]
    if observer.kept:
        labels |= {"kept": [responses[row] for row in observer.kept], "part": ["real", "imag"]}
        labels["frequency"] = ("frequency", observer.frequency, {"units": "Hz"})
    return labels


def _attributes(plan: Plan, name: str) -> dict:
    attributes = _RESULTS[name][1]
    if name not in ("peak_magnitude", "frf"):
        return attributes
    excitation = plan.case(0)[2]
    return {"units": "1" if excitation is not None and excitation.kind == "base" else "m s-2 N-1", **attributes}
