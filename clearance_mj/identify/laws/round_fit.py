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
from ...estimate import Estimates, Parameter, UnknownScale, solve
from ...rig import Bushing, Friction
from .force_fit import STOP, FamilyProblem, ForceFit
from .measured_motion import RoundCase, RoundMotion

__all__ = ["HOLE", "RoundFit", "fit_round", "hole_of", "parameters_of", "placed", "round_case", "spread_by_rig"]

HOLE = "out_of_round_y", "out_of_round_yz"  # names of both numbers of a hole that is not quite round
OUT_OF_ROUND = 0.05  # of a gap, 1 σ of both of these
FARTHEST_OUT = 0.9  # of a gap, at most
TOLD = 5.99  # square of both over their covariance from which on a hole is not round: 95 % of χ² of two
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
        known = _fields(self.estimates.names, self.estimates.draw(1, seed)[0])
        case = round_case(known, self.nominal, self.contact, self.filling)
        offset = np.array([known.get(name, getattr(bushing, name)) for name in ("offset_y", "offset")])
        own = case.bushing
        hole = {"shape": own.shape, "wall": own.wall} if bushing.wall else {}
        return placed(bushing, offset, gap=own.gap, friction=own.friction, film=own.film, **hole), case.law

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
        estimates = Estimates.of(parameters, values, covariance)
        bushing = placed(self.bushing, values[at], **hole_of(self.bushing, self.bushing.gap, estimates))
        return dataclasses.replace(self, bushing=bushing, estimates=estimates)


def hole_of(bushing: Bushing, gap: float, estimates: Estimates, own: str = "") -> dict[str, Any]:
    """Return the shape and the wall of a bushing's hole: oval where the estimates of both its numbers say so.

    Parameters
    ----------
    bushing : Bushing
        Whose hole it remains if these are not among the estimates.
    gap : float
        Radial clearance found, m.
    estimates : Estimates
        Of this clearance or, with others', those whose names begin with ``own``.
    own : str
        Such as "bushings[0].".
    """
    at = [i for i, name in enumerate(estimates.names) if name.startswith(own) and name.endswith(HOLE)]
    if not at:
        return {"shape": bushing.shape, "wall": bushing.wall}
    value, covariance = estimates.value[at], estimates.covariance[np.ix_(at, at)]
    return _hole(value.tolist() if value @ np.linalg.pinv(covariance) @ value > TOLD else (0.0, 0.0), gap)


def _hole(numbers: Sequence[float], gap: float) -> dict[str, Any]:
    if not (size := math.hypot(*numbers)):
        return {"shape": "round", "wall": None}
    wide, across = (min(1.0, FARTHEST_OUT * gap / size) * x for x in numbers)
    return {"shape": "oval", "wall": {"wide": wide, "across": across}}


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
    shape, numbers = motion.nominal.shape, motion.nominal.wall or {}
    for name, field in zip(HOLE, ("wide", "across") if shape in ("round", "oval") else ()):
        start, most = float(numbers.get(field, 0.0)), 5 * OUT_OF_ROUND * wide
        found.append(Parameter(f"{own}.{name}", "m", start, start - most, start + most, OUT_OF_ROUND * wide, "linear"))
    friction = known.get(f"{own}.friction.coefficient")
    start, std = (friction.start, friction.prior_std) if friction else FRICTION
    if motion.turns or friction:
        factor = math.exp(6 * std)
        found.append(Parameter(f"{own}.friction", "", start, start / factor, start * factor, std))
    return found


class _RoundProblem(FamilyProblem[RoundCase]):
    lanes = False

    def case(self, values: np.ndarray) -> RoundCase:
        known = _fields([p.name for p in self.parameters], values)
        return round_case(known, self.motion.nominal, self.contact, self.filling)


def fit_round(
    motion: RoundMotion, parameters: Sequence[Parameter], contact: ContactFamily, filling: FillingFamily,
    starts: Sequence[Mapping[str, float]] = (),
) -> RoundFit:  # fmt: skip
    """Fit a family at a round clearance, from the likeliest of some values by name or, without any, from the priors."""
    problem = _RoundProblem(motion, parameters, contact, filling)
    found = solve(problem, [problem.at(values) for values in starts or ({},)], stop=STOP)
    loss, case = cast(UnknownScale, found.loss), problem.case(found.values)
    # What a law misses at a place of the wall, it misses whenever the shaft comes by: blocks of time do not show that.
    parts = problem.parts_of_fit(found, problem.parameters, max(loss.correlated, 2 * REPEATED * motion.rate))
    return RoundFit(law=case.law, bushing=case.bushing, case=case, loss=loss, **parts)


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


def _fields(names: Sequence[str], values: np.ndarray) -> dict[str, float]:
    """Values by the fields of the bushing, and the names of parameters of contact and filling."""
    return {name.rpartition(".")[2]: float(value) for name, value in zip(names, values)}


def round_case(
    known: Mapping[str, float], nominal: Bushing, contact: ContactFamily, filling: FillingFamily
) -> RoundCase:
    """Return a law by the values of its bushing's fields and of the parameters of contact and filling; these may be 0.

    Parameters
    ----------
    known : mapping of str to float
        SI units, such as "gap", "rest_y" and "contact stiffness"; what is not given is as in the rig file.
    nominal : Bushing
        As the rig file has it, with the shaft's radius.
    contact, filling : ContactFamily, FillingFamily
        Families of contact and filling.
    """
    friction = nominal.friction
    if "friction" in known:
        friction = dataclasses.replace(friction or Friction(known["friction"]), coefficient=known["friction"])
    bushing = dataclasses.replace(
        nominal, gap=known.get("gap", nominal.gap), friction=friction, offset=0.0, offset_y=0.0
    )
    of_contact, of_filling = (
        [known.get(p.name, 0.0) for p in family.parameters(nominal)] for family in (contact, filling)
    )
    within = bushing if filling.round_only else nominal
    law = ContactLaw(contact.make(nominal, *of_contact), filling.make(within, *of_filling))
    if bushing.film and isinstance(law.grease[0], OilBearing):
        film = dataclasses.replace(bushing.film, viscosity=law.grease[0].viscosity)
        bushing = dataclasses.replace(bushing, film=film)
    if HOLE[0] in known:
        bushing = dataclasses.replace(bushing, **_hole([known[name] for name in HOLE], bushing.gap))
    return RoundCase(bushing, law, (known.get("rest_y", 0.0), known.get("rest_z", 0.0)))
