"""A drive found from logs of its motor alone: play, teeth, efficiency and friction, all in units of the motor."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize
import scipy.signal
from tqdm import tqdm

from ..core.errors import RecordError
from ..estimate import Estimates, Parameter, Problem, Solution, Stop, UnknownScale, jackknife, solve
from .fit import ADVICE
from .record import DriveRecord
from .teeth import NUMBERS, predicted

__all__ = ["MotorSideFit", "fit_motor_side"]

POINTS, FEWER = 10000, 4000  # of a run, means over its samples; in the search from several starts
SETTLED = 0.5  # s, after which what was before the log is forgotten
PIECE = 1.0  # s, of which one after another is left out for intervals
FAR = 5.0  # of the noise, from which on errors count less than by their squares
SMOOTHED = 0.1  # s, over which a parabola is laid for the speeds where the search begins
SLOW = 0.2  # of the usual speed, below which friction may not slide
EFFICIENCIES = np.linspace(0.3, 1.0, 36)
PLAYS = 0.0015 * 1.5 ** np.arange(8)  # of the motion, where searches begin
RUBS = 0.1, 0.25, 0.5  # of friction that is the load's
INERTIAS = 0.3, 1.0, 3.0  # of what they start with
SHARES = 0.3, 0.7  # of inertia that is the load's
FIRST = Stop(steps=6, decrease=0.0, gain=3.0, move=1e-6)
STOP = Stop(steps=40, decrease=0.0, gain=0.2, move=1e-6)


@dataclass(frozen=True, eq=False)
class MotorSideFit:
    """What the motor's side tells of a drive."""

    values: dict[str, float]
    """by name, SI units at the motor"""
    estimates: Estimates
    """of every number that was fitted"""
    runs: tuple[str, ...]
    """names of the runs that it was found from"""

    @property
    def not_told(self) -> tuple[str, ...]:
        """What the runs do not tell, in words, and which motion would."""
        return ()

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, SI units."""
        return {}


class _Search:
    def __init__(self, records: Sequence[DriveRecord], parameters: list[Parameter], steps: int) -> None:
        self.records, self.parameters, self.steps = records, parameters, steps
        at = {p.name: p.start for p in parameters}
        way = np.mean([np.ptp(r.motor_angle) for r in records])
        self.lean = [float(np.clip(2 * at[f"load of {r.name}"] / (at["spring"] * way), -1, 1)) for r in records]
        self.noise = [_noise(record.motor_angle) for record in records]
        self.first = [round(SETTLED * record.fs) for record in records]
        pieces, count = [], 0
        for record, first in zip(records, self.first):
            size = record.motor_angle.size - first
            piece = np.arange(size) // max(1, round(PIECE * record.fs)) + count
            pieces.append(piece)
            count = piece[-1] + 1
        self.pieces = np.concatenate(pieces)
        self.blocks = np.flatnonzero(np.diff(self.pieces, prepend=-1))
        self.problem = Problem(
            parameters, lambda values: np.array([self.residuals(row) for row in values]),
            loss=UnknownScale(self.blocks), lanes=False, step=1e-3,
        )  # fmt: skip

    def residuals(self, values: np.ndarray) -> np.ndarray:
        rows = []
        common = len(NUMBERS) - 2
        for i, (record, noise, first) in enumerate(zip(self.records, self.noise, self.first)):
            own = np.array([*values[:common], self.lean[i], values[common + i]])
            angle, _ = predicted(record.motor_angle, record.motor_torque, 1 / record.fs, own, self.steps)
            rows.append((angle - record.motor_angle)[first:] / (FAR * noise))
        return np.concatenate(rows)


def fit_motor_side(records: Sequence[DriveRecord], progress: bool = False) -> MotorSideFit:
    records = [record.thinned(POINTS) for record in records]
    parameters = _parameters(records)
    start = {p.name: p.start for p in parameters}
    ends = []
    for play in tqdm(PLAYS, desc="play of the drive", unit="fit", disable=not progress):
        held = play * start["play"] / 0.01
        fixed = {"play": held, "stiffness": start["stiffness"]}
        search = _Search(records, [_held(p, fixed[p.name]) if p.name in fixed else p for p in parameters], 4)
        starts = [
            {
                "inertia": 2 * (1 - share) * size * start["inertia"],
                "load inertia": 2 * share * size * start["load inertia"],
                "friction": 2 * (1 - rub) * start["friction"],
                "load friction": 2 * rub * start["load friction"],
            }
            for share in SHARES
            for rub in RUBS
            for size in INERTIAS
        ]
        if ends:
            starts.append(dict(zip(start, ends[-1].values.tolist())) | {"play": held})
        ends.append(solve(search.problem, [search.problem.at(each) for each in starts], stop=FIRST))
    found = min(ends, key=_misfit)
    search = _Search(records, parameters, 8)
    for _ in range(2):
        search.problem.step = np.clip(0.3 * np.sqrt(np.diag(found.covariance)), 1e-6, 0.1)
        found = solve(search.problem, [search.problem.at(found.values)], stop=STOP)
        ends.append(found)
    fine = search
    covariance = jackknife(found.rows, found.scores, fine.pieces, found.prior)
    names = [p.name for p in parameters]
    fit = MotorSideFit(
        dict(zip(names, found.values.tolist())), found.estimates(covariance), tuple(r.name for r in records)
    )
    object.__setattr__(fit, "debug", (ends, found)); object.__setattr__(fit, "info", np.sqrt(np.diag(found.covariance))*found.problem.unit)
    return fit


def _held(parameter: Parameter, value: float) -> Parameter:
    return dataclasses.replace(parameter, start=value, low=value, high=value)


def _misfit(found: Solution) -> float:
    return float(np.mean(2 * (np.sqrt(1 + found.residuals**2) - 1)))


def _noise(x: np.ndarray) -> float:
    return float(np.median(np.abs(np.diff(x, 3))) / 0.6745 / math.sqrt(20.0)) or 1e-9 * float(np.ptp(x))


def _rigid(records: Sequence[DriveRecord]) -> tuple[dict[str, float], list[float], float]:
    """What a drive without play that is as stiff as can be would have: numbers by name, loads of runs, speed."""
    rows, torques, ones = [], [], []
    for i, record in enumerate(records):
        size = 2 * max(2, round(0.5 * SMOOTHED * record.fs)) + 1
        x, v, a = (
            scipy.signal.savgol_filter(record.motor_angle, size, 2, deriv=k, delta=1 / record.fs) for k in range(3)
        )
        rows.append(np.vstack((x, v, a)))
        torques.append(scipy.signal.savgol_filter(record.motor_torque, size, 2))
        ones.append(np.full(x.size, i))
    (x, v, a), torque, run = np.concatenate(rows, axis=1), np.concatenate(torques), np.concatenate(ones)
    speed = float(np.sqrt(np.mean(v**2)))
    sliding = np.abs(v) > SLOW * speed
    x, v, a, torque, run = (each[sliding] for each in (x, v, a, torque, run))
    way, own = np.sign(v), (run == np.arange(len(records))[:, None]).astype(float)
    bounds = np.array([0.0] * 5 + [-np.inf] * (1 + len(records))), np.inf
    side, best = np.zeros(x.size), None
    for _ in range(3):
        tried = []
        for efficiency in EFFICIENCIES if side.any() else (1.0,):
            grows = efficiency ** (-way * side)
            table = np.vstack((a, v, way, grows * a, grows * way, grows * x, grows * own))
            scale = np.abs(table).max(axis=1)
            line = scipy.optimize.lsq_linear((table / scale[:, None]).T, torque, bounds).x / scale
            error = np.mean(np.abs(torque - line @ table))
            tried.append((error, efficiency, line))
        best = min(tried, key=lambda each: each[0])
        side = np.sign(best[2][5] * x + best[2][6:] @ own)
    _, efficiency, line = best
    names = "inertia", "damping", "friction", "load inertia", "load friction", "spring"
    return {"efficiency": efficiency} | dict(zip(names, line.tolist())), line[6:].tolist(), speed


def _parameters(records: Sequence[DriveRecord]) -> list[Parameter]:
    rigid, loads, speed = _rigid(records)
    way = float(np.mean([np.ptp(record.motor_angle) for record in records]))
    moment = float(np.mean([np.ptp(record.motor_torque) for record in records]))
    inertia = max(rigid["inertia"] + rigid["load inertia"], 5e-4 * moment * way / speed**2)
    coulomb = max(rigid["friction"] + rigid["load friction"], 0.01 * moment)

    def positive(name: str, unit: str, start: float, factor: float) -> Parameter:
        return Parameter(name, unit, start, start / factor**4, start * factor**4, math.log(factor))

    def free(
        name: str, unit: str, start: float, std: float, low: float = -math.inf, high: float = math.inf
    ) -> Parameter:
        return Parameter(name, unit, start, max(low, start - 6 * std), min(high, start + 6 * std), std, "linear")

    return [
        positive("inertia", "kg m²", 0.5 * inertia, 3.0),
        positive("load inertia", "kg m²", 0.5 * inertia, 3.0),
        positive("play", "rad", 0.01 * way, 4.0),
        positive("stiffness", "N m/rad", 50 * moment / way, 5.0),
        positive("teeth's damping", "N m s/rad", 0.2 * moment / way, 6.0),
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
            free(f"load of {record.name}", "N m", start, 0.1 * moment)
            for record, start in zip(records, loads)
        ),
    ]  # fmt: skip
