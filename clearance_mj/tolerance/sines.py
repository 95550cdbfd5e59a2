"""Sines under which designs of a production are looked at."""

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

BATCH, LEAST_TASKS = 8, 16  # designs of one task, at most, and tasks, if there are as many designs
SAMPLES = 64  # frequencies of a design that are timed at most, to say how long all take


@dataclass(frozen=True, eq=False)
class Sines:
    """Sines of all levels and frequencies, and what designs must not do under them."""

    levels: ArrayLike
    """(n_levels,) amplitudes, m/s² or N, increasing; of kind "unbalance" what the rig's unbalances are multiplied by"""
    frequencies: ArrayLike
    """(n_frequencies,) Hz, increasing; of kind "unbalance" turns in a second"""
    limit: Limit | str | None = None
    """what must not be exceeded, such as "contact_force > 20 N"; None: only contact counts"""
    kind: str | None = None
    """ "base", "force" or "unbalance"; None: unbalance of a rig that has some, else that of its shaker"""
    n_harmonics: int | None = None
    """of the motion, H; None: 9, 13 or 21, the fewest that reach 0.7 of the highest natural frequency within the range
    of frequencies; 21 with a limit on an acceleration"""
    n_samples: int | None = None
    """of a period, at least 4 H + 1; None: the power of two from 12 H on, and four times as many where vibrations end
    early with them"""
    n_modes: int = 8
    """in the Ritz basis, as in the modal engine"""


def settings_of(model: Model, sines: Sines) -> Settings:
    """Return what designs are looked at with, or refuse what cannot be; see `production`.

    Parameters
    ----------
    model : Model
        In the middle of the scatter.
    sines : Sines
        What is asked.
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
    poles = resonances(solver).imag / solver.system.pace
    reach = REACH * float(poles[poles <= fastest].max(initial=0.0)) / (2 * np.pi)
    return Settings(kind, level, frequency, limit, sines.n_harmonics, sines.n_samples, sines.n_modes, reach)


def total_of(name: str, settings: Settings, designs: Designs, runner: Runner) -> Rattling:
    """Return what designs do, in their order; see `production`.

    Parameters
    ----------
    name : str
        Of the computation, on its bar and files.
    settings : Settings
        What they are looked at with.
    designs : Designs
        The designs.
    runner : Runner
        How they are computed.
    """
    size, n = min(max(len(designs) // LEAST_TASKS, 1), BATCH), settings.frequencies.size
    batches = [Batch(i, designs[i : i + size]) for i in range(0, len(designs), size)]
    timed = np.random.default_rng(0).permutation(n)[:SAMPLES]
    samples = [functools.partial(_at_one_frequency, settings, designs[:1], i) for i in timed.tolist()]
    compute, inputs = functools.partial(_arrays_of, settings), functools.partial(_inputs, settings)
    found = runner.run(name, compute, batches, inputs, samples, n * len(designs))
    parts = [Rattling(**each) for each in found]
    return Rattling(
        np.sum([part.counts for part in parts], axis=0), np.concatenate([part.of_designs for part in parts], axis=1)
    )


def _at_one_frequency(settings: Settings, designs: Designs, i: int) -> None:
    rattling_of(replace(settings, frequencies=settings.frequencies[[i]]), Batch(0, designs))


def _arrays_of(settings: Settings, batch: Batch) -> dict[str, np.ndarray]:
    return rattling_of(settings, batch)._asdict()


def _inputs(settings: Settings, batch: Batch) -> object:
    """Everything that the results of a batch depend on, as plain data."""
    designs = batch.designs
    models = [model.content() for model in designs.drawn] or [designs.nominal.content(), designs.values.tolist()]
    arrays = settings.levels.tolist(), settings.frequencies.tolist()
    limit = settings.limit and (settings.limit.quantity, settings.limit.value, settings.limit.at)
    how = settings.kind, settings.harmonics, settings.samples, settings.modes, settings.reach
    return models, designs.names, *arrays, limit, *how
