"""What happens inside a round bushing, with derivatives for the implicit step; compiled, SI units.

Forces count against positive displacement, of y and z. Each function adds to an array ``to`` (10,): force along y and
z, its derivatives with y and z (yy, yz, zy, zz), and those with the speeds. Nothing here is taken from the package.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

ENGAGED = 1e-6  # m of penetration over which a contact's damper sets in: a step has no solution where the force jumps
CLOSEST = 0.97  # largest eccentricity of films, as of `table.LARGEST`


class Bushings(NamedTuple):
    """Every bushing's numbers, one entry for each."""

    gap: np.ndarray  # radial, the mean of all directions
    oval: np.ndarray  # (n, 2) a: the gap is g (1 + a_0 cos 2θ + a_1 sin 2θ)
    offset: np.ndarray  # (n, 2) of the unloaded shaft's centre from the bushing's middle
    contact: np.ndarray  # (n, 4) k, k3, α, c of a whole bushing: N = (k δ + k3 δ³)(1 + α δ̇) + c δ̇, never pulling
    friction: np.ndarray  # (n, 2) μ, and the bristles' stiffness of a whole bushing
    radius: np.ndarray  # of the shaft
    elastic: np.ndarray  # stiffness that never slides, relaxed where the unloaded shaft is
    slip: np.ndarray  # (n, 2, n_elements) stiffness and yield displacement of Maxwell-slip elements
    squeeze: np.ndarray  # (n, 2) c, h of a damper c/(1 - (e/h)²)^1.5
    film: np.ndarray  # 12 μ R L (R/C)², 0 without oil
    table: np.ndarray  # (2, n_ε, n_ψ) see `table.film_table`


@numba.njit(cache=True, nogil=True, inline="always")
def contact(
    b: Bushings, j: int, y: float, z: float, vy: float, vz: float, dy: float, dz: float, rolled: float, bristle: float,
    to: np.ndarray,
) -> float:  # fmt: skip
    """Add the force of half of bushing j at y, z from its middle; return the bristle's deflection along the wall.

    ``dy``, ``dz``: motion within the step; ``rolled``: that of the shaft's surface by its spin, R Ω h.
    """
    gap, ac, as_ = b.gap[j], b.oval[j, 0], b.oval[j, 1]
    square = y * y + z * z
    if square <= (gap * (1.0 - abs(ac) - abs(as_))) ** 2:
        return 0.0
    e = math.sqrt(square)
    ry, rz = y / e, z / e
    c2, s2 = ry * ry - rz * rz, 2.0 * ry * rz
    wave = gap * (ac * c2 + as_ * s2)
    depth = e - gap - wave
    if depth <= 0.0:
        return 0.0
    # φ = e - g(θ) is the depth along the radius. The force N ∇φ has the potential ∫N dφ and is normal to the wall.
    turn = 2.0 * gap * (as_ * c2 - ac * s2) / e
    ny, nz = ry + turn * rz, rz - turn * ry
    speed = ny * vy + nz * vz
    first, third = b.contact[j, 0] * depth, b.contact[j, 1] * depth * depth * depth
    damped, share = 1.0 + b.contact[j, 2] * speed, min(depth / ENGAGED, 1.0)
    force = 0.5 * ((first + third) * damped + b.contact[j, 3] * share * speed)
    if force <= 0.0:
        return 0.0
    slope = 0.5 * (first + 3.0 * third) / depth * damped
    if share < 1.0:
        slope += 0.5 * b.contact[j, 3] / ENGAGED * speed
    viscous = 0.5 * (b.contact[j, 2] * (first + third) + b.contact[j, 3] * share)
    # Second derivatives of φ: along the wall, and between radius and wall.
    bent, mixed = force * (1.0 + 4.0 * wave / e) / e, force * turn / e
    to[0] += force * ny
    to[1] += force * nz
    to[2] += slope * ny * ny + bent * rz * rz - 2.0 * mixed * ry * rz
    to[3] += slope * ny * nz - bent * ry * rz + mixed * (ry * ry - rz * rz)
    to[4] += slope * ny * nz - bent * ry * rz + mixed * (ry * ry - rz * rz)
    to[5] += slope * nz * nz + bent * ry * ry + 2.0 * mixed * ry * rz
    to[6] += viscous * ny * ny
    to[7] += viscous * ny * nz
    to[8] += viscous * ny * nz
    to[9] += viscous * nz * nz
    if b.friction[j, 0] == 0.0:
        return 0.0
    size = math.sqrt(ny * ny + nz * nz)
    ty, tz = -nz / size, ny / size
    stiffness, limit = 0.5 * b.friction[j, 1], b.friction[j, 0] * force * size
    rubbing = stiffness * (bristle + ty * dy + tz * dz + rolled)
    if abs(rubbing) <= limit:
        to[2] += stiffness * ty * ty
        to[3] += stiffness * ty * tz
        to[4] += stiffness * tz * ty
        to[5] += stiffness * tz * tz
    else:
        rubbing = limit if rubbing > 0.0 else -limit
        by_depth = rubbing / force * slope
        to[2] += by_depth * ty * ny
        to[3] += by_depth * ty * nz
        to[4] += by_depth * tz * ny
        to[5] += by_depth * tz * nz
        by_speed = rubbing / force * viscous
        to[6] += by_speed * ty * ny
        to[7] += by_speed * ty * nz
        to[8] += by_speed * tz * ny
        to[9] += by_speed * tz * nz
    to[0] += rubbing * ty
    to[1] += rubbing * tz
    turned = rubbing / (e * size)  # t turns by -n for each motion along t
    to[2] -= turned * ny * ty
    to[3] -= turned * ny * tz
    to[4] -= turned * nz * ty
    to[5] -= turned * nz * tz
    return rubbing / stiffness


