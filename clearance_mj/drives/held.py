"""Lost motion, in ticks, of servos that hold a position while others pull them to and fro, from their logs."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy.stats

from ..core.errors import RecordError
from ..core.files import plain_file
from ..core.notes import note
from .record import read_table

__all__ = ["HeldLostMotion", "HeldServo", "ServoLog", "fit_held"]

TURN = 4096  # ticks
SIGN_BIT = 10  # of a load, 1: negative
CONFIDENCE = 0.95
FOLLOWS = 0.9  # R² of load on error, above which the load is proportional to the error
_COLUMN = re.compile(r"\s*(target pos|pos|load)\s*\((\d+)\)\s*", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class ServoLog:
    """Targets, positions and loads of several servos, as their controllers log them."""

    name: str
    """of the log"""
    target: dict[int, np.ndarray]
    """(n,) ticks, by the servo's number"""
    position: dict[int, np.ndarray]
    """(n,) ticks, of the encoder at the output"""
    load: dict[int, np.ndarray]
    """(n,) of the motor's voltage, in 0.1 % of the largest"""

    @staticmethod
    def is_one(path: str | Path) -> bool:
        """Return True if a file's first line has targets and positions of servos.

        Parameters
        ----------
        path : path
            The file, of any kind.
        """
        try:
            with plain_file(path).open("rb") as file:
                header = file.readline(10000).decode(errors="replace")
        except OSError:
            return False  # the reader reports the reason
        kinds = {match[1].lower() for cell in header.split(",") if (match := _COLUMN.fullmatch(cell))}
        return {"target pos", "pos"} <= kinds

    @classmethod
    def read(cls, path: str | Path) -> ServoLog:
        """Read a table with the columns ``target pos (1)``, ``pos (1)``, ``load (1)`` of each servo.

        Loads are sign and magnitude with bit 10. Rows before the first telemetry, without positions, are left out.

        Parameters
        ----------
        path : path
            The file.

        Raises
        ------
        RecordError
            For a file without such columns, or without rows.
        """
        table = read_table(path)
        series: dict[str, dict[int, pd.Series]] = {"target pos": {}, "pos": {}, "load": {}}
        for header, column in table.items():
            if match := _COLUMN.fullmatch(str(header)):
                series[match[1].lower()][int(match[2])] = pd.to_numeric(column, errors="coerce")
        servos = sorted(series["target pos"].keys() & series["pos"].keys() & series["load"].keys())
        if len(servos) < 3:
            raise RecordError(f"{path}: needs target pos (N), pos (N) and load (N) of a held servo and two that pull")
        lacking = ((i, kind) for i in sorted({*series["pos"], *series["load"]} - {*servos}) for kind in series)
        note(path, [f"servo {i} is left out: no {kind} ({i})" for i, kind in lacking if i not in series[kind]])
        rows = np.all([series[kind][i].notna() for kind in series for i in servos], axis=0)
        if not rows.any():
            raise RecordError(f"{path}: has no row with positions of all servos")
        arrays = {kind: {i: series[kind][i][rows].to_numpy(dtype=float, copy=True) for i in servos} for kind in series}
        loads = {i: _decode_load(load) for i, load in arrays["load"].items()}
        return cls(Path(path).name.split(".")[0], arrays["target pos"], arrays["pos"], loads)


class HeldLostMotion(NamedTuple):
    """Difference of a held servo's positions after either puller, ticks."""

    ticks: float
    low: float  #: of the interval: scatter of the pulls, and rounding of each position to a tick
    high: float
    pulls: tuple[int, int]  #: of each puller


