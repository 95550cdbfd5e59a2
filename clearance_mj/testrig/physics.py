"""What happens inside a bushing, point by point: contact, grease hysteresis, squeeze film.

Compiled scalar laws with their derivatives, for the implicit integrator. Written for the test rig alone: the package's
own clearance laws must not be used to judge themselves.
"""

from __future__ import annotations

import math

import numba

__all__ = ["bouc_wen", "contact", "squeeze_film"]


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
