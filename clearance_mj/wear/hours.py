"""Integration of gaps over hours, with a step that adapts to how the rate of wear changes.

Each step is one of Bogacki & Shampine's pair of orders 2 and 3 (Applied Mathematics Letters 2, 1989, 321), whose
difference is its error. Every rate is that of the vibration at the gaps of that moment, which goes on from the
vibration at the step's begin. A step on which a branch of vibrations ends is halved until the end is located; so is
one over which a rate jumps. Where a vibration jumps, the machine goes on with the one to which it falls.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..model import Model
from .growth import clearances_of, growth, with_clearances
from .operation import Source, Vibration

__all__ = ["REACHED", "Moment", "wear_on"]

FIRST, LONGEST = 0.01, 0.1  # of a gap, by which it grows in the first step and at most in a step
LOCATED = 1e-4  # of a gap, within which the end of a branch is located
BEYOND = 2e-4  # of a gap, by which it has grown past the end where the vibration after a jump is sought
JUMPS = 0.2  # relative change of rubbing over a located step that is a jump, beyond its errors
REACHED = 1e-6  # of a limit, within which it is reached
CHANGED = 0.02  # the same where a branch has ended: where it has only become unstable, rubbing may stay as it was
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
    """Yield a machine from its begin on: after every step, and at each jump once more with the vibration after it.

    The last moment is that at which a gap reaches its limit, the time is over, or nothing rubs any more.

    Parameters
    ----------
    source : Source
        Its vibrations.
    model : Model
        At the begin.
    limits : ndarray, shape (n_bushings,)
        Gaps at which it ends, m; infinite where there is none.
    hours : float
        Time at which it ends.
    accuracy : float
        Of the growth in a step, relative.
    """
    first = source.first(model)
    now = Moment(0.0, model, first, growth(model.rig, first.rubbing), None)
    yield now
    step = _longest(now, FIRST)
    while now.hours < hours and now.rate.any() and not _reached(now, limits):
        step = min(step, _longest(now, LONGEST), hours - now.hours, _to_limit(now, limits))
        try:
            new, error = _stepped(source, now, step, accuracy)
        except _Ended:
            if _growth(now, step) > LOCATED:
                step /= 2
                continue
            now = _fallen(source, now)
            yield now
            step = _longest(now, FIRST)
            continue
        if error > 1.0 and _growth(now, step) > LOCATED:
            step *= max(SHRINK, SAFETY * error ** (-1 / 3))
            continue
        if (share := _within_limits(now, new, limits)) < 1.0:
            step *= share
            continue
        jumped = error > 1.0 and _jumps(now.vibration, new.vibration, JUMPS)
        now = new._replace(fell_from=now.vibration if jumped else None)
        yield now
        step *= min(GROW, SAFETY * max(error, 1e-6) ** (-1 / 3)) if error <= 1.0 else 1.0


def _growth(now: Moment, step: float) -> float:
    """Largest share of a gap by which it grows, or its middle moves, in so many hours."""
    return float(np.max(np.abs(now.rate).max(axis=1) * step / clearances_of(now.model.rig)[:, 0]))


def _longest(now: Moment, share: float) -> float:
    """Hours in which no gap grows by more than a share."""
    fastest = _growth(now, 1.0)
    return share / fastest if fastest > 0 else np.inf


def _reached(now: Moment, limits: np.ndarray) -> bool:
    return bool(np.any(clearances_of(now.model.rig)[:, 0] >= limits * (1 - REACHED)))


def _within_limits(now: Moment, new: Moment, limits: np.ndarray) -> float:
    """The share of a step after which the first limit is reached; 1 if none is passed."""
    before, after = clearances_of(now.model.rig)[:, 0], clearances_of(new.model.rig)[:, 0]
    passed = after > limits * (1 + REACHED)
    return float(np.min((limits - before)[passed] / (after - before)[passed], initial=1.0))


def _to_limit(now: Moment, limits: np.ndarray) -> float:
    """Hours to the nearest limit at the rate of now."""
    gaps, rate = clearances_of(now.model.rig)[:, 0], now.rate[:, 0]
    way = np.where(rate > 0, (limits - gaps) / np.where(rate > 0, rate, 1.0), np.inf)
    return float(np.min(way))


def _stepped(source: Source, now: Moment, step: float, accuracy: float) -> tuple[Moment, float]:
    """The moment after a step, and the error of the step over what is allowed."""
    start = clearances_of(now.model.rig)
    slopes = [now.rate]

    def after(change: np.ndarray, before: Vibration, at: Model) -> tuple[Model, Vibration]:
        model = with_clearances(now.model, start + step * change)
        if (found := source.follow(before, at, model)) is None:
            raise _Ended
        slopes.append(growth(model.rig, found.rubbing))
        return model, found

    middle, at_middle = after(slopes[0] / 2, now.vibration, now.model)
    late, at_late = after(0.75 * slopes[1], at_middle, middle)
    mean = (2 * slopes[0] + 3 * slopes[1] + 4 * slopes[2]) / 9
    end, at_end = after(mean, at_late, late)
    missed = step * np.abs(-5 / 72 * slopes[0] + slopes[1] / 12 + slopes[2] / 9 - slopes[3] / 8)
    of_gap = np.max(np.abs(step * mean), axis=1)
    noise = step * np.max(np.abs(slopes[3]), axis=1) * _relative(at_end, now.vibration)
    allowed = accuracy * (of_gap + 0.01 * of_gap.max()) + noise
    error = float(np.max(missed.max(axis=1) / np.maximum(allowed, 1e-300)))
    return Moment(now.hours + step, end, at_end, slopes[3], None), error


def _relative(*vibrations: Vibration) -> np.ndarray:
    """Standard errors of rubbings over them."""
    return np.asarray(sum(v.error / np.maximum(v.power, 1e-300) for v in vibrations))


def _jumps(before: Vibration, after: Vibration, share: float) -> bool:
    change, size = np.abs(after.power - before.power), np.maximum(after.power, before.power)
    return bool(np.any(change > np.maximum(share * size, SURE * np.hypot(after.error, before.error))))


def _fallen(source: Source, now: Moment) -> Moment:
    """The machine after the jump at the end of a branch, which lies within a share `LOCATED` of the gap."""
    step = _longest(now, BEYOND)
    model = with_clearances(now.model, clearances_of(now.model.rig) + step * now.rate)
    found = source.leap(now.vibration, model)
    jumped = _jumps(now.vibration, found, CHANGED)
    return Moment(now.hours + step, model, found, growth(model.rig, found.rubbing), now.vibration if jumped else None)
