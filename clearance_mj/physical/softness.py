"""Physical contact stiffness and damping as MuJoCo's solref and solimp.

MuJoCo's constraint law for an active row of violation r is f = (a_ref - a)/R with R = (1-d)/d Â and a_ref = -B ṙ - K
d r. In the direct format K = -solref[0]/d², B = -solref[1]/d. With one impedance d for all penetrations, solref = [-k
(1-d) Â, -c (1-d) Â] therefore gives f = k r + c ṙ - μ a with μ = d/((1-d) Â): the physical force but for a parasitic
mass μ, which a small d makes negligible (MuJoCo documentation, Computation: Constraint model, Parameters). With the
default impedance 0.9 the force is wrong by a factor.

With μ = h² k + h c and the damping c + h k it is the force of backward Euler, k (r + h ṙ₊) + c ṙ₊ with ṙ₊ = ṙ + h a,
which is stable at any time step h.
"""

from __future__ import annotations

import json
import numbers
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import LawError

if TYPE_CHECKING:
    from ..clearance.law import Law

__all__ = [
    "IMPEDANCE", "INVERSE_INERTIA", "SOLREF_PER_UNIT", "Softness", "implicit_impedance", "read_softness",
    "rounded_solref_solimp", "softness", "solref_solimp", "stiffness_damping",
]  # fmt: skip

IMPEDANCE = 1e-4
"""Smallest impedance that MuJoCo does not clamp."""

LARGEST_IMPEDANCE = 5e-4  # that `rounded_solref_solimp` tries

_RIGID = 9999.0  # d/(1 - d) of the largest impedance that MuJoCo does not clamp

INVERSE_INERTIA = 1e4
"""1/kg, Â that `set_inverse_inertia` writes over MuJoCo's estimate, so that the parasitic mass is 1e-8 kg"""

SOLREF_PER_UNIT = -(1 - IMPEDANCE) * INVERSE_INERTIA
"""solref of 1 N/m or 1 N s/m, where Â is `INVERSE_INERTIA`"""


class Softness(NamedTuple):
    """Stiffness and damping of an element; of its law, if there is one, the largest."""

    k: float  # N/m, or N m/rad
    c: float
    law: Law | None = None
    depth: float = 0.0  # m or rad, penetration at which a hardening law is linearised
    shared: bool = False  # True if the contact points of a pair share it
    ratio: float | None = None  # of the critical damping of the inertia behind the element, instead of c
    implicit: bool = False  # True for backward Euler

    def at_step(self, inverse: float, step: float) -> tuple[float, float]:
        """Return k and c of the solver's row; an implicit one has the damping c + h k."""
        return float(self.k), float(self.damping(inverse) + self.implicit * step * self.k)

    def damping(self, inverse: float) -> float:
        """Return c of an element with Â behind it."""
        return self.c if self.ratio is None else 2 * self.ratio * float(np.sqrt(self.k / inverse))

    @property
    def data(self) -> str:
        """The text that a model stores."""
        if self.law is None:
            damping = f"c={float(self.c)!r}" if self.ratio is None else f"ratio={float(self.ratio)!r}"
            return f"k={float(self.k)!r} {damping}" + (" implicit=1" if self.implicit else "")
        return json.dumps({"law": self.law.to_dict(), "depth": self.depth} | ({"shared": True} if self.shared else {}))


def softness(
    k: float | None, c: float | None, law: Law | None, depth: float, ratio: float | None = None,
    implicit: bool = False,
) -> Softness:  # fmt: skip
    """Return the softness of a stiffness and a damping or damping ratio, or of a law.

    Raises
    ------
    LawError
        For both or neither, an implicit law, a stiffness that is not > 0, a damping that is not >= 0, and laws that
        engines cannot have as a limit.
    """
    if law is None:
        if k is None or (c is None and ratio is None):
            raise LawError(
                "give a stiffness k and a damping c, or a law; damping_ratio or restitution may take the place of c"
            )
        for label, value in (("k", k), ("c", c)):
            if value is not None and not isinstance(value, numbers.Real):
                raise LawError(f"{label} must be a number, got {value!r}")
        result = Softness(k, float(c or 0.0), ratio=ratio, implicit=bool(implicit))
    else:
        if k is not None or c is not None or ratio is not None:
            raise LawError("give a stiffness k and a damping c, or a law, not both")
        if implicit:
            raise LawError("implicit=True needs a stiffness k and a damping, not a law")
        if not hasattr(law, "largest"):
            raise LawError(f"law must be a law such as clearance_mj.clearance.ContactLaw, got {law!r}")
        if np.any(law.table(1).adhesion):
            raise LawError("MuJoCo's contacts and limits never pull, so a law with adhesion cannot be theirs")
        hardest_k, hardest_c = (float(largest[0]) for largest in law.largest([depth]))
        result = Softness(hardest_k, hardest_c, law, depth)
    solref_solimp(result.k, result.c, 1.0)  # checks the ranges
    return result


def read_softness(data: str) -> Softness:
    """Return the softness of a model's text."""
    if data.startswith("{"):
        from ..clearance.law_files import law_from_dict

        values = json.loads(data)
        result = softness(None, None, law_from_dict(values["law"]), float(values["depth"]))
        return result._replace(shared=bool(values.get("shared")))
    values = {name: float(value) for name, value in (part.split("=") for part in data.split())}
    return Softness(values["k"], values.get("c", 0.0), ratio=values.get("ratio"), implicit="implicit" in values)


