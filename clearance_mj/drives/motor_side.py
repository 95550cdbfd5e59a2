"""Identification of a drive from logs of its motor, with or without the load's angle or torque."""

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

from ..estimate import Estimates, Parameter, Problem, Solution, StoppingCriteria, UnknownScale, one_by_one, solve
from ..estimate.covariance import jackknife
from ..estimate.estimates import UNIDENTIFIED
from ..physical.identification.record import quantum
from .fit import ADVICE, free, in_words, named_values, positive, require_motion
from .record import DriveRecord, window_means
from .teeth import NUMBERS, predict_teeth

__all__ = ["MotorSideFit", "fit_motor_side"]

POINTS = 10000  # per run at most, after averaging neighbouring samples
STEPS = 4  # of the integration between samples
SETTLED = 0.5  # s, after which the initial state no longer matters
PIECE = 1.0  # s, within which errors may be correlated: pieces of the jackknife
TORQUE_ERROR = 0.01  # of its range, expected error of averaged load torque: efficiency turns over
FAR = 5.0  # times the noise, beyond which the loss grows more slowly than the square
SMOOTHED = 0.1  # s, window of the parabolas that give start values of speeds
MEANS = 0.1  # s, averaging window of the load's torque
SLOW = 0.2  # of the RMS speed, below which friction may stick
EFFICIENCIES = np.linspace(0.3, 1.0, 36)  # start values
PLAY = 0.01  # of the stroke, expected
PLAYS = 0.2 * 1.7 ** np.arange(6)  # times that, each fixed once while all else is fitted
FREED = 2  # best of these fits, from which all parameters are fitted
RUBS = 0.1, 0.25, 0.5  # load's fraction of the friction, start values
SHARES = 0.3, 0.7  # load's fraction of the inertia, start values
INERTIAS = 0.3, 1.0, 3.0  # times the inertia of the rigid fit, start values
FIRST = StoppingCriteria(steps=6, decrease=0.0, gain=3.0, move=1e-6)
STOP = StoppingCriteria(steps=40, decrease=0.0, gain=0.2, move=1e-6)

WORDS = ADVICE | {
    "play": "a reversal without load would tell it",
    "stiffness": "a finer encoder and faster sampling would tell it: how far the teeth give is hidden",
    "efficiency": "motion to and fro under loads of different size would tell it",
    "friction": "reversals under loads of different size, one of them none, would tell it",
    "turnover": "slow reversals under load would tell it",
}
"""Motions that would identify a parameter which the motor's side does not"""

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
"""Names in tables, of parameters whose short names are not clear"""


@dataclass(frozen=True, eq=False)
class MotorSideFit:
    """A drive identified from logs of its motor, in the motor's units: the ratio does not show there."""

    estimates: Estimates
    """of every fitted parameter"""
    crossings: int
    """number of tooth crossings in all runs"""
    runs: tuple[str, ...]
    """names of the runs"""

    @property
    def values(self) -> dict[str, float]:
        """All parameters by name, SI units at the motor.

        Play is to either side. Spring and loads are those that the motor feels through the elastic teeth.
        """
        return dict(zip(self.estimates.names, self.estimates.value.tolist()))

    @property
    def not_told(self) -> tuple[str, ...]:
        """Sentences that name each unidentified parameter and the motion that would identify it."""
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
    """Identify a drive from logs of its motor, and of the load's angle or torque where they have it.

    The load hangs behind play and elastic teeth (`teeth.predict_teeth`). Play is fixed at several sizes while all else
    is fitted, since fits that free it too early end in wrong minima; then all parameters are fitted, from the best two.
    Where runs have the load's angle or torque, they are compared with those of the load behind the teeth.

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
    search = _MotorSideSearch([record.thinned(POINTS) for record in records])
    solution = min((search.fit_all(start) for start in search.fit_fixed_play(progress)[:FREED]), key=_scale)
    if any(channel.name == "load_torque" for channel in search.channels):
        search.rescale_torque(solution.values)
        solution = search.fit_all(solution)
    covariance = jackknife(solution.rows, solution.scores, search.pieces, solution.prior)
    values = named_values(solution)
    # After a crossing the teeth carry the load's friction. Their deflection is then below the angle's uncertainty, so
    # that the bias of their stiffness exceeds what residuals show.
    if not any(channel.name == "load_angle" for channel in search.channels):
        uncertainty = search.angle_std(values["correction"]) * values["stiffness"] / values["load friction"]
        row = [*values].index("stiffness")
        covariance[row, row] += (uncertainty / solution.problem.unit[row]) ** 2
    runs = tuple(record.name for record in records)
    return MotorSideFit(solution.estimates(covariance), search.crossings(solution.values), runs)


@dataclass
class _Channel:
    """A measured channel of a run, and the weight of its errors."""

    run: int
    name: str  #: of the record's column
    measured: np.ndarray
    error: float  #: expected, rad or N m
    window: int = 1  #: samples per averaged error

    @classmethod
    def of(cls, run: int, name: str, record: DriveRecord) -> _Channel:
        """Return a channel of a run; torques are averaged, since teeth ring in other phases than the model's."""
        measured = getattr(record, name)
        if name != "load_torque":
            return cls(run, name, measured, _noise(measured))
        return cls(run, name, measured, TORQUE_ERROR * float(np.ptp(measured)), max(1, round(MEANS * record.fs)))


