"""Random excitation over a production: the fraction of designs that touch within an hour, how often and how hard.

Designs are marched eight at a time in the lanes of the modal engine, under one noise; its seed is that of the eight,
whatever the number of workers. All levels have the same noise, scaled. Results of eight designs are not independent,
therefore: intervals come from the scatter between groups of eight.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby, product
from typing import NamedTuple

import numpy as np

from ..clearance.law import Law
from ..clearance.modelled import Modelled, rig_and_law
from ..core.cache import code_outside
from ..core.errors import ClearanceError
from ..core.runner import ALL_CORES, Runner
from ..engines import Engine, get_engine
from ..model import Model
from ..rig import Rig
from ..signals.psd import PSD
from ..statistics.shares import share_interval
from .designs import Designs
from .impacts import groups_side_by_side, march
from .peaks import QUANTITIES, SETTLING, HourPeaks, noise_of, peaks_of_record

__all__ = ["DesignPeaks", "LevelPeaks", "Noise", "peaks_of_designs", "peaks_over_production", "random_production"]

TOGETHER = 8  # consecutive designs that share a noise
TIMED = 5.0  # s of excitation, marched to estimate the time of all
LEAST_GROUPS = 5  # number of groups from which on their scatter is used
SPREAD = (0.05, 0.5, 0.95)
OF_DESIGN = ("impacts_per_second", "impact_probability", "median", "low", "high", "exceeded")


@dataclass(frozen=True)
class DesignPeaks:
    """Peaks of one design at one level."""

    design: int
    """its index among the models, from 0"""
    level: float
    """RMS of the excitation, m/s² or N"""
    impacts_per_second: tuple[float, ...]
    """of each bushing"""
    impact_probability: tuple[float, ...]
    """probability that each bushing touches within the time"""
    median: tuple[float, ...]
    """median of the largest value of the time, of each bushing or sensor; nan with too few peaks"""
    low: tuple[float, ...]
    """its 5 % quantile"""
    high: tuple[float, ...]
    """its 95 % quantile"""
    exceeded: tuple[float, ...]
    """probability that the largest value exceeds the limit; nan without a limit or with too few peaks"""


@dataclass(frozen=True)
class LevelPeaks:
    """A production at one level: fractions of designs with intervals, and quantiles over the designs.

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
    lower end assumes that it never exceeds and the upper end that it does if it touches; nan without a limit"""
    impacts_per_second: np.ndarray
    """(n_bushings, 3) 5, 50 and 95 % quantile over the designs, 1/s"""
    largest: np.ndarray
    """(n_rows, 3) the same quantiles of each design's median of the largest value; 0 where it has too few peaks"""
    too_few: np.ndarray = field(default_factory=lambda: np.empty(0))
    """(n_rows,) fraction of designs with too few peaks for a fit"""
    by_design: tuple[DesignPeaks, ...] = ()
    """peaks of each design, in their order"""


@dataclass(frozen=True, eq=False)
class Noise:
    """Random excitation under which designs of a production are marched, and the predicted quantity."""

    psd: PSD
    """shape of the excitation's spectrum"""
    levels: Sequence[float]
    """RMS levels to which it is scaled, m/s² or N"""
    duration: float = 60.0
    """length of the record after settling, s"""
    hours: float = 1.0
    """time whose largest value is predicted, h"""
    quantity: str = "contact_force"
    """predicted quantity: "contact_force", "penetration" or "acceleration" """
    limit: float | None = None
    """its value whose probability of being exceeded is predicted"""
    engine: str | Engine = "modal"
    """engine of the march"""
    settling: float = SETTLING
    """time at the start that is left out, s"""


class _Task(NamedTuple):
    """Designs under the same noise, at one level."""

    first: int
    level: float
    cases: tuple[tuple[Rig, Law], ...]
    noise: Noise
    seed: int


def peaks_of_designs(
    models: Sequence[Rig | Modelled], noise: Noise, seed: int = 0, runner: Runner = ALL_CORES
) -> list[DesignPeaks]:
    """March every design at every level; return the results of `peaks_over_an_hour` for each, level by level.

    Parameters
    ----------
    models : sequence of Model or Rig
        Designs of a production; their order decides which have the same noise.
    noise : Noise
        Excitation of the march.
    seed : int
        Seed of all noise.
    runner : Runner
        Workers, and folder of finished results.

    Raises
    ------
    ClearanceError
        As `peaks_over_an_hour`; if there are no models or levels.
    """
    if not len(models) or not len(noise.levels):
        raise ClearanceError("a production needs one model or more, and one level or more")
    ClearanceError.require_known("quantity", noise.quantity, QUANTITIES)
    get_engine(noise.engine)
    cases = [rig_and_law(model) for model in models]
    starts = product(noise.levels, range(0, len(cases), TOGETHER))
    tasks = [_Task(first, float(level), tuple(cases[first : first + TOGETHER]), noise, seed) for level, first in starts]
    part = tasks[0]._replace(noise=replace(noise, duration=TIMED, settling=0.0))
    times = len(tasks) * (noise.duration + noise.settling) / TIMED
    results = runner.run("random excitation", _march, tasks, _task_inputs, [partial(_march, part)], times)
    return [
        DesignPeaks(task.first + i, task.level, *(tuple(arrays[name][i].tolist()) for name in OF_DESIGN))
        for task, arrays in zip(tasks, results)
        for i in range(len(task.cases))
    ]


