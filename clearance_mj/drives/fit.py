"""A drive found from runs that measured both of its ends: a chain of parts, each accepted by its evidence."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from tqdm import tqdm

from ..core.errors import RecordError
from ..estimate import Estimates, Parameter, Problem, Solution, Stop, UnknownScale, log_evidence, solve
from ..estimate.covariance import jackknife, student_widening
from .drive import Drive, PreslidingFriction, Strand
from .record import DriveRecord

__all__ = ["PARTS", "DriveFit", "fit_drive"]

POINTS = 1000  # of a run, means over its samples
BLOCKS = 4  # of a run, within which errors may be correlated
PIECES = 4  # at least, of which one after another is left out for intervals: whole runs, for errors of a law repeat
UNEXPLAINED = 0.25  # of the load's torque, from which on the chain is not what the runs show
EVIDENCE = 5.0  # by which a part must raise the logarithm of the evidence
MOST = 20  # parameters
FAR = 5.0  # of the errors' RMS, from which on they count less than by their squares
STARTS = (0.2, 0.5), (1.0, 3.0), (4.0, 0.5)  # of friction's sizes, where searches begin
STOP = Stop(steps=40)

PARTS: dict[str, tuple[str, ...]] = {
    "second strand": ("second coulomb", "second share"),
    "damping": ("damping",),
    "inertia": ("inertia",),
    "entrance compliance": ("entrance compliance",),
    "growing compliance": ("compliance growth",),
    "backlash": ("backlash", "backlash torque"),
    "curvature": ("curvature",),
}
"""What a drive may have beside ratio, compliance, play, a spring and friction, and the parameters of each"""

ADVICE = {
    "inertia": "a faster motion would tell it",
    "damping": "motions of clearly different speed would tell it",
    "capstan": "reversals under loads of different size would tell it",
    "coulomb": "a reversal with hardly any load would tell it",
    "compliance": "a locked output, or loads of different size at one angle, would tell it",
    "efficiency": "a torque sensor at the load that is calibrated would tell it",
    "stiffness": "a slow ramp over the whole range without load would tell it",
}
"""Which motion would tell a parameter that runs do not"""


@dataclass(frozen=True, eq=False)
class DriveFit:
    """A drive as runs have it."""

    drive: Drive
    """with the values that were found"""
    estimates: Estimates
    """of every number that was fitted"""
    parts: tuple[str, ...]
    """that were accepted, of `PARTS`, in that order"""
    gains: tuple[float, ...]
    """by which each raised the logarithm of the evidence"""
    runs: tuple[str, ...]
    """names of the runs that it was found from"""
    largest_torque: float
    """N m of the load, in these"""
    unexplained: float = 0.0
    """RMS error of the load's torque, as a share of its standard deviation"""

    @property
    def not_told(self) -> tuple[str, ...]:
        """What the runs do not tell, in words, and which motion would."""
        told = in_words(self.estimates.only_prior, ADVICE)
        if self.unexplained < UNEXPLAINED:
            return told
        return (
            f"efficiency, stiffness, friction and play are not told by these runs: the drive leaves "
            f"{self.unexplained:.0%} of the load's torque unexplained, as of motion so fast that inertia and rattling "
            "count; slower runs would tell, or physical.identification.fit_model, which has both",
            *told,
        )

    def table(self) -> dict[str, float]:
        """Return what a catalogue of gears says, seen at the load's end.

        Lost motion, hysteresis and stiffness are those of the load's angle with the motor held, while its torque goes
        to the largest and back: between the middles of both ways at ± 3 % of it, between both ways without torque, and
        from half of the torque on. "lost in reversals" is what the load loses when the motor turns back without load.
        """
        d, most = self.drive, self.largest_torque
        torque, angle = d.hysteresis(most)
        at = np.array([-0.03, 0.0, 0.03, 0.5, 1.0]) * most
        ways = []
        for growing in (np.gradient(torque) > 0, np.gradient(torque) < 0):
            order = np.argsort(torque[growing])
            ways.append(np.interp(at, torque[growing][order], angle[growing][order]))
        middle, apart = np.mean(ways, axis=0), abs(ways[0] - ways[1])
        coulomb = sum(s.share * s.coulomb for s in d.strands) * d.efficiency / abs(d.ratio)
        shown = {
            "ratio": d.ratio,
            "lost motion at 3 % of the torque, rad": abs(middle[2] - middle[0]),
            "hysteresis without torque, rad": apart[1],
            "lost in reversals, rad": 2 * abs(d.ratio) * d.friction.lost_motion,
            "stiffness from half to full torque, N m/rad": 0.5 * most / abs(ways[0][4] - ways[0][3]),
            "friction without load, N m": coulomb,
            "efficiency of driving": d.efficiency * math.exp(-d.capstan),
        }
        return {name: float(value) for name, value in shown.items()}

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
    """Find the drive that runs of both of its ends show.

    It begins as a ratio with elasticity and friction in its transmission. Parts are added one after another, that
    first whose evidence is largest, while one is worth more than it costs.

    Parameters
    ----------
    records : sequence of DriveRecord
        Runs of both ends, with reversals.
    parts : sequence of str, optional
        Of `PARTS`, that it has; by default those that the evidence is for.
    most : int
        Number of parameters at most.
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
    search = _Search([record.thinned(POINTS) for record in records])
    kept, gains = list(parts or ()), [math.nan] * len(parts or ())
    found = search.begun()
    with tqdm(desc="parts of the drive", unit="fit", disable=not progress) as bar:
        while parts is None:
            search.rescale(found)
            begun = search.named(found)
            found, tried = search.fitted(kept, begun), {}
            for part in PARTS:
                if part not in kept and found.problem.size + len(PARTS[part]) <= most:
                    tried[part] = search.fitted((*kept, part), begun)
                    bar.update()
            if not tried:
                break
            # Errors of the nearest fit say how many of them are one observation, for all.
            divisor = min(tried.values(), key=lambda fit: fit.cost * fit.loss.divisor).loss.divisor
            best = max(tried, key=lambda part: _evidence(tried[part], divisor))
            gain = _evidence(tried[best], divisor) - _evidence(found, divisor)
            if gain < EVIDENCE:
                break
            found = tried[best]
            kept.append(best)
            gains.append(gain)
    search.rescale(found)
    found = search.fitted(kept, search.named(found))
    covariance = jackknife(found.rows, found.scores, search.pieces, found.prior)
    covariance *= student_widening(np.unique(search.pieces).size) ** 2
    drive, load = made(search.named(found)), np.concatenate([record.load_torque for record in search.records])
    unexplained = np.sqrt(np.mean([drive.errors(record)[1] ** 2 for record in search.records])) / np.std(load)
    largest = max(float(np.abs(record.load_torque).max()) for record in records)  # type: ignore[arg-type]
    return DriveFit(
        drive, found.estimates(covariance), tuple(kept), tuple(gains),
        tuple(record.name for record in records), largest, float(unexplained),
    )  # fmt: skip


def made(values: Mapping[str, float]) -> Drive:
    """Return the drive of values by name.

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
    named: dict[str, Any] = {name.replace(" ", "_"): value for name, value in values.items()}
    own = {f.name: named[f.name] for f in dataclasses.fields(Drive) if f.name in named}
    return Drive(**own | {"strands": tuple(strands), "friction": friction})


