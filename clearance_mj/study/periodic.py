"""A study's law under sines: its periodic vibrations over frequency at the study's levels, and its rattle map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..clearance.law import ConstantLaw, ContactLaw, Law
from ..core.errors import ClearanceError
from ..core.tasks import run_tasks
from ..model import Model
from ..periodic import Branch, RattleMap, follow_response, follow_unbalance, map_rattle
from ..periodic.condensed import UNBALANCE
from ..periodic.excitation import excited_by
from ..periodic.resolution import ends_of_range
from ..periodic.summaries import stable_points
from ..signals.stepped_sines import SineSteps

__all__ = ["PeriodicVibrations", "amplitude_error", "from_both_ends", "has_periodic_vibrations", "periodic_vibrations"]

HARMONICS, MAP_HARMONICS = 9, 7
"""of the branches and of the map; of the Table-1 rig's study 9 find folds as 21 do within 0.002 %, fundamentals within
0.15 %, amplitudes within 3 %"""
MAP_LEVELS, MAP_FREQUENCIES = 8, 150
BEYOND = 1.5  # times the highest level of the records, to which levels go on


@dataclass(frozen=True, eq=False)
class PeriodicVibrations:
    """Periodic vibrations of a law under sines, or why there are none."""

    law: str  #: name; "" if no law has periodic vibrations
    branches: tuple[Branch, ...]  #: over frequency, in the order of their levels
    map: RattleMap | None  #: over level and frequency
    missing: str  #: why there is nothing to show; "" if there is


def amplitude_error(branches: tuple[Branch, ...], steps: SineSteps) -> np.ndarray:
    """Return the relative error of each sensor's amplitude at each step, (n, n_sensors).

    It is that of the vibration on which a sweep in the step's direction comes to its frequency, of the branch whose
    level is nearest; nan where that has none that is stable.

    Parameters
    ----------
    branches : tuple of Branch
        Over frequency.
    steps : SineSteps
        Steps of a record.
    """
    errors = np.full(steps.acceleration.shape, np.nan)
    levels = np.array([abs(branch.level[0, 0]) for branch in branches])
    for i, (frequency, level) in enumerate(zip(steps.frequency, steps.level)):
        nearest = levels[np.argmin(np.abs(levels - level))]
        of_level = [branch for branch, x in zip(branches, levels) if x == nearest]
        met = [amplitude for branch in of_level for amplitude in _stable_amplitudes(branch, frequency)]
        if met:
            errors[i] = met[0 if steps.upwards[i] else -1] * level / nearest / steps.acceleration[i] - 1
    return errors


def _stable_amplitudes(branch: Branch, frequency: float) -> list[np.ndarray]:
    """Return stable amplitudes of the sensors at a frequency, in their order along the branch from low frequencies."""
    x, y, stable = branch.frequency, branch.amplitude(), stable_points(branch)
    amplitudes = []
    for j in np.flatnonzero(((x[:-1] - frequency) * (x[1:] - frequency) <= 0) & stable[:-1] & stable[1:]):
        fraction = (frequency - x[j]) / (x[j + 1] - x[j]) if x[j + 1] != x[j] else 0.0
        amplitudes.append(y[j] + fraction * (y[j + 1] - y[j]))
    return amplitudes if x[0] <= x[-1] else amplitudes[::-1]


def has_periodic_vibrations(law: Law) -> bool:
    """Return True if harmonic balance takes a law: it is not over time or amplitude.

    Parameters
    ----------
    law : Law
        The law.
    """
    return isinstance(law, ConstantLaw | ContactLaw)


def from_both_ends(model: Model, amplitude: float, ends: tuple[float, float], **settings: Any) -> tuple[Branch, ...]:
    """Return the branch over frequency at a level; if it ends early, a second one from the other end towards it.

    Parameters
    ----------
    model, amplitude, ends, **settings
        As for `periodic.follow_response`; of kind "unbalance" the amplitude is a factor of the rig's unbalances.
    """
    first = _follow(model, amplitude, ends, **settings)
    if not first.ended:
        return (first,)
    try:
        return first, _follow(model, amplitude, (ends[1], ends[0]), **settings)
    except ClearanceError:
        return (first,)


def _follow(
    model: Model, amplitude: float, ends: tuple[float, float], kind: str | None = None, **settings: Any
) -> Branch:
    excited = excited_by(model, kind)
    if excited == UNBALANCE:
        start, stop = ends_of_range(ends)
        return follow_unbalance(model, (2 * np.pi * start, 2 * np.pi * stop), factor=amplitude, **settings)
    return follow_response(model, amplitude, ends, kind=excited, **settings)


def periodic_vibrations(
    name: str, model: Model, levels: list[float], band: tuple[float, float], kind: str,
    workers: int | None = None, progress: bool = False,
) -> PeriodicVibrations:  # fmt: skip
    """Return periodic vibrations under sines of some amplitudes, and a rattle map between and beyond.

    Parameters
    ----------
    name : str
        Name of the law.
    model : Model
        Rig and law, a `ConstantLaw` or a `ContactLaw`.
    levels : list of float
        Amplitudes of the excitation, rising, m/s² or N.
    band : tuple of float
        First and last frequency, Hz.
    kind : str
        "base" or "force".
    workers : int, optional
        Threads; default: one for each core.
    progress : bool
        Show a progress bar.
    """
    wanted = [*levels, BEYOND * levels[-1]]
    of_map = np.linspace(levels[0], wanted[-1], MAP_LEVELS), np.geomspace(*band, MAP_FREQUENCIES)

    def mapped() -> RattleMap:
        return map_rattle(model, *of_map, kind=kind, n_harmonics=MAP_HARMONICS, workers=1)

    def followed(level: float) -> Callable[[], tuple[Branch, ...]]:
        return lambda: from_both_ends(model, level, band, n_harmonics=HARMONICS, kind=kind, stability=False)

    tasks: list[Callable[[], Any]] = [mapped, *map(followed, wanted)]
    try:
        ends_of_range(band)  # map and branches are computed side by side: which of them refuses first is chance
        parts = dict(run_tasks(lambda task: task(), tasks, workers, progress="periodic vibrations" if progress else ""))
    except ClearanceError as error:
        return PeriodicVibrations(name, (), None, str(error))
    branches = tuple(branch for task in tasks[1:] for branch in parts[task])
    return PeriodicVibrations(name, branches, parts[mapped], "")