def random_production(designs: Designs, noise: Noise, seed: int = 0, runner: Runner = ALL_CORES) -> list[LevelPeaks]:
    """Estimate the fractions of a production that touch, and exceed a limit, within a time of random excitation.

    Parameters
    ----------
    designs : Designs
        Such as drawn by `Scatter.draw`.
    noise, seed, runner
        As in `peaks_of_designs`.

    Returns
    -------
    list of LevelPeaks
        One for each level, in rising order.

    Raises
    ------
    ClearanceError
        As `peaks_of_designs`.
    """
    return peaks_over_production(peaks_of_designs([designs.model(i) for i in range(len(designs))], noise, seed, runner))


def peaks_over_production(found: Iterable[DesignPeaks]) -> list[LevelPeaks]:
    """Summarise the peaks of all designs, a `LevelPeaks` for each level in rising order.

    Parameters
    ----------
    found : iterable of DesignPeaks
        Peaks of designs, in any order.

    Raises
    ------
    ClearanceError
        If there is none.
    """
    designs = sorted(found, key=lambda each: (each.level, each.design))
    if not designs:
        raise ClearanceError("there is no design to say anything of a production")
    return [_summarise_level(level, list(each)) for level, each in groupby(designs, key=lambda each: each.level)]


def _task_inputs(task: _Task) -> object:
    """Return all inputs of a task's results, as plain data."""
    engine, models = get_engine(task.noise.engine), [Model(rig, law).content() for rig, law in task.cases]
    settings = {name: value for name, value in vars(task.noise).items() if name not in ("psd", "levels", "engine")}
    engine_inputs = engine.name, vars(engine), code_outside(engine)
    return models, task.first, task.level, task.noise.psd.to_dict(), task.seed, settings, *engine_inputs


def _march(task: _Task) -> dict[str, np.ndarray]:
    """March the designs of a task; return their peaks, a row for each."""
    asked, engine = task.noise, get_engine(task.noise.engine)
    noise = noise_of(asked.psd.scaled(task.level), asked.duration + asked.settling, [task.seed, task.first // TOGETHER])
    peaks: dict[int, HourPeaks] = {}
    for together in groups_side_by_side(task.cases, noise, engine):
        blocks = list(march([task.cases[i] for i in together], [noise], engine, asked.settling))
        for lane, i in enumerate(together):
            lane_of = [block[lane] for block in blocks]
            peaks[i] = peaks_of_record(*task.cases[i], lane_of, noise, asked.quantity, asked.hours, asked.limit)
    each = [peaks[i] for i in sorted(peaks)]
    rows = [(one.impacts_per_second, one.impact_probability, one.median, *one.interval.T, one.exceeded) for one in each]
    return dict(zip(OF_DESIGN, map(np.array, zip(*rows))))


def _summarise_level(level: float, designs: list[DesignPeaks]) -> LevelPeaks:
    groups = np.array([each.design // TOGETHER for each in designs])
    names = ("impacts_per_second", "impact_probability", "median", "exceeded")
    rates, touch, median, exceeded = (np.array([getattr(each, name) for each in designs]) for name in names)
    too_few = np.isnan(median)
    if np.isnan(exceeded[~too_few]).any():  # no limit was asked for
        exceeds = np.full((exceeded.shape[1], 3), np.nan)
    else:
        at_most = np.where(too_few, touch if touch.shape == exceeded.shape else 1.0, exceeded)
        low, high = (_fractions(np.where(too_few, 0.0, exceeded), groups), _fractions(at_most, groups))
        exceeds = np.column_stack((low[:, :2], high[:, 2]))
    impacts, largest = (np.quantile(each, SPREAD, axis=0).T for each in (rates, np.where(too_few, 0.0, median)))
    fractions, unknown = _fractions(touch, groups), too_few.mean(axis=0)
    return LevelPeaks(level, len(designs), fractions, exceeds, impacts, largest, unknown, tuple(designs))


def _fractions(probability: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return the mean probability of designs, (n, n_rows), with an interval: (n_rows, 3).

    The interval is that of a fraction of independent designs; where the means of groups scatter more than independent
    designs would, of correspondingly fewer designs.
    """
    n, mean = len(probability), probability.mean(axis=0)
    number = np.full(mean.shape, float(n))
    labels = np.unique(groups)
    if labels.size >= LEAST_GROUPS:
        means = np.array([probability[groups == label].mean(axis=0) for label in labels])
        variance = means.var(axis=0, ddof=1) / labels.size
        with np.errstate(divide="ignore", invalid="ignore"):
            number = np.where(variance > 0, np.minimum(mean * (1 - mean) / variance, n), n)
    return np.column_stack((mean, *share_interval(mean, number, SPREAD[2] - SPREAD[0])))
