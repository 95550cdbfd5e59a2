"""Bouc-Wen hysteresis with a gap, from records of displacement and force (Eqs 9 and 11).

The element is f = λ k y + (1-λ) k z with dz = dy (1 - |z|ⁿ (γ + β sign(z dy))), A = 1 because k scales it. The gap
enters in one of two ways:

- "fixed": it stays where it is, as in a bushing: y = gap(x - x0, d), Eq. 11.
- "reopening": dead travel in series with the slider, as in a friction damper with backlash: the slider carries the gap
  along, so that after every reversal the dead travel 2d is run through anew once the spring is unloaded. y = x - x0 and
  z is the deflection beyond the dead travel; within it z = 0.

Parameters are fitted by output error: the loop is computed from the record's displacement and its force compared with
the measured force, by bounded least squares from several starts.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clearance_mj import Grease, RecordError
from clearance_mj.clearance.greases.bouc_wen import bouc_wen_step
from clearance_mj.clearance.walls.slot import gap as penetration
from clearance_mj.core.jit import jit
from clearance_mj.estimate import Estimates, Parameter, Problem, Solution, StoppingCriteria, coloured, one_by_one, solve
from clearance_mj.estimate.estimates import UNIDENTIFIED

DEAD_TRAVEL = ("fixed", "reopening")
NAMES = {"k": "N/m", "elastic_ratio": "1", "beta": "1/mⁿ", "gamma": "1/mⁿ", "exponent": "1", "gap": "m", "offset": "m"}
"""parameters and their units"""
POSSIBLE = ((0.0, np.inf), (0.0, 1.0), (0.0, np.inf), (-np.inf, np.inf), (1.0, 6.0), (0.0, np.inf), (-np.inf, np.inf))
SHORTEST = 20  # samples
POLISHED = 2  # starts, the best after a rough solution, that are solved to the end
MAX_STEPS = 40  # of a solution
STEP = 1e-6  # of what varies, for differences
UNRELATED = 0.95  # NRMSE above which force and displacement are unrelated
SCALED = (
    Parameter("k X/F", "1", 1.0, 1e-2, 1e4),
    Parameter("λ", "1", 0.5, 0.0, 1.0, transform="linear"),
    Parameter("z_ult/X", "1", 1.0, 1e-3, 1e2),
    Parameter("γ/β", "1", 0.0, -0.9, 1.0, transform="linear"),
    Parameter("n", "1", 1.5, 1.0, 6.0, transform="linear"),
    Parameter("d/X", "1", 0.1, 0.0, 1.0, transform="linear"),
    Parameter("x0/X", "1", 0.0, -1.2, 1.2, transform="linear"),
)  # What is fitted, with X half the range of the displacement and F half that of the force
K, RATIO, YIELD, SHAPE, EXPONENT, GAP, OFFSET = range(7)


@dataclass(frozen=True, eq=False)
class BoucWenFit:
    """Bouc-Wen element with a gap, fitted to records, and how well they identify its parameters."""

    k: float  #: N/m, stiffness k
    elastic_ratio: float  #: λ, fraction of the stiffness that does not slide
    beta: float  #: β, 1/mⁿ
    gamma: float  #: γ, 1/mⁿ
    exponent: float  #: n
    gap: float  #: m, d: half the dead travel
    offset: float
    """m, x0: the displacement at which the gap is centred (of a re-opening gap: in the first record's beginning)"""
    dead_travel: str = "fixed"  #: "fixed" or "reopening"
    estimates: Estimates | None = None
    """of these parameters, but a gap that was given; allows for residuals correlated in time. None: not fitted"""
    unidentified: tuple[str, ...] = ()
    """parameters the records do not identify, by their standard deviation near the solution; β and γ, whose unit
    depends on n, count as identified where the yield displacement, γ/β and n are"""
    nrmse: float = 0.0  #: RMS of the residual over the RMS of the measured force about its mean
    starts: tuple[float, ...] = ()
    """nrmse that each start ended with, best first; only the first two are solved to the end"""

    @property
    def value(self) -> np.ndarray:
        """(7,) the parameters in the order of the fields."""
        return np.array([getattr(self, name) for name in NAMES])

    @property
    def yield_displacement(self) -> float:
        """z_ult = (β+γ)^(-1/n), m."""
        return (self.beta + self.gamma) ** (-1 / self.exponent)

    @property
    def yield_force(self) -> float:
        """(1-λ) k z_ult, N: largest force of the sliding part."""
        return (1 - self.elastic_ratio) * self.k * self.yield_displacement

    @property
    def grease(self) -> Grease:
        """The element without its gap, as the engines take it."""
        return Grease(self.k, 0.0, self.elastic_ratio, 1.0, self.beta, self.gamma, self.exponent)

    def force(self, time: ArrayLike, displacement: ArrayLike, offset: float | None = None) -> np.ndarray:
        """Force (n,), N, under a displacement (n,), m, over rising times (n,), s; it does not depend on rate.

        ``offset``: m, x0 of this record if it is not the fitted one; see `offset_of`.
        """
        _, x, _ = checked(time, displacement, np.zeros(np.shape(time)), "the motion")
        offset = self.offset if offset is None else offset
        z_ult, reopening = self.yield_displacement, self.dead_travel == "reopening"
        shape = self.gamma / self.beta
        return loop_force(x, self.k, self.elastic_ratio, z_ult, shape, self.exponent, self.gap, offset, reopening)

    def offset_of(self, displacement: float, force: float) -> float:
        """Return x0, m, of a re-opening gap at a record's beginning, from its first displacement, m, and force, N.

        Within the dead travel the force says nothing: the gap is then taken as centred.
        """
        if self.dead_travel != "reopening":
            raise RecordError("a fixed gap stays where it was fitted; only a re-opening gap starts anew in each record")
        spring = (1 - self.elastic_ratio) * self.k
        if spring == 0 or abs(force) < 0.01 * self.yield_force:
            return displacement
        deflection = np.clip(force / spring, -0.99 * self.yield_displacement, 0.99 * self.yield_displacement)
        return float(displacement - deflection - np.sign(force) * self.gap)


def bouc_wen(
    time: ArrayLike, displacement: ArrayLike, force: ArrayLike, gap: float | None = None, dead_travel: str = "fixed"
) -> BoucWenFit:
    """Identify a Bouc-Wen element with a gap from measured displacement and force.

    Parameters
    ----------
    time, displacement, force : array_like, shape (n,), or sequences of them
        s, m and N. Several records of one element are given as lists of arrays. Each begins as if the element had
        been unloaded at x0.
    gap : float, optional
        m, d if it is known, 0 for an element without gap; else it is fitted.
    dead_travel : {"fixed", "reopening"}
        "fixed": the gap stays where it is; "reopening": the slider carries it along, so that its dead travel starts
        anew at each reversal. The second needs records that begin at the same point of the dead travel, or loops long
        enough for that not to matter.

    Raises
    ------
    RecordError
        If a channel is not finite, constant, clipped or too short, if the gap is larger than the motion, or if the
        force does not follow the displacement; the message says what can still be identified.

    Notes
    -----
    Bouc-Wen: Ismail, Ikhouane and Rodellar, The hysteresis Bouc-Wen model, a survey, Arch. Comput. Methods Eng. 16,
    2009. Covariance of output error with coloured residuals: Ljung, System Identification, 2nd ed., 1999, section 9.4.
    """
    RecordError.require_known("dead_travel", dead_travel, DEAD_TRAVEL)
    comparison = _LoopComparison(checked_records(time, displacement, force), gap, dead_travel == "reopening")
    problem = Problem(comparison.parameters, one_by_one(comparison.residual), step=STEP, lanes=False)
    starts = [problem.at(values) for values in comparison.starts()]
    rough = solve(problem, starts, n_best=len(starts), stop=StoppingCriteria(MAX_STEPS, decrease=1e-3, move=1e-3))
    solutions = [rough, *rough.others]
    exact = StoppingCriteria(MAX_STEPS, decrease=1e-10, move=1e-10)
    best = solve(problem, [s.at for s in solutions[:POLISHED]], n_best=POLISHED, stop=exact)
    costs = [s.cost for s in (best, *best.others, *solutions[POLISHED:])]
    nrmse = tuple(float(np.sqrt(cost / comparison.size)) for cost in sorted(costs))
    if nrmse[0] > UNRELATED:
        raise RecordError(
            f"the force does not follow the displacement ({100 * nrmse[0]:.0f} % of it is left): no contact, the "
            f"gap is larger than the motion of ±{comparison.x_scale:.3g} m; the record shows nothing more"
        )
    estimates, unidentified = comparison.estimates(best)
    k, ratio, beta, gamma, exponent, d, offset = comparison.natural(best.values).tolist()
    return BoucWenFit(k, ratio, beta, gamma, exponent, d, offset, dead_travel, estimates, unidentified, nrmse[0], nrmse)


class _LoopComparison:
    """Records compared with the loop of an element of scaled parameters."""

    def __init__(self, records: Sequence[tuple[np.ndarray, ...]], gap: float | None, reopening: bool) -> None:
        self.reopening = reopening
        self.displacement = [x for _, x, _ in records]
        self.force = [f for _, _, f in records]
        self.x_scale = max(np.ptp(x) for x in self.displacement) / 2
        self.x_middle = 0.0 if reopening else (np.max(self.displacement[0]) + np.min(self.displacement[0])) / 2
        self.f_scale = max(np.ptp(f) for f in self.force) / 2
        all_forces = np.concatenate(self.force)
        self.size, self.f_rms = all_forces.size, np.std(all_forces)
        if gap is not None and not (np.isfinite(gap) and gap >= 0):
            raise RecordError(f"gap must be >= 0 m, or None to fit it, got {gap!r}")
        if gap is not None and gap >= self.x_scale:
            raise RecordError(
                f"the gap of {gap:.3g} m is larger than the motion of ±{self.x_scale:.3g} m: no contact in the record, "
                f"so it shows nothing of the element but its mean force, {np.mean(all_forces):.3g} N"
            )
        self.gap = None if gap is None else gap / self.x_scale
        self.free = np.array([self.gap is None or i != GAP for i in range(len(SCALED))])
        """(7,) of the scaled parameters: a gap that is given is not fitted"""
        self.parameters = [p for p, free in zip(SCALED, self.free) if free]

    def starts(self) -> Iterator[np.ndarray]:
        """Yield starts with stiff and soft springs, early and late yield, small and large gap."""
        for d in (0.02, 0.1, 0.35) if self.gap is None else (self.gap,):
            beyond_gap = max(1 - d, 0.05)
            for ratio, z_ult in ((0.1, 0.1), (0.5, 0.3), (0.9, 0.3)):
                k = 1 / (ratio * beyond_gap + (1 - ratio) * min(z_ult, beyond_gap))
                yield np.array([k, ratio, z_ult * beyond_gap, 0.0, 1.5, d, 0.0])[self.free]

    def scaled_parameters(self, free: np.ndarray) -> np.ndarray:
        """Return all scaled parameters (7,), from those that are fitted."""
        theta = np.full(len(SCALED), self.gap, dtype=float)
        theta[self.free] = free
        return theta

    def natural(self, free: np.ndarray) -> np.ndarray:
        """Return the parameters in the order of `NAMES`, SI units."""
        k, ratio, z, shape, n, d, x0 = self.scaled_parameters(free)
        beta = (z * self.x_scale) ** -n / (1 + shape)
        k = k * self.f_scale / self.x_scale
        return np.array([k, ratio, beta, shape * beta, n, d * self.x_scale, x0 * self.x_scale + self.x_middle])

    def residual(self, free: np.ndarray) -> np.ndarray:
        """Return (n,) difference of the forces, over the RMS of the measured one."""
        k, ratio, z, shape, n, d, x0 = self.scaled_parameters(free)
        k, x_scale = k * self.f_scale / self.x_scale, self.x_scale
        element = k, ratio, z * x_scale, shape, n, d * x_scale, x0 * x_scale + self.x_middle, self.reopening
        model = [loop_force(x, *element) for x in self.displacement]
        return (np.concatenate(model) - np.concatenate(self.force)) / self.f_rms

    def estimates(self, solution: Solution) -> tuple[Estimates, tuple[str, ...]]:
        """Return estimates of the natural parameters, and the names of those that the records do not identify."""
        scaled, problem = coloured(solution.rows, solution.residuals), solution.problem
        sigma = np.zeros(len(SCALED))
        sigma[self.free] = np.sqrt(np.diag(scaled))
        sides = [solution.at + sign * STEP * np.eye(problem.size) for sign in (1, -1)]
        ahead, behind = (np.array([self.natural(v) for v in problem.values(points)]) for points in sides)
        jacobian = ((ahead - behind) / (problem.inside(sides[0]) - problem.inside(sides[1])).sum(axis=1)[:, None]).T
        value = self.natural(solution.values)
        parameters = [Parameter(name, unit, v, *ends, transform="linear")
                      for (name, unit), v, ends in zip(NAMES.items(), value, POSSIBLE)]  # fmt: skip
        fitted = np.flatnonzero(self.free)
        covariance = (jacobian @ scaled @ jacobian.T)[np.ix_(fitted, fitted)]
        estimates = Estimates.of([parameters[i] for i in fitted], value[fitted], covariance)
        return estimates, self._unidentified(solution, sigma)

    def _unidentified(self, solution: Solution, sigma: np.ndarray) -> tuple[str, ...]:
        """Return names with standard deviations above half: relative of k, yield, n; of λ, γ/β; of d and x0 over z."""
        theta = self.scaled_parameters(solution.values)
        at_bound = np.zeros(len(SCALED), dtype=bool)
        at_bound[self.free] = solution.at_bound
        limit = np.full(len(SCALED), UNIDENTIFIED)
        limit[EXPONENT] *= theta[EXPONENT]
        limit[GAP] = limit[OFFSET] = UNIDENTIFIED * max(theta[YIELD], theta[GAP])
        open_ = sigma > limit
        for i in (K, YIELD, SHAPE, EXPONENT):  # the ends of λ, d and x0 are real values
            open_[i] |= at_bound[i]
        open_[[YIELD, SHAPE]] = open_[[YIELD, SHAPE, EXPONENT]].any()
        return tuple(name for name, unknown in zip(NAMES, open_) if unknown)


def checked_records(time: Any, displacement: Any, force: Any) -> list[tuple[np.ndarray, ...]]:
    """Return time, displacement and force of each of one or several records; refuse faulty ones."""
    if not (isinstance(time, Sequence) and len(time) and np.ndim(time[0]) == 1):
        return [checked(time, displacement, force, "the record", constant=False)]
    if not len(time) == len(displacement) == len(force):
        raise RecordError(f"{len(time)} times, {len(displacement)} displacements and {len(force)} forces")
    return [checked(*each, f"record {i + 1}", constant=False) for i, each in enumerate(zip(time, displacement, force))]


def checked(
    time: ArrayLike, displacement: ArrayLike, force: ArrayLike, where: str, constant: bool = True
) -> tuple[np.ndarray, ...]:
    """Return the channels as float arrays; refuse faulty ones."""
    arrays = [np.asarray(a, dtype=float) for a in (time, displacement, force)]
    t, x, f = arrays
    if t.ndim != 1 or not t.shape == x.shape == f.shape:
        raise RecordError(f"{where}: time, displacement and force are (n,) each, got {t.shape}, {x.shape}, {f.shape}")
    for name, a in zip(("time", "displacement", "force"), arrays):
        if not np.isfinite(a).all():
            raise RecordError(f"{where}: {name} is not finite at sample {int(np.argmin(np.isfinite(a)))}")
    if not (np.diff(t) > 0).all():
        raise RecordError(f"{where}: the time does not rise at sample {int(np.argmin(np.diff(t) > 0)) + 1}")
    if constant:
        return t, x, f
    if t.size < SHORTEST:
        raise RecordError(f"{where}: {t.size} samples are too short a record, at least {SHORTEST} are needed")
    for name, a in (("displacement", x), ("force", f)):
        if np.ptp(a) == 0:
            raise RecordError(f"{where}: the {name} is constant at {a[0]:.6g}: a loop cannot be identified")
    _refuse_clipped(x, f, where)
    return t, x, f


def _refuse_clipped(x: np.ndarray, f: np.ndarray, where: str) -> None:
    """Refuse a force that moves while the displacement rests exactly at its extreme, where it is cut off."""
    for extreme in (x.max(), x.min()):
        at = x == extreme
        inner = at[1:] & at[:-1]
        force_travel = np.abs(np.diff(f))[inner].sum()
        if inner.sum() > 0.005 * x.size and force_travel > np.ptp(f) and np.ptp(f[at]) > 0.2 * np.ptp(f):
            raise RecordError(
                f"{where}: the displacement is clipped at {extreme:.6g} m ({int(at.sum())} samples) while the force "
                "goes on; cut the record to the part below"
            )


FINE = 0.05  # largest step of the displacement, over the yield displacement


@jit
def loop_force(
    x: np.ndarray, k: float, ratio: float, z_ult: float, shape: float, exponent: float, d: float, offset: float,
    reopening: bool,
) -> np.ndarray:  # fmt: skip
    """Return the force along a displacement, from rest: Bouc-Wen in units of z_ult, so that β + γ = 1."""
    beta, gamma = 1.0 / (1.0 + shape), shape / (1.0 + shape)
    force = np.empty(x.size)
    y = x[0] - offset
    slack, z = min(max(y, -d), d), 0.0  # position within a re-opening gap; state beyond it
    if reopening:
        z = max(min((y - slack) / z_ult, 0.999), -0.999)
    else:
        y = penetration(y, d)
    last = 0.0 if not reopening else y
    for i in range(x.size):
        u = x[i] - offset
        if reopening:
            dy = u - last
            last = u
            if z * dy < 0.0:  # unload first
                travel_left, z = _until_zero(z, dy / z_ult, beta, gamma, exponent)
                dy = travel_left * z_ult
            if z == 0.0 and dy != 0.0:
                beyond = slack + dy
                slack = min(max(beyond, -d), d)
                dy = beyond - slack  # exactly 0 within the gap
            z = _advance(z, dy / z_ult, beta, gamma, exponent)
            y = u
        else:
            y = penetration(u, d)
            z = _advance(z, (y - last) / z_ult, beta, gamma, exponent)
            last = y
        force[i] = ratio * k * y + (1.0 - ratio) * k * z_ult * z
    return force


@jit
def _advance(z: float, travel: float, beta: float, gamma: float, exponent: float) -> float:
    steps = min(int(abs(travel) / FINE) + 1, 1000)
    for _ in range(steps):
        z = bouc_wen_step((z,), (travel / steps,), 1.0, beta, gamma, exponent)[0]
    return z


@jit
def _until_zero(z: float, travel: float, beta: float, gamma: float, exponent: float) -> tuple[float, float]:
    """Advance z towards 0; return the travel that is left when it gets there, and z."""
    steps = min(int(abs(travel) / FINE) + 1, 1000)
    part = travel / steps
    for i in range(steps):
        new = bouc_wen_step((z,), (part,), 1.0, beta, gamma, exponent)[0]
        if new * z <= 0.0:
            return part * (steps - i) - part * z / (z - new), 0.0
        z = new
    return 0.0, z
