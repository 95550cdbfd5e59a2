"""What items share: dataset, laws, tests and simulations, each made once, when it is first asked for."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

from clearance_mj.engines import simulate
from clearance_mj.errors import RecordError
from clearance_mj.identify import get_method
from clearance_mj.io.dataset import Dataset, Record
from clearance_mj.signals.correlation import Comparison, compare
from clearance_mj.signals.frf import FRF, estimate_frf
from clearance_mj.study import N_MODES, RESOLUTION, Case, IdentifiedLaw
from clearance_mj.vehicle import experiment as vehicle

from .published import Printed

__all__ = ["DATASET", "Context"]

DATASET = Path("data/table1_rig")
METHODS = ("nominal", "constant", "ridge-as-printed", "ridge", "output-error")
ENGINES = ("links", "modal")
SENSORS = set(range(1, 9))
QUICK_METHODS = ("nominal", "ridge-as-printed", "amplitude")
QUICK_ENGINES = ("modal",)


class Context:
    """What items share.

    Parameters
    ----------
    dataset : str or Path
        Folder of the test records.
    quick : bool
        Take fewer noises, the laws that need no search, and the fastest engine.
    stage : callable, optional
        Is told in words what is being done.
    """

    def __init__(self, dataset=DATASET, quick: bool = False, stage: Callable[[str], None] = lambda words: None):
        self.path, self.quick, self.stage = Path(dataset), quick, stage
        self.warnings: dict[str, tuple[str, ...]] = {}
        self._cases: dict[float, list[Case]] = {}
        self._drives: dict[vehicle.Case, vehicle.Outcome] = {}

    @property
    def methods(self) -> tuple[str, ...]:
        """Ways to a law, from the least knowledge to the most."""
        return QUICK_METHODS if self.quick else METHODS

    @property
    def engines(self) -> tuple[str, ...]:
        """The engines, the main one first."""
        return QUICK_ENGINES if self.quick else ENGINES

    @cached_property
    def dataset(self) -> Dataset:
        """The test records.

        Raises
        ------
        RecordError
            If the folder is no dataset, or not one of a rig and records as the article has them.
        """
        dataset = Dataset.load(self.path)
        nodes = {s.node for s in dataset.rig.sensors}
        if len(dataset.rig.bushings) != 2 or nodes != SENSORS or dataset.rig.shaker.kind != "base":
            raise RecordError(f"{self.path}: the article's rig has two bushings, sensors 1 to 8 and a shaken base")
        levels = [r.level for r in dataset.validate]
        if not levels or None in levels or min(map(levels.count, levels)) < 2:
            raise RecordError(
                f'{self.path}: needs two records with role "validate" at each level, the second as repeat'
            )
        return dataset

    @cached_property
    def article(self):
        """The article's Tables 1 and 2."""
        modes, sensors = (Printed.load(number).numbers for number in (1, 2))
        modes.index = modes.index.astype(int)
        return SimpleNamespace(modes=modes.to_dict("index"), sensors=sensors.to_dict("index"))

    @cached_property
    def laws(self) -> tuple[IdentifiedLaw, ...]:
        """The clearance's laws, identified from the records with role "identify"."""
        return tuple(self._law(name) for name in self.methods)

    def _law(self, name) -> IdentifiedLaw:
        self.stage(f"identifying: {name}")
        method = get_method(name)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = method.run(self.dataset, None)
        if caught:
            self.warnings[name] = tuple(dict.fromkeys(str(w.message) for w in caught))
        return IdentifiedLaw(name, found.law, method.prior_information, found.parameters)

    @cached_property
    def tests(self) -> dict[str, FRF]:
        """Measured FRFs of the validation records, by name."""
        return {r.name: estimate_frf(r.response(), resolution=RESOLUTION) for r in self.dataset.validate}

    @property
    def levels(self) -> list[float]:
        """Levels of the validation records, rising, m/s²."""
        return sorted({r.level for r in self.dataset.validate})

    @property
    def main_level(self) -> float:
        """The middle level, m/s²."""
        return self.levels[len(self.levels) // 2]

    def records(self, level: float) -> list[Record]:
        """Return the validation records of a level; the models are driven as the first was.

        Parameters
        ----------
        level : float
            m/s².

        Raises
        ------
        RecordError
            If there is none.
        """
        found = [r for r in self.dataset.validate if r.level == level]
        if not found:
            known = ", ".join(f"{known:g}" for known in self.levels)
            raise RecordError(f"{self.path}: no validation record has level {level:g}; there are {known}")
        return found

    def repeat(self, level: float) -> Comparison:
        """Return how the second record of a level compares with the first: what the rig repeats itself within.

        Parameters
        ----------
        level : float
            m/s².
        """
        return compare(*(self.tests[r.name] for r in self.records(level)[:2]), N_MODES)

    def cases(self, level: float) -> list[Case]:
        """Return every law on every engine under the excitation of a level's first record.

        Parameters
        ----------
        level : float
            m/s².
        """
        if level not in self._cases:
            record, laws = self.records(level)[0], self.laws
            self.stage(f"simulating: {level:g} m/s²")
            jobs = [(law, engine, record) for law in laws for engine in self.engines]
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                self._cases[level] = list(pool.map(lambda job: self._case(*job), jobs))
        return self._cases[level]

    def _case(self, knowledge, engine, record) -> Case:
        response = simulate(record.rig, record.excitation(), knowledge.law, engine)
        frf = estimate_frf(response, resolution=RESOLUTION)
        return Case(knowledge.name, engine, record, frf, compare(self.tests[record.name], frf, N_MODES), {})

    def drives(self, cases: Sequence[vehicle.Case]) -> list[vehicle.Outcome]:
        """Return what comes out of cases of motion control.

        Parameters
        ----------
        cases : sequence of Case
            Those that another item has driven are not driven again.
        """
        self.stage("driving")
        new = [case for case in dict.fromkeys(cases) if case not in self._drives]
        self._drives.update(zip(new, vehicle.run_all(new)))
        return [self._drives[case] for case in cases]
