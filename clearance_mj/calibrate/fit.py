"""The fit: bounded least squares in the logarithms of the free parameters, and combinations not identified."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import Any

import numpy as np
import scipy.stats
from tqdm import tqdm

from ..core.errors import RecordError, RigError
from ..core.kinds import checks_kinds
from ..estimate.estimates import Combination, Estimates, principal_deviations, unidentified_combinations
from ..estimate.problem import Problem, one_by_one
from ..estimate.solver import StoppingCriteria, solve
from ..rig import Rig
from ..signals.correlation import relative_error
from ..signals.frf import QUANTITY
from ..structure.base import parse_place
from .free import Free, free_parameter, keys_of, with_values
from .targets import FRFTarget, ModalTarget, sensor_rows

__all__ = ["Calibration", "StartSolution", "calibrate", "profile"]

MAX_STARTS = 1000  # each takes a tenth of a second or more
MAX_DRAWS = 100  # of a hypercube, for points that are rigs
STEP = 1e-4  # of a logarithm, for differences
SAME = 1e-3  # difference of logarithms below which two starts ended with the same rig
AS_GOOD = 1.0  # Δχ² below which two rigs fit equally well
EQUAL = 2e-6  # Δχ² below which rigs fit equally for every purpose
EXACT = StoppingCriteria(steps=100, decrease=1e-12, move=1e-12)


@dataclass(frozen=True, eq=False)
class StartSolution:
    """Solution of one start."""

    value: np.ndarray
    """(n_free,) SI units"""
    chi2: float
    """sum of the squared residuals"""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A rig calibrated to targets, with the estimates of its parameters."""

    rig: Rig
    """calibrated"""
    start: Rig
    """the rig that was given"""
    targets: tuple[ModalTarget | FRFTarget, ...]
    """the measured data that it was calibrated to"""
    estimates: Estimates
    """of the free parameters; the covariance grows with χ² where that exceeds the degrees of freedom"""
    residual: np.ndarray
    """in standard deviations of the data"""
    unidentified: tuple[Combination, ...]
    """combinations that the data do not identify, least known first"""
    at_bound: tuple[str, ...]
    """parameters that ended at a bound"""
    solutions: tuple[StartSolution, ...]
    """of every start, best first; of perfect fits, the nearest to the rig that was given"""

    @property
    def chi2(self) -> float:
        """Sum of the squared residuals."""
        return float(np.sum(self.residual**2))

    @property
    def distinct(self) -> tuple[StartSolution, ...]:
        """Rigs that differ and fit equally well, the best first."""
        solutions: list[StartSolution] = []
        for solution in self.solutions:
            good = solution.chi2 <= self.solutions[0].chi2 + AS_GOOD
            if good and all(np.max(np.abs(np.log(solution.value / s.value))) > SAME for s in solutions):
                solutions.append(solution)
        return tuple(solutions)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plain words on what not to rely on."""
        words = [
            f"the data do not identify {c} (standard deviation of its logarithm {c.std:.2g})" for c in self.unidentified
        ]
        words += [f"{path} ended at a bound" for path in self.at_bound]
        if len(self.distinct) > 1:
            words.append(f"{len(self.distinct)} different rigs fit equally well; the one written is one of them")
        return tuple(words)

    def to_dict(self) -> dict[str, Any]:
        """Return values, standard deviations, correlations, residuals and every start's solution as plain data."""
        estimates = self.estimates
        return {
            "free": {
                p.name: {"value": float(v), "std": float(s), "start": p.start}
                for p, v, s in zip(estimates.parameters, estimates.value, estimates.std)
            },
            "correlation": estimates.correlation.tolist(), "chi2": self.chi2,
            "data": sum(t.size for t in self.targets), "residual_std": self.residual.tolist(),
            "modes": [row for t in self.targets if isinstance(t, ModalTarget) for row in self._mode_rows(t)],
            "unidentified": [{"exponent": c.exponent, "std": c.std} for c in self.unidentified],
            "at_bound": list(self.at_bound),
            "solutions": [{"value": s.value.tolist(), "chi2": s.chi2} for s in self.solutions],
            "equally_good": len(self.distinct), "warnings": list(self.warnings),
        }  # fmt: skip

    def _mode_rows(self, target: ModalTarget) -> Iterator[dict[str, float]]:
        start, fitted = (target.model(rig)[0] for rig in (self.start, self.rig))
        names = "mode", "test_hz", "start_hz", "calibrated_hz", "relative_error"
        for row in zip(target.mode, target.frequency, start, fitted, relative_error(target.frequency, fitted)):
            yield dict(zip(names, map(float, row)))


