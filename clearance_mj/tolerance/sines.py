"""Sine excitations of designs of a production."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..core.runner import Runner
from ..model import Model
from ..periodic.excitation import excited_by
from ..periodic.in_gap import resonances
from ..periodic.map_rows import solver_at
from ..periodic.rattle_maps import increasing
from ..periodic.resolution import resolution
from .designs import Designs
from .limits import Limit
from .rattling import HARMONICS, REACH, Batch, Rattling, Settings, rattling_of

__all__ = ["Sines", "settings_of", "total_of"]

BATCH, LEAST_TASKS = (8, 16)  # most designs of one task, and least number of tasks, if there are as many designs
SAMPLES = 64  # largest number of frequencies of a design that are timed, to estimate the time of all


@dataclass(frozen=True, eq=False)
class Sines:
    """Sines of all levels and frequencies, and the limit of designs under them."""

    levels: ArrayLike
    """(n_levels,) amplitudes, m/s² or N, increasing; of kind "unbalance" factors of the rig's unbalances"""
    frequencies: ArrayLike
    """(n_frequencies,) Hz, increasing; of kind "unbalance" turns in a second"""
    limit: Limit | str | None = None
    """limit, such as "contact_force > 20 N"; None: only contact counts"""
    kind: str | None = None
    """ "base", "force" or "unbalance"; None: unbalance of a rig that has some, else that of its shaker"""
    n_harmonics: int | None = None
    """of the motion, H; None: 9, 13 or 21, the fewest that reach 0.7 of the highest natural frequency within the range
    of frequencies; 21 with a limit on an acceleration"""
    n_samples: int | None = None
    """of a period, at least 4 H + 1; None: the power of two from 12 H on, and four times as many where vibrations end
    early with them"""
    n_modes: int = 8
    """modes in the Ritz basis, as in the modal engine"""


def settings_of(model: Model, sines: Sines) -> Settings:
    """Check the request and return the settings for designs; see `production`.

    Parameters
    ----------
    model : Model
        Model in the middle of the scatter.
    sines : Sines
        Levels, frequencies and limit.
    """
    level, frequency = increasing(sines.levels, "levels", 1), increasing(sines.frequencies, "frequencies", 1)
    kind = excited_by(model, sines.kind)
    limit = Limit.parse(sines.limit) if isinstance(sines.limit, str) else sines.limit
    if limit:
        limit.row(model.rig)
    highest = HARMONICS[-1] if sines.n_harmonics is None else sines.n_harmonics
    harmonics, counts = resolution(highest, sines.n_samples, 1, sines.n_modes)
    fastest = 2 * np.pi * float(frequency[-1])
    solver = solver_at(model, kind, 1.0, fastest, harmonics, counts[0], sines.n_modes)
    poles = resonances(solver).imag / solver.system.frequency_ratio
    reach = REACH * float(poles[poles <= fastest].max(initial=0.0)) / (2 * np.pi)
    return Settings(kind, level, frequency, limit, sines.n_harmonics, sines.n_samples, sines.n_modes, reach)


def total_of(name: str, settings: Settings, designs: Designs, runner: Runner) -> Rattling:
    """Compute all designs and combine their results, in their order; see `production`.

    Parameters
    ----------
    name : str
        Name of the computation, on its bar and files.
    settings : Settings
        Settings of the computation.
    designs : Designs
        The designs.
    runner : Runner
        Workers, and folder of finished results.
    """
    size, n = min(max(len(designs) // LEAST_TASKS, 1), BATCH), settings.frequencies.size
    batches = [Batch(i, designs[i : i + size]) for i in range(0, len(designs), size)]
    timed = np.random.default_rng(0).permutation(n)[:SAMPLES]
    samples = [functools.partial(_compute_one_frequency, settings, designs[:1], i) for i in timed.tolist()]
    compute, inputs = functools.partial(_compute_arrays, settings), functools.partial(_batch_inputs, settings)
    results = runner.run(name, compute, batches, inputs, samples, n * len(designs))
    counts = np.sum([each["counts"] for each in results], axis=0)
    return Rattling(counts, np.concatenate([each["of_designs"] for each in results], axis=1))


def _compute_one_frequency(settings: Settings, designs: Designs, i: int) -> None:
    rattling_of(replace(settings, frequencies=settings.frequencies[[i]]), Batch(0, designs))


def _compute_arrays(settings: Settings, batch: Batch) -> dict[str, np.ndarray]:
    return rattling_of(settings, batch)._asdict()


def _batch_inputs(settings: Settings, batch: Batch) -> object:
    """Return all inputs of a batch's results, as plain data."""
    designs = batch.designs
    models = [model.content() for model in designs.drawn] or [designs.nominal.content(), designs.values.tolist()]
    arrays = settings.levels.tolist(), settings.frequencies.tolist()
    limit = settings.limit and (settings.limit.quantity, settings.limit.value, settings.limit.at)
    options = settings.kind, settings.harmonics, settings.samples, settings.modes, settings.reach
    return models, designs.names, *arrays, limit, *options
