"""Physical contact stiffness and damping as MuJoCo's solref and solimp.

MuJoCo's constraint law for an active row of violation r is f = (a_ref - a)/R with R = (1-d)/d Â and a_ref = -B ṙ - K
d r. In the direct format K = -solref[0]/d², B = -solref[1]/d. With one impedance d for all penetrations, solref = [-k
(1-d) Â, -c (1-d) Â] therefore gives f = k r + c ṙ - μ a with μ = d/((1-d) Â): the physical force but for a parasitic
mass μ, which a small d makes negligible (MuJoCo documentation, Computation: Constraint model, Parameters). With the
default impedance 0.9 the force is wrong by a factor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import LawError

__all__ = ["IMPEDANCE", "INVERSE_INERTIA", "SOLREF_PER_UNIT", "solref_solimp", "stiffness_damping", "written"]

IMPEDANCE = 1e-4
"""Smallest impedance that MuJoCo does not clamp."""

LARGEST_IMPEDANCE = 5e-4  # Up to which `written` looks for numbers of few digits

INVERSE_INERTIA = 1e4
"""1/kg; `set_inverse_inertia` writes it over MuJoCo's frozen estimate: a known Â, and a parasitic mass of 1e-8 kg"""

SOLREF_PER_UNIT = -(1 - IMPEDANCE) * INVERSE_INERTIA
"""of 1 N/m or 1 N s/m, to which solref is proportional, where Â is `INVERSE_INERTIA`"""


def solref_solimp(
    k: ArrayLike, c: ArrayLike, inverse_inertia: ArrayLike, impedance: float = IMPEDANCE
) -> tuple[np.ndarray, np.ndarray]:
    """Solver parameters with which a contact or limit is a spring k and damper c.

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
    for name, value, ok in (
        ("k", k, k > 0),
        ("c", c, c >= 0),
        ("inverse_inertia", inverse_inertia, inverse_inertia > 0),
    ):
        if not np.all(ok & np.isfinite(value)):
            raise LawError(
                f"{name} = {value[~(ok & np.isfinite(value))].flat[0]:g} cannot be a contact's; see the ranges"
            )
    if not 1e-4 <= impedance <= 0.9999:
        raise LawError(f"impedance {impedance:g} lies outside 1e-4..0.9999, to which MuJoCo clamps it")
    scale = (1 - impedance) * inverse_inertia
    return np.stack((-k * scale, -c * scale), axis=-1), np.array([impedance, impedance, 1.0, 0.5, 1.0])


def stiffness_damping(solref: ArrayLike, impedance: ArrayLike, inverse_inertia: ArrayLike) -> np.ndarray:
    """Read stiffness and damping out of solver parameters: the inverse of `solref_solimp`.

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


def written(k: float, c: float, inverse_inertia: float) -> tuple[np.ndarray, np.ndarray]:
    """Solver parameters of six digits, which is what MJCF files keep, that give k and c within 1e-6.

    The impedance may be anything small, so it is chosen, from `IMPEDANCE` up, such that rounding loses nothing of the
    stiffness and less than 5e-7 of the damping.

    Parameters
    ----------
    k, c : float
        Stiffness, N/m, > 0, and damping, N s/m, >= 0.
    inverse_inertia : float
        Â of the row, 1/kg.

    Returns
    -------
    solref, solimp : ndarray, shapes (2,) and (5,)
        As of `solref_solimp`, which says what is refused.
    """
    largest = -solref_solimp(k, c, inverse_inertia)[0][0]
    digit = 10.0 ** (np.floor(np.log10(largest)) - 5)
    count = int(largest / digit * (LARGEST_IMPEDANCE - IMPEDANCE))
    least, found = np.inf, (0.0, 0.0, IMPEDANCE)
    for n in range(count + 1):
        stiffness = digit * (np.floor(largest / digit) - n)
        impedance = _six_digits(max(1 - stiffness / (k * inverse_inertia), IMPEDANCE))
        exact = c * (1 - impedance) * inverse_inertia
        damping = _six_digits(exact)
        lost = abs(damping - exact) / max(exact, np.finfo(float).tiny)
        if lost < least:
            least, found = lost, (_six_digits(stiffness), damping, impedance)
        if lost < 5e-7:
            break
    stiffness, damping, impedance = found
    return np.array([-stiffness, -damping]), np.array([impedance, impedance, 1.0, 0.5, 1.0])


def _six_digits(value: float) -> float:
    return float(f"{value:.6g}")
