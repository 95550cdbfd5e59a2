"""Run a plan into a folder, or go on where a run stopped.

Results wait in a table on disk until all are there, ``cases.npy``, with one row for each case.

It is made full of zeros before the first case runs. One process, which has locked the folder, writes; a row holds a
digest over the case's number and its results, and counts only if that is right. So none is stored twice, a row that a
kill or a power cut tore is computed again, a killed process loses at most the cases in flight, and finished cases are
never recomputed. When every row counts, ``results.nc`` is written from them, and only then the table is removed.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..core.cache import code, file_lock
from ..core.errors import ClearanceError
from ..core.files import SEAL, is_sealed, plain_file, remove_leftovers, replacing, seal, write_text
from ..core.provenance import made_from
from ..core.tasks import run_tasks, workers_to_use
from ..version import __version__
from .plan import Plan

__all__ = ["RESULTS", "Table", "labelled", "run_sweep"]

PLAN, TABLE, RESULTS, LOCK, PROVENANCE = "plan.json", "cases.npy", "results.nc", "lock", "provenance.json"
SHOWN = {
    RESULTS, "sweep.html", "sweep.png", "sweep_frf.png", "sensitivity.csv", "sensitivity.json", "sensitivity.png",
}  # fmt: skip
"""Results, and what is drawn of them"""
FILES = {PLAN, TABLE, LOCK, PROVENANCE, f"{RESULTS}{SEAL}", *SHOWN}  # What a sweep leaves in its folder
LARGEST = 2**32 - 8  # bytes of one variable in a netCDF-3 file with 64-bit offsets


def run_sweep(
    plan: Plan,
    out: str | Path,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
    executor: Executor | None = None,
) -> xr.Dataset:
    """Run a sweep, or go on with one that was interrupted.

    Parameters
    ----------
    plan : Plan
        The plan.
    out : str or Path
        Folder for the results: ``results.nc`` once all cases are done.
    workers : int, optional
        Processes on this machine; default: one for each core.
    scheduler : str, optional
        Address of a Dask scheduler, whose cluster then computes the cases.
    progress : bool
        Show a progress bar with the time left.
    executor : concurrent.futures.Executor, optional
        What computes the cases instead, of any library (a pool of threads or processes, MPI, a queue of a cluster); it
        is left open.

    Returns
    -------
    xarray.Dataset
        Every result over ``case``, with ``parameter`` (case, varied) and ``error`` (case,): why a case has none.

    Raises
    ------
    ClearanceError
        If the folder holds another plan's sweep or something else, another sweep is writing there, or the workers are
        lost.

    Notes
    -----
    Cases run in a shuffled order, so that those that are done are a fair sample of those that are left, and with them
    the time left that is shown: stiff or loud corners of a grid may cost many times what the others do. Processes start
    by importing the calling script: start a sweep below ``if __name__ == "__main__"``.
    """
    workers = workers_to_use(workers)
    out = Path(out)
    _check_folder(out)
    with file_lock(out / LOCK, "sweep"):
        _check_plan(plan, out / PLAN)
        remove_leftovers(out, FILES)
        results = out / RESULTS
        if not is_sealed(results):
            table = Table(out / TABLE, plan.shapes, len(plan.points))
            _compute(plan, table, workers, scheduler, executor, progress)
            with replacing(results) as temporary:
                labelled(plan, table).to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
            seal(results)
        (out / TABLE).unlink(missing_ok=True)
    return xr.load_dataset(results, engine="scipy")


def _check_folder(out: Path) -> None:
    if out.exists() and not out.is_dir():
        raise ClearanceError(f"--out {out} is a file; give a folder")
    try:
        out.mkdir(parents=True, exist_ok=True)
        found = sorted(p.name for p in out.iterdir() if p.name[0] != ".")
    except OSError as error:
        raise ClearanceError(f"--out {out}: cannot be used ({error.strerror})") from None
    if others := [name for name in found if name not in FILES or not (_is_begun(out) or _is_lock(out, found))]:
        raise ClearanceError(f"--out {out} holds {others[0]!r}, which is not of a sweep; give another folder")


def _is_begun(out: Path) -> bool:
    """Whether a folder holds the plan of a sweep, and none of its files is a link."""
    return "code" in _plan(out / PLAN) and not any((out / name).is_symlink() for name in FILES)


def _is_lock(out: Path, found: list[str]) -> bool:
    """Whether a folder holds nothing but the lock of a sweep that ended before it wrote its plan."""
    lock = out / LOCK
    is_alone = found == [LOCK] and lock.is_file() and not lock.is_symlink()
    return is_alone and re.fullmatch(rb"\d*", lock.read_bytes()) is not None


def _plan(path: Path) -> dict[str, Any]:
    """The plan that was written down; empty if it is damaged or not there."""
    try:
        found = json.loads(plain_file(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _check_plan(plan: Plan, path: Path) -> None:
    """Write the plan down, or refuse it if another one was begun here."""
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
    if difference := _difference(_plan(path), data):
        version, other = "begun with another version of clearance_mj", f"of another plan ({difference})"
        what = version if difference == "code" else other
        raise ClearanceError(f"{path.parent} holds a sweep {what}; give another folder")


def _difference(a: Any, b: Any, where: str = "") -> str:
    """Where nested plain data differ first; empty if nowhere."""
    if type(a) is type(b) and isinstance(a, dict | list) and len(a) == len(b):
        keys = a.keys() | b.keys() if isinstance(a, dict) else range(len(a))
        for key in sorted(keys):
            step = f"[{key}]" if isinstance(a, list) else f".{key}" if where else key
            inner = [part.get(key) if isinstance(part, dict) else part[key] for part in (a, b)]
            if found := _difference(inner[0], inner[1], where + step):
                return found
        return ""
    return "" if a == b else where or "plan"


def _compute(
    plan: Plan, table: Table, workers: int | None, scheduler: str | None, executor: Executor | None, progress: bool
) -> None:
    finished = table.finished()
    left = np.random.default_rng(0).permutation(np.flatnonzero(~finished)).tolist()
    done, words = int(finished.sum()), "sweep" if progress else ""
    for case, values in run_tasks(
        plan.evaluate, left, workers, processes=True, scheduler=scheduler, executor=executor, progress=words, done=done
    ):
        table.write(case, values)


# Results of a sweep as labelled arrays: every result over the cases, and what each case was.

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
"""Dimensions beside the case, and attributes"""


def labelled(plan: Plan, table: Table) -> xr.Dataset:
    """Return a finished table with names, units and labels."""
    rows = table.rows()
    variables: dict[str, Any] = {
        name: (("case", *_RESULTS[name][0]), rows[name], _attributes(plan, name)) for name in plan.shapes
    }
    variables["parameter"] = (("case", "varied"), plan.points, {"long_name": "values of the varied parameters, SI"})
    variables["error"] = ("case", [text.decode(errors="ignore") for text in rows["error"]])
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


DIGEST = 8  # bytes
MESSAGE = 240  # bytes of the line that says why a case has no results


class Table:
    """Results on disk of n cases, with quantities of these shapes; made if the file is not there.

    A ClearanceError says if the file holds another table, or there is no room on the disk.
    """

    def __init__(self, path: Path, shapes: dict[str, tuple[int, ...]], n_cases: int):
        numbers = [(name, "<f8", shape) for name, shape in shapes.items()]
        self.path, self.row = path, np.dtype([("digest", f"V{DIGEST}"), ("error", f"S{MESSAGE}"), *numbers])
        if not path.exists():
            with replacing(path) as temporary:
                np.lib.format.open_memmap(temporary, "w+", self.row, (n_cases,)).flush()
        rows = self.rows()
        if rows.dtype != self.row or rows.shape != (n_cases,):
            raise ClearanceError(f"{path}: is not the table of this sweep; remove it to begin again")
        self._start = rows.offset

    def rows(self) -> np.memmap:
        """Return the table (n_cases,) as it is on disk: fields "error" and those of ``shapes``."""
        try:
            return np.lib.format.open_memmap(self.path, "r")
        except Exception as error:  # numpy raises whatever parsing a damaged header as Python leads to
            raise ClearanceError(f"{self.path}: is damaged ({error}); remove it to begin again") from None

    def finished(self) -> np.ndarray:
        """Return which cases (n_cases,) have results, or are known to have none."""
        return np.array([row["digest"].tobytes() == _digest(i, row) for i, row in enumerate(self.rows())], dtype=bool)

    def write(self, case: int, values: dict | str) -> None:
        """Store what came of a case: its results, or why it has none."""
        row = np.zeros((), self.row)
        if isinstance(values, str):
            row["error"] = values.encode()[:MESSAGE]
        for name in (self.row.names or ())[2:]:
            row[name] = math.nan if isinstance(values, str) else values[name]
        row["digest"] = np.void(_digest(case, row))
        try:
            with self.path.open("rb+") as file:
                file.seek(self._start + case * self.row.itemsize)
                file.write(row.tobytes())
        except OSError as error:
            raise ClearanceError(f"{self.path}: cannot be written ({error.strerror})") from None


def _digest(case: int, row: np.ndarray) -> bytes:
    return hashlib.blake2b(row.tobytes()[DIGEST:], digest_size=DIGEST, salt=case.to_bytes(16, "little")).digest()
