"""Forces inside a bushing, point by point: contact, grease hysteresis, squeeze film.

Compiled scalar models with their derivatives, for the implicit integrator; SI units, forces against positive
displacement. Written for the test rig alone: the package's own clearance models must not be used to judge themselves.
"""

import math

import numpy as np

from clearance_mj.core.jit import jit

BOUC_WEN, IWAN, LUGRE = range(3)  # Kinds of hysteresis


@jit
def contact(
    x: float, v: float, gap: float, stiffness: float, exponent: float, dissipation: float
) -> tuple[float, float, float]:
    """Force of a stop on a shaft that has left the gap (Hunt & Crossley 1975, Journal of Applied Mechanics 42).

    F = K δⁿ (1 + 1.5 α δ̇), never pulling, with the penetration δ = |x| - gap. The original form with a constant
    α is used, not κ δ̇/v_i with the speed v_i of each impact: it needs no memory, and is defined for a shaft that rests
    on the stop. An impact at low speed v_i has the restitution 1 - α v_i.

    Returns force, ∂force/∂x and ∂force/∂v for stiffness K (N/mⁿ), exponent n and dissipation α (s/m).
    """
    side = 1.0 if x > 0.0 else -1.0
    depth = side * x - gap
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    # The square root is exact to the last bit on every machine; a general power is not.
    power = depth * math.sqrt(depth) if exponent == 1.5 else depth**exponent
    damped = 1.0 + 1.5 * dissipation * side * v
    if damped <= 0.0:
        return 0.0, 0.0, 0.0
    force = stiffness * power
    return side * force * damped, exponent * force * damped / depth, 1.5 * dissipation * force


@jit
def bouc_wen(step: float, z: float, amplitude: float, beta: float, gamma: float, exponent: int) -> tuple[float, float]:
    """Advance the hysteretic displacement by one step of the true displacement (Eq. 9 of the article).

    ż = A ẋ - β|ẋ||z|ⁿ⁻¹z - γ ẋ|z|ⁿ does not know time: dz/dx = A - (β sgn(ẋ z) + γ)|z|ⁿ. Heun's rule in x.

    Returns z after the step and dz/dstep to first order.
    """
    slope = _slope(step, z, amplitude, beta, gamma, exponent)
    ahead = _slope(step, z + step * slope, amplitude, beta, gamma, exponent)
    return z + 0.5 * step * (slope + ahead), ahead


@jit
def _slope(step: float, z: float, amplitude: float, beta: float, gamma: float, exponent: int) -> float:
    power = 1.0
    for _ in range(exponent):
        power *= abs(z)
    return amplitude - (beta + gamma if step * z > 0.0 else gamma - beta) * power


@jit
def iwan(step: float, before: np.ndarray, yields: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """Move parallel Jenkins elements of equal stiffness: springs in series with Coulomb sliders.

    W. D. Iwan, "A distributed-element model for hysteresis and its steady-state dynamic response", Journal of
    Applied Mechanics 33 (1966). Exact for any step: each element follows the motion up to its yield displacement.

    Each slides at its deflection in ``yields``; ``after`` is filled with the deflections after the step. Returns their
    mean and the share of the elements that do not slide.
    """
    total, sticking = 0.0, 0
    for i in range(yields.size):
        deflection = before[i] + step
        if abs(deflection) < yields[i]:
            sticking += 1
        else:
            deflection = yields[i] if deflection > 0.0 else -yields[i]
        after[i] = deflection
        total += deflection
    return total / yields.size, sticking / yields.size


@jit
def lugre(
    step: float, time_step: float, v: float, z: float, coulomb: float, static: float, stribeck_speed: float
) -> tuple[float, float, float, float]:
    """Advance the mean deflection of the bristles: ż = v - |v| z / Z(v), Z(v) = Z_c + (Z_s - Z_c) exp(-(v/v_s)²).

    C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, "A new model for control of systems with friction", IEEE
    Transactions on Automatic Control 40 (1995), with g(v) = σ0 Z(v). Exact for a step at constant speed.

    v is the velocity at the end of the step. Returns z after it and dz/dstep, ż and ∂ż/∂v; derivatives without that
    of Z.
    """
    limit = _stribeck(step / time_step, coulomb, static, stribeck_speed)
    side = 1.0 if step > 0.0 else -1.0
    left = (z - side * limit) * math.exp(-abs(step) / limit)
    after = side * limit + left
    slope = 1.0 - (1.0 if v > 0.0 else -1.0) * after / _stribeck(v, coulomb, static, stribeck_speed)
    return after, -side * left / limit, v * slope, slope


@jit
def _stribeck(v: float, coulomb: float, static: float, stribeck_speed: float) -> float:
    ratio = v / stribeck_speed
    return coulomb + (static - coulomb) * math.exp(-ratio * ratio)


@jit
def squeeze_film(x: float, v: float, damping: float, height: float, limit: float) -> tuple[float, float, float]:
    """Force of a viscous film that thins as the shaft comes near the wall: c v / max(1 - |x|/h, limit)².

    Returns force, ∂force/∂x and ∂force/∂v.
    """
    thickness = 1.0 - abs(x) / height
    if thickness <= limit:
        c = damping / (limit * limit)
        return c * v, 0.0, c
    c = damping / (thickness * thickness)
    side = 1.0 if x > 0.0 else -1.0
    return c * v, 2.0 * c * v * side / (thickness * height), c
