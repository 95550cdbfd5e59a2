"""The main job: what each kind of knowledge of the clearance is worth in predicting the FRFs of a rig.

Every law is simulated on every engine under the measured excitation of every validation record, and its FRFs are
compared with the record's. The same record level with another seed gives the repeat floor: how closely the rig
repeats itself.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import itertools
import json
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from tqdm import tqdm

from . import workshop
from ._version import __version__
from .clearance.law import Law, load_law
from .engines import get_engine, simulate
from .errors import ClearanceError, LawError, RecordError
from .files import replacing, to_json
from .identify.laws import get_method
from .io.dataset import Dataset, Record
from .io.results import dataset_to_frf, frf_to_dataset
from .signals.correlation import Comparison, compare, with_modes
from .signals.frf import FRF, estimate_frf
from .signals.response import Response
from .statistics import repeatability
from .statistics.frf_bands import Band, draw_laws, frf_band, paired_error
from .statistics.intervals import CONFIDENCE

__all__ = ["ENGINES", "METHODS", "Case", "Knowledge", "Study", "contact_statistics", "run_study"]

ENGINES = ("links", "modal")
METHODS = ("nominal", "constant", "ridge-as-printed", "ridge", "force-balance", "amplitude", "output-error")
RESOLUTION = 0.5
"""Hz, of the FRFs that are compared"""
N_MODES = 4
BAND_ENGINE, DRAWN = "modal", 12
"""of FRF bands: the cheapest engine; a width out of so many laws has a standard deviation of a fifth"""
FILES = {workshop.CACHE, "figures", "laws", "report.html", "results.nc", "summary.json", "tables"}
"""What a study leaves in its folder"""


@dataclass(frozen=True)
class Knowledge:
    """A law and what it was allowed to know."""

    name: str
    """the method's"""
    law: Law
    """what was found"""
    knows: str
    """in words"""
    parameters: tuple[dict, ...] = ()
    """fitted parameters: name, unit, value, relative_std"""


@dataclass(frozen=True)
class Case:
    """One law on one engine against one validation record."""

    law: str
    """name"""
    engine: str
    """name"""
    record: Record
    """validation record that drives it"""
    frf: FRF
    """the model's"""
    comparison: Comparison
    """of the test's FRFs with the model's"""
    statistics: dict
    """RMS and peak displacement (m), share of time in contact and peak contact force (N) of each bushing; step, s"""


