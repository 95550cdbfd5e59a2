"""A clearance and its law by the values of their parameters, as fits vary them: slots, stops and round clearances."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...clearance import ContactLaw, along
from ...clearance.family import ContactFamily, FillingFamily
from ...clearance.oil_bearing import OilBearing
from ...clearance.record import Clearance, clearance_records
from ...estimate import Estimates, Parameter
from ...rig import Bushing, Friction, Rig
from ...rig.dimensions import shaft_radius

__all__ = [
    "HOLE", "OFFSETS", "RESTS", "ClearanceWithLaw", "case_of", "fields_of", "forces_along", "hole_of", "nominal_of",
    "open_parameters", "placed",
]  # fmt: skip

HOLE = "out_of_round_y", "out_of_round_yz"  # names of both numbers of a hole that is not quite round
OFFSETS, RESTS = ("offset_y", "offset"), ("rest_y", "rest_z")  # along y and z; of one coordinate the last alone
OUT_OF_ROUND = 0.05  # of a gap, 1 σ of both of these
FARTHEST_OUT = 0.9  # of a gap, at most
FARTHEST_OFFSET = 0.999  # of the gap: the unloaded shaft touches no wall
CHI_SQUARE = 5.99  # square of both over their covariance from which on a hole is not round: 95 % of χ² of two
REST = 0.5  # of a gap, or of how far that is, 1 σ of where the shaft is when its probes read zero
FRICTION = 0.1, math.log(2.0)  # coefficient and its 1 σ, as a logarithm, where the rig file gives none


class ClearanceWithLaw(NamedTuple):
    """A clearance and its law."""

    bushing: Bushing  #: with its gap, wall, length and friction; with ``rest`` its offset counts for nothing
    law: ContactLaw  #: of contact and filling
    rest: tuple[float, ...] | None = None
    """from the middle to where the shaft is when its probes read zero, m, where that is not the unloaded place"""

    @property
    def middle(self) -> tuple[float, ...]:
        """Position of the shaft when its probes read zero, from the middle of the clearance, m."""
        names = OFFSETS[-self.bushing.n_coordinates :]
        return tuple(getattr(self.bushing, name) for name in names) if self.rest is None else self.rest

    @property
    def bushings(self) -> tuple[Bushing]:
        """The clearance alone."""
        return (self.bushing,)

    def records(self, step: float) -> Clearance:
        """Return the clearance's records for compiled loops with a step, s."""
        if self.rest is None:
            return clearance_records(self, self.law, step)
        bushing = dataclasses.replace(self.bushing, offset=0.0, offset_y=0.0)
        records = clearance_records(self._replace(bushing=bushing), self.law, step)
        offset, wall = (int(records.bushings[name][0]) for name in ("offset", "wall"))
        records.numbers[offset : offset + len(self.rest)] = self.rest
        if records.bushings["touching"][0] == 1:
            records.numbers[wall : wall + 2] -= self.rest
        return records


def forces_along(
    case: ClearanceWithLaw, x: np.ndarray, v: np.ndarray, spin: np.ndarray, step: float, lever: float = 1.0
) -> np.ndarray:
    """Return the forces (n_t, d) of a law against its displacements, N, in a motion of the shaft from where it rests.

    Parameters
    ----------
    case : Case
        The law.
    x, v : ndarray, shape (n_t, 3, d)
        Displacements and velocities of the middle and both ends, m and m/s.
    spin : ndarray, shape (n_t,)
        rad/s.
    step : float
        s.
    lever : float
        By which the law's ends are farther from the middle.
    """
    if lever != 1.0:
        x, v = (displacement[:, :1] + lever * (displacement - displacement[:, :1]) for displacement in (x, v))
    return along.forces_along(case.records(step), 0, x, v, spin)


def nominal_of(rig: Rig, number: int) -> Bushing:
    """Return a clearance as the rig file has it, a round one with the radius of its shaft."""
    bushing = rig.bushings[number]
    return dataclasses.replace(bushing, radius=shaft_radius(rig, number) or None) if bushing.is_round else bushing


