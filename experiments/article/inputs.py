"""Inputs that items share, made when one is first asked for."""

from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path

import experiments.article.ridge_as_printed  # noqa: F401  (registers a method)
from clearance_mj import Dataset, RecordError, Rig
from clearance_mj.core.cache import ResultCache
from clearance_mj.study import Study
from clearance_mj.vehicle import experiment as vehicle

DATASET = Path("data/table1_rig")
METHODS = ("nominal", "constant", "ridge-as-printed", "ridge", "output-error")
QUICK_METHODS = ("nominal", "ridge-as-printed", "amplitude")
SENSORS = set(range(1, 9))
Runs = Callable[[Sequence[vehicle.Case]], list[vehicle.Outcome]]  # Cases of vehicle runs to what comes out of them


class Inputs:
    """A dataset's study and vehicle runs; quick: fewer noises, laws that need no search, the fastest engine."""

    def __init__(self, dataset: str | Path = DATASET, quick: bool = False, cache: Path | None = None, progress=False):
        self.path, self.quick, self.progress = Path(dataset), quick, progress
        self.cache = ResultCache(cache) if cache else None
        self._outcomes: dict[vehicle.Case, vehicle.Outcome] = {}

    @cached_property
    def study(self) -> Study:
        """The laws on the engines, the main engine first; RecordError if the records are not as the article has them.

        Two bushings, sensors 1 to 8, a shaken base, and two records of each level, of which the models follow the
        first and the second is the repeat.
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
        methods, engines = (QUICK_METHODS, ("modal",)) if self.quick else (METHODS, ("links", "modal"))
        return Study(dataset, methods, engines, self.cache, progress=self.progress)

    @property
    def rig(self) -> Rig:
        """The rig of the dataset."""
        return self.study.dataset.rig

    def runs(self, cases: Sequence[vehicle.Case]) -> list[vehicle.Outcome]:
        """Return what comes out of vehicle runs; those that another item has asked for are not run again."""
        new = [case for case in dict.fromkeys(cases) if case not in self._outcomes]
        self._outcomes.update(zip(new, vehicle.run_all(new, progress=self.progress)))
        return [self._outcomes[case] for case in cases]