class _Search:
    """Fits of drives with different parts to the same runs."""

    def __init__(self, records: Sequence[DriveRecord]) -> None:
        self.records = records
        x, torque, angle, load = (
            np.concatenate([getattr(record, name) for record in records])
            for name in ("motor_angle", "motor_torque", "load_angle", "load_torque")
        )
        ratio, zero = np.polyfit(x, angle, 1)
        self.errors = np.array([np.std(angle - ratio * x - zero), np.std(load)])
        """rad and N m, RMS that is expected of the load's angle and torque"""
        self.known = {p.name: p for p in _parameters(float(ratio), float(zero), x, torque, load)}
        parts = -(-PIECES // len(records))  # of a run
        whole = [np.arange(r.motor_angle.size) * parts // r.motor_angle.size + parts * i for i, r in enumerate(records)]
        self.pieces = np.concatenate([piece for each in whole for piece in (each, each)])
        """(n_residuals,) piece of its run that each is in"""
        sizes = [record.motor_angle.size for record in records for _ in range(2)]
        self.blocks = np.concatenate(
            [first + np.arange(BLOCKS) * size // BLOCKS for first, size in zip(np.cumsum([0, *sizes]), sizes)]
        )

    def begun(self) -> Solution:
        """Fit what all drives have, from several sizes of its friction."""
        coulomb, capstan = self.known["coulomb"].start, self.known["capstan"].start
        starts = [{"coulomb": c * coulomb, "capstan": m * capstan} for c, m in STARTS]
        return min((self.fitted((), start) for start in starts), key=lambda fit: fit.cost * fit.loss.divisor)

    def fitted(self, parts: Sequence[str], begun: Mapping[str, float]) -> Solution:
        """Fit a drive with parts, from values by name."""
        optional = {name for names in PARTS.values() for name in names}
        wanted = {name for part in parts for name in PARTS[part]}
        parameters = [p for name, p in self.known.items() if name in wanted or name not in optional]
        names = [p.name for p in parameters]

        def residuals(values: np.ndarray) -> np.ndarray:
            return np.array([self.residuals(made(dict(zip(names, row)))) for row in values.tolist()])

        problem = Problem(parameters, residuals, loss=UnknownScale(self.blocks, POINTS), lanes=False)
        return solve(problem, [problem.at(begun)], stop=STOP)

    def residuals(self, drive: Drive) -> np.ndarray:
        """Errors (n,) of angle and torque, run by run."""
        rows = []
        for record in self.records:
            for measured, told, size in zip((record.load_angle, record.load_torque), drive.follow(record), self.errors):
                rows.append((told - measured) / (FAR * size))
        return np.concatenate(rows)

    def rescale(self, found: Solution) -> None:
        """Take the errors of a fit for those that are expected."""
        drive = made(self.named(found))
        self.errors = np.sqrt(np.mean(np.square([drive.errors(record) for record in self.records]), axis=0))

    @staticmethod
    def named(found: Solution) -> dict[str, float]:
        return dict(zip((p.name for p in found.problem.parameters), found.values.tolist()))


def _evidence(found: Solution, divisor: float) -> float:
    loss = dataclasses.replace(cast(UnknownScale, found.loss), correlated=divisor)
    return log_evidence(float(loss.cost(found.residuals[None])[0]), found.at, found.information / divisor)


def positive(name: str, unit: str, start: float, factor: float) -> Parameter:
    """Return a parameter > 0 that is known up to a factor, by its logarithm."""
    return Parameter(name, unit, start, start / factor**4, start * factor**4, math.log(factor))


def free(name: str, unit: str, start: float, std: float, low: float = -math.inf, high: float = math.inf) -> Parameter:
    """Return a parameter that is known up to a standard deviation."""
    return Parameter(name, unit, start, max(low, start - 6 * std), min(high, start + 6 * std), std, "linear")


def in_words(names: Iterable[str], advice: Mapping[str, str]) -> tuple[str, ...]:
    """Say that runs do not tell these parameters, and which motion would."""
    tells = ((name, next((f"; {words}" for part, words in advice.items() if part in name), "")) for name in names)
    return tuple(f"{name} is not told by these runs{words}" for name, words in tells)


def _parameters(ratio: float, zero: float, x: np.ndarray, torque: np.ndarray, load: np.ndarray) -> list[Parameter]:
    """All numbers that a drive may have; sizes are those of the runs."""
    way, moment, most = float(np.ptp(x)), float(np.ptp(torque)), float(np.ptp(load))
    efficiency = min(2.0, max(0.05, most * abs(ratio) / moment))
    gives = 0.1 * way / moment
    wide = 10 * moment

    return [
        free("ratio", "", ratio, 0.2 * abs(ratio)),
        free("zero", "rad", zero, 0.2 * way * abs(ratio)),
        free("compliance", "rad/(N m)", gives, 2 * gives, 0.0),
        positive("coulomb", "N m", 0.1 * moment, 4.0),
        free("capstan", "", 0.1, 0.2, 0.0, 3.0),
        positive("efficiency", "", efficiency, 1.5),
        free("torque zero", "N m", float(np.mean(torque)), 0.3 * moment, -wide, wide),
        free("stiffness", "N m/rad", 0.0, 0.2 * moment / way),
        free("damping", "N m s/rad", 0.0, 0.1 * moment / way, 0.0),
        free("inertia", "kg m²", 0.0, 0.01 * moment / way, 0.0),
        positive("width", "rad", 0.03 * way, 3.0),
        free("friction", "N m", 0.0, 0.1 * moment, 0.0),
        free("lost motion", "rad", 0.0, 0.03 * way, 0.0),
        positive("second coulomb", "N m", 0.2 * moment, 4.0),
        free("second share", "", 0.5, 0.25, 0.0, 1.0),
        free("entrance compliance", "rad/(N m)", 0.0, gives, 0.0),
        free("compliance growth", "1/rad", 0.0, 0.5 / way),
        free("backlash", "rad", 0.0, 0.03 * way, 0.0),
        positive("backlash torque", "N m", 0.03 * moment, 3.0),
        free("curvature", "1/rad", 0.0, 0.1 / way),
    ]  # fmt: skip


def require_motion(records: Sequence[DriveRecord]) -> None:
    """Raise RecordError without runs, or for one whose motor never turns back or whose torque never changes.

    Parameters
    ----------
    records : sequence of DriveRecord
        Runs to find a drive from.
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
    # Of all together: a run that ends before its springs are back may give a little more than it gets.
    if (lost := sum(record.lost_work for record in records)) < 0:
        names = f'run "{records[0].name}"' if len(records) == 1 else f"{len(records)} runs together"
        raise RecordError(
            f"{names}: the drive gives {-lost:.3g} J more than it gets; a torque or an angle counts the other way round"
        )
