"""Laws fitted to the restoring forces of a round clearance: gap, place of the shaft, friction, contact, filling."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from ...clearance import ContactLaw
from ...clearance.family import ContactFamily, FillingFamily
from ...clearance.oil_bearing import OilBearing
from ...estimate import Estimates, Parameter, Problem, UnknownScale, solve
from ...rig import Bushing, Friction
from .force_fit import MAX_CORRELATION_LENGTH, MAX_RESIDUAL, STOP, ForceFit
from .round_motion import RoundCase, RoundMotion

__all__ = ["HOLE", "RoundFit", "fit_round", "parameters_of", "placed", "spread_by_rig"]

HOLE = "out_of_round_y", "out_of_round_yz"  # names of both numbers of a hole that is not quite round
OUT_OF_ROUND = 0.05  # of a gap, 1 σ of both of these
REPEATED = 0.2  # s, of both directions: so much of a motion counts as one observation in intervals, at least
REST = 0.5  # of a gap, 1 σ of where the shaft is when its probes read zero
FRICTION = 0.1, math.log(2.0)  # coefficient and its 1 σ, as a logarithm, where the rig file gives none


@dataclass(frozen=True, eq=False)
class RoundFit(ForceFit):
    """One family of contact and filling at one round clearance."""

    case: RoundCase
    """as found; ``bushing`` has the offset of the unloaded shaft as well, once that is known"""
    loss: UnknownScale
    """of the residuals, as the fit ended"""

    def drawn(self, bushing: Bushing, seed: int) -> tuple[Bushing, ContactLaw]:
        """Draw gap, offset and law from their covariance.

        Parameters
        ----------
        bushing : Bushing
            Everything else is its own.
        seed : int
            Seed of the random numbers.
        """
        values, names = self.estimates.draw(1, seed)[0], self.estimates.names
        case, known = _case(values, names, self.nominal, self.contact, self.filling), dict(zip(names, values))
        offset = np.array([v for n, v in known.items() if n.endswith((".offset_y", ".offset"))])
        own = case.bushing
        offset = offset if offset.size else np.array([bushing.offset_y, bushing.offset])
        return placed(bushing, offset, gap=own.gap, friction=own.friction, film=own.film), case.law

    def offset_by(self, moved: np.ndarray, spread: np.ndarray) -> RoundFit:
        """Return the fit with the unloaded shaft's offsets in the place of where it rests.

        Parameters
        ----------
        moved : ndarray, shape (2,)
            From the unloaded place to rest along y and z, m.
        spread : ndarray, shape (2, 2)
            Covariance of that, m².
        """
        found, parameters, values = self.estimates, [], self.estimates.value.copy()
        covariance = found.covariance.copy()
        at: list[int] = []
        for i, p in enumerate(found.parameters):
            where, _, field = p.name.rpartition(".")
            if field in ("rest_y", "rest_z"):
                own = float(moved[len(at)])
                name = f"{where}.{'offset_y' if field == 'rest_y' else 'offset'}"
                p = dataclasses.replace(p, name=name, start=p.start - own, low=p.low - own, high=p.high - own)
                values[i] -= own
                at.append(i)
            parameters.append(p)
        covariance[np.ix_(at, at)] += spread
        bushing = placed(self.bushing, values[at])
        estimates = Estimates.of(parameters, values, covariance)
        return dataclasses.replace(self, bushing=bushing, estimates=estimates)


def placed(bushing: Bushing, offset: np.ndarray, **changed: Any) -> Bushing:
    """Return a bushing with the unloaded shaft at an offset (2,) along y and z, short of its wall, and other fields."""
    size, gap = float(np.hypot(*offset)), changed.get("gap", bushing.gap)
    y, z = (offset * min(1.0, 0.999 * gap / max(size, 1e-300))).tolist()
    # Changed at once: with the old offset, a smaller gap would be no bushing.
    return dataclasses.replace(bushing, **changed, offset_y=y, offset=z)


def parameters_of(motion: RoundMotion, priors: Sequence[Parameter], rest: tuple[float, float]) -> list[Parameter]:
    """Return what is open of a round clearance beside contact and filling.

    ``priors``: of the rig file, of which those of the gap and of friction are taken. ``rest``: from the middle to where
    the shaft rests when its probes read zero, m, as the rig file has it.
    """
    own = f"bushings[{motion.number}]"
    known = {p.name: p for p in priors}
    gap = known.get(f"{own}.gap")
    wide = motion.nominal.gap
    found = [dataclasses.replace(gap, name=f"{own}.gap")] if gap else []
    for axis, start in zip("yz", rest):
        found.append(Parameter(f"{own}.rest_{axis}", "m", start, -3 * wide, 3 * wide, REST * wide, "linear"))
    for name in HOLE:
        most = 5 * OUT_OF_ROUND * wide
        found.append(Parameter(f"{own}.{name}", "m", 0.0, -most, most, OUT_OF_ROUND * wide, "linear"))
    friction = known.get(f"{own}.friction.coefficient")
    start, std = (friction.start, friction.prior_std) if friction else FRICTION
    if motion.turns or friction:
        factor = math.exp(6 * std)
        found.append(Parameter(f"{own}.friction", "", start, start / factor, start * factor, std))
    return found


class _RoundProblem(Problem):
    """A family's parameters and the residuals of its force, over the errors that laws are expected to have."""

    def __init__(
        self, motion: RoundMotion, parameters: Sequence[Parameter], contact: ContactFamily, filling: FillingFamily
    ) -> None:
        self.motion, self.contact, self.filling = motion, contact, filling
        own = [*contact.parameters(motion.nominal), *filling.parameters(motion.nominal)]
        loss = UnknownScale(motion.blocks, MAX_CORRELATION_LENGTH)
        super().__init__([*parameters, *own], self._over_errors, loss=loss, lanes=False)

    def case(self, values: np.ndarray) -> RoundCase:
        names = [p.name for p in self.parameters]
        return _case(values, names, self.motion.nominal, self.contact, self.filling)

    def _over_errors(self, values: np.ndarray) -> np.ndarray:
        found = self.motion.residuals([self.case(each) for each in values])[self.motion.fitted].T
        return np.where(np.abs(found) < MAX_RESIDUAL, found, np.inf)