@checks_kinds
def calibrate(
    rig: Rig, targets: Sequence[ModalTarget | FRFTarget], free: Free, n_starts: int = 8, seed: int = 0,
    progress: bool = False,
) -> Calibration:  # fmt: skip
    """Find the parameters of a rig that bring it closest to measured data.

    Parameters
    ----------
    rig : Rig
        Where to start, and every value that is not free.
    targets : sequence of ModalTarget or FRFTarget
        Measured data that the rig is calibrated to.
    free : mapping of str to (float, float) or None
        Paths of the free parameters as in the rig's file, such as "beam.diameter" or "masses[0].mass", with their
        bounds in SI units. Without a number, as in "bushings.grease.stiffness", all entries share one value. None:
        ×/÷ 1.2 for dimensions and material of the shaft, the whole shaft for a position, ×/÷ 10 for the rest.
    n_starts : int
        The rig itself and n_starts - 1 points of a Latin hypercube between the bounds, of positions, or their
        logarithms.
    seed : int
        Seed of the hypercube.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Calibration
        Bushings keep their order along the shaft.

    Raises
    ------
    RigError
        If a path is unknown, a bound is impossible or does not hold the start.
    RecordError
        If there are fewer data than free parameters, data of a sensor or an excitation that the rig lacks, or not 1
        to `MAX_STARTS` starts.
    """
    if not 1 <= n_starts <= MAX_STARTS:
        raise RecordError(f"n_starts must be 1 to {MAX_STARTS}, got {n_starts}")
    comparison = _TargetComparison(rig, tuple(targets), free)
    residuals = one_by_one(comparison.residual)
    problem = Problem(comparison.parameters, residuals, step=STEP, central=True, lanes=False, invalid=RigError)
    points = _starts(problem, n_starts, seed)
    bar = tqdm(points, desc="calibrating", unit="start", disable=not progress)
    solved = [solve(problem, point, stop=EXACT) for point in bar]
    perfect = min(s.cost for s in solved) + EQUAL
    # What separates perfect fits is rounding: the nearest to the first start then goes first.
    solved.sort(key=lambda s: (max(s.cost, perfect), np.linalg.norm(s.at - points[0])))
    best = solved[0]
    direction, std = principal_deviations(best.jacobian)
    freedom = best.residuals.size - problem.size
    model_error = max(1.0, best.cost / freedom) if freedom else 1.0
    return Calibration(
        rig=comparison.rig(best.values), start=rig, targets=comparison.targets,
        estimates=best.estimates(model_error * (direction.T * std**2) @ direction), residual=best.residuals,
        unidentified=unidentified_combinations(comparison.paths, direction, std),
        at_bound=tuple(path for path, at in zip(comparison.paths, best.at_bound) if at),
        solutions=tuple(StartSolution(s.values, s.cost) for s in solved),
    )  # fmt: skip


def profile(
    rig: Rig, targets: Sequence[ModalTarget | FRFTarget], free: Free, path: str, values: Sequence[float] | np.ndarray,
    n_starts: int = 4, seed: int = 0, progress: bool = False,
) -> list[Calibration]:  # fmt: skip
    """Calibrate with one more parameter held at each of several values: the family of rigs that fit.

    Parameters
    ----------
    rig, targets, free, n_starts, seed, progress
        As for `calibrate`; each value starts from the rig of the one before.
    path : str
        The parameter that is held.
    values : sequence of float
        Values at which it is held, SI units.

    Returns
    -------
    list of Calibration
        One for each value.

    Raises
    ------
    ClearanceError
        As `calibrate`.

    Notes
    -----
    Raue et al., Structural and practical identifiability analysis by exploiting the profile likelihood,
    Bioinformatics 25, 2009.
    """
    keys = keys_of(rig, path)
    parameters = [free_parameter(rig, name, given) for name, given in free.items()]
    bounds = {p.name: (p.low, p.high) for p in parameters}
    results: list[Calibration] = []
    for value in tqdm(values, desc="profile", unit="rig", disable=not progress):
        last = results[-1].rig if results else rig
        results.append(calibrate(with_values(last, dict.fromkeys(keys, float(value))), targets, bounds, n_starts, seed))
    return results


