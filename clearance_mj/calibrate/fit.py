"""The fit: bounded least squares in the logarithms of the free parameters, and what it leaves open."""

from __future__ import annotations

import contextlib
import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize
import scipy.stats
from tqdm import tqdm

from ..errors import ClearanceError, RecordError, RigError
from ..paths import Place, numbers, places, value_at, written
from ..rig import Rig
from ..signals.correlation import relative_error
from ..signals.frf import QUANTITY
from .targets import FRFTarget, ModalTarget

__all__ = ["Calibration", "Combination", "Solution", "calibrate", "profile", "value_of"]

SHAFT = ("length", "young_modulus", "density", "diameter", "width", "height")
POINTS = ("position", "mass", "stiffness", "damping")
"""What the linear rig depends on: of its shaft, and of masses, sensors and bushings with their grease"""
NEAR = 1.2
FAR = 10.0
"""default bounds are start / factor to start × factor: NEAR for the shaft, FAR for the rest but positions"""
NEAREST = 0.02
"""lowest default bound of a position, as a share of the shaft's length"""
STEP = 1e-4
"""difference of a logarithm for the Jacobian"""
HARDLY = 0.5
"""standard deviation of a combination of logarithms above which the data do not tell it"""
SHARE = 0.1
"""exponent below which a parameter does not count to a combination"""
ROUNDING = 1e-9
SAME = 1e-3
"""difference of logarithms below which two starts found the same rig"""
AS_GOOD = 1.0
"""Δχ² below which two rigs fit equally well"""
EQUAL = 1e-6
"""half of Δχ² below which rigs fit equally for every purpose"""


@dataclass(frozen=True, eq=False)
class Combination:
    """A product of powers of parameters that the data do not tell."""

    exponent: dict[str, float]
    """of each parameter that counts"""
    std: float
    """standard deviation of its logarithm"""

    def __str__(self):
        powers = " × ".join(f"{path}^{power:+.2f}" for path, power in self.exponent.items())
        return powers if len(self.exponent) > 1 else next(iter(self.exponent))


@dataclass(frozen=True, eq=False)
class Solution:
    """What one start ended with."""

    value: np.ndarray
    """(n_free,) SI units"""
    chi2: float
    """sum of the squared residuals"""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A rig calibrated to targets, and how well they tell its parameters."""

    rig: Rig
    """calibrated"""
    start: Rig
    """the rig that was given"""
    targets: tuple[ModalTarget | FRFTarget, ...]
    """what it was calibrated to"""
    paths: tuple[str, ...]
    """the free parameters"""
    value: np.ndarray
    """(n_free,) SI units"""
    covariance: np.ndarray
    """(n_free, n_free) of the logarithms; grows with χ² where that exceeds the degrees of freedom"""
    residual: np.ndarray
    """in standard deviations of the data"""
    untold: tuple[Combination, ...]
    """what the data do not tell, least told first"""
    at_bound: tuple[str, ...]
    """parameters that ended at a bound"""
    solutions: tuple[Solution, ...]
    """of every start, best first; of perfect fits, the nearest to the rig that was given"""

    @property
    def std(self) -> np.ndarray:
        """(n_free,) standard deviations to first order, SI units."""
        return self.value * np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> np.ndarray:
        """(n_free, n_free) correlation coefficients of the logarithms."""
        sigma = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(sigma, sigma)

    @property
    def chi2(self) -> float:
        """Sum of the squared residuals."""
        return float(np.sum(self.residual**2))

    @property
    def distinct(self) -> tuple[Solution, ...]:
        """Rigs that differ and fit equally well, the best first."""
        found: list[Solution] = []
        for solution in self.solutions:
            good = solution.chi2 <= self.solutions[0].chi2 + AS_GOOD
            if good and all(np.max(np.abs(np.log(solution.value / s.value))) > SAME for s in found):
                found.append(solution)
        return tuple(found)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plain words on what not to rely on."""
        words = [f"the data do not tell {c} (standard deviation of its logarithm {c.std:.2g})" for c in self.untold]
        words += [f"{path} ended at a bound" for path in self.at_bound]
        if len(self.distinct) > 1:
            words.append(f"{len(self.distinct)} different rigs fit equally well; the one written is one of them")
        return tuple(words)

    def to_dict(self) -> dict:
        """Return values, standard deviations, correlations, residuals and every start's solution as plain data."""
        return {
            "free": {
                path: {"value": float(v), "std": float(s), "start": float(value_of(self.start, path))}
                for path, v, s in zip(self.paths, self.value, self.std)
            },
            "correlation": self.correlation.tolist(),
            "chi2": self.chi2,
            "data": sum(t.size for t in self.targets),
            "residual_std": self.residual.tolist(),
            "modes": [row for t in self.targets if isinstance(t, ModalTarget) for row in _mode_rows(self, t)],
            "untold": [{"exponent": c.exponent, "std": c.std} for c in self.untold],
            "at_bound": list(self.at_bound),
            "solutions": [{"value": s.value.tolist(), "chi2": s.chi2} for s in self.solutions],
            "equally_good": len(self.distinct),
            "warnings": list(self.warnings),
        }


