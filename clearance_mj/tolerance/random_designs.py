"""Random excitation over a production: which share of designs touches within an hour, how often and how hard.

Designs are marched eight at a time in the lanes of the modal engine, which share one noise; its seed is that of the
eight, whatever the number of workers. All levels have the same noise, scaled. What is seen of eight designs is not
independent, therefore: intervals come from the scatter between groups of eight.
"""

from __future__ import annotations

import contextlib
import itertools
import json
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.special

from ..clearance.law import Law
from ..clearance.modelled import Modelled, rig_and_law
from ..core.cache import code, digest
from ..core.errors import ClearanceError
from ..core.tasks import print_duration, run_tasks, workers_to_use
from ..engines import Engine, get_engine
from ..rig import Rig
from ..signals.psd import PSD
from .designs import Designs
from .impacts import Block, lanes_of, march
from .peaks import QUANTITIES, SETTLING, HourPeaks, noise_of, peaks_of_record

__all__ = ["DesignPeaks", "LevelPeaks", "peaks_of_designs", "peaks_over_production", "random_production"]

TOGETHER = 8  # consecutive designs that share a noise
TIMED = 5.0  # s of excitation, from whose march it is said how long all take
LEAST_GROUPS = 5  # from which on their scatter is used
SPREAD = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class DesignPeaks:
    """What an hour does to one design at one level; plain numbers, so that whoever calls can keep them."""

    design: int
    """its place among the models, from 0"""
    level: float
    """RMS of the excitation, m/s² or N"""
    impacts_per_second: tuple[float, ...]
    """of each bushing"""
    impact_probability: tuple[float, ...]
    """that each bushing touches within the time"""
    median: tuple[float, ...]
    """median of the largest value of the time, of each bushing or sensor; nan with too few peaks"""
    low: tuple[float, ...]
    """its 5 % quantile"""
    high: tuple[float, ...]
    """its 95 % quantile"""
    exceeded: tuple[float, ...]
    """probability that the largest value exceeds the limit; nan without a limit or with too few peaks"""

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data; ``DesignPeaks(**data)`` makes it again."""
        return {name: list(x) if isinstance(x, tuple) else x for name, x in asdict(self).items()}


@dataclass(frozen=True)
class LevelPeaks:
    """A production at one level: shares of designs with intervals, and quantiles over the designs.

    Intervals go from 5 to 95 %.
    """

    level: float
    """RMS of the excitation, m/s² or N"""
    designs: int
    """number of designs"""
    touches: np.ndarray
    """(n_bushings, 3) P(impact within the time) of a design of the production, and its interval"""
    exceeds: np.ndarray
    """(n_rows, 3) P(largest value over the limit), and its interval; where a design has too few peaks for a fit, the
    lower end takes none of it to exceed and the upper end all of it that touches; nan without a limit"""
    impacts_per_second: np.ndarray
    """(n_bushings, 3) 5, 50 and 95 % quantile over the designs, 1/s"""
    largest: np.ndarray
    """(n_rows, 3) the same of each design's median of the largest value; 0 where a design has too few peaks"""
    too_few: np.ndarray = field(default_factory=lambda: np.empty(0))
    """(n_rows,) share of designs with too few peaks for a fit"""
    by_design: tuple[DesignPeaks, ...] = ()
    """what is known of each design, in their order"""


class _Task(NamedTuple):
    """Designs that share a noise, at one level."""

    first: int
    level: float
    cases: tuple[tuple[Rig, Law], ...]
    psd: PSD
    seed: int
    duration: float
    settling: float
    quantity: str
    hours: float
    limit: float | None
    engine: Engine


