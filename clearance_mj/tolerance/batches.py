"""Many designs: what they are looked at with, batches of them on many workers, and what is done kept on disk."""

from __future__ import annotations

import functools
from concurrent.futures import Executor
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..core.cache import ResultCache, load_arrays, save_arrays
from ..core.tasks import print_duration, run_tasks, workers_to_use
from ..model import Model
from ..periodic.excitation import excited_by
from ..periodic.in_gap import resonances
from ..periodic.map_rows import solver_at
from ..periodic.rattle_maps import increasing
from ..periodic.resolution import resolution
from .designs import Designs
from .limits import Limit
from .rattling import HARMONICS, REACH, Batch, Rattling, Settings, rattling_of

__all__ = ["settings_of", "total_of"]

BATCH = 8  # designs of one task


def settings_of(
    model: Model, levels: ArrayLike, frequencies: ArrayLike, limit: Limit | str | None, kind: str | None,
    n_harmonics: int | None = None, n_samples: int | None = None, n_modes: int = 8,
) -> Settings:  # fmt: skip
    """Return what designs are looked at with, or refuse what cannot be; see `production`."""
    level, frequency = increasing(levels, "levels", 1), increasing(frequencies, "frequencies", 1)
    kind = excited_by(model, kind)
    limit = Limit.parse(limit) if isinstance(limit, str) else limit
    if limit:
        limit.row(model.rig)
    harmonics, counts = resolution(HARMONICS[-1] if n_harmonics is None else n_harmonics, n_samples, 1, n_modes)
    fastest = 2 * np.pi * float(frequency[-1])
    solver = solver_at(model, kind, 1.0, fastest, harmonics, counts[0], n_modes)
    poles = resonances(solver).imag / solver.system.pace
    reach = REACH * float(poles[poles <= fastest].max(initial=0.0)) / (2 * np.pi)
    return Settings(kind, level, frequency, limit, n_harmonics, n_samples, n_modes, reach)


def total_of(
    settings: Settings, designs: Designs, workers: int | None = None, scheduler: str | None = None,
    executor: Executor | None = None, progress: str = "", kept: Path | None = None,
) -> Rattling:  # fmt: skip
    """Return what designs do, in their order; see `production`. ``progress`` describes a bar, empty for none."""
    workers = workers_to_use(workers)
    batches = [Batch(i, designs[i : i + BATCH]) for i in range(0, len(designs), BATCH)]
    cache = ResultCache(kept) if kept else None
    counts = np.zeros((5, settings.levels.size, settings.frequencies.size), dtype=np.int64)
    of_designs: dict[int, np.ndarray] = {}

    def add(batch: Batch, found: Rattling) -> None:
        nonlocal counts
        counts += found.counts
        of_designs[batch.first] = found.of_designs

    for batch in batches if cache else ():
        if cache and (known := cache.find("batch", _inputs(settings, batch), load_arrays, ".npz")) is not None:
            add(batch, Rattling(**known))
    left = [batch for batch in batches if batch.first not in of_designs]
    compute = functools.partial(rattling_of, settings)
    alone = workers == 1 and not scheduler and not executor
    if progress and left and not scheduler and not executor:
        first, count = Batch(left[0].first, left[0].designs[:1]), sum(len(batch.designs) for batch in left)
        print_duration(f"{progress}, {count} designs", lambda: compute(first), count, min(workers, len(left)))
    run = run_tasks(
        compute, left, workers, processes=not alone, scheduler=scheduler, executor=executor, progress=progress,
        done=len(of_designs),
    )  # fmt: skip
    for batch, found in run:
        add(batch, found)
        if cache:
            cache.keep("batch", _inputs(settings, batch), found._asdict(), save_arrays, ".npz")
    if cache:
        cache.drop_unused()
    return Rattling(counts, np.concatenate([of_designs[batch.first] for batch in batches], axis=1))


def _inputs(settings: Settings, batch: Batch) -> object:
    """Everything that the results of a batch depend on, as plain data."""
    designs = batch.designs
    models = [model.to_dict() for model in designs.drawn] or [designs.nominal.to_dict(), designs.values.tolist()]
    arrays = settings.levels.tolist(), settings.frequencies.tolist()
    limit = settings.limit and (settings.limit.quantity, settings.limit.value, settings.limit.at)
    how = settings.kind, settings.harmonics, settings.samples, settings.modes, settings.reach
    return models, designs.names, *arrays, limit, *how
