"""What happens inside a bushing, point by point: contact, grease hysteresis, squeeze film.

Compiled scalar laws with their derivatives, for the implicit integrator. Written for the test rig alone: the package's
own clearance laws must not be used to judge themselves.
"""

from __future__ import annotations

import math

import numba

__all__ = ["BOUC_WEN", "IWAN", "LUGRE", "bouc_wen", "contact", "iwan", "lugre", "squeeze_film"]

BOUC_WEN, IWAN, LUGRE = range(3)
"""Kinds of hysteresis"""


@numba.njit(cache=True, nogil=True)
def contact(x, v, gap, stiffness, exponent, dissipation):
    """Force of a stop on a shaft that has left the gap (Hunt & Crossley 1975, Journal of Applied Mechanics 42).

    F = K δⁿ (1 + 1.5 α δ̇), never pulling, with the penetration δ = |x| - gap. The original form with a constant
    α is used, not κ δ̇/v_i with the speed v_i of each impact: it needs no memory, and is defined for a shaft that rests
    on the stop. An impact at low speed v_i has the restitution 1 - α v_i.

    Parameters
    ----------
    x, v : float
        Displacement in m and velocity in m/s.
    gap : float
        m
    stiffness : float
        K, N/mⁿ
    exponent : float
        n; 1.5 is Hertz's.
    dissipation : float
        α, s/m

    Returns
    -------
    force, dforce_dx, dforce_dv : float
        N, N/m, N s/m; the force is positive against positive displacement.
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


@numba.njit(cache=True, nogil=True)
def bouc_wen(step, z, amplitude, beta, gamma, exponent):
    """Advance the hysteretic displacement by one step of the true displacement (Eq. 9 of the article).

    ż = A ẋ - β|ẋ||z|ⁿ⁻¹z - γ ẋ|z|ⁿ does not know time: dz/dx = A - (β sgn(ẋ z) + γ)|z|ⁿ. Heun's rule in x.

    Parameters
    ----------
    step : float
        Change of displacement, m.
    z : float
        Hysteretic displacement before it, m.
    amplitude, beta, gamma : float
        A, and β and γ in 1/mⁿ.
    exponent : int
        n

    Returns
    -------
    z, dz_dstep : float
        After the step, m; the derivative to first order.
    """
    slope = _slope(step, z, amplitude, beta, gamma, exponent)
    ahead = _slope(step, z + step * slope, amplitude, beta, gamma, exponent)
    return z + 0.5 * step * (slope + ahead), ahead


@numba.njit(cache=True, nogil=True)
def _slope(step, z, amplitude, beta, gamma, exponent):
    power = 1.0
    for _ in range(exponent):
        power *= abs(z)
    return amplitude - (beta + gamma if step * z > 0.0 else gamma - beta) * power


@numba.njit(cache=True, nogil=True)
def iwan(step, before, yields, after):
    """Move parallel Jenkins elements of equal stiffness: springs in series with Coulomb sliders.

    W. D. Iwan, "A distributed-element model for hysteresis and its steady-state dynamic response", Journal of
    Applied Mechanics 33 (1966). Exact for any step: each element follows the motion up to its yield displacement.

    Parameters
    ----------
    step : float
        Change of displacement, m.
    before : ndarray, shape (n,)
        Deflection of each element's spring, m.
    yields : ndarray, shape (n,)
        Where each slides, m.
    after : ndarray, shape (n,)
        Filled with the deflections after the step.

    Returns
    -------
    z, dz_dstep : float
        Mean deflection after the step, m, and the share of the elements that do not slide.
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


@numba.njit(cache=True, nogil=True)
def lugre(step, time_step, v, z, coulomb, static, stribeck_speed):
    """Advance the mean deflection of the bristles: ż = v - |v| z / Z(v), Z(v) = Z_c + (Z_s - Z_c) exp(-(v/v_s)²).

    C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, "A new model for control of systems with friction", IEEE
    Transactions on Automatic Control 40 (1995), with g(v) = σ0 Z(v). Exact for a step at constant speed.

    Parameters
    ----------
    step : float
        Change of displacement, m.
    time_step : float
        s
    v : float
        Velocity at its end, m/s.
    z : float
        Deflection before it, m.
    coulomb, static : float
        Z_c and Z_s, m.
    stribeck_speed : float
        v_s, m/s

    Returns
    -------
    z, dz_dstep, rate, drate_dv : float
        After the step, m; its derivative, but for that of Z; ż, m/s, and its derivative, but for that of Z.
    """
    limit = _stribeck(step / time_step, coulomb, static, stribeck_speed)
    side = 1.0 if step > 0.0 else -1.0
    left = (z - side * limit) * math.exp(-abs(step) / limit)
    after = side * limit + left
    slope = 1.0 - (1.0 if v > 0.0 else -1.0) * after / _stribeck(v, coulomb, static, stribeck_speed)
    return after, -side * left / limit, v * slope, slope


@numba.njit(cache=True, nogil=True)
def _stribeck(v, coulomb, static, stribeck_speed):
    ratio = v / stribeck_speed
    return coulomb + (static - coulomb) * math.exp(-ratio * ratio)


@numba.njit(cache=True, nogil=True)
def squeeze_film(x, v, damping, height, limit):
    """Force of a viscous film that thins as the shaft comes near the wall: c v / max(1 - |x|/h, limit)².

    Parameters
    ----------
    x, v : float
        Displacement in m and velocity in m/s.
    damping : float
        c of the centred shaft, N s/m.
    height : float
        h, m
    limit : float
        Smallest relative thickness.

    Returns
    -------
    force, dforce_dx, dforce_dv : float
        N, N/m, N s/m
    """
    thickness = 1.0 - abs(x) / height
    if thickness <= limit:
        c = damping / (limit * limit)
        return c * v, 0.0, c
    c = damping / (thickness * thickness)
    side = 1.0 if x > 0.0 else -1.0
    return c * v, 2.0 * c * v * side / (thickness * height), c