def peaks_of_designs(
    models: Sequence[Rig | Modelled], psd: PSD, levels: Sequence[float], duration: float = 60.0, seed: int = 0,
    quantity: str = "contact_force", hours: float = 1.0, limit: float | None = None, engine: str | Engine = "modal",
    settling: float = SETTLING, known: Collection[tuple[int, float]] = (), workers: int | None = None,
    scheduler: str | None = None, progress: bool = False,
) -> Iterator[DesignPeaks]:  # fmt: skip
    """March every design at every level; yield what `peaks_over_an_hour` says of each, as it is found.

    Parameters
    ----------
    models : sequence of Model or Rig
        Designs of a production; their order decides which share a noise.
    psd : PSD
        Shape of the excitation's spectrum.
    levels : sequence of float
        RMS to which it is scaled, m/s² or N.
    duration, quantity, hours, limit, engine, settling
        As in `peaks_over_an_hour`.
    seed : int
        Seed of all noise.
    known : collection of (int, float)
        Designs and levels that are known from a run that was interrupted; they are left out, the rest is the same.
    workers : int, optional
        Processes. Default: one for each core.
    scheduler : str, optional
        Address of a Dask scheduler, whose cluster then marches the designs.
    progress : bool
        Show a progress bar.

    Raises
    ------
    ClearanceError
        As `peaks_over_an_hour`; if there are no models or levels.
    """
    if not len(models) or not len(levels):
        raise ClearanceError("a production needs one model or more, and one level or more")
    ClearanceError.require_known("quantity", quantity, QUANTITIES)
    cases, done, chosen = [rig_and_law(model) for model in models], set(known), get_engine(engine)
    tasks = []
    for level, first in itertools.product(levels, range(0, len(cases), TOGETHER)):
        group = tuple(cases[first : first + TOGETHER])
        if not done.issuperset((first + i, level) for i in range(len(group))):
            tasks.append(
                _Task(first, float(level), group, psd.scaled(level), seed, duration, settling, quantity, hours, limit,
                      chosen)
            )  # fmt: skip
    many = bool(scheduler) or (workers_to_use(workers) > 1 and len(tasks) > 1)  # a process takes seconds to start
    said = "designs, eight at a time" if progress else ""
    if tasks and progress and not scheduler:
        part = partial(_marched, tasks[0]._replace(duration=TIMED, settling=0.0))
        times, what = len(tasks) * (duration + settling) / TIMED, f"random excitation, {len(cases)} designs"
        print_duration(what, part, times, min(workers_to_use(workers), len(tasks)))
    run = run_tasks(_marched, tasks, workers if many else 1, processes=many, scheduler=scheduler, progress=said)
    for _, found in run:
        yield from (each for each in found if (each.design, each.level) not in done)


def random_production(
    designs: Designs, psd: PSD, levels: Sequence[float], duration: float = 60.0, seed: int = 0,
    quantity: str = "contact_force", hours: float = 1.0, limit: float | None = None, workers: int | None = None,
    scheduler: str | None = None, progress: bool = False, kept: Path | None = None,
) -> list[LevelPeaks]:  # fmt: skip
    """Find how many of a production touch, and exceed a limit, within a time of random excitation.

    Parameters
    ----------
    designs : Designs
        As `Scatter.draw` or `draw_posterior` draws them.
    psd : PSD
        Shape of the excitation's spectrum.
    levels : sequence of float
        RMS to which it is scaled, m/s² or N.
    duration, seed, quantity, hours, limit, workers, scheduler, progress
        As in `peaks_of_designs`.
    kept : Path, optional
        Folder for what is done, so that an interrupted call goes on where it stopped; it is made if it is not there.

    Returns
    -------
    list of LevelPeaks
        One for each level, in rising order.

    Raises
    ------
    ClearanceError
        As `peaks_of_designs`.
    """
    models = [designs.model(i) for i in range(len(designs))]
    shared = duration, seed, quantity, hours, limit
    done: list[DesignPeaks] = []
    path: Path | None = None
    if kept:
        kept.mkdir(parents=True, exist_ok=True)
        path = kept / f"peaks_{digest(code(), [each.to_dict() for each in models], psd.to_dict(), shared)[:16]}.jsonl"
        done = list(_known(path))
    known = {(each.design, each.level) for each in done}
    run = peaks_of_designs(
        models, psd, levels, *shared, known=known, workers=workers, scheduler=scheduler, progress=progress
    )
    for each in run:
        done.append(each)
        if path:
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(each.to_dict()) + "\n")
    wanted = {float(level) for level in levels}
    return peaks_over_production(each for each in done if each.level in wanted)


