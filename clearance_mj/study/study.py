"""A study: laws, cases, repeatability and FRF bands of a dataset, each computed when it is first asked for."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import warnings
from collections.abc import Callable, Sequence

import numpy as np

from ..clearance.law import Law
from ..core.cache import ResultCache, code_outside
from ..core.errors import RecordError
from ..core.tasks import run_tasks
from ..engines import get_engine, simulate
from ..identify import METHODS as METHODS_BY_NAME
from ..identify import get_method, require
from ..identify.records.checks import IdentifiabilityWarning
from ..io.dataset import Dataset, Record
from ..model import Model
from ..signals.comparison import Comparison, compare, compare_modes
from ..signals.frf import FRF, estimate_frf
from ..signals.stepped_sines import SineSteps, sine_steps
from ..statistics.contact import contact_statistics
from ..statistics.frf_bands import Band, frf_band, paired_error
from . import stored
from .case import Case, require_comparable
from .identified import IdentifiedModel
from .level_modes import LevelModes
from .periodic import PeriodicVibrations, has_periodic_vibrations, periodic_vibrations
from .rows import Summaries, agreement_rows, level_summaries, scatter_rows

__all__ = ["ENGINES", "METHODS", "N_MODES", "RESOLUTION", "Study"]

ENGINES = ("links", "modal")
METHODS = ("nominal", "constant", "amplitude", "bench")
"""tried where none are named: rig file alone, constants, a law with the rig taken for exact, rig and law"""
RESOLUTION = 0.5
"""Hz, of the FRFs that are compared"""
N_MODES = 4
BAND_ENGINE = "modal"  # of FRF bands: the cheapest


class Study:
    """Laws on engines, compared with the validation records of a dataset.

    What is costly is computed when it is first asked for and kept in the cache.

    Parameters
    ----------
    dataset : Dataset
        Rig and records.
    methods : sequence of str, optional
        Ways to a law, see `identify.identify`; default: those of `METHODS` that the records allow.
    engines : sequence of str
        Engines to run.
    cache : ResultCache, optional
        Where results are kept for the next study; default: nowhere.
    workers : int, optional
        Threads; default: one for each core.
    progress : bool
        Show progress bars.

    Raises
    ------
    RecordError
        If the dataset has nothing to compare with, no bushings, a validation record without level, or not what a method
        that was named needs.
    ClearanceError
        For an unknown engine or method.
    """

    def __init__(
        self, dataset: Dataset, methods: Sequence[str] | None = None, engines: Sequence[str] = ENGINES,
        cache: ResultCache | None = None, workers: int | None = None, progress: bool = False,
    ):  # fmt: skip
        for engine in engines:
            get_engine(engine)
        for method in methods or ():
            get_method(method)
        require_comparable(dataset)
        for method in methods or ():
            require(method, dataset)
        self.dataset, self.engines = dataset, tuple(engines)
        self._named = None if methods is None else tuple(methods)
        self.left_out: dict[str, str] = {}
        """why methods that were not named are left out, by their names"""
        for method in METHODS if methods is None else ():
            self._try(method, functools.partial(get_method(method).require, dataset))
        self.cache, self._workers, self._progress = cache, workers, progress
        self._laws: dict[str, IdentifiedModel] = {}
        self._tests: dict[str, FRF] = {}
        self._cases: dict[tuple[str, str, str], Case] = {}

    def _try(self, method: str, find: Callable[[], object]) -> None:
        """Leave a method out, and warn of it, where it cannot be had from the records."""
        try:
            find()
        except RecordError as error:
            self.left_out[method] = str(error)
            words = f'method "{method}" is left out of the study: {error}'
            warnings.warn(words, IdentifiabilityWarning, stacklevel=3)

    @functools.cached_property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods in the study: those that were named, or those of `METHODS` that give a law."""
        if self._named is not None:
            return self._named
        for method in METHODS:
            if method not in self.left_out:
                self._try(method, functools.partial(self.law, method))
        return tuple(method for method in METHODS if method not in self.left_out)

    # What is computed.

    def law(self, name: str) -> IdentifiedModel:
        """Return a law by the name of its method, identified if it was not yet.

        Parameters
        ----------
        name : str
            The method.
        """
        if name not in self._laws:
            method = get_method(name)
            inputs = [name, self.dataset.rig.content(), *map(stored.record_digest, self.dataset.identify)]
            inputs += code_outside(method.find)

            def compute() -> IdentifiedModel:
                with warnings.catch_warnings():  # all are raised below, those of stored results too
                    warnings.simplefilter("ignore", IdentifiabilityWarning)
                    return IdentifiedModel.of(name, method.find(self.dataset, self._progress))

            found = self._laws[name] = stored.law(self.cache, name, inputs, self.dataset.rig, compute)
            for text in found.warnings:
                warnings.warn(text, IdentifiabilityWarning, stacklevel=2)
        return self._laws[name]

    @property
    def laws(self) -> tuple[IdentifiedModel, ...]:
        """The laws of all methods."""
        return tuple(self.law(name) for name in self.methods)

    def test(self, record: Record) -> FRF:
        """Return the measured FRFs of a record.

        Parameters
        ----------
        record : Record
            A validation record.
        """
        if record.name not in self._tests:
            self._tests[record.name] = estimate_frf(record.response(), resolution=RESOLUTION)
        return self._tests[record.name]

    @property
    def tests(self) -> dict[str, FRF]:
        """Measured FRFs by the record's name."""
        return {record.name: self.test(record) for record in self.dataset.validate}

    @functools.cached_property
    def level_modes(self) -> dict[float, LevelModes]:
        """By level: the modes that all its records show well, which are compared, and why others are not."""
        found = {}
        for level in self.levels:
            records = self.records(level)
            found[level] = LevelModes.of([r.name for r in records], [self.test(r) for r in records], N_MODES)
        return found

    def _compared(self, record: Record, model: FRF) -> Comparison:
        """The test's FRFs of a validation record, compared with others."""
        test, modes = self.test(record), self.level_modes[record.level or 0.0].of_record[record.name]
        return compare(test, model, compare_modes(test, model, N_MODES, modes))

    def simulated(
        self, laws: Sequence[str] | None = None, engines: Sequence[str] | None = None,
        records: Sequence[Record] | None = None,
    ) -> tuple[Case, ...]:  # fmt: skip
        """Return the cases of laws on engines under records, simulated if they were not yet.

        Parameters
        ----------
        laws, engines : sequence of str, optional
            Their names; default: all of the study.
        records : sequence of Record, optional
            Default: all validation records.
        """
        wanted = list(itertools.product(
            self.methods if laws is None else laws, self.engines if engines is None else engines,
            self.dataset.validate if records is None else records,
        ))  # fmt: skip
        keys = [(law, engine, record.name) for law, engine, record in wanted]
        missing = [i for i, key in enumerate(keys) if key not in self._cases]
        for law, _, record in (wanted[i] for i in missing):
            self.law(law), self.test(record)
        if missing:
            _ = self.level_modes  # before threads want it
        words = "simulating" if self._progress else ""
        for i, case in run_tasks(lambda i: self._case(*wanted[i]), missing, self._workers, progress=words):
            self._cases[keys[i]] = case
        return tuple(self._cases[key] for key in keys)

    @property
    def cases(self) -> tuple[Case, ...]:
        """Every law on every engine against every validation record."""
        return self.simulated()

    def _case(self, name: str, engine: str, record: Record) -> Case:
        model, test = self._laws[name].model, self._tests[record.name]

        def compute() -> stored.CaseResult:
            response = simulate(model, record.excitation(), None, engine)
            frf = estimate_frf(response, resolution=RESOLUTION)
            return stored.CaseResult(
                frf, self._compared(record, frf), contact_statistics(response), response.provenance
            )

        engine_used = get_engine(engine)
        settings = dataclasses.asdict(engine_used)
        inputs = [*_content(model), engine, settings, RESOLUTION, N_MODES, stored.record_digest(record)]
        inputs += [self.level_modes[record.level or 0.0].of_record[record.name].frequency.tolist()]
        inputs += code_outside(engine_used, *_models(model.law))
        found = stored.case(self.cache, f"{name}_{engine}_{record.name}", inputs, test, compute)
        return Case(name, engine, record, found.frf, found.comparison, found.statistics)

    @functools.cached_property
    def repeatability(self) -> dict[float, Comparison]:
        """By level: the second seed's record compared with the first's."""
        pairs = {level: self.records(level)[:2] for level in self.levels}
        return {level: self._compared(pair[0], self.test(pair[1])) for level, pair in pairs.items() if len(pair) == 2}

    @functools.cached_property
    def bands(self) -> dict[str, tuple[Band, np.ndarray]]:
        """By law with a covariance, at `main_record`: FRF band, and the record's random error about the fitted law."""
        found = {}
        for law in self.laws:
            if law.drawn:
                found[law.name] = self._band(law)
        return found

    def _band(self, law: IdentifiedModel) -> tuple[Band, np.ndarray]:
        record = self.main_record

        def compute() -> tuple[Band, np.ndarray]:
            excitation = record.excitation()
            band = frf_band(law.model, excitation, law.drawn, resolution=RESOLUTION, misfit=law.misfit)
            response = law.model.simulate(excitation, BAND_ENGINE)
            return band, paired_error(record.response(), response, RESOLUTION)

        inputs = [
            [_content(model) for model in (law.model, *law.drawn)],
            law.to_dict()["misfit"],
            RESOLUTION,
            stored.record_digest(record),
            *code_outside(*_models(law.law)),
        ]
        return stored.band(self.cache, f"band_{law.name}", inputs, compute)

    @functools.cached_property
    def periodic(self) -> PeriodicVibrations:
        """What the best law that has periodic vibrations does under sines of the study's levels, and beyond them."""
        names = sorted(self.methods, key=lambda name: name == self.best_law)
        name = next((name for name in reversed(names) if has_periodic_vibrations(self.law(name).law)), None)
        if name is None:
            why = "laws over time or amplitude have no periodic vibrations, and the study has no other"
            return PeriodicVibrations("", (), None, why)
        record, model = self.main_record, self.law(name).model
        band = record.band or (RESOLUTION, record.fs / 2)

        def compute() -> PeriodicVibrations:
            kind = record.excitation_kind
            return periodic_vibrations(name, model, self.levels, band, kind, self._workers, self._progress)

        inputs = [*_content(model), self.levels, band, record.excitation_kind, *code_outside(*_models(model.law))]
        return stored.periodic(self.cache, f"periodic_{name}", inputs, model.rig, model.law, compute)

    @functools.cached_property
    def sine_steps(self) -> dict[str, SineSteps]:
        """By record under a stepped sine: frequencies and amplitudes of its steps."""
        return {record.name: sine_steps(record.response()) for record in self.dataset.sines}

    # What it says.

    @property
    def levels(self) -> list[float]:
        """Levels of the validation records, rising."""
        return sorted({r.level for r in self.dataset.validate if r.level is not None})

    @property
    def main_level(self) -> float:
        """The middle level, which figures show first."""
        return self.levels[len(self.levels) // 2]

    @property
    def main_record(self) -> Record:
        """The first record of the main level."""
        return self.records(self.main_level)[0]

    @property
    def main_engine(self) -> str:
        """The engine that is shown where there is room for one: "links" if it was run, else the first."""
        return "links" if "links" in self.engines else self.engines[0]

    @property
    def base_law(self) -> str:
        """The law that others are compared with: the best constants, else the first."""
        return "constant" if "constant" in self.methods else self.methods[0]

    @property
    def best_law(self) -> str:
        """The law that is shown where there is room for one: the last that a rig was found with, else the last.

        Records to validate have no say in it.
        """
        with_rig = [name for name in self.methods if name in METHODS_BY_NAME and METHODS_BY_NAME[name].finds_rig]
        return (with_rig or self.methods)[-1]

    @property
    def unit(self) -> str:
        """Unit of the levels: m/s² for a shaken base, N for a force."""
        return "N" if self.dataset.validate[0].excitation_kind == "force" else "m/s²"

    @property
    def is_synthetic(self) -> bool:
        """Whether any record's provenance says that it was computed, not measured."""
        return self.dataset.is_synthetic

    def records(self, level: float) -> list[Record]:
        """Return the validation records of a level.

        Parameters
        ----------
        level : float
            m/s², or N.
        """
        return [r for r in self.dataset.validate if r.level == level]

    def case(self, law: str, engine: str, level: float) -> Case:
        """Return the first case of a law, an engine and a level.

        Parameters
        ----------
        law, engine : str
            Their names.
        level : float
            m/s², or N.
        """
        return self.simulated([law], [engine], self.records(level)[:1])[0]

    def of_law(self, law: str, engine: str) -> dict[float, list[Comparison]]:
        """Return comparisons of a law on an engine by level, one for each of the level's records.

        Parameters
        ----------
        law, engine : str
            One of `combinations`.
        """
        return {
            level: [c.comparison for c in self.simulated([law], [engine], self.records(level))] for level in self.levels
        }

    @property
    def combinations(self) -> list[tuple[str, str]]:
        """Laws and engines, in the order in which they were asked for."""
        return list(itertools.product(self.methods, self.engines))

    def rows(self) -> list[dict]:
        """Return one row per level, law and engine: means over the level's records, and the repeatability.

        Errors and criteria have the limits of their 95 % interval beside them (``rmse_db_low``, ``rmse_db_high``),
        see `intervals.over_seeds` and, for the repeatability, `intervals.on_power_law`.
        """
        return self._rows

    @functools.cached_property
    def _rows(self) -> list[dict]:
        summaries = {key: self._summaries(*key) for key in self.combinations}
        return agreement_rows(self.levels, {v: c.summary() for v, c in self.repeatability.items()}, summaries)

    def scatter_rows(self) -> list[dict]:
        """What the intervals rest on: a row per law, engine and measure, with Cochran's test of equal scatter."""
        return scatter_rows({key: self._summaries(*key) for key in self.combinations})

    def _summaries(self, law: str, engine: str) -> Summaries:
        return {level: level_summaries(found) for level, found in self.of_law(law, engine).items()}


def _content(model: Model) -> list[object]:
    """What results of a model depend on; plain data."""
    return [model.rig.content(), model.law.to_dict()]


def _models(law: Law) -> list[object]:
    """Contact and grease models of a law."""
    return [*getattr(law, "contact", ()), *(law.grease or ())]