def open_parameters(
    number: int, nominal: Bushing, priors: Sequence[Parameter], rest: tuple[float, ...] | None = None,
    turns: bool = False,
) -> list[Parameter]:  # fmt: skip
    """Return the open parameters of a clearance but for contact and filling.

    Parameters
    ----------
    number : int
        Index of the clearance.
    nominal : Bushing
        As `nominal_of` returns it.
    priors : sequence of Parameter
        Of the rig file, of which those of the gap, of the offset or the length of a slot, and of friction are taken.
    rest : tuple of float, optional
        From the middle to where the shaft rests when its probes read zero, m, as the rig file has it. It is open in the
        place of the offset.
    turns : bool
        True if the shaft turns in any record.
    """
    path, gap, across = f"bushings[{number}]", nominal.gap, nominal.is_round
    prior_of = {p.name: p for p in priors}
    fields = ["gap"] if across else ["gap", "length"] if rest else ["gap", "offset", "length"]
    if rest and nominal.stops != "both":
        fields.remove("gap")  # one wall alone: where the shaft rests says where it is
    opened = [prior_of[name] for field in fields if (name := f"{path}.{field}") in prior_of]
    reach = max(gap, float(np.linalg.norm(rest or 0.0)))  # a weight may press the shaft deep into a soft wall
    for name, start in zip(RESTS[-len(rest) :], rest) if rest else ():
        opened.append(Parameter(f"{path}.{name}", "m", start, -3 * reach, 3 * reach, REST * reach, "linear"))
    wall = nominal.wall or {}
    for name, field in zip(HOLE, ("wide", "across") if nominal.shape in ("round", "oval") else ()):
        start, most = float(wall.get(field, 0.0)), 5 * OUT_OF_ROUND * gap
        opened.append(Parameter(f"{path}.{name}", "m", start, start - most, start + most, OUT_OF_ROUND * gap, "linear"))
    friction = prior_of.get(f"{path}.friction.coefficient")
    start, std = (friction.start, friction.prior_std) if friction else FRICTION
    if friction or (turns and across):
        factor = math.exp(6 * std)
        opened.append(Parameter(f"{path}.friction", "", start, start / factor, start * factor, std))
    return opened


def fields_of(names: Sequence[str], values: np.ndarray) -> dict[str, float]:
    """Return values by the fields of their bushing, and by the names of parameters of contact and filling."""
    return {name.rpartition("].")[2]: float(value) for name, value in zip(names, values)}


def case_of(
    known: Mapping[str, float], nominal: Bushing, contact: ContactFamily, filling: FillingFamily
) -> ClearanceWithLaw:
    """Return a clearance and its law by the values of its fields and of the parameters of contact and filling.

    Parameters
    ----------
    known : mapping of str to float
        SI units, such as "gap", "rest_y" and "contact stiffness"; fields that are not given are as in the rig file,
        parameters of contact and filling 0.
    nominal : Bushing
        As `nominal_of` returns it.
    contact, filling : ContactFamily, FillingFamily
        Families of contact and filling.
    """
    rest, friction = None, nominal.friction
    offset = np.array([known.get(name, getattr(nominal, name)) for name in OFFSETS[-nominal.n_coordinates :]])
    if RESTS[-1] in known:
        rest, offset = tuple(known[name] for name in RESTS[-nominal.n_coordinates :]), 0.0 * offset
    if "friction" in known:
        friction = dataclasses.replace(friction or Friction(known["friction"]), coefficient=known["friction"])
    gap, length = known.get("gap", nominal.gap), known.get("length", nominal.length)
    bushing = placed(nominal, offset, gap=gap, length=length, friction=friction)
    of_contact, of_filling = ([known.get(p.name, 0.0) for p in f.parameters(nominal)] for f in (contact, filling))
    within = bushing if filling.round_only else nominal
    law = ContactLaw(contact.make(nominal, *of_contact), filling.make(within, *of_filling))
    if bushing.film and isinstance(law.grease[0], OilBearing):
        film = dataclasses.replace(bushing.film, viscosity=law.grease[0].viscosity)
        bushing = dataclasses.replace(bushing, film=film)
    if HOLE[0] in known:
        bushing = dataclasses.replace(bushing, **_oval([known[name] for name in HOLE], gap))
    return ClearanceWithLaw(bushing, law, rest)


def placed(bushing: Bushing, offset: np.ndarray, **changed: Any) -> Bushing:
    """Return a bushing with the unloaded shaft at an offset (d,), short of its wall, and other fields."""
    size, gap = float(np.linalg.norm(offset)), changed.get("gap", bushing.gap)
    limited = offset * min(1.0, FARTHEST_OFFSET * gap / max(size, 1e-300))
    # Changed at once: with the old offset, a smaller gap would be no bushing.
    return dataclasses.replace(bushing, **changed, **dict(zip(OFFSETS[-len(limited) :], limited.tolist())))


def hole_of(bushing: Bushing, gap: float, estimates: Estimates, prefix: str = "") -> dict[str, Any]:
    """Return the shape and the wall of a bushing's hole: oval where the estimates of both its numbers say so.

    Parameters
    ----------
    bushing : Bushing
        Whose hole it remains if these are not among the estimates.
    gap : float
        Identified radial clearance, m.
    estimates : Estimates
        Of this clearance or, with others', those whose names begin with ``prefix``.
    prefix : str
        Such as "bushings[0].".
    """
    at = [i for i, name in enumerate(estimates.names) if name.startswith(prefix) and name.endswith(HOLE)]
    if not at:
        return {"shape": bushing.shape, "wall": bushing.wall}
    value, covariance = estimates.value[at], estimates.covariance[np.ix_(at, at)]
    if value @ np.linalg.pinv(covariance) @ value <= CHI_SQUARE:
        return {"shape": "round", "wall": None}
    return _oval(value.tolist(), gap)


def _oval(numbers: Sequence[float], gap: float) -> dict[str, Any]:
    wide, across = (min(1.0, FARTHEST_OUT * gap / max(math.hypot(*numbers), 1e-300)) * x for x in numbers)
    return {"shape": "oval", "wall": {"wide": wide, "across": across}}
