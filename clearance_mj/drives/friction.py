"""Hysteresis of a transmission: presliding, and friction that grows with the torque; compiled.

A sliding element and a play are those of Prandtl and Ishlinskii. `carried` is the play of a torque: the output torque
of a cable, a gear or a screw follows the input only after friction has reversed. For an elastic cable around a pulley
its bounds are Euler's and Eytelwein's capstan, T e^{-μφ} and T e^{μφ}.
"""

from __future__ import annotations

import numpy as np

from ..core.jit import jit

__all__ = ["carried", "entering", "presliding"]


def presliding(x: np.ndarray, width: float) -> np.ndarray:
    """Return the friction (n,) of an element in a motion x (n,), over its sliding friction: 1 where it slides forward.

    It slides after ``width`` from rest, and after twice that from a reversal. Where it is at first is not known: it
    begins in the middle of the motion, which is gone through once before.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Angle, rad.
    width : float
        rad.
    """
    return (x - _play(x - width, x + width, float(np.mean(x)))) / width


def carried(torque: np.ndarray, coulomb: float, forward: float, backward: float) -> np.ndarray:
    """Return the torque (n,), N m, that comes out of a transmission into which a torque (n,) goes.

    It stays between (T - C) η and (T + C)/η' for T > C, of the efficiencies η forward and η' backward, and changes only
    at these bounds; those of a negative torque are mirrored. What is carried at first is not known: it begins with the
    mean of the torque, which is gone through once before.

    Parameters
    ----------
    torque : ndarray, shape (n,)
        N m.
    coulomb : float
        Friction C without load, N m.
    forward, backward : float
        As in `clearance_mj.physical.Efficiency`.
    """
    low, high = torque - coulomb, torque + coulomb
    lowest, highest = (low / backward, high / backward) if backward > 0.0 else (-np.inf, np.inf)
    low, high = np.where(low > 0.0, low * forward, lowest), np.where(high < 0.0, high * forward, highest)
    return _play(low, high, float(np.mean(torque)))


def entering(torque: np.ndarray, coulomb: float, forward: float, backward: float) -> np.ndarray:
    """Return the torque (n,), N m, that the motor's side feels of a load whose torque (n,) goes to and fro.

    The bounds of `carried` from its other end: the load's torque rises to (T + C)/η' of the input T, and falls to
    (T - C) η.

    Parameters
    ----------
    torque : ndarray, shape (n,)
        What is carried, N m.
    coulomb : float
        Friction C without load, N m.
    forward, backward : float
        As in `clearance_mj.physical.Efficiency`.
    """
    low = np.where(torque > 0.0, torque * backward, torque / forward) - coulomb
    high = np.where(torque > 0.0, torque / forward, torque * backward) + coulomb
    return _play(low, high, float(np.mean(torque)))


@jit
def _play(low: np.ndarray, high: np.ndarray, value: float) -> np.ndarray:
    """Return the play operator (n,) between bounds (n,), applied twice so that the initial value is forgotten."""
    values = np.empty(low.size)
    for _ in range(2):
        for i in range(low.size):
            value = min(max(value, low[i]), high[i])
            values[i] = value
    return values