def _mode_rows(calibration, target) -> Iterator[dict]:
    start, fitted = (target.model(rig)[0] for rig in (calibration.start, calibration.rig))
    columns = (target.mode, target.frequency, start, fitted, relative_error(target.frequency, fitted))
    names = ("mode", "test_hz", "start_hz", "calibrated_hz", "relative_error")
    for row in zip(*columns):
        yield dict(zip(names, map(float, row)))


def calibrate(
    rig: Rig,
    targets: Sequence[ModalTarget | FRFTarget],
    free: Mapping[str, tuple[float, float] | None],
    starts: int = 8,
    seed: int = 0,
    progress: str | None = None,
) -> Calibration:
    """Find the parameters of a rig that bring it closest to measured data.

    Parameters
    ----------
    rig : Rig
        Where to start, and every value that is not free.
    targets : sequence of ModalTarget or FRFTarget
        The data.
    free : mapping of str to (float, float) or None
        Paths of the free parameters as in the rig's file, such as "beam.diameter" or "masses[0].mass", with their
        bounds in SI units. Without a number, as in "bushings.grease.stiffness", all entries share one value. None:
        ×/÷ 1.2 for dimensions and material of the shaft, the whole shaft for a position, ×/÷ 10 for the rest.
    starts : int
        The rig itself and starts - 1 points of a Latin hypercube between the bounds, of positions, or their logarithms.
    seed : int
        Of the hypercube.
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    Calibration
        Bushings keep their order along the shaft.

    Raises
    ------
    RigError
        If a path is unknown, a bound is impossible or does not hold the start.
    RecordError
        If there are fewer data than free parameters, or data of a sensor or an excitation that the rig lacks.
    """
    problem = _Problem(rig, tuple(targets), free)
    points = problem.starts(starts, seed)
    solved = [problem.solve(x) for x in tqdm(points, desc=progress, unit="start", disable=progress is None)]
    least = min(s.cost for s in solved) + EQUAL
    # What separates perfect fits is rounding: the nearest to the first start then goes first.
    solved.sort(key=lambda s: (max(s.cost, least), np.linalg.norm(s.x - points[0])))
    best = solved[0]
    covariance, untold = problem.told(best)
    return Calibration(
        rig=problem.rig(best.x),
        start=rig,
        targets=problem.targets,
        paths=problem.paths,
        value=np.exp(best.x),
        covariance=covariance,
        residual=best.fun,
        untold=untold,
        at_bound=tuple(path for path, at in zip(problem.paths, best.active_mask) if at),
        solutions=tuple(Solution(np.exp(s.x), 2 * float(s.cost)) for s in solved),
    )


