"""The angle of a turning shaft out of its once-per-turn pulses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from ..core.errors import RecordError
from .arrays import ArrayData, read_only

__all__ = ["ShaftTurning", "turning_of_pulses"]

MIN_TURNS = 2  # whole ones, from which the speed is known at both ends of a record
HIGH, LOW = 0.6, 0.4  # of the pulses' height: a pulse begins above one and ends below the other


@dataclass(frozen=True, eq=False, repr=False)
class ShaftTurning(ArrayData):
    """How a shaft turned in a record. Made by `turning_of_pulses`."""

    marks: np.ndarray
    """(n_turns + 1,) s, at which the once-per-turn mark passed: the shaft's angle is a multiple of 2π there"""
    angle: np.ndarray
    """(n_t,) rad at each sample, > 0 from y to z"""
    speed: np.ndarray
    """(n_t,) rad/s at each sample"""

    def __post_init__(self) -> None:
        for name in ("marks", "angle", "speed"):
            self._set(**{name: read_only(getattr(self, name))})

    @property
    def mean_speed(self) -> float:
        """Mean from the first mark to the last, rad/s."""
        turns = 2 * np.pi * (self.marks.size - 1) / (self.marks[-1] - self.marks[0])
        return float(np.sign(self.speed[0]) * turns)

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


def turning_of_pulses(pulses: np.ndarray, fs: float, sense: float = 1.0) -> ShaftTurning:
    """Return the angle and the speed of a shaft out of the pulses of a keyphasor.

    A pulse marks the angle 0 where it rises through the half of its height, between samples as a line through both.
    Between the marks the angle is a cubic spline; before the first and after the last the speed stays.

    Parameters
    ----------
    pulses : ndarray, shape (n_t,)
        In any unit, high once per turn for less than a half of it.
    fs : float
        Samples per second.
    sense : float
        Sign of the spin: 1 from y to z, which one mark does not tell.

    Raises
    ------
    RecordError
        If there are less than two whole turns.
    """
    low, high = float(np.min(pulses)), float(np.max(pulses))
    level = (np.asarray(pulses, dtype=float) - low) / (high - low if high > low else 1.0)
    marks = _rises(level) / fs
    if marks.size < MIN_TURNS + 1:
        raise RecordError(
            f"its keyphasor shows {max(marks.size - 1, 0)} whole turns in {level.size / fs:g} s; needs {MIN_TURNS} or "
            "more"
        )
    turns = CubicSpline(marks, 2 * np.pi * np.arange(marks.size))
    time = np.arange(level.size) / fs
    inside = np.clip(time, marks[0], marks[-1])
    speed = turns(inside, 1)
    return ShaftTurning(marks, sense * (turns(inside) + speed * (time - inside)), sense * speed)


def _rises(level: np.ndarray) -> np.ndarray:
    """Samples, between samples, at which pulses from 0 to 1 rise through 0.5, once for each pulse."""
    state = np.where(level > HIGH, 1, np.where(level < LOW, -1, 0))
    known = np.flatnonzero(state)
    begun = np.flatnonzero((state[known][1:] == 1) & (state[known][:-1] == -1))
    found = []
    for before, after in zip(known[begun], known[begun + 1]):
        crossed = before + np.flatnonzero(level[before + 1 : after + 1] >= 0.5)[0]
        found.append(crossed + (0.5 - level[crossed]) / (level[crossed + 1] - level[crossed]))
    return np.array(found)