def fit_round(
    motion: RoundMotion, parameters: Sequence[Parameter], contact: ContactFamily, filling: FillingFamily,
    starts: Sequence[Mapping[str, float]] = (),
) -> RoundFit:  # fmt: skip
    """Fit a family at a round clearance, from the likeliest of some values by name or, without any, from the priors."""
    problem = _RoundProblem(motion, parameters, contact, filling)
    found = solve(problem, [problem.at(values) for values in starts or ({},)], stop=STOP)
    loss = cast(UnknownScale, found.loss)
    case = problem.case(found.values)
    # What a law misses at a place of the wall, it misses whenever the shaft comes by: blocks of time do not show that.
    alike = max(loss.correlated, 2 * REPEATED * motion.rate)
    covariance = np.linalg.inv(found.information / alike + found.prior) * np.outer(problem.unit, problem.unit)
    misfit, held_out = (
        float(loss.scale(residuals)) ** 0.5
        for residuals in (found.residuals, motion.residuals([case])[motion.held_out, 0])
    )
    return RoundFit(
        contact, filling, motion.nominal, case.law, case.bushing,
        Estimates.of(problem.parameters, found.values, covariance), found.at, found.information,
        loss.losses(found.residuals), found.residuals.size, loss.correlated, misfit, held_out, case, loss,
    )  # fmt: skip


def spread_by_rig(
    motion: RoundMotion, drawn: Sequence[RoundMotion], parameters: Sequence[Parameter], fit: RoundFit
) -> RoundFit:
    """Return a fit whose estimates also vary with the rig: with motions and forces on rigs drawn from its posterior.

    One Gauss-Newton step of the fit for each of them; ``motion``: that of the fit.
    """
    problem = _RoundProblem(motion, parameters, fit.contact, fit.filling)
    linear = problem.linearised(fit.point)
    weighted = linear.jacobian * fit.loss.weights(linear.residuals).curvature[:, None]
    information = weighted.T @ linear.jacobian / fit.correlation_length + np.eye(fit.point.size)
    moved = []
    for other in drawn:
        changed = other.residuals([fit.case])[motion.fitted, 0] - linear.residuals
        moved.append(np.linalg.solve(information, weighted.T @ changed / fit.correlation_length))
    steps = np.array(moved) * problem.unit
    covariance = fit.estimates.covariance + steps.T @ steps / max(len(steps), 1)
    estimates = Estimates.of(fit.estimates.parameters, fit.estimates.value, covariance)
    return dataclasses.replace(fit, estimates=estimates)


def _case(
    values: Sequence[float] | np.ndarray, names: Sequence[str], nominal: Bushing, contact: ContactFamily,
    filling: FillingFamily,
) -> RoundCase:  # fmt: skip
    known = {n.rpartition(".")[2]: float(v) for n, v in zip(names, values) if n.startswith("bushings[")}
    own, n = [float(v) for v in values[len(known) :]], len(contact.parameters(nominal))
    friction = nominal.friction
    if "friction" in known:
        friction = dataclasses.replace(friction or Friction(known["friction"]), coefficient=known["friction"])
    bushing = dataclasses.replace(
        nominal, gap=known.get("gap", nominal.gap), friction=friction, offset=0.0, offset_y=0.0
    )
    law = ContactLaw(
        contact.make(nominal, *own[:n]), filling.make(bushing if filling.round_only else nominal, *own[n:])
    )
    if bushing.film and isinstance(law.grease[0], OilBearing):
        film = dataclasses.replace(bushing.film, viscosity=law.grease[0].viscosity)
        bushing = dataclasses.replace(bushing, film=film)
    rest, hole = ((known.get(a, 0.0), known.get(b, 0.0)) for a, b in (("rest_y", "rest_z"), HOLE))
    return RoundCase(bushing, law, rest, hole)