def profile(
    rig: Rig,
    targets: Sequence[ModalTarget | FRFTarget],
    free: Mapping[str, tuple[float, float] | None],
    path: str,
    values: Sequence[float],
    starts: int = 4,
    seed: int = 0,
    progress: str | None = None,
) -> list[Calibration]:
    """Calibrate with one more parameter held at each of several values: the family of rigs that fit.

    Parameters
    ----------
    rig, targets, free, starts, seed
        As for `calibrate`; each value starts from the rig of the one before.
    path : str
        The parameter that is held.
    values : sequence of float
        What it is held at, SI units.
    progress : str, optional
        Show a progress bar with this name.

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
    held = _places(rig, path)
    bounds = {name: _bounds(rig, name, given) for name, given in free.items()}
    found: list[Calibration] = []
    for value in tqdm(values, desc=progress, unit="rig", disable=progress is None):
        last = found[-1].rig if found else rig
        found.append(calibrate(_changed(last, dict.fromkeys(held, float(value))), targets, bounds, starts, seed))
    return found


class _Problem:
    """Residuals as a function of the logarithms of the free parameters."""

    def __init__(self, rig, targets, free):
        self.start, self.targets, self.paths = rig, targets, tuple(free)
        if not self.paths:
            raise RigError("name at least one free parameter")
        self.places = [_places(rig, path) for path in self.paths]
        every = [place for group in self.places for place in group]
        if len(set(every)) < len(every):
            raise RigError(f"a free parameter is named twice: {', '.join(self.paths)}")
        self.low, self.high = np.log([_bounds(rig, path, free[path]) for path in self.paths]).T
        self.order = np.argsort([b.position for b in rig.bushings])
        size, known = sum(t.size for t in targets), {s.node for s in rig.sensors}
        if size < len(self.paths):
            raise RecordError(f"{len(self.paths)} free parameters need as many data; the targets hold {size}")
        if missing := sorted({node for t in targets for node in t.nodes} - known):
            raise RecordError(f"the data's node {missing[0]} is no sensor of rig {rig.name!r}: {sorted(known)}")
        for target in targets:
            if isinstance(target, FRFTarget) and target.frf.quantity != QUANTITY[rig.shaker.kind]:
                raise RecordError(
                    f"the FRFs are {target.frf.quantity}, but the shaker of rig {rig.name!r} is {rig.shaker.kind!r}: "
                    f"{QUANTITY[rig.shaker.kind]}"
                )
        self.impossible = np.full_like(self._compare(rig), np.inf)
        """what `least_squares` answers with a shorter step"""

    def rig(self, x) -> Rig:
        values = np.exp(x).tolist()
        return _changed(self.start, {place: v for group, v in zip(self.places, values) for place in group})

    def residual(self, x) -> np.ndarray:
        try:
            rig = self.rig(x)
        except RigError:
            return self.impossible
        if np.any(np.diff([rig.bushings[i].position for i in self.order]) <= 0):
            return self.impossible
        return self._compare(rig)

    def _compare(self, rig):
        return np.concatenate([target.residual(rig) for target in self.targets])

    def jacobian(self, x) -> np.ndarray:
        """Central differences, one-sided beside a rig that cannot be."""
        columns = []
        for i in range(x.size):
            step = np.zeros(x.size)
            step[i] = STEP
            ahead, behind, width = self.residual(x + step), self.residual(x - step), 2 * STEP
            if not (np.isfinite(ahead).all() and np.isfinite(behind).all()):
                here, width = self.residual(x), STEP
                ahead, behind = (side if np.isfinite(side).all() else here for side in (ahead, behind))
            columns.append((ahead - behind) / width)
        return np.stack(columns, axis=1)

    def starts(self, count, seed) -> list[np.ndarray]:
        """The rig itself, then points of a Latin hypercube that are rigs."""
        own = np.log([value_of(self.start, path) or np.nan for path in self.paths])
        own = np.where(np.isfinite(own), own, (self.low + self.high) / 2)
        inner = 1e-6 * (self.high - self.low)
        points = [np.clip(own, self.low + inner, self.high - inner)]
        if not np.isfinite(self.residual(points[0])).all():
            raise RigError(
                f"no rig can start with {', '.join(self.paths)} as given: bushings overlap or leave the shaft"
            )
        sampler = scipy.stats.qmc.LatinHypercube(len(self.paths), rng=np.random.default_rng(seed))
        for _ in range(100):
            if len(points) >= count:
                break
            drawn = self._spread(sampler.random(max(count, 1)))
            points += [x for x in drawn if np.isfinite(self.residual(x)).all()]
        return points[: max(count, 1)]

    def _spread(self, share):
        """Even between the bounds for a position, even between their logarithms for the rest."""
        low, high = np.exp(self.low), np.exp(self.high)
        position = [path.endswith("position") for path in self.paths]
        return np.where(position, np.log(low + (high - low) * share), self.low + (self.high - self.low) * share)

    def solve(self, start):
        return scipy.optimize.least_squares(
            self.residual, start, self.jacobian, (self.low, self.high), x_scale="jac",
            xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=100,
        )  # fmt: skip

    def told(self, solution):
        """Covariance of the logarithms and the combinations that the data do not tell."""
        _, singular, v = np.linalg.svd(solution.jac, full_matrices=True)
        singular = np.append(singular, np.zeros(v.shape[0] - singular.size))
        spread = 1 / np.maximum(singular, 1e-9 * max(singular[0], 1.0))
        untold = tuple(self._combination(*pair) for pair in zip(v[::-1], spread[::-1]) if pair[1] > HARDLY)
        freedom = sum(t.size for t in self.targets) - len(self.paths)
        model_error = max(1.0, 2 * solution.cost / freedom) if freedom else 1.0
        return model_error * (v.T * spread**2) @ v, untold

    def _combination(self, v, std) -> Combination:
        v = v * np.sign(v[np.argmax(np.abs(v))])
        return Combination({path: float(e) for path, e in zip(self.paths, v) if abs(e) > SHARE}, float(std))


def _counts(place) -> bool:
    """Whether the linear rig depends on a number."""
    if place[0] == "beam":
        return place[1] in SHAFT or place[1] == "rayleigh"
    return place[0] in ("masses", "bushings", "sensors") and place[-1] in POINTS and "contact" not in place


def _shared(place) -> str:
    """Path of a field of all entries of a list; the numbers of beam.rayleigh share no value, their units differ."""
    return written((*(step for step in place[:-1] if isinstance(step, str)), place[-1]))


def _places(rig, path) -> list[Place]:
    """Every place in the rig's plain data that a path stands for."""
    data = rig.to_dict()
    known = [place for place in numbers(data) if _counts(place)]
    with contextlib.suppress(ClearanceError):
        found = places(data, path)
        if found and found[0] in known and path in (written(found[0]), _shared(found[0])):
            return found
    names = dict.fromkeys(re.sub(r"\[\d+\]", "[N]", written(place)) for place in known)
    counts = {k: len(getattr(rig, k)) for k in ("masses", "bushings", "sensors")}
    having = ", ".join(f"{n} {kind}" for kind, n in counts.items())
    raise RigError(f"{path!r} is no free parameter of rig {rig.name!r} ({having}); known: {', '.join(names)}")