@numba.njit(cache=True, nogil=True, inline="always")
def grease(
    b: Bushings, j: int, y: float, z: float, vy: float, vz: float, dy: float, dz: float, before: np.ndarray,
    after: np.ndarray, to: np.ndarray,
) -> None:  # fmt: skip
    """Add elastic force, Maxwell-slip elements and squeeze damper at displacements y, z; fills ``after``.

    An element's deflection (2,) beyond its yield is brought back to it along itself, so that it has no preferred axis.
    """
    to[0] += b.elastic[j] * y
    to[1] += b.elastic[j] * z
    to[2] += b.elastic[j]
    to[5] += b.elastic[j]
    for i in range(b.slip.shape[2]):
        k, limit = b.slip[j, 0, i], b.slip[j, 1, i]
        if k == 0.0:
            continue
        sy, sz = before[j, i, 0] + dy, before[j, i, 1] + dz
        size = math.sqrt(sy * sy + sz * sz)
        if size > limit:
            shrunk = limit / size
            uy, uz = sy / size, sz / size
            sy, sz = shrunk * sy, shrunk * sz
            to[2] += k * shrunk * uz * uz
            to[3] -= k * shrunk * uy * uz
            to[4] -= k * shrunk * uy * uz
            to[5] += k * shrunk * uy * uy
        else:
            to[2] += k
            to[5] += k
        after[j, i, 0], after[j, i, 1] = sy, sz
        to[0] += k * sy
        to[1] += k * sz
    c, height = b.squeeze[j, 0], b.squeeze[j, 1]
    if c == 0.0:
        return
    ey, ez = (y + b.offset[j, 0]) / height, (z + b.offset[j, 1]) / height
    square = ey * ey + ez * ez
    held = square >= CLOSEST * CLOSEST
    open_ = 1.0 - (CLOSEST * CLOSEST if held else square)
    factor = c / (open_ * math.sqrt(open_))
    to[0] += factor * vy
    to[1] += factor * vz
    to[6] += factor
    to[9] += factor
    if not held:
        slope = 3.0 * factor / (open_ * height)
        to[2] += slope * vy * ey
        to[3] += slope * vy * ez
        to[4] += slope * vz * ey
        to[5] += slope * vz * ez