@dataclass(frozen=True)
class Study:
    """Everything a report shows."""

    dataset: Dataset
    """rig and records"""
    laws: tuple[Knowledge, ...]
    """of every method"""
    tests: dict[str, FRF]
    """measured FRFs by the record's name"""
    cases: tuple[Case, ...]
    """every law on every engine against every validation record"""
    floor: dict[float, Comparison]
    """by level: the second seed's record against the first's"""
    bands: dict[str, tuple[Band, np.ndarray]] = dataclasses.field(default_factory=dict)
    """by law with a covariance, at `main_record`: FRF band, and the record's random error about the fitted law"""

    @property
    def levels(self) -> list[float]:
        """Levels of the validation records, rising."""
        return sorted({r.level for r in self.dataset.validate})

    @property
    def main_level(self) -> float:
        """The middle level, which figures show first."""
        return self.levels[len(self.levels) // 2]

    @property
    def main_record(self) -> Record:
        """The first record of the main level."""
        return next(r for r in self.dataset.validate if r.level == self.main_level)

    def case(self, law: str, engine: str, level: float) -> Case:
        """Return the first case of a law, an engine and a level.

        Parameters
        ----------
        law, engine : str
            Their names.
        level : float
            m/s².
        """
        return next(c for c in self.cases if (c.law, c.engine, c.record.level) == (law, engine, level))

    def of(self, law: str, engine: str) -> dict[float, list[Comparison]]:
        """Comparisons of a law on an engine by level, one for each of the level's records.

        Parameters
        ----------
        law, engine : str
            One of `combinations`.
        """
        found = [c for c in self.cases if (c.law, c.engine) == (law, engine)]
        return {level: [c.comparison for c in found if c.record.level == level] for level in self.levels}

    @property
    def combinations(self) -> list[tuple[str, str]]:
        """Laws and engines that were run, in the order in which they were asked for."""
        return list(dict.fromkeys((c.law, c.engine) for c in self.cases))

    def rows(self) -> list[dict]:
        """One row per level, law and engine: means over the level's records, and the repeat floor.

        Errors and criteria have the limits of their 95 % interval beside them (``rmse_db_low``, ``rmse_db_high``),
        see `intervals.over_seeds` and, for the floor, `intervals.on_power_law`.
        """
        return self._rows

    @functools.cached_property
    def _rows(self) -> list[dict]:
        tables = {("repeat", "rig"): repeatability.floor_rows({level: c.summary() for level, c in self.floor.items()})}
        for law, engine in self.combinations:
            tables[law, engine] = repeatability.mean_rows(self._summaries(law, engine))
        return [
            {"level": level, "law": law, "engine": engine} | table[level]
            for level in self.levels
            for (law, engine), table in tables.items()
            if level in table
        ]

    def scatter_rows(self) -> list[dict]:
        """What the intervals rest on: a row per law, engine and measure, with Cochran's test of equal scatter."""
        rows = []
        for law, engine in self.combinations:
            by_level = self._summaries(law, engine)
            for key in filter(repeatability.has_interval, by_level[self.levels[0]][0]):
                found = repeatability.pooled(by_level, key)
                row = {"law": law, "engine": engine, "measure": key, "scatter_of_logarithm": found.scatter}
                row |= {"degrees_of_freedom": found.freedom, "cochran": found.cochran}
                rows.append(row | {"cochran_limit": found.cochran_limit})
        return rows

    def _summaries(self, law, engine):
        return {level: [c.summary() for c in found] for level, found in self.of(law, engine).items()}


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
        ``<out>.partial``, from where an interrupted study goes on. A study that is there already is replaced; laws
        and cases of it are taken over where the inputs are the same.
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
    with workshop.open_workshop(out) as shop:
        laws = _laws(dataset, methods, shop.cache, progress)
        cases = _simulate_all(dataset, laws, engines, tests, shop.cache, workers, progress)
        study = Study(dataset, laws, tests, cases, _floor(dataset, tests))
        study = dataclasses.replace(study, bands=_bands(study, shop.cache, progress))
        _write_results(study, shop.finished)
        write_report(study, shop.finished, progress)
        shop.publish()
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


def _laws(dataset, methods, cache, progress) -> tuple[Knowledge, ...]:
    """The laws of the study; each is kept by the digest of what it was identified from."""
    evidence = workshop.digest(workshop.code(), dataset.rig.to_dict(), *map(_record_digest, dataset.identify))
    return tuple(_knowledge(dataset, name, cache, evidence, progress) for name in methods)


def _knowledge(dataset, name, cache, evidence, progress) -> Knowledge:
    method, stem = get_method(name), f"{name}_{evidence[:16]}"
    law, parameters = cache.find(f"{stem}.law.json"), cache.find(f"{stem}.parameters.json")
    if law and parameters:
        return Knowledge(name, load_law(law), method.knows, tuple(json.loads(parameters.read_text())))
    found = method.run(dataset, f"identifying: {name}" if progress else None)
    with cache.write(f"{stem}.law.json") as temporary:
        found.law.save(temporary)
    with cache.write(f"{stem}.parameters.json") as temporary:
        temporary.write_text(json.dumps(found.parameters))
    return Knowledge(name, found.law, method.knows, found.parameters)


def _simulate_all(dataset, laws, engines, tests, cache, workers, progress) -> tuple[Case, ...]:
    jobs = _jobs(dataset, laws, engines)
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        futures = [pool.submit(_case, *job, tests, cache) for job in jobs]
        try:
            for future in tqdm(
                as_completed(futures), total=len(jobs), desc="simulating", unit="run", disable=not progress
            ):
                future.result()
        finally:
            for future in futures:
                future.cancel()
    return tuple(future.result() for future in futures)


def _jobs(dataset, laws, engines) -> list[tuple]:
    """Every law, engine and record, with a file name that holds the digest of all that the result depends on."""
    digests = [_record_digest(record) for record in dataset.validate]
    jobs = []
    for knowledge, engine in itertools.product(laws, engines):
        settings = dataclasses.asdict(get_engine(engine))
        inputs = workshop.digest(workshop.code(), knowledge.law.to_dict(), engine, settings, RESOLUTION, N_MODES)
        for record, digest in zip(dataset.validate, digests):
            name = f"{knowledge.name}_{engine}_{record.name}_{workshop.digest(inputs, digest)[:16]}.nc"
            jobs.append((knowledge, engine, record, name))
    return jobs


def _case(knowledge, engine, record, name, tests, cache) -> Case:
    test, path = tests[record.name], cache.find(name)
    if path:
        with xr.open_dataset(path, engine="scipy") as data:
            frf, kept = dataset_to_frf(data.load()), json.loads(data.attrs["kept"])
        per_mode = {key: np.array(column) for key, column in kept["per_mode"].items()}
        return Case(knowledge.name, engine, record, frf, with_modes(test, frf, per_mode), kept["statistics"])
    response = simulate(record.rig, record.excitation(), knowledge.law, engine)
    frf, statistics = estimate_frf(response, resolution=RESOLUTION), contact_statistics(response)
    comparison = compare(test, frf, N_MODES)
    per_mode = {key: column.tolist() for key, column in comparison.per_mode.items()}
    attributes = {"kept": json.dumps({"statistics": statistics, "per_mode": per_mode})}
    attributes["provenance"] = json.dumps(response.provenance)
    with cache.write(name) as temporary:
        frf_to_dataset(frf).assign_attrs(attributes).to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
    return Case(knowledge.name, engine, record, frf, comparison, statistics)


def _bands(study, cache, progress) -> dict[str, tuple[Band, np.ndarray]]:
    found = {}
    for knowledge in study.laws:
        try:
            laws = draw_laws(study.dataset.rig, knowledge.name, knowledge.parameters, DRAWN)
        except LawError:  # it has no covariance, or the records do not tell one of its parameters
            continue
        words = f"band: {knowledge.name}" if progress else None
        found[knowledge.name] = _band(study.main_record, knowledge, laws, cache, words)
    return found


def _band(record, knowledge, laws, cache, words) -> tuple[Band, np.ndarray]:
    inputs = [law.to_dict() for law in (knowledge.law, *laws)]
    digest = workshop.digest(workshop.code(), inputs, BAND_ENGINE, RESOLUTION, _record_digest(record))
    name = f"band_{knowledge.name}_{digest[:16]}.nc"
    if path := cache.find(name):
        with xr.open_dataset(path, engine="scipy") as data:
            return Band(dataset_to_frf(data.load()), data["drawn"].values), data["error"].values
    under = record.rig, record.excitation(), knowledge.law
    band = frf_band(*under, laws, BAND_ENGINE, RESOLUTION, words)
    error = paired_error(record.response(), simulate(*under, BAND_ENGINE), RESOLUTION)
    lines = ("response", "frequency")
    kept = frf_to_dataset(band.fitted).assign(drawn=(("draw", *lines), band.drawn), error=(lines, error))
    with cache.write(name) as temporary:
        kept.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
    return band, error


def contact_statistics(response: Response) -> dict:
    """Motion and contact at the bushings of a simulation, and its time step.

    Parameters
    ----------
    response : Response
        A simulation's.

    Returns
    -------
    dict
        As `Case.statistics`.
    """
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
    (folder / "laws").mkdir()
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
        "confidence": CONFIDENCE,
        "seed_scatter": study.scatter_rows(),
        "statistics": [
            {"law": c.law, "engine": c.engine, "record": c.record.name, "level": c.record.level, **c.statistics}
            for c in study.cases
        ],
    }


def _record_digest(record: Record) -> str:
    """Digest of everything that a law or a case takes from a record."""
    response = record.response()
    arrays = [a for a in (response.excitation, response.acceleration, response.displacement) if a is not None]
    samples = [hashlib.sha256(np.ascontiguousarray(a).tobytes()).hexdigest() for a in arrays]
    facts = (record.name, record.fs, record.excitation_kind, record.band, record.level, record.rig.to_dict())
    return workshop.digest(*facts, *samples)