def value_of(rig: Rig, path: str) -> float:
    """Return the value of a parameter; the mean where several places share it.

    Parameters
    ----------
    rig : Rig
        The rig.
    path : str
        Such as "bushings[0].position", or "bushings.grease.stiffness" for all bushings.

    Raises
    ------
    RigError
        For an unknown path; the message lists the known ones.
    """
    data = rig.to_dict()
    return float(np.mean([value_at(data, place) for place in _places(rig, path)]))


def _changed(part, changes):
    """Return a rig, or a part of one, with new values by their places; it is checked once all are in."""
    if () in changes:
        return changes[()]
    inner: dict = {}
    for (first, *rest), value in changes.items():
        inner.setdefault(first, {})[tuple(rest)] = value
    if isinstance(part, tuple):
        return tuple(_changed(item, inner[i]) if i in inner else item for i, item in enumerate(part))
    return dataclasses.replace(part, **{name: _changed(getattr(part, name), sub) for name, sub in inner.items()})


def _bounds(rig, path, given) -> tuple[float, float]:
    value, field = value_of(rig, path), path.rpartition(".")[2]
    if given is None and field == "position":
        given = NEAREST * rig.beam.length, rig.beam.length
    elif given is None:
        factor = NEAR if field in SHAFT else FAR
        given = value / factor, value * factor
        if value <= 0:
            raise RigError(f"{path} starts at 0 and has no bounds; give them, as in {path}=1:10")
    low, high = given
    if not 0 < low < high < np.inf:
        raise RigError(f"the bounds of {path} must be 0 < low < high, got {low:g} and {high:g}")
    if value > 0 and not (1 - ROUNDING) * low <= value <= (1 + ROUNDING) * high:
        raise RigError(f"{path} starts at {value:g}, outside its bounds {low:g} to {high:g}")
    return low, high
