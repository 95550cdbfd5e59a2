"""Forces inside a bushing, point by point, with derivatives for the implicit step; compiled, SI units.

Forces count against positive displacement. Nothing here is taken from the package's clearance models or its test rig.
"""

import math
from typing import NamedTuple

import numpy as np

from clearance_mj.core.jit import jit

JOURNAL, THINNING = 0, 1
"""Kinds of film: Sommerfeld's long journal c/(1-ε²)^1.5, and c/max(1-ε, limit)²; ε = eccentricity over film height"""
ENGAGED = 1e-6  # m of penetration over which a contact's damper sets in: a step has no solution where the force jumps
CLOSEST = 0.97  # largest eccentricity of a journal's film


class Bushings(NamedTuple):
    """Every bushing's numbers, one entry for each."""

    gap: np.ndarray
    offset: (
        np.ndarray
    )  # of the unloaded shaft's centre in the bushing: contact at displacements gap - offset, -gap - offset
    rest: np.ndarray  # displacement of the shaft's centre at rest, where the grease is relaxed
    contact: np.ndarray  # (n, 5) k, n, k3, α, c of a whole bushing: F = (k δⁿ + k3 δ³)(1 + α δ̇) + c δ̇, never pulling
    film: np.ndarray  # (n, 4) kind, c, height, limit
    elastic: np.ndarray  # stiffness that never slides
    bouc_wen: np.ndarray  # (n, 4) k, β, γ, n: force k z, dz/dx = 1 - (β sgn(ẋ z) + γ)|z|ⁿ
    slip: np.ndarray  # (n, 2, n_elements) stiffness and yield displacement of Maxwell-slip elements
    stribeck: np.ndarray  # (n, 2) s, v_s: elements yield at (1 + s exp(-(v/v_s)²)) of it


@jit
def contact(depth: float, speed: float, p: np.ndarray, j: int) -> tuple[float, float, float]:
    """Return force and its derivatives with depth and speed, for half of bushing j."""
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    first = p[j, 0] * depth if p[j, 1] == 1.0 else p[j, 0] * depth ** p[j, 1]
    third = p[j, 2] * depth * depth * depth
    damped = 1.0 + p[j, 3] * speed
    engaged = min(depth / ENGAGED, 1.0)
    force = (first + third) * damped + p[j, 4] * engaged * speed
    if force <= 0.0:
        return 0.0, 0.0, 0.0
    slope = (p[j, 1] * first + 3.0 * third) / depth * damped
    if engaged < 1.0:
        slope += p[j, 4] / ENGAGED * speed
    return 0.5 * force, 0.5 * slope, 0.5 * (p[j, 3] * (first + third) + p[j, 4] * engaged)


@jit
def film(x: float, v: float, p: np.ndarray, j: int) -> tuple[float, float, float]:
    """Return force and its derivatives with x, the eccentricity, and v."""
    c, height = p[j, 1], p[j, 2]
    side = 1.0 if x > 0.0 else -1.0
    e = abs(x) / height
    if p[j, 0] == JOURNAL:
        open_ = 1.0 - min(e, CLOSEST) ** 2
        factor = c / (open_ * math.sqrt(open_))
        slope = 0.0 if e >= CLOSEST else 3.0 * e * side / (height * open_) * factor
    else:
        open_ = max(1.0 - e, p[j, 3])
        factor = c / (open_ * open_)
        slope = 0.0 if open_ == p[j, 3] else 2.0 * side / (height * open_) * factor
    return factor * v, slope * v, factor


@jit
def bouc_wen(step: float, z: float, beta: float, gamma: float, exponent: float) -> tuple[float, float]:
    """Return z after a step of displacement, by Heun's rule, and the slope at its end."""
    first = _slope(step, z, beta, gamma, exponent)
    last = _slope(step, z + step * first, beta, gamma, exponent)
    return z + 0.5 * step * (first + last), last


@jit
def _slope(step: float, z: float, beta: float, gamma: float, exponent: float) -> float:
    size = z * z if exponent == 2.0 else abs(z) ** exponent
    return 1.0 - ((beta if step * z > 0.0 else -beta) + gamma) * size


@jit
def slip(
    step: float, speed: float, before: np.ndarray, elements: np.ndarray, stribeck: np.ndarray, after: np.ndarray, j: int
) -> tuple[float, float]:
    """Move springs in series with sliders (Iwan 1966); return force and tangent stiffness, fill ``after``.

    The yield displacements follow the mean speed of the step (Stribeck).
    """
    ratio = speed / stribeck[j, 1]
    factor = 1.0 + stribeck[j, 0] * math.exp(-ratio * ratio)
    force, tangent = 0.0, 0.0
    for i in range(before.shape[1]):
        deflection, limit = before[j, i] + step, factor * elements[j, 1, i]
        if deflection > limit:
            deflection = limit
        elif deflection < -limit:
            deflection = -limit
        else:
            tangent += elements[j, 0, i]
        after[j, i] = deflection
        force += elements[j, 0, i] * deflection
    return force, tangent
