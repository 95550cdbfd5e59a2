"""The model in the observer: the nominal design model, the sensors' offsets and unknown forces of the axles.

The state is [e_y, e_ψ, v_y, r, δ, dδ/dt, b_r, b_a, F_f, F_r]: that of the design model, the offsets of yaw rate and
lateral acceleration, and the lateral forces of the axles that the nominal vehicle does not have: tyres and mass as they
are, the steering's lost motion, wind. These are Gauss-Markov processes (Gelb, Applied Optimal Estimation, 1974, section
3.8). They make the estimate of the motion right, as the accelerometer feels them, and stay in the observer.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg

from ...core.jit import jit
from ..controllers.design import DesignModel
from ..nominal import Servo, Vehicle

__all__ = ["N_STATES", "Deviations", "ObserverModel", "observer_model", "take"]

N_STATES = 10


class Deviations(NamedTuple):
    """Standard deviations that the observer counts on."""

    angle: float  # rad, of the steering angle
    yaw_rate: float  # rad/s
    acceleration: float  # m/s²
    position: float  # m
    yaw_rate_offset: float  # rad/s
    acceleration_offset: float  # m/s², with the share of gravity on a road with a cross slope
    age: float = 0.0  # s, of a measurement's age about its mean
    offset_drift: float = 0.05  # m/s² over the root of a second, of the offset of the acceleration
    force: float = 500.0  # N, of the unknown force of each axle
    force_time: float = 0.5  # s, correlation time of that force
    servo: float = 5.0  # rad/s² √s, density of the unknown acceleration of the servo


@dataclass(frozen=True, eq=False)
class ObserverModel:
    """The linear model over a period at the time of the measurements, and from then to the present."""

    period: float  # s
    flow: np.ndarray  # (10, 10) over a period
    inputs: np.ndarray  # (10, 3) of the two commands in a period, and the curvature
    noise: np.ndarray  # (10, 10) over a period
    start: np.ndarray  # (10,) variances of a start of which nothing is known but errors from the path and motion
    rows: np.ndarray  # (4, 10) of the measurements: steering angle, yaw rate, lateral acceleration, e_y
    variances: np.ndarray  # (4,)
    ahead: np.ndarray  # (10, 10) to the present
    since: np.ndarray  # (10, 2 n) of n commands and n curvatures since
    middles: np.ndarray  # (n,) s, of the times in which they are held

    def settled(self, driven: float, fixes: float) -> np.ndarray:
        """Return the covariance (10, 10) after having driven straight for a time, s, with fixes at a rate, Hz."""
        return _settled(self, driven, fixes).copy()


@functools.lru_cache(maxsize=16)
def _settled(model: ObserverModel, driven: float, fixes: float) -> np.ndarray:
    covariance, values, before = np.diag(model.start), np.zeros(4), -1
    for i in range(round(driven / model.period)):
        covariance = model.flow @ covariance @ model.flow.T + model.noise
        values[3] = 0.0 if (count := math.floor(i * model.period * fixes + 1e-9)) > before else math.nan
        before = count
        take(np.zeros(N_STATES), covariance, values, model.variances, model.rows, np.zeros(N_STATES))
    return covariance


@functools.lru_cache(maxsize=16)
def observer_model(
    vehicle: Vehicle, servo: Servo, speed: float, period: float, delay: float, deviations: Deviations
) -> ObserverModel:
    """Return the model of a nominal vehicle at a speed, m/s, sampled once a period, s, of measurements of an age, s."""
    A, B, G = _continuous(vehicle, servo, speed, deviations)
    rows = np.zeros((4, N_STATES))
    rows[0, 4] = rows[1, 3] = rows[1, 6] = rows[2, 7] = rows[3, 0] = 1.0
    rows[2] += A[2]
    rows[2, 3] += speed  # lateral acceleration dv_y/dt + v r + b_a
    whole = math.floor(delay / period + 1e-9)
    part = max(delay - whole * period, 0.0)
    flow, over = _held(A, B, period)
    first, over_first = _held(A, B, part)
    rest, over_rest = _held(A, B, period - part)
    steps = [np.linalg.matrix_power(flow, whole - i - 1) @ over for i in range(whole)]
    columns = np.array([np.linalg.matrix_power(flow, whole) @ over_first, *steps])
    start = np.zeros(N_STATES)
    start[6:] = np.square((deviations.yaw_rate_offset, deviations.acceleration_offset, *[deviations.force] * 2))
    inputs = np.column_stack((rest @ over_first[:, 0], over_rest[:, 0], over[:, 1]))
    ahead = np.linalg.matrix_power(flow, whole) @ first
    since = np.ascontiguousarray(np.concatenate((columns[:, :, 0], columns[:, :, 1])).T)
    middles = np.concatenate(([part / 2], part + (np.arange(whole) + 0.5) * period))
    noise, variances = _noise(A, G, period), np.square(deviations[:4])
    return ObserverModel(period, flow, inputs, noise, start, rows, variances, ahead, since, middles)


def _continuous(
    vehicle: Vehicle, servo: Servo, speed: float, deviations: Deviations
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A (10, 10), B (10, 2), G (10, 4) of dx/dt = A x + B [u, κ] + G w, w white noise of density 1."""
    A, B, G = np.zeros((N_STATES, N_STATES)), np.zeros((N_STATES, 2)), np.zeros((N_STATES, 4))
    A[:6, :6], B[:6, 0], B[:6, 1] = DesignModel(vehicle, servo, speed, 1.0).continuous
    A[2, 8:], A[3, 8:] = 1 / vehicle.mass, np.array([vehicle.lf, -vehicle.lr]) / vehicle.yaw_inertia
    A[8, 8] = A[9, 9] = -1 / deviations.force_time
    G[8, 0] = G[9, 1] = deviations.force * math.sqrt(2 / deviations.force_time)
    G[5, 2], G[7, 3] = deviations.servo, deviations.offset_drift
    return A, B, G


def _held(A: np.ndarray, B: np.ndarray, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Flow of dx/dt = A x + B u over a duration, s, and the effect of inputs that are held."""
    n, m = B.shape
    block = scipy.linalg.expm(np.block([[A, B], [np.zeros((m, n + m))]]) * duration)
    return block[:n, :n].copy(), block[:n, n:].copy()


def _noise(A: np.ndarray, G: np.ndarray, duration: float) -> np.ndarray:
    """Covariance of x after a duration, s, of white noise G w (Van Loan, IEEE Trans. Autom. Control 23, 1978)."""
    n = len(A)
    block = scipy.linalg.expm(np.block([[-A, G @ G.T], [np.zeros((n, n)), A.T]]) * duration)
    return block[n:, n:].T @ block[:n, n:]


@jit
def take(
    state: np.ndarray, covariance: np.ndarray, values: np.ndarray, variances: np.ndarray, rows: np.ndarray,
    moved: np.ndarray,
) -> None:  # fmt: skip
    """Take measurements that are not NaN into account, one after another, in place.

    The variance (n,) of each is larger by the square of what it moved, rows (n, 10) times ``moved`` (10,), in the
    standard deviation of its age.
    """
    for i in range(values.size):
        if np.isnan(values[i]):
            continue
        cross = covariance @ rows[i]
        variance = np.dot(rows[i], cross) + variances[i] + np.dot(rows[i], moved) ** 2
        if variance > 0.0:
            state += cross * ((values[i] - np.dot(rows[i], state)) / variance)
            covariance -= np.outer(cross, cross) / variance