@numba.njit(cache=True, nogil=True, inline="always")
def film(b: Bushings, j: int, y: float, z: float, vy: float, vz: float, spin: float, to: np.ndarray) -> None:
    """Add the oil's force at y, z from the middle: A times that of a table, see `experiments.benches.film`.

    w, the speed over the gap as seen from the oil that turns with Ω/2, has A sin ψ outwards and -A cos ψ along.
    """
    scale, c = b.film[j], b.gap[j]
    e, half = math.sqrt(y * y + z * z), 0.5 * spin / c
    ry, rz = (y / e, z / e) if e > 1e-12 * c else (1.0, 0.0)
    e = max(e, 1e-7 * c)
    wy, wz = vy / c + half * z, vz / c - half * y
    out, along = ry * wy + rz * wz, ry * wz - rz * wy
    a = math.sqrt(out * out + along * along)
    if a == 0.0:
        return
    cosine, sine = -along / a, out / a
    eps = min(e / c, CLOSEST)
    n_e, n_psi = b.table.shape[1] - 1, b.table.shape[2] - 1
    at_e, at_psi = eps / CLOSEST * n_e, (math.atan2(out, -along) + math.pi) / (2.0 * math.pi) * n_psi
    m, n = min(int(at_e), n_e - 1), min(int(at_psi), n_psi - 1)
    s, t = at_e - m, at_psi - n
    open_ = 1.0 - eps * eps
    weight = scale / (open_ * open_)
    steep = 4.0 * eps / open_
    held = e / c >= CLOSEST
    fr = fr_e = fr_psi = ft = ft_e = ft_psi = 0.0
    for part in range(2):
        p00, p01 = b.table[part, m, n], b.table[part, m, n + 1]
        p10, p11 = b.table[part, m + 1, n], b.table[part, m + 1, n + 1]
        low, high = p00 + t * (p01 - p00), p10 + t * (p11 - p10)
        value = weight * (low + s * (high - low))
        by_e = 0.0 if held else weight * (high - low) * n_e / CLOSEST + steep * value
        by_psi = weight * ((1.0 - s) * (p01 - p00) + s * (p11 - p10)) * n_psi / (2.0 * math.pi)
        if part == 0:
            fr, fr_e, fr_psi = value, by_e, by_psi
        else:
            ft, ft_e, ft_psi = value, by_e, by_psi
    # Derivatives with P = A cos ψ and Q = A sin ψ; then those with motion outwards and along, whose axes turn by 1/e.
    r_p, r_q = cosine * fr - sine * fr_psi, sine * fr + cosine * fr_psi
    t_p, t_q = cosine * ft - sine * ft_psi, sine * ft + cosine * ft_psi
    q_along, p_along = half + along / e, out / e
    rr, rt = a * fr_e / c + r_p * half, r_p * p_along + r_q * q_along - a * ft / e
    tr, tt = a * ft_e / c + t_p * half, t_p * p_along + t_q * q_along + a * fr / e
    _turn(to, 2, rr, rt, tr, tt, ry, rz)
    _turn(to, 6, r_q / c, -r_p / c, t_q / c, -t_p / c, ry, rz)
    to[0] -= a * (fr * ry - ft * rz)
    to[1] -= a * (fr * rz + ft * ry)


@numba.njit(cache=True, nogil=True, inline="always")
def _turn(to: np.ndarray, at: int, rr: float, rt: float, tr: float, tt: float, c: float, s: float) -> None:
    """Subtract a matrix of outward and along, r = (c, s) and t = (-s, c), as one of y and z."""
    to[at] -= rr * c * c - (rt + tr) * c * s + tt * s * s
    to[at + 1] -= (rr - tt) * c * s + rt * c * c - tr * s * s
    to[at + 2] -= (rr - tt) * c * s + tr * c * c - rt * s * s
    to[at + 3] -= rr * s * s + (rt + tr) * c * s + tt * c * c
