"""The angle of a turning shaft by the pulses of its keyphasor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.ndimage
from scipy.interpolate import CubicSpline

from ..core.errors import RecordError
from .arrays import ArrayData

__all__ = ["ShaftTurning", "turning_of_pulses"]

MIN_TREND = 8  # turns, from which on a change of their speed is known
CREEP = 1e-3  # fraction of a steady speed, below which its change is none
MIN_TURNS = 2  # whole ones, from which the speed is known at both ends of a record
HIGH, LOW = 0.6, 0.4  # of the pulses' height: a pulse begins above one and ends below the other
ANOTHER = 1.4  # times as many pulses as stated, from which on a turn has another number of them
LONG, SHORT = 1.5, 0.6  # of the usual way between two pulses: one is missing, or one too many
IRREGULAR = 0.05  # fraction of pulses, from which on they do not come as those of some other number
NEAR = 4  # turns either side, of which the median is the usual way


@dataclass(frozen=True, eq=False, repr=False)
class ShaftTurning(ArrayData):
    """Rotation of a shaft in a record. Made by `turning_of_pulses`."""

    marks: np.ndarray
    """(n_turns + 1,) s, at which the once-per-turn mark passed: the shaft's angle is a multiple of 2π there"""
    angle: np.ndarray
    """(n_t,) rad at each sample, > 0 from y to z"""
    speed: np.ndarray
    """(n_t,) rad/s at each sample"""

    @property
    def mean_speed(self) -> float:
        """Mean from the first mark to the last, rad/s."""
        turns = 2 * np.pi * (self.marks.size - 1) / (self.marks[-1] - self.marks[0])
        return float(np.sign(self.speed[0]) * turns)

    @property
    def drift(self) -> float:
        """Change of the speed from the first mark to the last over its mean, along a straight line."""
        middle = (self.marks[1:] + self.marks[:-1]) / 2
        if middle.size < MIN_TREND:
            return 0.0
        slope = np.polyfit(middle - middle.mean(), self.of_turns, 1)[0]
        return float(slope * (self.marks[-1] - self.marks[0]) / self.of_turns.mean())

    @property
    def steady_or_creeping(self) -> tuple[float, float]:
        """Speed at time 0, rad/s, and its rate, rad/s², which is 0 unless the speed creeps by more than 0.1 %."""
        mean, drift, (first, last) = self.mean_speed, self.drift, self.marks[[0, -1]]
        rate = mean * drift / (last - first) if abs(drift) > CREEP else 0.0
        return mean - rate * float(first + last) / 2, float(rate)

    def part(self, samples: slice) -> ShaftTurning:
        """Return the turning in a part of the record; the marks stay those of the whole.

        Parameters
        ----------
        samples : slice
            Of the record's samples.
        """
        return ShaftTurning(self.marks, self.angle[samples], self.speed[samples])

    @property
    def of_turns(self) -> np.ndarray:
        """(n_turns,) rad/s, mean of each turn."""
        return np.asarray(np.sign(self.speed[0]) * 2 * np.pi / np.diff(self.marks))


