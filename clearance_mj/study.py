"""The main job: what each kind of knowledge of the clearance is worth in predicting the FRFs of a rig.

Every law is simulated on every engine under the measured excitation of every validation record, and its FRFs are
compared with the record's. The same record level with another seed gives the repeat floor: how closely the rig
repeats itself.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import shutil
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from tqdm import tqdm

from ._version import __version__
from .clearance.law import Law, load_law
from .correlation import Comparison, compare
from .engines import get_engine, simulate
from .errors import ClearanceError, RecordError
from .frf import FRF, estimate_frf
from .identify.laws import get_method
from .io.dataset import Dataset, Record
from .io.files import replacing, to_json
from .io.results import dataset_to_frf, frf_to_dataset
from .response import Response

__all__ = ["ENGINES", "METHODS", "Case", "Knowledge", "Study", "run_study"]

ENGINES = ("links", "modal", "modal-mj")
METHODS = ("nominal", "constant", "ridge", "force-balance", "amplitude", "output-error")
RESOLUTION = 0.5
"""Hz, of the FRFs that are compared"""
N_MODES = 4
FILES = {"figures", "laws", "report.html", "results.nc", "summary.json", "tables"}
"""What a study leaves in its folder"""


@dataclass(frozen=True)
class Knowledge:
    """A law and what it was allowed to know."""

    name: str
    law: Law
    knows: str
    parameters: tuple[dict, ...] = ()
    """fitted parameters: name, unit, value, relative_std"""


@dataclass(frozen=True)
class Case:
    """One law on one engine against one validation record."""

    law: str
    engine: str
    record: Record
    frf: FRF
    comparison: Comparison
    statistics: dict
    """RMS and peak displacement (m), share of time in contact and peak contact force (N) of each bushing; step, s"""


@dataclass(frozen=True)
class Study:
    """Everything a report shows."""

    dataset: Dataset
    laws: tuple[Knowledge, ...]
    tests: dict[str, FRF]
    """measured FRFs by the record's name"""
    cases: tuple[Case, ...]
    floor: dict[float, Comparison]
    """by level: the second seed's record against the first's"""

    @property
    def levels(self) -> list[float]:
        """Levels of the validation records, rising."""
        return sorted({r.level for r in self.dataset.validate})

    @property
    def main_level(self) -> float:
        """The middle level, which figures show first."""
        return self.levels[len(self.levels) // 2]

    def case(self, law: str, engine: str, level: float) -> Case:
        """First case of a law, an engine and a level."""
        return next(c for c in self.cases if (c.law, c.engine, c.record.level) == (law, engine, level))

    def rows(self) -> list[dict]:
        """One row per level, law and engine: means over the level's records, and the repeat floor."""
        rows = []
        for level in self.levels:
            if level in self.floor:
                rows.append({"level": level, "law": "repeat", "engine": "rig"} | self.floor[level].summary())
            for law in (k.name for k in self.laws):
                for engine in dict.fromkeys(c.engine for c in self.cases):
                    found = [c for c in self.cases if (c.law, c.engine, c.record.level) == (law, engine, level)]
                    summaries = [c.comparison.summary() for c in found]
                    means = {key: _mean([s[key] for s in summaries]) for key in summaries[0]}
                    rows.append({"level": level, "law": law, "engine": engine} | means)
        return rows


def _mean(values) -> float:
    """Mean of the values that are numbers; a mode may be missing in one record and not in another."""
    finite = [v for v in values if np.isfinite(v)]
    return float(np.mean(finite)) if finite else float("nan")


def run_study(
    path,
    out,
    engines: Sequence[str] = ENGINES,
    methods: Sequence[str] = METHODS,
    workers: int | None = None,
    progress: bool = True,
) -> Study:
    """Run the study of a dataset and write its report.

    Parameters
    ----------
    path : str or Path
        Dataset folder.
    out : str or Path
        Folder for the results. It appears once everything in it is whole; until then the work is in
        ``<out>.partial``, from where an interrupted study goes on.
    engines : sequence of str
        Engines to run.
    methods : sequence of str
        Ways to a law, see `identify.law`.
    workers : int, optional
        Threads; default: one for each processor.
    progress : bool
        Show progress bars.

    Returns
    -------
    Study

    Raises
    ------
    RecordError, RigError
        If the dataset is not whole; nothing is written then.
    ClearanceError
        If ``out`` holds something else than a study, or another study is writing there.
    """
    from .report import write_report  # the report imports this module's types

    dataset, out = Dataset.load(path), Path(out)
    for engine in engines:
        get_engine(engine)
    for method in methods:
        get_method(method)
    _check(dataset)
    _check_out(out)
    tests = {r.name: estimate_frf(r.response(), resolution=RESOLUTION) for r in dataset.validate}
    with _workshop(out) as workshop:
        laws = _laws(dataset, methods, workshop, progress)
        cases = _simulate_all(dataset, laws, engines, tests, workshop, workers, progress)
        study = Study(dataset, laws, tests, cases, _floor(dataset, tests))
        finished = workshop / "finished"
        shutil.rmtree(finished, ignore_errors=True)
        _write_results(study, finished)
        write_report(study, finished, progress)
        _publish(finished, out)
    return study


def _check(dataset):
    if not dataset.validate:
        raise RecordError(f'{dataset.path}: no record has role "validate", so there is nothing to compare with')
    if not dataset.rig.bushings:
        raise RecordError(f"{dataset.path}: the rig has no bushings, so there is no clearance to study")
    for record in dataset.validate:
        if record.level is None:
            raise RecordError(f'{dataset.path}: record "{record.name}" has no level; validation records need one')


def _check_out(out):
    if out.exists() and not out.is_dir():
        raise ClearanceError(f"--out {out} is a file; give a folder")
    others = sorted({p.name for p in out.iterdir()} - FILES) if out.is_dir() else []
    if others:
        raise ClearanceError(f"--out {out} holds {others[0]!r}, which is not of a study; give another folder")


@contextmanager
def _workshop(out: Path):
    """The folder ``<out>.partial``, held by one process; removed after success, kept for the next try otherwise."""
    workshop = out.with_name(out.name + ".partial")
    (workshop / "cases").mkdir(parents=True, exist_ok=True)
    lock = workshop / "lock"
    holder = int(lock.read_text() or 0) if lock.exists() else 0
    if holder and _alive(holder):
        raise ClearanceError(f"{workshop}: another study (process {holder}) is writing there")
    lock.write_text(str(os.getpid()))
    try:
        yield workshop
    except BaseException:
        lock.unlink(missing_ok=True)
        raise
    shutil.rmtree(workshop)


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return process != os.getpid()


def _publish(finished: Path, out: Path):
    """Put the finished folder in the place of ``out``; an old study stays whole until then."""
    old = out.with_name(out.name + ".old")
    shutil.rmtree(old, ignore_errors=True)
    if out.exists():
        out.rename(old)
    finished.rename(out)
    shutil.rmtree(old, ignore_errors=True)


def _laws(dataset, methods, workshop, progress) -> tuple[Knowledge, ...]:
    """The laws of the study; each is kept with the digest of what it was identified from."""
    digest = _digest(__version__, dataset.rig.to_dict(), *(_record_digest(r) for r in dataset.identify))
    return tuple(_knowledge(dataset, name, workshop / "laws", digest, progress) for name in methods)


def _knowledge(dataset, name, folder, digest, progress) -> Knowledge:
    method, kept = get_method(name), folder / f"{name}.parameters.json"
    if kept.exists() and (data := json.loads(kept.read_text()))["digest"] == digest:
        return Knowledge(name, load_law(folder / f"{name}.json"), method.knows, tuple(data["parameters"]))
    found = method.run(dataset, f"identifying: {name}" if progress else None)
    found.law.save(folder / f"{name}.json")
    with replacing(kept) as temporary:
        temporary.write_text(to_json({"digest": digest, "parameters": found.parameters}))
    return Knowledge(name, found.law, method.knows, found.parameters)


def _simulate_all(dataset, laws, engines, tests, workshop, workers, progress) -> tuple[Case, ...]:
    jobs = [(k, engine, record) for k in laws for engine in engines for record in dataset.validate]
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        futures = {pool.submit(_case, *job, tests[job[2].name], workshop): job for job in jobs}
        try:
            for future in tqdm(
                as_completed(futures), total=len(jobs), desc="simulating", unit="run", disable=not progress
            ):
                future.result()
        finally:
            for future in futures:
                future.cancel()
    return tuple(future.result() for future in futures)


def _case(knowledge, engine, record, test, workshop) -> Case:
    settings = dataclasses.asdict(get_engine(engine))
    inputs = {"law": knowledge.law.to_dict(), "engine": engine, "settings": settings, "resolution": RESOLUTION}
    digest = _digest(inputs, record.rig.to_dict(), _record_digest(record), __version__)
    path = workshop / "cases" / f"{knowledge.name}_{engine}_{record.name}.nc"
    kept = _read_case(path, digest)
    if kept is None:
        response = simulate(record.rig, record.excitation(), knowledge.law, engine)
        frf, statistics = estimate_frf(response, resolution=RESOLUTION), _statistics(response)
        attributes = {"digest": digest, "statistics": json.dumps(statistics)}
        attributes["provenance"] = json.dumps(response.provenance)
        with replacing(path) as temporary:
            frf_to_dataset(frf).assign_attrs(attributes).to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
    else:
        frf, statistics = kept
    return Case(knowledge.name, engine, record, frf, compare(test, frf, N_MODES), statistics)


def _read_case(path, digest):
    if not path.exists():
        return None
    with xr.open_dataset(path, engine="scipy") as data:
        if data.attrs.get("digest") != digest:
            return None
        return dataset_to_frf(data.load()), json.loads(data.attrs["statistics"])


def _statistics(response: Response) -> dict:
    contact = np.abs(response.contact_force)
    # The anti-alias filter rings a little around an impact: count what is above its ripple.
    ripple = np.maximum(0.01 * contact.max(axis=0), 1e-3)
    return {
        "displacement_rms": response.displacement.std(axis=0).tolist(),
        "displacement_peak": np.abs(response.displacement).max(axis=0).tolist(),
        "contact_share": np.mean(contact > ripple, axis=0).tolist(),
        "contact_peak": contact.max(axis=0).tolist(),
        "step": response.provenance["step"],
    }


def _floor(dataset, tests) -> dict[float, Comparison]:
    floor = {}
    for level in sorted({r.level for r in dataset.validate}):
        names = [r.name for r in dataset.validate if r.level == level]
        if len(names) > 1:
            floor[level] = compare(tests[names[0]], tests[names[1]], N_MODES)
    return floor


def _write_results(study: Study, folder: Path):
    """FRFs of test and models in one labelled file, the laws, and the summary."""
    (folder / "laws").mkdir(parents=True)
    for knowledge in study.laws:
        knowledge.law.save(folder / "laws" / f"{knowledge.name}.json")
    models = [
        frf_to_dataset(c.frf).expand_dims(law=[c.law], engine=[c.engine], record=[c.record.name]) for c in study.cases
    ]
    tests = [frf_to_dataset(frf).expand_dims(record=[name]) for name, frf in study.tests.items()]
    combined = xr.combine_by_coords(models, combine_attrs="override").rename(value="model", coherence="model_coherence")
    measured = xr.concat(tests, "record", combine_attrs="override").rename(value="test", coherence="test_coherence")
    rig = json.dumps(study.dataset.rig.to_dict())
    combined = xr.merge((combined, measured), combine_attrs="override").assign_attrs(rig=rig, version=__version__)
    combined.to_netcdf(folder / "results.nc", engine="scipy", format="NETCDF3_64BIT")
    with replacing(folder / "summary.json") as temporary:
        temporary.write_text(to_json(_summary(study)))


def _summary(study: Study) -> dict:
    return {
        "version": __version__,
        "dataset": str(study.dataset.path),
        "rig": study.dataset.rig.name,
        "synthetic": any("synthetic" in str(r.provenance).lower() for r in study.dataset.records),
        "laws": [
            {"name": k.name, "knows": k.knows, "law": k.law.to_dict(), "parameters": list(k.parameters)}
            for k in study.laws
        ],
        "identified_from": [r.name for r in study.dataset.identify],
        "validated_on": [r.name for r in study.dataset.validate],
        "results": study.rows(),
        "statistics": [
            {"law": c.law, "engine": c.engine, "record": c.record.name, "level": c.record.level, **c.statistics}
            for c in study.cases
        ],
    }


def _record_digest(record: Record) -> str:
    excitation, response = record.excitation(), record.response()
    arrays = [a for a in (excitation.value, response.acceleration, response.displacement) if a is not None]
    return _digest(record.name, *(hashlib.sha256(np.ascontiguousarray(a).tobytes()).hexdigest() for a in arrays))


def _digest(*parts) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()
