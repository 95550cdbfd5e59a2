"""A drive found from logs of its motor, and its load's angle or torque if there: play, teeth, efficiency, friction."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize
import scipy.signal
from tqdm import tqdm

from ..estimate import Estimates, Parameter, Problem, Solution, Stop, UnknownScale, jackknife, one_by_one, solve
from ..estimate.estimates import UNIDENTIFIED
from ..physical.identification.record import quantum
from .fit import ADVICE, free, in_words, positive, require_motion
from .record import DriveRecord
from .teeth import NUMBERS, predicted

__all__ = ["MotorSideFit", "fit_motor_side"]

POINTS = 10000  # of a run, means over its samples
STEPS = 4  # of the integration between samples
SETTLED = 0.5  # s, after which what was before the log is forgotten
PIECE = 1.0  # s, within which errors may be correlated: one after another is left out for intervals
TORQUE_ERROR = 0.01  # of its range, that means of the load's torque are expected to be off: efficiency turns over
FAR = 5.0  # of the noise, from which on errors count less than by their squares
SMOOTHED = 0.1  # s, over which a parabola is laid for the speeds where the search begins
MEANS = 0.1  # s, over whose means the load's torque counts
SLOW = 0.2  # of the usual speed, below which friction may not slide
EFFICIENCIES = np.linspace(0.3, 1.0, 36)  # where the search begins
PLAY = 0.01  # of the motion, to be expected
PLAYS = 0.2 * 1.7 ** np.arange(6)  # of that, each held once while the rest is searched for
FREED = 2  # of these that are nearest, from which everything is searched for
RUBS = 0.1, 0.25, 0.5  # of the friction, that may be the load's
SHARES = 0.3, 0.7  # of the inertia, that may be the load's
INERTIAS = 0.3, 1.0, 3.0  # of what slow motion lets expect
FIRST = Stop(steps=6, decrease=0.0, gain=3.0, move=1e-6)
STOP = Stop(steps=40, decrease=0.0, gain=0.2, move=1e-6)

WORDS = ADVICE | {
    "play": "a reversal without load would tell it",
    "stiffness": "a finer encoder and faster sampling would tell it: how far the teeth give is hidden",
    "efficiency": "motion to and fro under loads of different size would tell it",
    "friction": "reversals under loads of different size, one of them none, would tell it",
    "turnover": "slow reversals under load would tell it",
}
"""Which motion would tell a parameter that the motor's side does not"""

NAMES = {
    "play": "play to either side",
    "stiffness": "stiffness of the teeth",
    "turnover": "speed at which efficiency turns over",
    "tail": "share of that which turns over slowly",
    "friction": "friction at the motor",
    "width": "angle in which that friction builds up",
    "load width": "angle in which the load's friction builds up",
    "damping": "damping at the motor",
    "spring": "spring that the motor feels",
    "correction": "rate at which measured angles correct the expected one",
}
"""In a table, of parameters whose own do not say enough"""