@dataclass(frozen=True)
class HeldServo:
    """Lost motion of a held servo, of its gear and of its control loop together."""

    servo: int
    """number of the servo"""
    stretched: HeldLostMotion
    """while the pullers stretch, at the end of each pull"""
    let_go: HeldLostMotion
    """after they have let go, in the second half of the pause"""
    gain: float
    """0.1 % of the largest voltage per tick of error, of the control loop"""
    follows: float
    """R² of the regression of load on error"""

    @property
    def not_told(self) -> tuple[str, ...]:
        """Sentences that name what the log does not identify, and the log that would."""
        motions = [("stretched", self.stretched), ("let go", self.let_go)]
        doubts = [
            f"servo {self.servo}, {state}: not told from none, for up to a tick hides in each position"
            for state, motion in motions if motion.low <= 0
        ]  # fmt: skip
        loop = (
            f"the loop pushes by {self.gain / 10:.3g} % of its voltage per tick of all that is lost"
            if self.follows > FOLLOWS
            else "its load does not say how much of that the loop pushes against"
        )
        return (
            *doubts,
            f"servo {self.servo}: gear and loop are not told apart, for the encoder sits at the output, within the "
            f"loop; {loop}; a second log with another gain of the loop would tell (its part goes with one over the "
            "gain, the gear's does not), or one of the motor's own angle",
        )

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, ticks and rad."""
        motions = {
            name: motion._asdict() | {"rad": motion.ticks * 2 * math.pi / TURN}
            for name, motion in (("stretched", self.stretched), ("let_go", self.let_go))
        }
        return dataclasses.asdict(self) | motions | {"not_told": list(self.not_told)}


def fit_held(
    log: ServoLog, held: Sequence[int] | None = None, pullers: tuple[int, int] | None = None
) -> tuple[HeldServo, ...]:
    """Estimate how far held servos are moved by the pulls of two others.

    A puller's target is at rest but when it stretches. Of every pull counts the last row before its target goes back,
    and the second half of the rows from then on to the next change of any target.

    Parameters
    ----------
    log : ServoLog
        The log.
    held : sequence of int, optional
        Numbers of the servos that hold; by default all that do not pull.
    pullers : (int, int), optional
        Numbers of those that pull; by default, of those whose target has two values, the two that leave one most
        often.

    Raises
    ------
    RecordError
        If it does not show which two pull, or one of them never does while the held ones have one target.
    """
    pullers = pullers or _find_pullers(log)
    servos = [i for i in log.target if i not in pullers] if held is None else list(held)
    if unknown := {*servos, *pullers} - log.target.keys():
        raise RecordError(f'log "{log.name}" has no servo {min(unknown)}; it has {", ".join(map(str, log.target))}')
    return tuple(_fit_servo(log, servo, servos, pullers) for servo in servos)


def _find_pullers(log: ServoLog) -> tuple[int, int]:
    candidates = [i for i, target in log.target.items() if np.unique(target).size == 2]
    pulls = {i: int(np.count_nonzero(np.diff(log.target[i]))) for i in candidates}
    ranked = sorted(candidates, key=lambda i: -pulls[i])
    if len(candidates) < 2 or any(pulls[i] == pulls[ranked[1]] for i in ranked[2:]):
        raise RecordError(f'log "{log.name}": its targets do not show which two servos pull; name them')
    return min(ranked[:2]), max(ranked[:2])


def _fit_servo(log: ServoLog, servo: int, servos: Sequence[int], pullers: tuple[int, int]) -> HeldServo:
    away = {i: log.target[i] != scipy.stats.mode(log.target[i]).mode for i in pullers}
    error = log.position[servo] - log.target[servo]
    targets = np.array([*(log.target[i] for i in servos), *away.values()])
    edges = [0, *(np.flatnonzero(np.any(np.diff(targets, axis=1), axis=0)) + 1), error.size]
    stretched: dict[int, list[float]] = {i: [] for i in pullers}
    let_go: dict[int, list[float]] = {i: [] for i in pullers}
    rows, puller = list[int](), None
    for begin, end in zip(edges[:-1], edges[1:]):
        pulling = [i for i in pullers if away[i][begin]]
        retargeted = begin > 0 and any(log.target[i][begin] != log.target[i][begin - 1] for i in servos)
        puller = None if retargeted or len(pulling) > 1 else puller
        if len(pulling) == 1 and end < error.size:
            puller = pulling[0]
            rows.append(end - 1)
            stretched[puller].append(float(error[end - 1]))
        elif puller is not None and not pulling:
            second_half = range(begin + (end - begin) // 2, end)
            rows += second_half
            let_go[puller].append(float(error[second_half].mean()))
            puller = None
    if min(map(len, (*stretched.values(), *let_go.values()))) < 2:
        raise RecordError(f'log "{log.name}": servos {pullers[0]} and {pullers[1]} must each pull twice and let go')
    line = scipy.stats.linregress(error[rows], log.load[servo][rows]) if np.ptp(error[rows]) else None
    gain, follows = (abs(float(line.slope)), float(line.rvalue**2)) if line else (math.nan, 0.0)
    return HeldServo(servo, _mean_difference(*stretched.values()), _mean_difference(*let_go.values()), gain, follows)


def _mean_difference(first: Sequence[float], second: Sequence[float]) -> HeldLostMotion:
    """Return the difference of two means, with Welch's interval widened by that of two rounded positions."""
    difference = abs(float(np.mean(first) - np.mean(second)))
    variances = [np.var(values, ddof=1) / len(values) for values in (first, second)]
    half_width = 0.0
    if variance := float(sum(variances)):
        degrees = variance**2 / sum(s**2 / (len(values) - 1) for s, values in zip(variances, (first, second)))
        half_width = float(scipy.stats.t.ppf(0.5 + CONFIDENCE / 2, degrees)) * math.sqrt(variance)
    half_width = math.hypot(half_width, 1 - math.sqrt(1 - CONFIDENCE))
    low, high = max(0.0, difference - half_width), difference + half_width
    return HeldLostMotion(difference, low, high, (len(first), len(second)))


def _decode_load(load: np.ndarray) -> np.ndarray:
    bits = load.astype(np.int64)
    return np.where(bits >> SIGN_BIT & 1, -1.0, 1.0) * (bits & ((1 << SIGN_BIT) - 1))