def turning_of_pulses(
    pulses: np.ndarray, fs: float, sense: float = 1.0, per_turn: int = 1,
    stated: Callable[[np.ndarray], np.ndarray] | None = None,
) -> ShaftTurning:  # fmt: skip
    """Return the angle and the speed of a shaft by the pulses of a keyphasor.

    A pulse marks the angle 0 where it rises through the half of its height, between samples as a line through both.
    Of several pulses in a turn every so-manieth is a mark, from the first of the record on: slots need not be even.
    Between the marks the angle is a cubic spline; before the first and after the last the speed stays.

    Parameters
    ----------
    pulses : ndarray, shape (n_t,)
        In any unit, high for less than a half of the way from one to the next.
    fs : float
        Samples per second.
    sense : float
        Sign of the spin: 1 from y to z; one mark does not show it.
    per_turn : int
        Number of pulses in a turn.
    stated : callable, optional
        Stated angle of the shaft, rad, at times (n,) s: pulses that do not come as it says are refused, and
        their height is that of most turns, whatever spikes there are.

    Raises
    ------
    RecordError
        If there are less than two whole turns, or pulses are missing or too many.
    """
    signal = np.asarray(pulses, dtype=float)
    time = np.arange(signal.size) / fs
    whole = turn_starts = np.zeros(1, dtype=int)
    if stated is not None:
        turns = np.abs(stated(time) - stated(time[:1])) / (2 * np.pi)
        turn_starts = np.searchsorted(turns, np.arange(max(turns[-1], 1.0)))
    for starts in (turn_starts, whole):  # of turns, if they are at all as stated
        low = np.quantile(np.minimum.reduceat(signal, starts), 0.25, method="higher")
        high = np.quantile(np.maximum.reduceat(signal, starts), 0.75, method="lower")
        usual = signal[np.abs(signal - (low + high) / 2) <= 0.75 * (high - low)]  # a quarter more is no spike
        low, high = np.min(usual, initial=low), np.max(usual, initial=high)
        level = (signal - low) / (high - low if high > low else 1.0)
        marks = _rises(level) / fs
        if marks.size > MIN_TURNS * per_turn:
            break
    if stated is not None and marks.size > MIN_TURNS:
        _check_pulses(marks, per_turn, np.abs(stated(marks)) * per_turn / (2 * np.pi))
    marks = marks[::per_turn]
    if marks.size < MIN_TURNS + 1:
        raise RecordError(
            f"its keyphasor shows {max(marks.size - 1, 0)} whole turns in {level.size / fs:g} s; needs {MIN_TURNS} or "
            "more"
        )
    angle = CubicSpline(marks, 2 * np.pi * np.arange(marks.size))
    inside = np.clip(time, marks[0], marks[-1])
    speed = angle(inside, 1)
    return ShaftTurning(marks, sense * (angle(inside) + speed * (time - inside)), sense * speed)


def _check_pulses(marks: np.ndarray, per_turn: int, stated: np.ndarray) -> None:
    """Refuse pulses at times (n,) s that do not come one by one as is stated (n,), and name the fault."""
    steps = np.abs(np.diff(stated))
    footprint = np.zeros(2 * NEAR * per_turn + 1)
    footprint[::per_turn] = 1  # one slot is compared with itself in other turns: slots may be uneven
    usual = scipy.ndimage.median_filter(steps, footprint=footprint, mode="nearest")
    irregular = np.mean((steps > LONG * usual) | (steps < SHORT * usual))
    ratio = steps / np.maximum(usual, 1.0)  # an edge that rings makes short ways usual
    long, short = np.flatnonzero(ratio > LONG), np.flatnonzero(ratio < SHORT)
    times, words = steps.size / steps.sum(), ""
    if not 1 / ANOTHER < times < ANOTHER and irregular < IRREGULAR:
        words = f"{times:.3g} times as many: give the number of pulses in a turn (pulses of spin), or another speed"
    elif short.size and (times > 1 or not long.size):
        words = f"the first too many at {marks[short[0] + 1]:.4g} s: an edge that rings, or a spike"
    elif long.size:
        words = f"{ratio[long[0]] - 1:.0f} missing after {marks[long[0]]:.4g} s; leave that part of the record out"
    if words:
        raise RecordError(f"its keyphasor shows {marks.size} pulses where {steps.sum() + 1:.0f} are stated, {words}")


def _rises(level: np.ndarray) -> np.ndarray:
    """Return fractional samples at which pulses from 0 to 1 rise through 0.5, once for each pulse."""
    state = np.where(level > HIGH, 1, np.where(level < LOW, -1, 0))
    known = np.flatnonzero(state)
    rising = np.flatnonzero((state[known][1:] == 1) & (state[known][:-1] == -1))
    crossings = []
    for before, after in zip(known[rising], known[rising + 1]):
        sample = before + np.flatnonzero(level[before + 1 : after + 1] >= 0.5)[0]
        crossings.append(sample + (0.5 - level[sample]) / (level[sample + 1] - level[sample]))
    return np.array(crossings)
