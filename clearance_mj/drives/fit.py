"""Identification of a drive from runs measured at both ends: parts are accepted one by one, by their evidence."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from tqdm import tqdm

from ..core.errors import RecordError
from ..estimate import Estimates, Parameter, Problem, Solution, StoppingCriteria, UnknownScale, log_evidence, solve
from ..estimate.covariance import jackknife, student_widening
from .drive import Drive, PreslidingFriction, Strand
from .record import DriveRecord

__all__ = ["PARTS", "DriveFit", "fit_drive"]

POINTS = 1000  # per run at most, after averaging neighbouring samples
BLOCKS = 4  # per run, within which errors may be correlated
PIECES = 4  # of all runs at least, for the jackknife of intervals: whole runs, since model errors repeat in each
UNEXPLAINED = 0.25  # RMS error over standard deviation of the load's torque, above which the model does not fit
EVIDENCE = 5.0  # least gain of log evidence for which a part is accepted
MOST = 20  # parameters at most
FAR = 5.0  # times the RMS error, beyond which the loss grows more slowly than the square
STARTS = (0.2, 0.5), (1.0, 3.0), (4.0, 0.5)  # factors on Coulomb and capstan friction at the start of the search
STOP = StoppingCriteria(steps=40)

PARTS: dict[str, tuple[str, ...]] = {
    "second strand": ("second coulomb", "second share"),
    "damping": ("damping",),
    "inertia": ("inertia",),
    "entrance compliance": ("entrance compliance",),
    "growing compliance": ("compliance growth",),
    "backlash": ("backlash", "backlash torque"),
    "curvature": ("curvature",),
}
"""Optional parts of a drive, besides ratio, compliance, play, a spring and friction, and the parameters of each"""

ADVICE = {
    "inertia": "a faster motion would tell it",
    "damping": "motions of clearly different speed would tell it",
    "capstan": "reversals under loads of different size would tell it",
    "coulomb": "a reversal with hardly any load would tell it",
    "compliance": "a locked output, or loads of different size at one angle, would tell it",
    "efficiency": "a torque sensor at the load that is calibrated would tell it",
    "stiffness": "a slow ramp over the whole range without load would tell it",
}
"""Motions that would identify a parameter which the runs do not"""


@dataclass(frozen=True, eq=False)
class DriveFit:
    """A drive identified from runs, with its estimates and the parts that were accepted."""

    drive: Drive
    """with the estimated values"""
    estimates: Estimates
    """of every fitted parameter"""
    parts: tuple[str, ...]
    """of `PARTS`, in the order in which they were accepted"""
    gains: tuple[float, ...]
    """gain of log evidence of each part"""
    runs: tuple[str, ...]
    """names of the runs"""
    largest_torque: float
    """N m at the load, in these runs"""
    unexplained: float = 0.0
    """RMS error of the load's torque over its standard deviation"""

    @property
    def not_told(self) -> tuple[str, ...]:
        """Sentences that name each unidentified parameter and the motion that would identify it."""
        unidentified = in_words(self.estimates.only_prior, ADVICE)
        if self.unexplained < UNEXPLAINED:
            return unidentified
        return (
            f"efficiency, stiffness, friction and play are not told by these runs: the drive leaves "
            f"{self.unexplained:.0%} of the load's torque unexplained, as of motion so fast that inertia and rattling "
            "count; slower runs would tell, or physical.identification.fit_model, which has both",
            *unidentified,
        )

    def table(self) -> dict[str, float]:
        """Return the data of a gear catalogue, at the load's end.

        Lost motion, hysteresis and stiffness are those of the load's angle with the motor held, while its torque goes
        to the largest and back: between the centres of both branches at ± 3 % of it, between both branches at zero
        torque, and from half of the torque on. "lost in reversals" is the load's loss when the motor reverses unloaded.
        """
        d, largest = self.drive, self.largest_torque
        torque, angle = d.hysteresis(largest)
        levels = np.array([-0.03, 0.0, 0.03, 0.5, 1.0]) * largest
        branches = []
        for direction in (np.gradient(torque) > 0, np.gradient(torque) < 0):
            order = np.argsort(torque[direction])
            branches.append(np.interp(levels, torque[direction][order], angle[direction][order]))
        centre, width = np.mean(branches, axis=0), abs(branches[0] - branches[1])
        coulomb = sum(s.share * s.coulomb for s in d.strands) * d.efficiency / abs(d.ratio)
        table = {
            "ratio": d.ratio,
            "lost motion at 3 % of the torque, rad": abs(centre[2] - centre[0]),
            "hysteresis without torque, rad": width[1],
            "lost in reversals, rad": 2 * abs(d.ratio) * d.friction.lost_motion,
            "stiffness from half to full torque, N m/rad": 0.5 * largest / abs(branches[0][4] - branches[0][3]),
            "friction without load, N m": coulomb,
            "efficiency of driving": d.efficiency * math.exp(-d.capstan),
        }
        return {name: float(value) for name, value in table.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, SI units."""
        return {
            "drive": dataclasses.asdict(self.drive), "parts": dict(zip(self.parts, self.gains)),
            "estimates": self.estimates.rows(), "runs": list(self.runs),
            "table": self.table(), "not_told": list(self.not_told),
        }  # fmt: skip


def fit_drive(
    records: Sequence[DriveRecord], parts: Sequence[str] | None = None, most: int = MOST, progress: bool = False
) -> DriveFit:
    """Identify a drive from runs measured at both of its ends.

    The first model is a ratio with elasticity and friction in its transmission. Parts are added one after another, that
    with the largest evidence first, while the evidence grows by more than a threshold.

    Parameters
    ----------
    records : sequence of DriveRecord
        Runs of both ends, with reversals.
    parts : sequence of str, optional
        Of `PARTS`; by default those that the evidence supports.
    most : int
        Largest number of parameters.
    progress : bool
        Show progress bars.

    Raises
    ------
    RecordError
        For runs of one end alone, without reversals, or none.
    """
    _require(records)
    if parts and (unknown := set(parts) - set(PARTS)):
        raise RecordError(f'part "{min(unknown)}" is unknown; known: {", ".join(PARTS)}')
    search = _DriveSearch([record.thinned(POINTS) for record in records])
    accepted, gains = list(parts or ()), [math.nan] * len(parts or ())
    solution = search.fit_base()
    with tqdm(desc="parts of the drive", unit="fit", disable=not progress) as bar:
        while parts is None:
            search.rescale(solution)
            start = named_values(solution)
            solution, candidates = search.fit(accepted, start), {}
            for part in PARTS:
                if part not in accepted and solution.problem.size + len(PARTS[part]) <= most:
                    candidates[part] = search.fit((*accepted, part), start)
                    bar.update()
            if not candidates:
                break
            # The errors of the best fit give the number of samples per independent observation, for all fits.
            divisor = min(candidates.values(), key=lambda fit: fit.cost * fit.loss.divisor).loss.divisor
            best = max(candidates, key=lambda part: _evidence(candidates[part], divisor))
            gain = _evidence(candidates[best], divisor) - _evidence(solution, divisor)
            if gain < EVIDENCE:
                break
            solution = candidates[best]
            accepted.append(best)
            gains.append(gain)
    search.rescale(solution)
    solution = search.fit(accepted, named_values(solution))
    covariance = jackknife(solution.rows, solution.scores, search.pieces, solution.prior)
    covariance *= student_widening(np.unique(search.pieces).size) ** 2
    drive = drive_of_values(named_values(solution))
    load = np.concatenate([record.load_torque for record in search.records])
    unexplained = np.sqrt(np.mean([drive.errors(record)[1] ** 2 for record in search.records])) / np.std(load)
    largest = max(float(np.abs(record.load_torque).max()) for record in records)  # type: ignore[arg-type]
    return DriveFit(
        drive, solution.estimates(covariance), tuple(accepted), tuple(gains),
        tuple(record.name for record in records), largest, float(unexplained),
    )  # fmt: skip


def drive_of_values(values: Mapping[str, float]) -> Drive:
    """Return the drive with these parameter values.

    Parameters
    ----------
    values : mapping of str to float
        As `DriveFit.estimates` names them.
    """
    second = values.get("second share", 0.0)
    strands = [Strand(1 - second, values["coulomb"])]
    if second:
        strands.append(Strand(second, values["second coulomb"]))
    friction = PreslidingFriction(values["width"], values["friction"], values["lost motion"])
    arguments: dict[str, Any] = {name.replace(" ", "_"): value for name, value in values.items()}
    fields = {f.name: arguments[f.name] for f in dataclasses.fields(Drive) if f.name in arguments}
    return Drive(**fields | {"strands": tuple(strands), "friction": friction})


class _DriveSearch:
    """Fits of drives with different parts to the same runs."""

    def __init__(self, records: Sequence[DriveRecord]) -> None:
        self.records = records
        x, torque, angle, load = (
            np.concatenate([getattr(record, name) for record in records])
            for name in ("motor_angle", "motor_torque", "load_angle", "load_torque")
        )
        ratio, zero = np.polyfit(x, angle, 1)
        self.rms = np.array([np.std(angle - ratio * x - zero), np.std(load)])
        """rad and N m, expected RMS errors of the load's angle and torque"""
        self.parameters = {p.name: p for p in _parameters(float(ratio), float(zero), x, torque, load)}
        n = -(-PIECES // len(records))  # per run
        pieces = [np.arange(r.motor_angle.size) * n // r.motor_angle.size + n * i for i, r in enumerate(records)]
        self.pieces = np.concatenate([piece for numbers in pieces for piece in (numbers, numbers)])
        """(n_residuals,) number of the piece that each residual belongs to"""
        sizes = [record.motor_angle.size for record in records for _ in range(2)]
        self.blocks = np.concatenate(
            [first + np.arange(BLOCKS) * size // BLOCKS for first, size in zip(np.cumsum([0, *sizes]), sizes)]
        )

    def fit_base(self) -> Solution:
        """Fit the drive without optional parts, from several sizes of its friction."""
        coulomb, capstan = self.parameters["coulomb"].start, self.parameters["capstan"].start
        starts = [{"coulomb": c * coulomb, "capstan": m * capstan} for c, m in STARTS]
        return min((self.fit((), start) for start in starts), key=lambda fit: fit.cost * fit.loss.divisor)

    def fit(self, parts: Sequence[str], start: Mapping[str, float]) -> Solution:
        """Fit a drive with optional parts, from start values by name."""
        optional = {name for names in PARTS.values() for name in names}
        selected = {name for part in parts for name in PARTS[part]}
        parameters = [p for name, p in self.parameters.items() if name in selected or name not in optional]
        names = [p.name for p in parameters]

        def residuals(values: np.ndarray) -> np.ndarray:
            return np.array([self.residuals(drive_of_values(dict(zip(names, row)))) for row in values.tolist()])

        problem = Problem(parameters, residuals, loss=UnknownScale(self.blocks, POINTS), lanes=False)
        return solve(problem, [problem.at(start)], stop=STOP)

    def residuals(self, drive: Drive) -> np.ndarray:
        """Return scaled errors (n,) of angle and torque, run by run."""
        rows = []
        for record in self.records:
            for measured, model, size in zip((record.load_angle, record.load_torque), drive.follow(record), self.rms):
                rows.append((model - measured) / (FAR * size))
        return np.concatenate(rows)

    def rescale(self, solution: Solution) -> None:
        """Set the expected RMS errors to those of a fit."""
        drive = drive_of_values(named_values(solution))
        self.rms = np.sqrt(np.mean(np.square([drive.errors(record) for record in self.records]), axis=0))


def named_values(solution: Solution) -> dict[str, float]:
    """Return the values of a solution by the names of its parameters."""
    return dict(zip((p.name for p in solution.problem.parameters), solution.values.tolist()))


def _evidence(solution: Solution, divisor: float) -> float:
    loss = dataclasses.replace(cast(UnknownScale, solution.loss), correlated=divisor)
    return log_evidence(float(loss.cost(solution.residuals[None])[0]), solution.at, solution.information / divisor)


def positive(name: str, unit: str, start: float, factor: float) -> Parameter:
    """Return a parameter > 0 with a log-normal prior: known up to a factor."""
    return Parameter(name, unit, start, start / factor**4, start * factor**4, math.log(factor))


def free(name: str, unit: str, start: float, std: float, low: float = -math.inf, high: float = math.inf) -> Parameter:
    """Return a parameter with a normal prior, and bounds."""
    return Parameter(name, unit, start, max(low, start - 6 * std), min(high, start + 6 * std), std, "linear")


def in_words(names: Iterable[str], advice: Mapping[str, str]) -> tuple[str, ...]:
    """Return a sentence per unidentified parameter, with the motion that would identify it."""
    lines = ((name, next((f"; {words}" for part, words in advice.items() if part in name), "")) for name in names)
    return tuple(f"{name} is not told by these runs{words}" for name, words in lines)


def _parameters(ratio: float, zero: float, x: np.ndarray, torque: np.ndarray, load: np.ndarray) -> list[Parameter]:
    """Return all parameters that a drive may have; priors are scaled to the runs."""
    stroke, torque_range, load_range = float(np.ptp(x)), float(np.ptp(torque)), float(np.ptp(load))
    efficiency = min(2.0, max(0.05, load_range * abs(ratio) / torque_range))
    compliance = 0.1 * stroke / torque_range
    bound = 10 * torque_range

    return [
        free("ratio", "", ratio, 0.2 * abs(ratio)),
        free("zero", "rad", zero, 0.2 * stroke * abs(ratio)),
        free("compliance", "rad/(N m)", compliance, 2 * compliance, 0.0),
        positive("coulomb", "N m", 0.1 * torque_range, 4.0),
        free("capstan", "", 0.1, 0.2, 0.0, 3.0),
        positive("efficiency", "", efficiency, 1.5),
        free("torque zero", "N m", float(np.mean(torque)), 0.3 * torque_range, -bound, bound),
        free("stiffness", "N m/rad", 0.0, 0.2 * torque_range / stroke),
        free("damping", "N m s/rad", 0.0, 0.1 * torque_range / stroke, 0.0),
        free("inertia", "kg m²", 0.0, 0.01 * torque_range / stroke, 0.0),
        positive("width", "rad", 0.03 * stroke, 3.0),
        free("friction", "N m", 0.0, 0.1 * torque_range, 0.0),
        free("lost motion", "rad", 0.0, 0.03 * stroke, 0.0),
        positive("second coulomb", "N m", 0.2 * torque_range, 4.0),
        free("second share", "", 0.5, 0.25, 0.0, 1.0),
        free("entrance compliance", "rad/(N m)", 0.0, compliance, 0.0),
        free("compliance growth", "1/rad", 0.0, 0.5 / stroke),
        free("backlash", "rad", 0.0, 0.03 * stroke, 0.0),
        positive("backlash torque", "N m", 0.03 * torque_range, 3.0),
        free("curvature", "1/rad", 0.0, 0.1 / stroke),
    ]  # fmt: skip


def require_motion(records: Sequence[DriveRecord]) -> None:
    """Raise RecordError without runs, or for one whose motor never turns back or whose torque never changes.

    Parameters
    ----------
    records : sequence of DriveRecord
        The runs.
    """
    if not records:
        raise RecordError("a drive is found from one run at least")
    for record in records:
        if not np.ptp(record.motor_torque):
            raise RecordError(f'run "{record.name}": the motor\'s torque never changes; it says nothing of a drive')
        if not record.reversals:
            raise RecordError(f'run "{record.name}": the motor never turns back; play and friction show in reversals')


def _require(records: Sequence[DriveRecord]) -> None:
    for record in records:
        if not record.both_ends:
            raise RecordError(
                f'run "{record.name}" has the motor\'s end only; a drive is found from angle and torque of both ends'
            )
    require_motion(records)
    # Summed over runs: a single run that ends with its springs loaded may return more work than it received.
    if (lost := sum(record.lost_work for record in records)) < 0:
        names = f'run "{records[0].name}"' if len(records) == 1 else f"{len(records)} runs together"
        raise RecordError(
            f"{names}: the drive gives {-lost:.3g} J more than it gets; a torque or an angle counts the other way round"
        )
