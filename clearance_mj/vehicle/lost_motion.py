"""Lost motion of the road wheel: the shaft in its bushings reduced to one degree of freedom, quasi-static.

With d the wheel angle less the servo's, h the half-gap, g the gap function (Eq. 11), M the moment that turns the wheel
back and T_f its Coulomb friction against the ground,

    c dd/dt + k_s d + k g(d, h) + M + T_f sign(dδ/dt) = 0.

In contact and without friction d = -h σ - M/k, σ = ±1 the side: the clearance is torque-driven, its side follows the
moment. Where T_f exceeds the moment the wheel stays until the shaft has crossed the play and pushes: friction-driven.
Steps are implicit (backward Euler), so that contacts of any stiffness are stable; the step's equation is piecewise
linear and solved exactly.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from .plant import STEP

__all__ = ["LostMotion", "QuasiStaticShaft", "lost_motion_step"]


class LostMotion(NamedTuple):
    """The reduced clearance, at the road wheel."""

    half_gap: float  # h, rad
    stiffness: float  # k of the contact, N m/rad
    shaft_stiffness: float = 0.0  # k_s, N m/rad: what bends the shaft within the play
    damping: float = 0.0  # c, N m s/rad: grease in the bushings and rack
    friction: float = 0.0  # T_f, N m


@numba.njit(cache=True, nogil=True, inline="always")
def _resistance(d: float, before: float, h: float, p: LostMotion) -> float:
    """Torque with which the shaft resists a lost motion d after one step."""
    beyond = max(d - p.half_gap, 0.0) + min(d + p.half_gap, 0.0)
    return p.damping / h * (d - before) + p.shaft_stiffness * d + p.stiffness * beyond


@numba.njit(cache=True, nogil=True, inline="always")
def _balanced(moment: float, before: float, h: float, p: LostMotion) -> float:
    """Lost motion at which the shaft resists just ``-moment`` after one step."""
    slope = p.damping / h + p.shaft_stiffness
    push = p.damping / h * before - moment
    if push > slope * p.half_gap:
        return (push + p.stiffness * p.half_gap) / (slope + p.stiffness)
    if push < -slope * p.half_gap:
        return (push - p.stiffness * p.half_gap) / (slope + p.stiffness)
    return push / slope if slope > 0.0 else before


@numba.njit(cache=True, nogil=True)
def lost_motion_step(d: float, turn: float, moment: float, h: float, p: LostMotion) -> tuple[float, int]:
    """Lost motion after one step.

    Parameters
    ----------
    d : float
        Wheel angle less servo angle, rad.
    turn : float
        How far the servo turns in this step, rad.
    moment : float
        M, N m.
    h : float
        Step, s.
    p : LostMotion
        The reduced clearance.

    Returns
    -------
    d : float
        rad.
    contact : int
        σ: 1 where the shaft pushes the wheel to the left, -1 to the right, 0 within the play.
    """
    stuck = d - turn
    load = _resistance(stuck, d, h, p) + moment
    if abs(load) <= p.friction:
        after = stuck
    elif load > 0.0:  # the wheel turns back, friction holds against it
        after = _balanced(moment - p.friction, d, h, p)
    else:
        after = _balanced(moment + p.friction, d, h, p)
    return after, (1 if after < -p.half_gap else -1 if after > p.half_gap else 0)


@numba.njit(cache=True, nogil=True)
def _lost_motion(
    lost: np.ndarray, turn: np.ndarray, moment: np.ndarray, p: LostMotion
) -> tuple[np.ndarray, np.ndarray]:
    out, contact = np.empty(turn.size), np.empty(turn.size, dtype=np.int8)
    for i in range(turn.size):
        lost[0], contact[i] = lost_motion_step(lost[0], turn[i], moment[i], STEP, p)
        out[i] = lost[0]
    return out, contact


class QuasiStaticShaft:
    """The reduced clearance over a run, in steps of 1 ms from the middle of the gap.

    Parameters
    ----------
    model : LostMotion
        The reduced clearance.
    """

    def __init__(self, model: LostMotion):
        self._model, self._lost = model, np.zeros(1)

    def advance(self, turn: np.ndarray, moment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lost motion, rad, and contact side after each step.

        Parameters
        ----------
        turn : ndarray, shape (n,)
            How far the servo turns in each step, rad.
        moment : ndarray, shape (n,)
            That turns the wheel back, N m.
        """
        return _lost_motion(self._lost, turn, moment, self._model)