def solref_solimp(
    k: ArrayLike, c: ArrayLike, inverse_inertia: ArrayLike, impedance: float = IMPEDANCE
) -> tuple[np.ndarray, np.ndarray]:
    """Return solver parameters with which a contact or limit is a spring k and damper c.

    Parameters
    ----------
    k : array_like, shape (...)
        Stiffness, N/m, > 0.
    c : array_like, shape (...)
        Damping, N s/m, >= 0.
    inverse_inertia : array_like, shape (...)
        Â of the row, 1/kg: ``body_invweight0[b1, 0] + body_invweight0[b2, 0]`` of a contact, ``tendon_invweight0``
        of a tendon limit, ``dof_invweight0`` of a joint limit.
    impedance : float
        d, constant over the penetration, within 1e-4..0.9999 (MuJoCo clamps it to that).

    Returns
    -------
    solref : ndarray, shape (..., 2)
        Direct format, both negative.
    solimp : ndarray, shape (5,)
        The same for every row.

    Raises
    ------
    LawError
        For a stiffness, damping, inverse inertia or impedance out of range.
    """
    k, c, inverse_inertia = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in (k, c, inverse_inertia)))
    in_range = {"k": (k, k > 0), "c": (c, c >= 0), "inverse_inertia": (inverse_inertia, inverse_inertia > 0)}
    for name, (value, ok) in in_range.items():
        if (wrong := value[~(ok & np.isfinite(value))]).size:
            raise LawError(f"{name} = {wrong[0]:g} cannot be a contact's; see the ranges")
    if not 1e-4 <= impedance <= 0.9999:
        raise LawError(f"impedance {impedance:g} lies outside 1e-4..0.9999, to which MuJoCo clamps it")
    scale = (1 - impedance) * inverse_inertia
    return np.stack((-k * scale, -c * scale), axis=-1), np.array([impedance, impedance, 1.0, 0.5, 1.0])


def stiffness_damping(solref: ArrayLike, impedance: ArrayLike, inverse_inertia: ArrayLike) -> np.ndarray:
    """Return stiffness and damping of solver parameters: the inverse of `solref_solimp`.

    Parameters
    ----------
    solref : array_like, shape (..., 2)
        MuJoCo's solref in the direct (negative) format.
    impedance : array_like, shape (...)
        d, constant over the penetration.
    inverse_inertia : array_like, shape (...)
        Â of the row, 1/kg.

    Returns
    -------
    ndarray, shape (..., 2)
        k, N/m, and c, N s/m.
    """
    scale = (1 - np.asarray(impedance, dtype=float)) * np.asarray(inverse_inertia, dtype=float)
    return -np.asarray(solref, dtype=float) / scale[..., None]


def implicit_impedance(k: float, c: float, inverse_inertia: float, step: float) -> float:
    """Return the impedance with which a spring k and damper c + h k act as by backward Euler with a time step h.

    Parameters
    ----------
    k, c : float
        Stiffness, N/m, and damping, N s/m.
    inverse_inertia : float
        Â of the row, 1/kg.
    step : float
        Time step h, s.

    Raises
    ------
    LawError
        Where MuJoCo would clamp it: the spring is then rigid at this step.
    """
    mass = (step**2 * k + step * c) * inverse_inertia
    if mass > _RIGID:
        largest = _RIGID / inverse_inertia / step**2
        raise LawError(
            f"k = {k:g} and c = {c:g} are rigid at the time step {step:g} s; up to k = {largest:.3g} can be implicit"
        )
    return max(mass / (1 + mass), IMPEDANCE)


def rounded_solref_solimp(
    k: float, c: float, inverse_inertia: float, impedance: float | None = None
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return solver parameters of six digits, the precision of MJCF files, that give k and c within 1e-6.

    The impedance is chosen, from `IMPEDANCE` up, such that rounding changes the stiffness not at all and the damping
    by less than 5e-7.

    Parameters
    ----------
    k, c : float
        Stiffness, N/m, > 0, and damping, N s/m, >= 0.
    inverse_inertia : float
        Â of the row, 1/kg.
    impedance : float, optional
        Instead of a small one; near 1 rounding changes k and c by up to 5e-7/(1 - d).

    Returns
    -------
    solref, solimp : ndarray, shapes (2,) and (5,)
        As of `solref_solimp`.
    """
    if impedance is not None:
        solref, solimp = solref_solimp(k, c, inverse_inertia, _six_digits(impedance))
        return np.array([_six_digits(value) for value in solref]), solimp
    k_scaled = -solref_solimp(k, c, inverse_inertia)[0][0]
    digit = 10.0 ** (np.floor(np.log10(k_scaled)) - 5)
    count = int(k_scaled / digit * (LARGEST_IMPEDANCE - IMPEDANCE))
    least_error, best = np.inf, (0.0, 0.0, IMPEDANCE)
    for n in range(count + 1):
        stiffness = digit * (np.floor(k_scaled / digit) - n)
        impedance = _six_digits(max(1 - stiffness / (k * inverse_inertia), IMPEDANCE))
        exact = c * (1 - impedance) * inverse_inertia
        damping = _six_digits(exact)
        error = abs(damping - exact) / max(exact, np.finfo(float).tiny)
        if error < least_error:
            least_error, best = error, (_six_digits(stiffness), damping, impedance)
        if error < 5e-7:
            break
    stiffness, damping, impedance = best
    return np.array([-stiffness, -damping]), np.array([impedance, impedance, 1.0, 0.5, 1.0])


def _six_digits(value: float) -> float:
    return float(f"{value:.6g}")