@dataclass(frozen=True, eq=False)
class MotorSideFit:
    """What logs of its motor tell of a drive: everything in the motor's units, for the ratio does not show there."""

    estimates: Estimates
    """of every number that was fitted"""
    crossings: int
    """how often the teeth changed sides in all runs"""
    runs: tuple[str, ...]
    """names of the runs that it was found from"""

    @property
    def values(self) -> dict[str, float]:
        """Every number by name, SI units at the motor.

        Play is to either side. Spring and loads are those that the motor feels through the elastic teeth.
        """
        return dict(zip(self.estimates.names, self.estimates.value.tolist()))

    @property
    def not_told(self) -> tuple[str, ...]:
        """What the runs do not tell, in words, and which motion would."""
        e = self.estimates
        names = set(e.only_prior)
        if not self.crossings:
            names |= {"play"}
        names |= {p.name for p, std in zip(e.parameters, e.varied_std) if p.transform == "log" and std > UNIDENTIFIED}
        return in_words((name for name in e.names if name in names), WORDS)

    def table(self) -> dict[str, float]:
        """Return every number with its unit, in plain names, at the motor."""
        e = self.estimates
        return {
            ", ".join(filter(None, (NAMES.get(p.name, p.name), p.unit))): float(value)
            for p, value in zip(e.parameters, e.value)
        }

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, SI units."""
        return {
            "estimates": self.estimates.rows(), "runs": list(self.runs), "crossings": self.crossings,
            "table": self.table(), "not_told": list(self.not_told),
        }  # fmt: skip


def fit_motor_side(records: Sequence[DriveRecord], progress: bool = False) -> MotorSideFit:
    """Find what logs of the motor's side tell of a drive, and of the load's angle or torque where they have it.

    The load hangs behind play and elastic teeth (`teeth.predicted`). Play is held at several sizes while everything
    else is searched for, for searches that let go of it too early end at wrong ones; then all is set free, from the two
    nearest. Where runs have the load's angle or torque, they are compared with those of the load behind the teeth.

    Parameters
    ----------
    records : sequence of DriveRecord
        Runs with reversals.
    progress : bool
        Show a progress bar.

    Raises
    ------
    RecordError
        For runs without reversals, with a torque that never changes, or none.
    """
    require_motion(records)
    search = _Search([record.thinned(POINTS) for record in records])
    found = min((search.freed(end) for end in search.begun(progress)[:FREED]), key=_scale)
    if any(each.name == "load_torque" for each in search.channels):
        search.weigh(found.values)
        found = search.freed(found)
    covariance = jackknife(found.rows, found.scores, search.pieces, found.prior)
    names = [p.name for p in search.parameters]
    values = dict(zip(names, found.values.tolist()))
    # The teeth carry the load's friction after a crossing. How far they give then is not seen well where the angle is
    # not known so closely: their stiffness comes out too low by more than residuals show.
    if not any(each.name == "load_angle" for each in search.channels):
        hidden = search.unsure(values["correction"]) * values["stiffness"] / values["load friction"]
        at = names.index("stiffness")
        covariance[at, at] += (hidden / found.problem.unit[at]) ** 2
    return MotorSideFit(
        found.estimates(covariance), search.crossings(found.values), tuple(record.name for record in records)
    )


@dataclass
class _Channel:
    """What a run has measured, and how its errors count."""

    run: int
    name: str  #: of the record's column
    measured: np.ndarray
    error: float  #: that is expected, rad or N m
    window: int = 1  #: samples, over whose means errors count

    @classmethod
    def of(cls, run: int, name: str, record: DriveRecord) -> _Channel:
        """Return a channel of a run; torques count by means, for teeth ring in other phases than the model's."""
        measured = getattr(record, name)
        if name != "load_torque":
            return cls(run, name, measured, _noise(measured))
        return cls(run, name, measured, TORQUE_ERROR * float(np.ptp(measured)), max(1, round(MEANS * record.fs)))