class _TargetComparison:
    """Rigs with values of the free parameters, compared with the targets."""

    def __init__(self, rig: Rig, targets: tuple[ModalTarget | FRFTarget, ...], free: Free):
        self.start, self.targets, self.paths = rig, targets, tuple(free)
        if not self.paths:
            raise RigError("name at least one free parameter")
        self.keys = [keys_of(rig, path) for path in self.paths]
        keys = [*chain(*self.keys)]
        if len(set(keys)) < len(keys):
            raise RigError(f"a free parameter is named twice: {', '.join(self.paths)}")
        self.parameters = [free_parameter(rig, path, bounds) for path, bounds in free.items()]
        order = sorted((place, i) for i, b in enumerate(rig.bushings) if (place := parse_place(b.position)))
        self.order = [(i, j) for (a, i), (b, j) in pairwise(order) if a[0] == b[0]]
        """neighbours on one shaft"""
        self._check_targets()

    def _check_targets(self) -> None:
        rig, size = self.start, sum(t.size for t in self.targets)
        if size < len(self.paths):
            raise RecordError(f"{len(self.paths)} free parameters need as many data; the targets hold {size}")
        for target in self.targets:
            sensor_rows(rig, target.nodes)
        kind, driven = rig.shaker.kind, QUANTITY[rig.shaker.kind]
        for target in self.targets:
            if isinstance(target, FRFTarget) and (measured := target.frf.quantity) != driven:
                raise RecordError(f"the FRFs are {measured}, but the shaker of rig {rig.name!r} is {kind!r}: {driven}")

    def rig(self, values: np.ndarray) -> Rig:
        """Return the rig with values (n_free,); a RigError if there cannot be one."""
        return with_values(self.start, {key: v for group, v in zip(self.keys, values.tolist()) for key in group})

    def residual(self, values: np.ndarray) -> np.ndarray:
        """Return (n_residuals,) of the targets, in standard deviations of the data."""
        rig = self.rig(values)
        at = [parse_place(b.position) or ("", 0.0) for b in rig.bushings]
        if any(at[i] >= at[j] for i, j in self.order):
            raise RigError("bushings keep their order along the shaft")
        return np.concatenate([target.residual(rig) for target in self.targets])


def _starts(problem: Problem, count: int, seed: int) -> list[np.ndarray]:
    """Return the rig itself, then points of a Latin hypercube that are rigs: even in positions, else in logarithms."""
    inner = 1e-6 * (problem.high - problem.low)
    points = [np.clip(np.zeros(problem.size), problem.low + inner, problem.high - inner)]
    paths = [p.name for p in problem.parameters]
    if not _is_possible(problem, points[0]):
        raise RigError(f"no rig can start with {', '.join(paths)} as given: bushings overlap or leave the shaft")
    sampler = scipy.stats.qmc.LatinHypercube(problem.size, rng=np.random.default_rng(seed))
    low, high = problem.values(np.array((problem.low, problem.high)))
    position = [path.endswith("position") for path in paths]
    for _ in range(MAX_DRAWS):
        if len(points) >= count:
            break
        fractions = sampler.random(count)
        even_in_value = np.array([problem.at(values) for values in low + (high - low) * fractions])
        drawn = np.where(position, even_in_value, problem.low + (problem.high - problem.low) * fractions)
        points += [point for point in drawn if _is_possible(problem, point)]
    return points[:count]


def _is_possible(problem: Problem, point: np.ndarray) -> bool:
    return bool(np.isfinite(problem.residuals(point[None])).all())
