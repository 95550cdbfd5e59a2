"""Grease of every bushing from the restoring forces while the shaft is inside the gap (Eq. 9, with squeeze film)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...clearance.greases.bouc_wen import bouc_wen_step, film_damping
from ...clearance.walls.slot import penetration
from ...core.errors import RecordError
from ...core.jit import jit
from ...estimate import Estimates, Parameter, Problem, StoppingCriteria, one_by_one, sandwich, solve
from ...rig import Grease
from ..forces.restoring import RestoringForce
from .regression import LOCAL, non_negative, weights

__all__ = ["GreaseFit", "grease_parameters"]

MARGIN = 4  # samples on either side of a contact that the fit leaves out
SURE = 3.0  # standard deviations by which sliding and squeeze film must show, or the grease is taken to have none
SLIDE = 0.2  # of the yield displacement: longest step in which the Bouc-Wen state is advanced
FILM_LIMIT = 0.2  # smallest relative film thickness, as in `Grease`
STEP = 1e-6  # of what varies, for differences
SLIDING = (
    Parameter("yield displacement over gap", "1", 0.3, 0.03, 10.0),
    Parameter("γ/β", "1", 0.5, -0.9, 1.0, transform="linear"),
)
FILM_SHARE = Parameter("d/h", "1", 0.0, 0.0, 0.9, transform="linear")
NAMES = ("k", "N/m"), ("λ", "1"), ("z", "m"), ("γ/β", "1"), ("c", "N s/m"), ("d/h", "1")
"""parameters, z the yield displacement, and their units"""
K, RATIO, YIELD, SHAPE, DAMPING, FILM = range(6)


@dataclass(frozen=True, eq=False)
class GreaseFit:
    """Grease of every bushing, from the forces while the shaft is inside the gap."""

    grease: tuple[Grease, ...]  #: (n_bushings) fitted
    estimates: tuple[Estimates, ...]
    """(n_bushings) of k, λ, z (yield displacement), γ/β, c, d/h; without yield and film of k and c. Covariance from the
    scatter between blocks of half a second; infinite where the force does not depend on a parameter. Of what was left
    out (λ = 1, d/h = 0), that of the whole model"""
    residual: np.ndarray
    """(n_bushings,) RMS of the residual force over that of the force, both weighted"""


def grease_parameters(
    forces: RestoringForce | Sequence[RestoringForce], kind: Literal["bouc-wen", "linear"] = "bouc-wen"
) -> GreaseFit:
    """Fit the grease of every bushing to the restoring force while the shaft is not in contact.

    Bouc-Wen (Eq. 9, A = 1, n = 2) with squeeze film: yield, γ/β and film height are varied, the stiffnesses and the
    damping follow by non-negative linear least squares (variable projection, Golub & Pereyra 1973). Sliding or film
    that do not exceed three standard deviations are left out. Kind "linear": a spring and damper.
    """
    forces = [forces] if isinstance(forces, RestoringForce) else list(forces)
    fits = [_fit(_GreaseProblem(forces, j), kind) for j in range(len(forces[0].rig.bushings))]
    grease, estimates, residual = zip(*fits)
    return GreaseFit(grease, estimates, np.array(residual))


def _fit(problem: _GreaseProblem, kind: str) -> tuple[Grease, Estimates, float]:
    """Return the grease of one bushing, its parameters, and the relative RMS of the residual."""
    sliding = film = kind == "bouc-wen"
    value, covariance, residual = problem.fit(sliding, film)
    # What is not surely there would still act beyond the gap, where no sample of this fit lies.
    std = np.sqrt(np.diag(covariance))
    sliding = sliding and bool(1 - value[RATIO] > SURE * std[RATIO])
    film = film and bool(value[FILM] > SURE * std[FILM])
    if kind == "bouc-wen" and not (sliding and film):
        value, again, residual = problem.fit(sliding, film)
        covariance = np.where(np.isfinite(again), again, covariance)
    beta = 1 / (value[YIELD] ** 2 * (1 + value[SHAPE]))  # 0 for an infinite yield displacement
    height = float(problem.gap / value[FILM]) if film else None
    k, ratio, _, shape, c, _ = value.tolist()
    grease = Grease(k, c, ratio, 1.0, float(beta), float(shape * beta), film_height=height)
    indices = list(range(6)) if kind == "bouc-wen" else [K, DAMPING]
    relative_rms = float(np.sqrt(np.sum(residual**2) / np.sum(problem.target**2)))
    return grease, problem.estimates(value, covariance, indices), relative_rms


class _GreaseProblem:
    """Force of one bushing while the shaft is in the gap, against grease of parameters k, λ, z, γ/β, c, d/h."""

    def __init__(self, forces: Sequence[RestoringForce], bushing: int):
        self.forces, self.bushing = forces, bushing
        self.gap = forces[0].rig.bushings[bushing].gap
        self.weight = [weights(f, bushing) * self._free_of_contact(f) for f in forces]
        self.used = np.concatenate(self.weight) > 0
        self.target = np.concatenate([w * f.force[bushing] for w, f in zip(self.weight, forces)])[self.used]
        if np.sum(self.used) < LOCAL * forces[0].fs:
            names = ", ".join(f'"{f.name}"' for f in forces)
            raise RecordError(
                f"record {names}: the shaft is in contact at bushings[{bushing}] nearly all the time, so the grease "
                "cannot be identified; add a record of a lower level"
            )
        block = np.concatenate([i * 1e6 + f.time // LOCAL for i, f in enumerate(forces)])
        self.block = np.unique(block[self.used], return_inverse=True)[1]

    def _free_of_contact(self, force: RestoringForce) -> np.ndarray:
        """(n_t,) True where no end of the bushing is in contact, nor was or will be so within `MARGIN` samples."""
        touching = penetration(force.ends[self.bushing], *force.rig.bushings[self.bushing].walls).any(axis=0)
        return np.convolve(touching, np.ones(2 * MARGIN + 1), "same") < 0.5

    def fit(self, sliding: bool, film: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return parameters (6,), their covariance, infinite for those not varied, and the residual force."""

        def shape(p: np.ndarray) -> tuple[float, float, float]:
            """Yield displacement, γ/β and d/h."""
            yields = (self.gap * p[0], p[1]) if sliding else (np.inf, 0.0)
            return (*yields, p[-1] if film else 0.0)

        def residual(p: np.ndarray) -> np.ndarray:
            columns = self.columns(shape(p), sliding)
            if not np.isfinite(columns).all():  # the march of Bouc-Wen's state has left its range: no model here
                return np.full(self.target.size, np.inf)
            return self.target - columns @ non_negative(columns, self.target)

        opt = self._search(residual, sliding, film)
        yield_, ratio, thin = shape(opt)
        *stiffnesses, damping = non_negative(self.columns((yield_, ratio, thin), sliding), self.target)
        k = sum(stiffnesses)
        value = np.array([k, stiffnesses[0] / k if k > 0 else 1.0, yield_, ratio, damping, thin])
        varied = [K, *([RATIO, YIELD, SHAPE] if sliding else []), DAMPING, *([FILM] if film else [])]
        covariance = np.full((6, 6), np.inf)
        missed = residual(opt)
        covariance[np.ix_(varied, varied)] = sandwich(self._jacobian(value, varied, sliding), missed, self.block)
        return value, covariance, missed

    def estimates(self, value: np.ndarray, covariance: np.ndarray, indices: list[int]) -> Estimates:
        """Return estimates of the parameters with these indices."""
        low = (0.0, 0.0, 0.0, -1.0, 0.0, 0.0)
        high = (np.inf, 1.0, np.inf, 1.0, np.inf, 1.0)
        parameters = [Parameter(*NAMES[i], value[i], low[i], high[i], transform="linear") for i in indices]
        return Estimates.of(parameters, value[indices], covariance[np.ix_(indices, indices)])

    def columns(self, shape: tuple[float, float, float], sliding: bool) -> np.ndarray:
        """Return (n, 2 or 3) weighted displacement, Bouc-Wen state if it slides, and film velocity."""
        parts = [w[:, None] * _columns(f, self.bushing, *shape) for w, f in zip(self.weight, self.forces)]
        columns = np.concatenate(parts)[self.used]
        return columns if sliding else columns[:, [0, 2]]

    def _search(self, residual: Callable[[np.ndarray], np.ndarray], sliding: bool, film: bool) -> np.ndarray:
        """Return the best yield over gap, γ/β and d/h, as far as they are varied."""
        parameters = [*SLIDING] * sliding + [FILM_SHARE] * film
        if not parameters:
            return np.empty(0)
        problem = Problem(parameters, one_by_one(residual), step=STEP, lanes=False)
        yields = [(z, 0.5) for z in (0.3, 1.0)] if sliding else [()]
        starts = [problem.at([*y, *u]) for y in yields for u in ([(0.0,), (0.4,)] if film else [()])]
        return solve(problem, starts, stop=StoppingCriteria(decrease=1e-6, move=1e-5)).values

    def _jacobian(self, value: np.ndarray, varied: list[int], sliding: bool) -> np.ndarray:
        def force(p: np.ndarray) -> np.ndarray:
            full = value.copy()
            full[varied] = p
            k = (full[K] * full[RATIO], full[K] * (1 - full[RATIO])) if sliding else (full[K],)
            return self.columns((full[YIELD], full[SHAPE], full[FILM]), sliding) @ np.array([*k, full[DAMPING]])

        low = (0.0, 0.0, SLIDING[0].low * self.gap, SLIDING[1].low, 0.0, FILM_SHARE.low)
        high = (np.inf, 1.0, SLIDING[0].high * self.gap, SLIDING[1].high, np.inf, FILM_SHARE.high)
        parameters = [Parameter(*NAMES[i], value[i], low[i], high[i], transform="linear") for i in varied]
        steps = 1e-4 * np.maximum(np.abs(value), 1e-3 * np.array([1.0, 1.0, self.gap, 1.0, 1.0, 1.0]))[varied]
        problem = Problem(parameters, one_by_one(force), step=steps, central=True, lanes=False)
        return problem.linearised(np.zeros(len(varied))).jacobian