class _Search:
    """Fits to the same runs."""

    def __init__(self, records: Sequence[DriveRecord]) -> None:
        self.records = records
        self.parameters = _parameters(records)
        self.start = {p.name: p.start for p in self.parameters}
        self.reach: np.ndarray | float = 1e-3
        """coordinates, over which differences are taken"""
        self.channels = [
            _Channel.of(i, name, record)
            for name in ("motor_angle", "load_angle", "load_torque")
            for i, record in enumerate(records) if getattr(record, name) is not None
        ]  # fmt: skip
        self.first = [round(SETTLED * record.fs) for record in records]
        way = float(np.mean([np.ptp(record.motor_angle) for record in records]))
        half = 0.5 * max(abs(self.start["spring"]) * way, 1e-12)
        self.lean = [float(np.clip(self.start[f"load of {record.name}"] / half, -1, 1)) for record in records]
        """of each run: 1 where its load always leans on one side of the teeth, -1 on the other"""
        pieces, count = [], 0
        for record, first in zip(records, self.first):
            piece = np.arange(record.motor_angle.size - first) // max(1, round(PIECE * record.fs)) + count
            pieces.append(piece)
            count = int(piece[-1]) + 1
        self.pieces = np.concatenate([_means(pieces[each.run], each.window).astype(int) for each in self.channels])
        """(n_residuals,) piece that each is in"""

    def problem(self, held: Mapping[str, float]) -> Problem:
        """Return the problem with some parameters held at values."""
        parameters = [
            p if p.name not in held else dataclasses.replace(p, start=(v := held[p.name]), low=v, high=v)
            for p in self.parameters
        ]
        loss = UnknownScale(np.flatnonzero(np.diff(self.pieces, prepend=-1)))
        return Problem(parameters, one_by_one(self.residuals), loss=loss, lanes=False, step=self.reach)

    def begun(self, progress: bool) -> list[Solution]:
        """Hold play at several sizes, and the teeth's stiffness, and return what is found, the nearest first."""
        start, ends = self.start, list[Solution]()
        for share in tqdm(PLAYS, desc="play of the drive", unit="fit", disable=not progress):
            held = {"play": float(share) * start["play"], "stiffness": start["stiffness"]}
            starts = [
                {
                    name: 2 * share * start[name]
                    for name, share in zip(
                        ("inertia", "load inertia", "friction", "load friction"),
                        ((1 - part) * size, part * size, 1 - rub, rub),
                    )
                }
                for part in SHARES for rub in RUBS for size in INERTIAS
            ]  # fmt: skip
            if ends:
                starts.append(dict(zip(start, ends[-1].values.tolist())) | held)
            problem = self.problem(held)
            ends.append(solve(problem, [problem.at(each) for each in starts], stop=FIRST))
        return sorted(ends, key=_scale)

    def freed(self, found: Solution) -> Solution:
        """Let go of all that was held."""
        for _ in range(2):
            # Differences over a share of what is not known reach over the kinks of play.
            self.reach = np.clip(0.3 * np.sqrt(np.diag(found.covariance)), 1e-6, 0.1)
            problem = self.problem({})
            found = solve(problem, [problem.at(found.values)], stop=STOP)
        return found

    def residuals(self, values: np.ndarray) -> np.ndarray:
        """Errors (n,) of what is expected, of one channel after the other."""
        return np.concatenate([*self._errors(values)])

    def _errors(self, values: np.ndarray) -> Iterator[np.ndarray]:
        predictions = [self._predicted(i, values) for i in range(len(self.records))]
        named = dict(zip((p.name for p in self.parameters), values))
        for each in self.channels:
            told, teeth, load = predictions[each.run]
            if each.name == "load_angle":
                told = named["ratio"] * load + named["load zero"]
            elif each.name == "load_torque":
                told = teeth / named["ratio"] + named["load torque zero"]
            off = (told - each.measured)[self.first[each.run] :]
            yield _means(off, each.window) / (FAR * each.error)

    def weigh(self, values: np.ndarray) -> None:
        """Take what is usually left of the load's torques for the errors that are expected of them."""
        for each, left in zip(self.channels, [*self._errors(values)]):
            if each.name == "load_torque":
                usual = float(np.median(np.abs(left))) / 0.6745
                each.error *= max(1e-9, FAR * usual)

    def crossings(self, values: np.ndarray) -> int:
        """How often the teeth change sides, once what was before the log is forgotten."""
        count = 0
        for i, first in enumerate(self.first):
            teeth = self._predicted(i, values)[1][first:]
            count += int(np.count_nonzero(np.diff(np.sign(teeth[teeth != 0]))))
        return count

    def unsure(self, correction: float) -> float:
        """Standard deviation of the angle, rad: what is left of noise, and where within a sample something happens."""
        squares = [
            math.sqrt(2) * correction / record.fs * each.error**2 + np.mean(np.diff(_smooth(record)[0]) ** 2) / 12
            for each, record in zip(self.channels, self.records)
        ]
        return float(np.sqrt(np.mean(squares)))

    def _predicted(self, run: int, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        record, common = self.records[run], len(NUMBERS) - 2
        own = np.array([*values[:common], self.lean[run], values[common + run]])
        return predicted(record.motor_angle, record.motor_torque, 1 / record.fs, own, STEPS)


def _means(x: np.ndarray, window: int) -> np.ndarray:
    """Return means over one window after the other, without what is left at the end."""
    return np.asarray(x[: x.size // window * window].reshape(-1, window).mean(axis=1))


def _scale(found: Solution) -> float:
    """How large the errors of a fit are."""
    return float(found.loss.scale(found.residuals))  # type: ignore[attr-defined]


def _noise(x: np.ndarray) -> float:
    """Standard deviation of white noise (rad) on a smooth motion, from its third differences, and of counting."""
    white = float(np.median(np.abs(np.diff(x, 3))) / 0.6745 / math.sqrt(20.0))
    return max(white, quantum(x) / math.sqrt(12)) or 1e-9 * float(np.ptp(x))


def _smooth(record: DriveRecord) -> np.ndarray:
    """Return angle, speed, acceleration and torque (4, n) of parabolas through neighbouring samples."""
    size = 2 * max(2, round(0.5 * SMOOTHED * record.fs)) + 1
    angles = [scipy.signal.savgol_filter(record.motor_angle, size, 2, deriv=k, delta=1 / record.fs) for k in range(3)]
    return np.vstack((*angles, scipy.signal.savgol_filter(record.motor_torque, size, 2)))


def _rigid(records: Sequence[DriveRecord]) -> tuple[dict[str, float], list[float], float]:
    """What a drive without play that is as stiff as can be would have: numbers by name, loads of runs, speed."""
    rows, torques, ones = [], [], []
    for i, record in enumerate(records):
        smooth = _smooth(record)
        rows.append(smooth[:3])
        torques.append(smooth[3])
        ones.append(np.full(record.motor_angle.size, i))
    (x, v, a), torque, run = np.concatenate(rows, axis=1), np.concatenate(torques), np.concatenate(ones)
    speed = float(np.sqrt(np.mean(v**2)))
    sliding = np.abs(v) > SLOW * speed
    x, v, a, torque, run = (each[sliding] for each in (x, v, a, torque, run))
    way, own = np.sign(v), (run == np.arange(len(records))[:, None]).astype(float)
    bounds = np.array([0.0] * 5 + [-np.inf] * (1 + len(records))), np.inf
    side, efficiencies = np.zeros(x.size), np.ones(1)
    efficiency, line = 1.0, np.zeros(len(bounds[0]))
    for _ in range(3):
        least = math.inf
        for share in efficiencies:
            grows = share ** (-way * side)
            table = np.vstack((a, v, way, grows * a, grows * way, grows * x, grows * own))
            scale = np.abs(table).max(axis=1)
            tried = scipy.optimize.lsq_linear((table / scale[:, None]).T, torque, bounds).x / scale
            error = float(np.mean(np.abs(torque - tried @ table)))
            if error < least:
                least, efficiency, line = error, float(share), tried
        # Efficiency shows once it is known which way the load leans.
        side, efficiencies = np.sign(line[5] * x + line[6:] @ own), EFFICIENCIES
    names = "inertia", "damping", "friction", "load inertia", "load friction", "spring"
    return {"efficiency": efficiency} | dict(zip(names, line.tolist())), line[6:].tolist(), speed


def _parameters(records: Sequence[DriveRecord]) -> list[Parameter]:
    """All numbers that are fitted, in the order of `NUMBERS`; sizes are those of the runs."""
    rigid, loads, speed = _rigid(records)
    way = float(np.mean([np.ptp(record.motor_angle) for record in records]))
    moment = float(np.mean([np.ptp(record.motor_torque) for record in records]))
    inertia = max(rigid["inertia"] + rigid["load inertia"], 5e-4 * moment * way / speed**2)
    coulomb = max(rigid["friction"] + rigid["load friction"], 0.01 * moment)

    return [
        positive("inertia", "kg m²", 0.5 * inertia, 3.0),
        positive("load inertia", "kg m²", 0.5 * inertia, 3.0),
        positive("play", "rad", PLAY * way, 4.0),
        positive("stiffness", "N m/rad", 50 * moment / way, 3.0),
        positive("teeth's damping", "N m s/rad", 0.2 * moment / way, 5.0),
        free("efficiency", "", rigid["efficiency"], 0.2, 0.2, 1.0),
        positive("turnover", "rad/s", 0.03 * speed, 4.0),
        free("tail", "", 0.3, 0.5, 0.0, 1.0),
        positive("friction", "N m", 0.5 * coulomb, 4.0),
        positive("width", "rad", 0.01 * way, 3.0),
        positive("load friction", "N m", 0.5 * coulomb, 4.0),
        positive("load width", "rad", 0.005 * way, 4.0),
        free("damping", "N m s/rad", 0.0, 0.1 * moment / speed, 0.0),
        free("load damping", "N m s/rad", 0.0, 0.1 * moment / speed, 0.0),
        free("spring", "N m/rad", rigid["spring"], 0.1 * moment / way),
        positive("correction", "1/s", 20.0, 3.0),
        *(
            free(f"load of {record.name}", "N m", float(start), 0.1 * moment)
            for record, start in zip(records, loads)
        ),
        *_of_load(records),
    ]  # fmt: skip


def _of_load(records: Sequence[DriveRecord]) -> list[Parameter]:
    """Return the ratio, and zeros of what was measured at the load; where there is nothing, none."""
    found = list[Parameter]()
    for channel, unit, zero in (("angle", "rad", "load zero"), ("torque", "N m", "load torque zero")):
        pairs = [(getattr(r, f"motor_{channel}"), getattr(r, f"load_{channel}")) for r in records]
        if measured := [pair for pair in pairs if pair[1] is not None]:
            motor, load = np.concatenate(measured, axis=1)
            slope, offset = np.polyfit(motor, load, 1).tolist()
            # Without losses the torque grows by one over the ratio.
            ratio, start, std = (slope, offset, 0.1) if channel == "angle" else (1 / slope, 0.0, 0.15)
            found += [] if found else [free("ratio", "", ratio, std * abs(ratio))]
            found.append(free(zero, unit, start, 0.1 * float(np.ptp(load))))
    return found
