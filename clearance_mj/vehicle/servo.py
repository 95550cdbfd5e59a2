"""The steering servo: second order, with a limit of its speed."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from .plant import STEP

__all__ = ["ServoStep", "serve"]


class ServoStep(NamedTuple):
    """Servo over one step of 1 ms."""

    flow: np.ndarray  # (2, 2) exact flow of (angle less command, speed)
    rate_limit: float  # rad/s

    @classmethod
    def of(cls, frequency: float, damping: float, rate_limit: float) -> ServoStep:
        """Discretise a servo.

        Parameters
        ----------
        frequency, damping : float
            Natural frequency, Hz, and share of the critical damping.
        rate_limit : float
            rad/s.
        """
        natural = 2 * np.pi * frequency
        decay, turn = natural * damping, natural * np.emath.sqrt(1 - damping**2)
        cos, sin = np.cos(turn * STEP).real, (np.sin(turn * STEP) / turn).real if turn else STEP
        flow = np.exp(-decay * STEP) * np.array([[cos + decay * sin, sin], [-(natural**2) * sin, cos - decay * sin]])
        return cls(flow, float(rate_limit))


@numba.njit(cache=True, nogil=True)
def serve(state: np.ndarray, command: float, servo: ServoStep, n: int) -> np.ndarray:
    """Servo angle after each of n steps, rad, shape (n,).

    Parameters
    ----------
    state : ndarray, shape (2,)
        Angle, rad, and speed, rad/s; moves on.
    command : float
        Held, rad.
    servo : ServoStep
        The servo.
    n : int
        Steps.
    """
    out = np.empty(n)
    for i in range(n):
        error = state[0] - command
        angle = command + servo.flow[0, 0] * error + servo.flow[0, 1] * state[1]
        speed = servo.flow[1, 0] * error + servo.flow[1, 1] * state[1]
        reach = servo.rate_limit * STEP
        state[0] += min(max(angle - state[0], -reach), reach)
        state[1] = min(max(speed, -servo.rate_limit), servo.rate_limit)
        out[i] = state[0]
    return out