class _MotorSideSearch:
    """Fits of the same model to the same runs, with some parameters fixed."""

    def __init__(self, records: Sequence[DriveRecord]) -> None:
        self.records = records
        self.parameters = _parameters(records)
        self.start = {p.name: p.start for p in self.parameters}
        self.difference_step: np.ndarray | float = 1e-3
        """of the difference quotients, in the problem's coordinates"""
        self.channels = [
            _Channel.of(i, name, record)
            for name in ("motor_angle", "load_angle", "load_torque")
            for i, record in enumerate(records) if getattr(record, name) is not None
        ]  # fmt: skip
        self.first = [round(SETTLED * record.fs) for record in records]
        stroke = float(np.mean([np.ptp(record.motor_angle) for record in records]))
        half_range = 0.5 * max(abs(self.start["spring"]) * stroke, 1e-12)
        self.lean = [float(np.clip(self.start[f"load of {record.name}"] / half_range, -1, 1)) for record in records]
        """of each run: 1 where its load always pushes on one flank of the teeth, -1 on the other"""
        pieces, count = [], 0
        for record, first in zip(records, self.first):
            piece = np.arange(record.motor_angle.size - first) // max(1, round(PIECE * record.fs)) + count
            pieces.append(piece)
            count = int(piece[-1]) + 1
        self.pieces = np.concatenate([window_means(pieces[c.run], c.window).astype(int) for c in self.channels])
        """(n_residuals,) number of the piece that each residual belongs to"""

    def problem(self, fixed: Mapping[str, float]) -> Problem:
        """Return the problem with some parameters fixed at values."""
        parameters = [
            p if p.name not in fixed else dataclasses.replace(p, start=(v := fixed[p.name]), low=v, high=v)
            for p in self.parameters
        ]
        loss = UnknownScale(np.flatnonzero(np.diff(self.pieces, prepend=-1)))
        return Problem(parameters, one_by_one(self.residuals), loss=loss, lanes=False, step=self.difference_step)

    def fit_fixed_play(self, progress: bool) -> list[Solution]:
        """Fit all but the teeth's stiffness and play, which is fixed at several sizes; the best fit is first."""
        start, solutions = self.start, list[Solution]()
        for factor in tqdm(PLAYS, desc="play of the drive", unit="fit", disable=not progress):
            fixed = {"play": float(factor) * start["play"], "stiffness": start["stiffness"]}
            starts = [
                {"inertia": 2 * (1 - load_part) * size * start["inertia"],
                 "load inertia": 2 * load_part * size * start["load inertia"],
                 "friction": 2 * (1 - friction_part) * start["friction"],
                 "load friction": 2 * friction_part * start["load friction"]}
                for load_part in SHARES for friction_part in RUBS for size in INERTIAS
            ]  # fmt: skip
            if solutions:
                starts.append(named_values(solutions[-1]) | fixed)
            problem = self.problem(fixed)
            solutions.append(solve(problem, [problem.at(values) for values in starts], stop=FIRST))
        return sorted(solutions, key=_scale)

    def fit_all(self, solution: Solution) -> Solution:
        """Fit all parameters, from a solution with some of them fixed."""
        for _ in range(2):
            # Differences over a fraction of the standard deviation span the kinks of play.
            self.difference_step = np.clip(0.3 * np.sqrt(np.diag(solution.covariance)), 1e-6, 0.1)
            problem = self.problem({})
            solution = solve(problem, [problem.at(solution.values)], stop=STOP)
        return solution

    def residuals(self, values: np.ndarray) -> np.ndarray:
        """Return scaled prediction errors (n,), of one channel after the other."""
        return np.concatenate([*self._errors(values)])

    def _errors(self, values: np.ndarray) -> Iterator[np.ndarray]:
        predictions = [self._predict(i, values) for i in range(len(self.records))]
        parameters = dict(zip((p.name for p in self.parameters), values))
        for channel in self.channels:
            model, teeth, load = predictions[channel.run]
            if channel.name == "load_angle":
                model = parameters["ratio"] * load + parameters["load zero"]
            elif channel.name == "load_torque":
                model = teeth / parameters["ratio"] + parameters["load torque zero"]
            error = (model - channel.measured)[self.first[channel.run] :]
            yield window_means(error, channel.window) / (FAR * channel.error)

    def rescale_torque(self, values: np.ndarray) -> None:
        """Set the expected errors of the load's torques to the median of their residuals."""
        for channel, residual in zip(self.channels, [*self._errors(values)]):
            if channel.name == "load_torque":
                scale = float(np.median(np.abs(residual))) / 0.6745
                channel.error *= max(1e-9, FAR * scale)

    def crossings(self, values: np.ndarray) -> int:
        """Return the number of tooth crossings after the initial transient."""
        torques = (self._predict(i, values)[1][first:] for i, first in enumerate(self.first))
        return sum(int(np.count_nonzero(np.diff(np.sign(teeth[teeth != 0])))) for teeth in torques)

    def angle_std(self, correction: float) -> float:
        """Return the standard deviation of the angle, rad: of filtered noise, and of motion within a sample."""
        variances = [
            math.sqrt(2) * correction / record.fs * channel.error**2 + np.mean(np.diff(_smooth(record)[0]) ** 2) / 12
            for channel, record in zip(self.channels, self.records)
        ]
        return float(np.sqrt(np.mean(variances)))

    def _predict(self, run: int, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        record, common = self.records[run], len(NUMBERS) - 2
        parameters = np.array([*values[:common], self.lean[run], values[common + run]])
        return predict_teeth(record.motor_angle, record.motor_torque, 1 / record.fs, parameters, STEPS)


def _scale(solution: Solution) -> float:
    """Return the scale of the errors of a fit."""
    return float(solution.loss.scale(solution.residuals))  # type: ignore[attr-defined]


def _noise(x: np.ndarray) -> float:
    """Return the standard deviation (rad) of white noise, from third differences, or of quantization if larger."""
    white = float(np.median(np.abs(np.diff(x, 3))) / 0.6745 / math.sqrt(20.0))
    return max(white, quantum(x) / math.sqrt(12)) or 1e-9 * float(np.ptp(x))


def _smooth(record: DriveRecord) -> np.ndarray:
    """Return angle, speed, acceleration and torque (4, n), smoothed by local parabolas."""
    size = 2 * max(2, round(0.5 * SMOOTHED * record.fs)) + 1
    angles = [scipy.signal.savgol_filter(record.motor_angle, size, 2, deriv=k, delta=1 / record.fs) for k in range(3)]
    return np.vstack((*angles, scipy.signal.savgol_filter(record.motor_torque, size, 2)))


def _fit_rigid(records: Sequence[DriveRecord]) -> tuple[dict[str, float], list[float], float]:
    """Fit a rigid drive without play; return its parameters by name, the loads of runs and the RMS speed."""
    x, v, a, torque = np.concatenate([_smooth(record) for record in records], axis=1)
    run = np.repeat(np.arange(len(records)), [record.motor_angle.size for record in records])
    speed = float(np.sqrt(np.mean(v**2)))
    sliding = np.abs(v) > SLOW * speed
    x, v, a, torque, run = (values[sliding] for values in (x, v, a, torque, run))
    direction, in_run = np.sign(v), (run == np.arange(len(records))[:, None]).astype(float)
    bounds = np.array([0.0] * 5 + [-np.inf] * (1 + len(records))), np.inf
    side, efficiencies = np.zeros(x.size), np.ones(1)
    efficiency, best = 1.0, np.zeros(len(bounds[0]))
    for _ in range(3):
        least_error = math.inf
        for trial in efficiencies:
            factor = trial ** (-direction * side)
            terms = np.vstack((a, v, direction, factor * a, factor * direction, factor * x, factor * in_run))
            scale = np.abs(terms).max(axis=1)
            coefficients = scipy.optimize.lsq_linear((terms / scale[:, None]).T, torque, bounds).x / scale
            error = float(np.mean(np.abs(torque - coefficients @ terms)))
            if error < least_error:
                least_error, efficiency, best = error, float(trial), coefficients
        # Efficiency can be fitted once the sign of the load is known.
        side, efficiencies = np.sign(best[5] * x + best[6:] @ in_run), EFFICIENCIES
    names = "inertia", "damping", "friction", "load inertia", "load friction", "spring"
    return {"efficiency": efficiency} | dict(zip(names, best.tolist())), best[6:].tolist(), speed


def _parameters(records: Sequence[DriveRecord]) -> list[Parameter]:
    """Return all parameters, in the order of `NUMBERS`; priors are scaled to the runs."""
    rigid, loads, speed = _fit_rigid(records)
    stroke = float(np.mean([np.ptp(record.motor_angle) for record in records]))
    torque_range = float(np.mean([np.ptp(record.motor_torque) for record in records]))
    inertia = max(rigid["inertia"] + rigid["load inertia"], 5e-4 * torque_range * stroke / speed**2)
    coulomb = max(rigid["friction"] + rigid["load friction"], 0.01 * torque_range)

    return [
        positive("inertia", "kg m²", 0.5 * inertia, 3.0),
        positive("load inertia", "kg m²", 0.5 * inertia, 3.0),
        positive("play", "rad", PLAY * stroke, 4.0),
        positive("stiffness", "N m/rad", 50 * torque_range / stroke, 3.0),
        positive("teeth's damping", "N m s/rad", 0.2 * torque_range / stroke, 5.0),
        free("efficiency", "", rigid["efficiency"], 0.2, 0.2, 1.0),
        positive("turnover", "rad/s", 0.03 * speed, 4.0),
        free("tail", "", 0.3, 0.5, 0.0, 1.0),
        positive("friction", "N m", 0.5 * coulomb, 4.0),
        positive("width", "rad", 0.01 * stroke, 3.0),
        positive("load friction", "N m", 0.5 * coulomb, 4.0),
        positive("load width", "rad", 0.005 * stroke, 4.0),
        free("damping", "N m s/rad", 0.0, 0.1 * torque_range / speed, 0.0),
        free("load damping", "N m s/rad", 0.0, 0.1 * torque_range / speed, 0.0),
        free("spring", "N m/rad", rigid["spring"], 0.1 * torque_range / stroke),
        positive("correction", "1/s", 20.0, 3.0),
        *(
            free(f"load of {record.name}", "N m", float(start), 0.1 * torque_range)
            for record, start in zip(records, loads)
        ),
        *_load_parameters(records),
    ]  # fmt: skip


def _load_parameters(records: Sequence[DriveRecord]) -> list[Parameter]:
    """Return the ratio, and the offset of each channel measured at the load; [] if there is none."""
    parameters = list[Parameter]()
    for channel, unit, zero in (("angle", "rad", "load zero"), ("torque", "N m", "load torque zero")):
        pairs = [(getattr(r, f"motor_{channel}"), getattr(r, f"load_{channel}")) for r in records]
        if measured := [pair for pair in pairs if pair[1] is not None]:
            motor, load = np.concatenate(measured, axis=1)
            slope, offset = np.polyfit(motor, load, 1).tolist()
            # Without losses the torque grows by one over the ratio.
            ratio, start, std = (slope, offset, 0.1) if channel == "angle" else (1 / slope, 0.0, 0.15)
            parameters += [] if parameters else [free("ratio", "", ratio, std * abs(ratio))]
            parameters.append(free(zero, unit, start, 0.1 * float(np.ptp(load))))
    return parameters
