"""Integration of gaps over hours, with a step that adapts to how the rate of wear changes.

Each step is one of Bogacki & Shampine's pair of orders 2 and 3 (Applied Mathematics Letters 2, 1989, 321), whose
difference is its error. Every rate is that of the vibration at the gaps of that moment, continued from the vibration
at the step's begin. A step on which a branch of vibrations ends is halved until the end is located; so is one over
which a rate jumps. Where a vibration jumps, the machine continues with the next one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..model import Model
from .growth import clearances_of, growth, with_clearances
from .operation import Source, Vibration

__all__ = ["REACHED", "Moment", "wear_on"]

FIRST, LONGEST = 0.01, 0.1  # of a gap: its growth in the first step and at most in a step
LOCATED = 1e-4  # of a gap, within which the end of a branch is located
BEYOND = 2e-4  # of a gap: its growth past the end, where the vibration after a jump is computed
JUMPS = 0.2  # relative change of rubbing over a located step that is a jump, beyond its errors
REACHED = 1e-6  # of a limit: within which it counts as reached
CHANGED = 0.02  # the same where a branch has ended: if it has only become unstable, rubbing may stay as it was
SURE = 4.0  # standard errors
SAFETY, SHRINK, GROW = 0.9, 0.2, 4.0  # of the step's control


class Moment(NamedTuple):
    """The machine at a time."""

    hours: float
    model: Model
    vibration: Vibration
    rate: np.ndarray  #: (n_bushings, 3) of gap and offsets, m/h
    fell_from: Vibration | None  #: the last vibration before a jump at this moment


class _Ended(Exception):
    """A branch ended within a step."""


def wear_on(source: Source, model: Model, limits: np.ndarray, hours: float, accuracy: float) -> Iterator[Moment]:
    """Integrate wear and yield the machine after every step, and at each jump again with the vibration after it.

    At the last moment a gap reaches its limit, the time is over, or nothing rubs any more.

    Parameters
    ----------
    source : Source
        Source of its vibrations.
    model : Model
        Model at the begin.
    limits : ndarray, shape (n_bushings,)
        Gaps at which it ends, m; infinite where there is none.
    hours : float
        Time at which it ends.
    accuracy : float
        Relative error of the growth in a step.
    """
    first = source.first(model)
    now = Moment(0.0, model, first, growth(model.rig, first.rubbing), None)
    yield now
    step = _hours_of_growth(now, FIRST)
    while now.hours < hours and now.rate.any() and not _is_at_limit(now, limits):
        step = min(step, _hours_of_growth(now, LONGEST), hours - now.hours, _hours_to_limit(now, limits))
        try:
            new, error = _step(source, now, step, accuracy)
        except _Ended:
            if _relative_growth(now, step) > LOCATED:
                step /= 2
                continue
            now = _after_jump(source, now)
            yield now
            step = _hours_of_growth(now, FIRST)
            continue
        if error > 1.0 and _relative_growth(now, step) > LOCATED:
            step *= max(SHRINK, SAFETY * error ** (-1 / 3))
            continue
        if (fraction := _fraction_to_limit(now, new, limits)) < 1.0:
            step *= fraction
            continue
        jumped = error > 1.0 and _has_jumped(now.vibration, new.vibration, JUMPS)
        now = new._replace(fell_from=now.vibration if jumped else None)
        yield now
        step *= min(GROW, SAFETY * max(error, 1e-6) ** (-1 / 3)) if error <= 1.0 else 1.0


def _relative_growth(now: Moment, step: float) -> float:
    """Return the largest relative change of a gap, or of its middle over it, in so many hours."""
    return float(np.max(np.abs(now.rate).max(axis=1) * step / clearances_of(now.model.rig)[:, 0]))


def _hours_of_growth(now: Moment, fraction: float) -> float:
    """Return the hours in which no gap grows by more than a fraction."""
    fastest = _relative_growth(now, 1.0)
    return fraction / fastest if fastest > 0 else np.inf


def _is_at_limit(now: Moment, limits: np.ndarray) -> bool:
    return bool(np.any(clearances_of(now.model.rig)[:, 0] >= limits * (1 - REACHED)))


def _fraction_to_limit(now: Moment, new: Moment, limits: np.ndarray) -> float:
    """Return the fraction of a step after which the first limit is reached; 1 if none is passed."""
    before, after = clearances_of(now.model.rig)[:, 0], clearances_of(new.model.rig)[:, 0]
    passed = after > limits * (1 + REACHED)
    return float(np.min((limits - before)[passed] / (after - before)[passed], initial=1.0))


def _hours_to_limit(now: Moment, limits: np.ndarray) -> float:
    """Return the hours to the nearest limit at the current rate."""
    gaps, rate = clearances_of(now.model.rig)[:, 0], now.rate[:, 0]
    return float(np.min(np.where(rate > 0, (limits - gaps) / np.where(rate > 0, rate, 1.0), np.inf)))


def _step(source: Source, now: Moment, step: float, accuracy: float) -> tuple[Moment, float]:
    """Return the moment after a step, and the error of the step over the allowed one."""
    start = clearances_of(now.model.rig)
    slopes = [now.rate]

    def after(change: np.ndarray, before: Vibration, at: Model) -> tuple[Model, Vibration]:
        model = with_clearances(now.model, start + step * change)
        if (vibration := source.follow(before, at, model)) is None:
            raise _Ended
        slopes.append(growth(model.rig, vibration.rubbing))
        return model, vibration

    middle, at_middle = after(slopes[0] / 2, now.vibration, now.model)
    late, at_late = after(0.75 * slopes[1], at_middle, middle)
    mean = (2 * slopes[0] + 3 * slopes[1] + 4 * slopes[2]) / 9
    end, at_end = after(mean, at_late, late)
    step_error = step * np.abs(-5 / 72 * slopes[0] + slopes[1] / 12 + slopes[2] / 9 - slopes[3] / 8)
    of_gap = np.max(np.abs(step * mean), axis=1)
    noise = step * np.max(np.abs(slopes[3]), axis=1) * _relative_error(at_end, now.vibration)
    allowed = accuracy * (of_gap + 0.01 * of_gap.max()) + noise
    error = float(np.max(step_error.max(axis=1) / np.maximum(allowed, 1e-300)))
    return Moment(now.hours + step, end, at_end, slopes[3], None), error


def _relative_error(*vibrations: Vibration) -> np.ndarray:
    """Return the sum of the relative standard errors of rubbings."""
    return np.asarray(sum(v.error / np.maximum(v.power, 1e-300) for v in vibrations))


def _has_jumped(before: Vibration, after: Vibration, threshold: float) -> bool:
    change, size = np.abs(after.power - before.power), np.maximum(after.power, before.power)
    return bool(np.any(change > np.maximum(threshold * size, SURE * np.hypot(after.error, before.error))))


def _after_jump(source: Source, now: Moment) -> Moment:
    """Return the machine after the jump at the end of a branch, located within a fraction `LOCATED` of the gap."""
    step = _hours_of_growth(now, BEYOND)
    model = with_clearances(now.model, clearances_of(now.model.rig) + step * now.rate)
    new = source.leap(now.vibration, model)
    jumped = _has_jumped(now.vibration, new, CHANGED)
    return Moment(now.hours + step, model, new, growth(model.rig, new.rubbing), now.vibration if jumped else None)