def _columns(force: RestoringForce, bushing: int, yield_: float, ratio: float, film: float) -> np.ndarray:
    """(n_t, 3) displacement, Bouc-Wen state and film velocity of one bushing; ``film`` is d/h."""
    x, v, place = force.displacement[bushing], force.velocity[bushing], force.rig.bushings[bushing]
    beta = 1 / (yield_**2 * (1 + ratio))
    z = _bouc_wen(x, 1.0, beta, ratio * beta, 2.0, SLIDE * yield_) if yield_ < np.inf else x
    return np.column_stack((x, z, v * _film(x + place.offset, film / place.gap, FILM_LIMIT)))


def grease_force(force: RestoringForce, bushing: int, grease: Grease) -> np.ndarray:
    """Return (n_t,) force of a grease of the motion in a record, N."""
    x, v = force.displacement[bushing], force.velocity[bushing]
    z = _bouc_wen(x, grease.amplitude, grease.beta, grease.gamma, grease.exponent, SLIDE * grease.yield_displacement)
    elastic = grease.stiffness * (grease.elastic_ratio * x + (1 - grease.elastic_ratio) * z)
    inverse_film = 1 / grease.film_height if grease.film_height else 0.0
    film = _film(x + force.rig.bushings[bushing].offset, inverse_film, grease.film_limit)
    return elastic + grease.damping * v * film


@jit
def _bouc_wen(x: np.ndarray, a: float, beta: float, gamma: float, exponent: float, longest: float) -> np.ndarray:
    """(n_t,) state z of Eq. 9 along a motion that starts at rest, in steps of at most ``longest`` m."""
    out = np.empty(x.size)
    z, before = 0.0, 0.0
    for i in range(x.size):
        steps = int(min(abs(x[i] - before) / longest, 200.0)) + 1
        for _ in range(steps):
            z = bouc_wen_step((z,), ((x[i] - before) / steps,), a, beta, gamma, exponent)[0]
        before = x[i]
        out[i] = z
    return out


@jit
def _film(x: np.ndarray, inverse_film: float, limit: float) -> np.ndarray:
    """(n_t,) growth of the squeeze film's damping."""
    out = np.empty(x.size)
    for i in range(x.size):
        out[i] = film_damping(x[i], 1.0, inverse_film, limit)
    return out
