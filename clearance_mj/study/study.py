"""A study: laws, cases, repeatability and FRF bands of a dataset, each computed when it is first asked for."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Sequence

import numpy as np

from ..core.cache import ResultCache, code_outside
from ..core.overview import few
from ..core.tasks import run_tasks
from ..engines import default_engine, get_engine, simulate
from ..identify import METHODS as METHODS_BY_NAME
from ..identify.records.in_test import in_test
from ..io.dataset import Dataset, Record
from ..signals.compared_modes import common_modes
from ..signals.comparison import Comparison, compare, compare_modes
from ..signals.frf import FRF, estimate_frf
from ..signals.stepped_sines import SineSteps, sine_steps
from ..statistics.contact import contact_statistics
from ..statistics.frf_bands import Band
from . import stored
from .bands import law_band
from .case import LevelModes, StudyCase, require_comparable, single_input_dataset
from .conditions import Condition, conditions_of
from .identified import IdentifiedModel
from .laws import StudiedLaws
from .periodic import PeriodicVibrations, has_periodic_vibrations, periodic_vibrations
from .rows import Summaries, agreement_rows, level_summaries, scatter_rows
from .whirl_in_test import PlacedWhirl

__all__ = ["ENGINES", "N_MODES", "RESOLUTION", "Study"]

ENGINES = ("links", "modal")
"""of rigs that are chains of links; others are simulated by the last of them"""
RESOLUTION = 0.5
"""Hz, of the FRFs that are compared"""
N_MODES = 4


class Study:
    """Laws on engines, compared with the validation records of a dataset.

    What is costly is computed when it is first asked for and kept in the cache. Of a rig in space the records of each
    direction and spin are a separate study, one of `parts`, with the same laws and results.

    Parameters
    ----------
    dataset : Dataset
        Rig and records.
    methods : sequence of str, optional
        Ways to a law, see `identify.identify`; default: those of `laws.METHODS` that the records allow.
    engines : sequence of str, optional
        Engines to run; default: `ENGINES`, or "modal" alone of a rig in space or a model that is no chain of links.
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
        self, dataset: Dataset, methods: Sequence[str] | None = None, engines: Sequence[str] | None = None,
        cache: ResultCache | None = None, workers: int | None = None, progress: bool = False,
    ):  # fmt: skip
        require_comparable(dataset)
        self.dataset = single_input_dataset(dataset)
        self._engines = tuple(get_engine(engine).name for engine in engines or ())
        self.studied_laws = StudiedLaws(dataset, methods, cache, progress)
        """the laws"""
        self.condition: Condition | None = None
        """of a part of a study in space: direction and spin of its records"""
        self._workers, self._progress = workers, progress
        self._tests: dict[str, FRF] = {}
        self._cases: dict[tuple[str, str, str], StudyCase] = {}
        self.motions: dict[tuple[str, str, str], PlacedWhirl] = {}
        """of the shaft in records of its turning alone, by law, engine and record, as `TurningComparison` finds them"""

    @functools.cached_property
    def parts(self) -> tuple[Study, ...]:
        """Studies of the records of each direction and spin of a rig in space; of another, the study itself."""
        if not self.dataset.rig.moves_across or self.condition is not None:
            return (self,)
        return tuple(self._part(*condition) for condition in conditions_of(self.driven).items())

    def _part(self, condition: Condition, records: tuple[Record, ...]) -> Study:
        """Return the study of some of the validation records, with the same results."""
        others = tuple(r for r in self.dataset.records if r.role != "validate")
        dataset = dataclasses.replace(self.dataset, records=(*others, *records))
        part = Study(dataset, (), self._engines, workers=self._workers, progress=self._progress)
        part.studied_laws, part.condition = self.studied_laws, condition
        part._tests, part._cases = self._tests, self._cases
        return part

    @property
    def main_part(self) -> Study:
        """The part that is shown first: the one of most records."""
        return max(self.parts, key=lambda part: len(part.dataset.validate), default=self)

    @property
    def columns(self) -> dict[str, str | float]:
        """Columns that identify a part's rows; none for a rig in a plane."""
        return self.condition.columns if self.condition else {}

    @property
    def suffix(self) -> str:
        """Suffix of the names of a part's figures; "" for a rig in a plane."""
        return self.condition.suffix if self.condition else ""

    @property
    def driven(self) -> tuple[Record, ...]:
        """Validation records with an excitation, of which there are FRFs."""
        return tuple(r for r in self.dataset.validate if r.excitation_kind != "spin")

    @property
    def turned(self) -> tuple[Record, ...]:
        """Validation records of a shaft's turning alone, of which there are orbits."""
        return tuple(r for r in self.dataset.validate if r.excitation_kind == "spin")

    @property
    def cache(self) -> ResultCache | None:
        """Folder in which results are kept for the next study; None: nowhere."""
        return self.studied_laws.cache

    @cache.setter
    def cache(self, cache: ResultCache | None) -> None:
        self.studied_laws.cache = cache

    @functools.cached_property
    def engines(self) -> tuple[str, ...]:
        """Names of the engines: those asked for, or those that can simulate all identified models."""
        linked = self._engines or all(default_engine(law.model.rig) == "links" for law in self.laws)
        return self._engines or (ENGINES if linked else ENGINES[1:])

    @functools.cached_property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods in the study."""
        return self.studied_laws.methods

    @property
    def left_out(self) -> dict[str, str]:
        """Why methods that were not named are left out, by their names."""
        return self.studied_laws.left_out

    def law(self, name: str) -> IdentifiedModel:
        """Return a law by the name of its method, identified if it was not yet.

        Parameters
        ----------
        name : str
            The method.
        """
        return self.studied_laws.law(name)

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
        return {record.name: self.test(record) for record in self.driven}

    @functools.cached_property
    def level_modes(self) -> dict[float, LevelModes]:
        """Modes that all records of a level show well, which are compared, and why others are not, by level."""
        modes_by_level = {}
        for level in self.levels:
            names = [record.name for record in self.records(level)]
            modes, left_out = common_modes([self.test(record) for record in self.records(level)], names, N_MODES)
            modes_by_level[level] = LevelModes(dict(zip(names, modes)), tuple(left_out))
        return modes_by_level

    def _compare(self, record: Record, model: FRF) -> Comparison:
        """Return the comparison of a validation record's FRFs with a model's."""
        test, modes = self.test(record), self.level_modes[record.level or 0.0].of_record[record.name]
        return compare(test, model, compare_modes(test, model, N_MODES, modes))

    def simulated(
        self, laws: Sequence[str] | None = None, engines: Sequence[str] | None = None,
        records: Sequence[Record] | None = None,
    ) -> tuple[StudyCase, ...]:  # fmt: skip
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
            self.driven if records is None else records,
        ))  # fmt: skip
        keys = [(law, engine, record.name) for law, engine, record in wanted]
        missing = [i for i, key in enumerate(keys) if key not in self._cases]
        for law, _, record in (wanted[i] for i in missing):
            self.law(law), self.test(record)
        if missing:
            _ = self.level_modes  # before threads want it
        words = "simulating" if self._progress else ""
        for i, case in run_tasks(lambda i: self._simulate_case(*wanted[i]), missing, self._workers, progress=words):
            self._cases[keys[i]] = case
        return tuple(self._cases[key] for key in keys)

    @property
    def cases(self) -> tuple[StudyCase, ...]:
        """Every law on every engine against every validation record with an excitation."""
        return tuple(case for part in self.parts for case in part.simulated())

    def _simulate_case(self, name: str, engine: str, record: Record) -> StudyCase:
        test = self._tests[record.name]
        model = in_test(self.law(name).model, record.tested_rig, record.turning())

        def compute() -> stored.CaseResult:
            response = simulate(model, record.excitation(), None, engine)
            frf = estimate_frf(response, resolution=RESOLUTION)
            return frf, self._compare(record, frf), contact_statistics(response)

        used = get_engine(engine)
        modes = self.level_modes[record.level or 0.0].of_record[record.name]
        inputs = [*model.content(), engine, dataclasses.asdict(used), RESOLUTION, N_MODES]
        inputs += [stored.record_digest(record), modes.frequency.tolist(), *code_outside(used)]
        result = stored.case(self.cache, f"{name}_{engine}_{record.name}", inputs, test, compute)
        return StudyCase(name, engine, record, *result)

    @functools.cached_property
    def repeatability(self) -> dict[float, Comparison]:
        """Comparison of the second seed's record with the first's, by level."""
        pairs = {level: self.records(level)[:2] for level in self.levels}
        return {level: self._compare(pair[0], self.test(pair[1])) for level, pair in pairs.items() if len(pair) == 2}

    @functools.cached_property
    def bands(self) -> dict[str, tuple[Band, np.ndarray]]:
        """FRF band, and the record's random error about the fitted law, at `main_record`, by law with a covariance."""
        shown = [law for law in self.laws if law.drawn]
        return {law.name: law_band(law, self.main_record, RESOLUTION, self.cache) for law in shown}

    @functools.cached_property
    def periodic(self) -> PeriodicVibrations:
        """Periodic vibrations under sines of the study's levels and beyond, of the best law that has any."""
        nothing = functools.partial(PeriodicVibrations, "", (), None)
        if self.dataset.rig.moves_across:
            return nothing("clearance-mj response and clearance-mj orbits follow those of a rig in space")
        names = sorted(self.methods, key=lambda name: name == self.best_law)
        name = next((name for name in reversed(names) if has_periodic_vibrations(self.law(name).law)), None)
        if name is None:
            return nothing("laws over time or amplitude have no periodic vibrations, and the study has no other")
        record, model = self.main_record, self.law(name).model
        if unseen := [f"bushings[{j}].gap" for j in self.law(name).unseen_gaps]:
            return nothing(f"no record to identify shows {few(unseen)}, on which they rest")
        kind, band = record.excitation_kind, record.band or (RESOLUTION, record.fs / 2)
        settings = self.levels, band, kind, self._workers, self._progress
        compute = functools.partial(periodic_vibrations, name, model, *settings)
        inputs = [*model.content(), self.levels, band, kind]
        return stored.periodic(self.cache, f"periodic_{name}", inputs, model.rig, model.law, compute)

    @functools.cached_property
    def sine_steps(self) -> dict[str, SineSteps]:
        """Frequencies and amplitudes of the steps, by record under a stepped sine."""
        return {record.name: sine_steps(record.response()) for record in self.dataset.sines}

    @property
    def levels(self) -> list[float]:
        """Levels of the validation records, rising."""
        return sorted({r.level for r in self.driven if r.level is not None})

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
        """The law that is shown where there is room for one: the last with an identified rig, else the last.

        Records to validate have no say in it.
        """
        with_rig = [name for name in self.methods if name in METHODS_BY_NAME and METHODS_BY_NAME[name].finds_rig]
        return (with_rig or self.methods)[-1]

    @property
    def unit(self) -> str:
        """Unit of the levels: m/s² for a shaken base, N for a force."""
        return "N" if any(r.excitation_kind == "force" for r in self.driven[:1]) else "m/s²"

    @property
    def is_synthetic(self) -> bool:
        """True if any record's provenance says that it was computed, not measured."""
        return self.dataset.is_synthetic

    def records(self, level: float) -> list[Record]:
        """Return the validation records of a level.

        Parameters
        ----------
        level : float
            m/s², or N.
        """
        return [r for r in self.driven if r.level == level]

    def case(self, law: str, engine: str, level: float) -> StudyCase:
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
        return {v: [c.comparison for c in self.simulated([law], [engine], self.records(v))] for v in self.levels}

    @property
    def combinations(self) -> list[tuple[str, str]]:
        """Laws and engines, in the order in which they were asked for."""
        return [*itertools.product(self.methods, self.engines)]

    def rows(self) -> list[dict]:
        """Return one row per level, law and engine: means over the level's records, and the repeatability.

        Errors and criteria come with the limits of their 95 % interval (``rmse_db_low``, ``rmse_db_high``),
        see `intervals.over_seeds` and, for the repeatability, `intervals.on_power_law`.
        """
        return [part.columns | row for part in self.parts for row in part._rows]

    @functools.cached_property
    def _rows(self) -> list[dict]:
        summaries = {key: self._summaries(*key) for key in self.combinations}
        return agreement_rows(self.levels, {v: c.summary() for v, c in self.repeatability.items()}, summaries)

    def scatter_rows(self) -> list[dict]:
        """Scatter behind the intervals: a row per law, engine and measure, with Cochran's test of equal scatter."""
        by_part = [(part, {key: part._summaries(*key) for key in self.combinations}) for part in self.parts]
        return [part.columns | row for part, summaries in by_part for row in scatter_rows(summaries)]

    def _summaries(self, law: str, engine: str) -> Summaries:
        return {level: level_summaries(comparisons) for level, comparisons in self.of_law(law, engine).items()}
