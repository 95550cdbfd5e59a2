"""The model within the steering's twin: a single track with tyres that saturate, steered through the lost motion.

The lateral force of an axle over its slip angle is that of `tyre.Tyre`. The front wheels stand at servo angle, offset
and lost motion together; the aligning moment is the front force times the trail.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..core.jit import jit
from .commonroad import GRAVITY
from .lost_motion import LostMotion, lost_motion_step

__all__ = ["N_PARAMETERS", "N_STATES", "Known", "simulate"]

SIDE_MOMENT = 5.0  # N m, aligning moment below which the side of the contact cannot be relied on
N_PARAMETERS, N_STATES = 15, 3
STEPS_PER_SAMPLE = 2  # integration steps of the twin's model in a sample


class Known(NamedTuple):
    """What the twin takes as known; the rest it varies by factors and offsets."""

    mass: float  # kg
    yaw_inertia: float  # kg m²
    lf: float  # m
    lr: float  # m
    cornering_front: float  # N/rad, of the axle with a rigid steering
    cornering_rear: float  # N/rad
    shape: float  # C of the tyres
    trail: float  # m
    shaft_stiffness: float  # N m/rad
    damping: float  # N m s/rad
    heat: float  # N m rad: mean square of the road's moment, over four times its bandwidth and the damping
    creep: float  # N m of the friction that the road's moment takes away
    period: float  # s, of the samples


@jit
def _axle(slip: float, stiffness: float, largest: float, shape: float) -> float:
    return largest * math.sin(shape * math.atan(stiffness / (shape * largest) * slip))


@jit
def simulate(points: np.ndarray, servo: np.ndarray, speed: np.ndarray, known: Known) -> np.ndarray:
    """Yaw rate, lateral acceleration as read, lateral speed, yaw rate, lost motion, aligning moment (n_points, 6, n).

    For points (n_points, `N_PARAMETERS` + `N_STATES`): logarithms of half-gap and contact stiffness, friction,
    logarithms of factors on both cornering stiffnesses, of friction of the tyres, of factors on mass and yaw inertia
    per mass; offsets of yaw rate, acceleration and steering angle, lag of the steering angle, lateral and angular
    acceleration that nothing else explains; rate of wear, of no effect here; lateral speed, yaw rate and lost motion at
    the first sample. Servo angles and speeds (n + 1,) begin one sample earlier.
    """
    n = servo.size - 1
    out = np.empty((points.shape[0], 6, n))
    h, dt = known.period / STEPS_PER_SAMPLE, known.period
    lf, lr, trail, shape = known.lf, known.lr, known.trail, known.shape
    for q in range(points.shape[0]):
        x = points[q]
        mass = known.mass * math.exp(x[6])
        inertia = known.yaw_inertia * math.exp(x[6] + x[7])
        front, rear = known.cornering_front * math.exp(x[3]), known.cornering_rear * math.exp(x[4])
        load = math.exp(x[5]) * mass * GRAVITY / (lf + lr)
        most_front, most_rear = load * lr, load * lf
        friction = max(x[2] - known.creep, 0.0)
        play = LostMotion(math.exp(x[0]), math.exp(x[1]), known.shaft_stiffness, known.damping, friction)
        lag = min(max(x[11] / dt, 0.0), 1.0)
        vy, r, d = x[15], x[16], x[17]
        before = servo[1] + lag * (servo[0] - servo[1])
        for i in range(n):
            v = speed[i + 1]
            now = servo[i + 1] + lag * (servo[i] - servo[i + 1])
            after = now
            if i < n - 1:
                after = servo[i + 2] + lag * (servo[i + 1] - servo[i + 2])
            delta = now + d + x[10]
            force = _axle(delta - math.atan2(vy + lf * r, v), front, most_front, shape)
            back = _axle(-math.atan2(vy - lr * r, v), rear, most_rear, shape)
            out[q, 0, i] = r + x[8]
            out[q, 1, i] = (force * math.cos(delta) + back) / mass + x[9]
            out[q, 2, i], out[q, 3, i], out[q, 4, i], out[q, 5, i] = vy, r, d, trail * force
            if i == n - 1:
                break
            for j in range(1, STEPS_PER_SAMPLE + 1):
                moment = trail * force
                angle = now + (after - now) * j / STEPS_PER_SAMPLE
                d, _ = lost_motion_step(d, angle - before, moment, h, play)
                before = angle
                delta = angle + d + x[10]
                force = _axle(delta - math.atan2(vy + lf * r, v), front, most_front, shape)
                back = _axle(-math.atan2(vy - lr * r, v), rear, most_rear, shape)
                c = math.cos(delta)
                vm = vy + h / 2 * ((force * c + back) / mass - v * r + x[12])
                rm = r + h / 2 * ((lf * force * c - lr * back) / inertia + x[13])
                force = _axle(delta - math.atan2(vm + lf * rm, v), front, most_front, shape)
                back = _axle(-math.atan2(vm - lr * rm, v), rear, most_rear, shape)
                vy += h * ((force * c + back) / mass - v * rm + x[12])
                r += h * ((lf * force * c - lr * back) / inertia + x[13])
    return out
