"""Many results of one kind, such as those of a population: computed on many workers, stored on disk."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np

from .cache import ResultCache, load_arrays, save_arrays
from .tasks import print_duration, run_tasks, workers_to_use

__all__ = ["ALL_CORES", "Runner"]

Task = TypeVar("Task")
Arrays = Mapping[str, np.ndarray]
SUFFIX = ".npz"


@dataclass(frozen=True)
class _Numbered(Generic[Task]):
    """A task with the number that identifies it wherever it is computed."""

    number: int
    task: Task = field(compare=False)

    def __str__(self) -> str:
        if isinstance(self.task, range) and len(self.task) > 1:
            return f"{self.task[0]} to {self.task[-1]}"
        return str(self.number)


@dataclass(frozen=True)
class Runner:
    """Workers of a long computation, and the folder of their results.

    An interrupted call goes on where it stopped if it is made again with the same folder; any number of workers finds
    the same. Processes start by importing the calling script: start a call below ``if __name__ == "__main__"``.
    """

    workers: int | None = None
    """processes on this machine; None: one for each core; 1: only this one"""
    scheduler: str | None = None
    """address of a Dask scheduler, whose cluster computes instead"""
    executor: Executor | None = None
    """what computes instead, of any library; it is left open"""
    progress: bool = False
    """whether to show a bar with the time left, and to say before how long it takes"""
    kept: Path | None = None
    """folder of finished results, for several calls if needed; it is made if it is not there"""

    @functools.cached_property
    def _cache(self) -> ResultCache | None:
        return ResultCache(self.kept) if self.kept else None

    def run(
        self, name: str, function: Callable[[Task], Arrays], tasks: Sequence[Task], inputs: Callable[[Task], object],
        samples: Sequence[Callable[[], object]] = (), times: float = 0.0,
    ) -> list[Arrays]:  # fmt: skip
        """Return what a function makes of each task, in their order.

        Parameters
        ----------
        name : str
            Of the results, on bars and files.
        function : callable
            Of a task, to named arrays; like the tasks it can be pickled.
        tasks : sequence
            Parts of the computation. They are computed in a shuffled order, so that those that are done are a fair
            sample of those that are left, and with them the time left that a bar shows.
        inputs : callable
            Of a task, to everything that its result depends on, as plain data.
        samples : sequence of callable
            What is timed to say how long all take.
        times : float
            How many of them all tasks are as long as.

        Raises
        ------
        ClearanceError
            As `tasks.run_tasks`.
        """
        results: dict[int, Arrays] = {}
        files, cache = name.replace(" ", "_"), self._cache
        if cache:
            kept = {i: cache.find(files, inputs(task), load_arrays, SUFFIX) for i, task in enumerate(tasks)}
            results |= {i: arrays for i, arrays in kept.items() if arrays is not None}
        shuffled = np.random.default_rng(0).permutation(len(tasks)).tolist()
        pending = [_Numbered(i, tasks[i]) for i in shuffled if i not in results]
        elsewhere, count = bool(self.scheduler or self.executor), workers_to_use(self.workers)
        if self.progress and pending and samples and not elsewhere:
            print_duration(name, samples, times * len(pending) / len(tasks), min(count, len(pending)))
        run = run_tasks(
            functools.partial(_compute, function), pending, 1 if len(pending) == 1 else count,
            processes=count > 1 and len(pending) > 1, scheduler=self.scheduler, executor=self.executor,
            progress=name if self.progress else "", done=len(results),
        )  # fmt: skip
        for each, arrays in run:
            results[each.number] = arrays
            if cache:
                cache.keep(files, inputs(each.task), arrays, save_arrays, SUFFIX)
        return [results[i] for i in range(len(tasks))]

    def drop_unused(self) -> None:
        """Remove results of earlier calls, with other inputs, that no call of this runner used."""
        if self._cache:
            self._cache.drop_unused()


def _compute(function: Callable[[Task], Arrays], each: _Numbered[Task]) -> Arrays:
    return function(each.task)


ALL_CORES = Runner()
"""Processes on every core of this machine"""