def _known(path: Path) -> Iterator[DesignPeaks]:
    """What a run that was interrupted found; its last line may be torn."""
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else ():
        with contextlib.suppress(ValueError):
            data: dict[str, Any] = json.loads(line)
            values: dict[str, Any] = {name: tuple(x) if isinstance(x, list) else x for name, x in data.items()}
            yield DesignPeaks(**values)


def peaks_over_production(found: Iterable[DesignPeaks]) -> list[LevelPeaks]:
    """Return what all designs say of the production, a `LevelPeaks` for each level in rising order.

    Parameters
    ----------
    found : iterable of DesignPeaks
        In any order.

    Raises
    ------
    ClearanceError
        If there is none.
    """
    by_level: dict[float, list[DesignPeaks]] = {}
    for each in found:
        by_level.setdefault(each.level, []).append(each)
    if not by_level:
        raise ClearanceError("there is no design to say anything of a production")
    return [_of_level(level, sorted(by_level[level], key=lambda x: x.design)) for level in sorted(by_level)]


def _marched(task: _Task) -> list[DesignPeaks]:
    """Peaks of the designs of a task."""
    noise = noise_of(task.psd, task.duration + task.settling, [task.seed, task.first // TOGETHER])
    found: dict[int, DesignPeaks] = {}
    for together in lanes_of(task.cases, noise, task.engine):
        blocks: list[list[Block]] = list(march([task.cases[i] for i in together], [noise], task.engine, task.settling))
        for lane, i in enumerate(together):
            rig, law = task.cases[i]
            own = [block[lane] for block in blocks]
            peaks = peaks_of_record(rig, law, own, noise, task.quantity, task.hours, task.limit)
            found[i] = _of_design(task.first + i, task.level, peaks)
    return [found[i] for i in sorted(found)]


def _of_design(design: int, level: float, peaks: HourPeaks) -> DesignPeaks:
    rows = (peaks.impacts_per_second, peaks.impact_probability, peaks.median, *peaks.interval.T, peaks.exceeded)
    return DesignPeaks(design, level, *(tuple(np.asarray(row).tolist()) for row in rows))


def _of_level(level: float, designs: list[DesignPeaks]) -> LevelPeaks:
    groups = np.array([each.design // TOGETHER for each in designs])
    touch = np.array([each.impact_probability for each in designs])
    over = np.array([each.exceeded for each in designs])
    median = np.array([each.median for each in designs])
    too_few = np.isnan(median)
    if np.isnan(over[~too_few]).any():  # no limit was asked for
        exceeds = np.full((over.shape[1], 3), np.nan)
    else:
        at_most = np.where(too_few, touch if touch.shape == over.shape else 1.0, over)
        none, every = _share(np.where(too_few, 0.0, over), groups), _share(at_most, groups)
        exceeds = np.column_stack((none[:, :2], every[:, 2]))
    rates = np.array([each.impacts_per_second for each in designs])
    return LevelPeaks(
        level, len(designs), _share(touch, groups), exceeds, np.quantile(rates, SPREAD, axis=0).T,
        np.quantile(np.where(too_few, 0.0, median), SPREAD, axis=0).T, too_few.mean(axis=0),
        tuple(designs),
    )  # fmt: skip


def _share(probability: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Mean probability of designs, (n, n_rows), with an interval: (n_rows, 3).

    The interval is that of a share of independent designs with Jeffreys' prior; where the means of groups scatter more
    than independent designs would, of as many fewer designs.
    """
    n, mean = len(probability), probability.mean(axis=0)
    number = np.full(mean.shape, float(n))
    labels = np.unique(groups)
    if labels.size >= LEAST_GROUPS:
        means = np.array([probability[groups == label].mean(axis=0) for label in labels])
        variance = means.var(axis=0, ddof=1) / labels.size
        with np.errstate(divide="ignore", invalid="ignore"):
            number = np.where(variance > 0, np.minimum(mean * (1 - mean) / variance, n), n)
    ends = [
        scipy.special.betaincinv(number * mean + 0.5, number * (1 - mean) + 0.5, end) for end in (SPREAD[0], SPREAD[2])
    ]
    return np.column_stack((mean, np.minimum(ends[0], mean), np.maximum(ends[1], mean)))
