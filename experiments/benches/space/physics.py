"""Forces inside a round bushing, with derivatives for the implicit step; compiled, SI units.

Forces count against positive displacement, of y and z. Each function adds to row p of an array ``to``: force along y
and z, its derivatives with y and z (yy, yz, zy, zz), and those with the speeds; ``b``: `Bushings.numbers`. Nothing here
is taken from the package.
"""

import math
from typing import NamedTuple

import numpy as np

from clearance_mj.core.jit import jit

ENGAGED = 1e-6  # m of penetration over which a contact's damper sets in: a step has no solution where the force jumps
CLOSEST = 0.97  # largest eccentricity of films, as of `table.LARGEST`


class Bushings(NamedTuple):
    """Every bushing's numbers."""

    numbers: np.ndarray  # (n, 16) see the columns below
    slip: np.ndarray  # (n, 2, n_elements) stiffness and yield displacement of Maxwell-slip elements
    table: np.ndarray  # (2, n_ε, n_ψ) see `table.film_table`


COLUMNS = (
    "gap", "oval_cosine", "oval_sine", "offset_y", "offset_z", "k", "k3", "alpha", "c", "mu", "bristle", "radius",
    "elastic", "squeeze", "height", "film",
)  # fmt: skip
"""The radial gap is gap (1 + oval_cosine cos 2θ + oval_sine sin 2θ); offset: of the unloaded shaft from the middle;
contact of a whole bushing, never pulling: N = (k δ + k3 δ³)(1 + alpha δ̇) + c δ̇; mu and bristle, N/m: of dry friction;
elastic: a spring that never slides, relaxed where the unloaded shaft is; a damper squeeze/(1 - (e/height)²)^1.5; film:
12 μ R L (R/C)², 0 without oil"""
GAP, COSINE, SINE, OFFSET_Y, OFFSET_Z, K, K3, ALPHA, C, MU, BRISTLE, RADIUS, ELASTIC, SQUEEZE, HEIGHT, FILM = range(16)


@jit
def contact(
    b: np.ndarray, j: int, y: float, z: float, vy: float, vz: float, dy: float, dz: float, rolled: float,
    bristle: float, to: np.ndarray, p: int,
) -> float:  # fmt: skip
    """Add the force of half of bushing j at y, z from its middle; return the bristle's deflection along the wall.

    ``dy``, ``dz``: motion within the step; ``rolled``: that of the shaft's surface by its spin, R Ω h.
    """
    gap, ac, as_ = b[j, GAP], b[j, COSINE], b[j, SINE]
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
    first, third = b[j, K] * depth, b[j, K3] * depth * depth * depth
    damped, engaged = 1.0 + b[j, ALPHA] * speed, min(depth / ENGAGED, 1.0)
    force = 0.5 * ((first + third) * damped + b[j, C] * engaged * speed)
    if force <= 0.0:
        return 0.0
    slope = 0.5 * (first + 3.0 * third) / depth * damped
    if engaged < 1.0:
        slope += 0.5 * b[j, C] / ENGAGED * speed
    viscous = 0.5 * (b[j, ALPHA] * (first + third) + b[j, C] * engaged)
    # Second derivatives of φ: along the wall, and between radius and wall.
    bent, mixed = (1.0 + 4.0 * wave / e) / e, turn / e
    hyy, hzz = bent * rz * rz - 2.0 * mixed * ry * rz, bent * ry * ry + 2.0 * mixed * ry * rz
    hyz = mixed * (ry * ry - rz * rz) - bent * ry * rz
    to[p, 0] += force * ny
    to[p, 1] += force * nz
    # The force changes with the depth, and with its rate, v ∇φ, as ∇φ turns.
    push_y = slope * ny + viscous * (hyy * vy + hyz * vz)
    push_z = slope * nz + viscous * (hyz * vy + hzz * vz)
    to[p, 2] += ny * push_y + force * hyy
    to[p, 3] += ny * push_z + force * hyz
    to[p, 4] += nz * push_y + force * hyz
    to[p, 5] += nz * push_z + force * hzz
    _add(to, p, 6, viscous * ny * ny, viscous * ny * nz, viscous * ny * nz, viscous * nz * nz)
    if b[j, MU] == 0.0:
        return 0.0
    size = math.sqrt(ny * ny + nz * nz)
    ty, tz = -nz / size, ny / size
    stiffness, limit = 0.5 * b[j, BRISTLE], b[j, MU] * force * size
    rubbing = stiffness * (bristle + ty * dy + tz * dz + rolled)
    if abs(rubbing) <= limit:
        _add(to, p, 2, stiffness * ty * ty, stiffness * ty * tz, stiffness * tz * ty, stiffness * tz * tz)
    else:
        rubbing = limit if rubbing > 0.0 else -limit
        grown = rubbing / (size * size)  # of |∇φ|, with the limit
        by_y = rubbing / force * push_y + grown * (hyy * ny + hyz * nz)
        by_z = rubbing / force * push_z + grown * (hyz * ny + hzz * nz)
        _add(to, p, 2, by_y * ty, by_z * ty, by_y * tz, by_z * tz)
        by_speed = rubbing / force * viscous
        _add(to, p, 6, by_speed * ty * ny, by_speed * ty * nz, by_speed * tz * ny, by_speed * tz * nz)
    to[p, 0] += rubbing * ty
    to[p, 1] += rubbing * tz
    turned = rubbing / (size * size)  # t turns by -n as ∇φ does by t
    by_y, by_z = turned * (hyy * ty + hyz * tz), turned * (hyz * ty + hzz * tz)
    _add(to, p, 2, -ny * by_y, -ny * by_z, -nz * by_y, -nz * by_z)
    return rubbing / stiffness


@jit
def grease(
    b: np.ndarray, elements: np.ndarray, j: int, y: float, z: float, vy: float, vz: float, dy: float, dz: float,
    before: np.ndarray,
    after: np.ndarray, to: np.ndarray, p: int,
) -> None:  # fmt: skip
    """Add elastic force, Maxwell-slip elements and squeeze damper at displacements y, z; fills ``after``.

    An element's deflection (2,) beyond its yield is brought back to it along itself, so that it has no preferred axis.
    """
    to[p, 0] += b[j, ELASTIC] * y
    to[p, 1] += b[j, ELASTIC] * z
    to[p, 2] += b[j, ELASTIC]
    to[p, 5] += b[j, ELASTIC]
    for i in range(elements.shape[2]):
        k, limit = elements[j, 0, i], elements[j, 1, i]
        if k == 0.0:
            continue
        sy, sz = before[j, i, 0] + dy, before[j, i, 1] + dz
        size = math.sqrt(sy * sy + sz * sz)
        if size > limit:
            shrunk = limit / size
            uy, uz = sy / size, sz / size
            sy, sz = shrunk * sy, shrunk * sz
            _add(to, p, 2, k * shrunk * uz * uz, -k * shrunk * uy * uz, -k * shrunk * uy * uz, k * shrunk * uy * uy)
        else:
            to[p, 2] += k
            to[p, 5] += k
        after[j, i, 0], after[j, i, 1] = sy, sz
        to[p, 0] += k * sy
        to[p, 1] += k * sz
    c, height = b[j, SQUEEZE], b[j, HEIGHT]
    if c == 0.0:
        return
    ey, ez = (y + b[j, OFFSET_Y]) / height, (z + b[j, OFFSET_Z]) / height
    square = ey * ey + ez * ez
    held = square >= CLOSEST * CLOSEST
    open_ = 1.0 - (CLOSEST * CLOSEST if held else square)
    factor = c / (open_ * math.sqrt(open_))
    to[p, 0] += factor * vy
    to[p, 1] += factor * vz
    to[p, 6] += factor
    to[p, 9] += factor
    if not held:
        slope = 3.0 * factor / (open_ * height)
        _add(to, p, 2, slope * vy * ey, slope * vy * ez, slope * vz * ey, slope * vz * ez)


@jit
def film(
    b: np.ndarray, table: np.ndarray, j: int, y: float, z: float, vy: float, vz: float, spin: float, to: np.ndarray,
    p: int,
) -> None:  # fmt: skip
    """Add the oil's force at y, z from the middle: A times that of a table, see `experiments.benches.film`.

    w, the speed over the gap as seen from the oil that turns with Ω/2, has A sin ψ outwards and -A cos ψ along.
    """
    scale, c = b[j, FILM], b[j, GAP]
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
    n_e, n_psi = table.shape[1] - 1, table.shape[2] - 1
    at_e, at_psi = eps / CLOSEST * n_e, (math.atan2(out, -along) + math.pi) / (2.0 * math.pi) * n_psi
    m, n = min(int(at_e), n_e - 1), min(int(at_psi), n_psi - 1)
    s, t = at_e - m, at_psi - n
    open_ = 1.0 - eps * eps
    weight = scale / (open_ * open_)
    steep = 4.0 * eps / open_
    held = e / c >= CLOSEST
    fr = fr_e = fr_psi = ft = ft_e = ft_psi = 0.0
    for part in range(2):
        p00, p01 = table[part, m, n], table[part, m, n + 1]
        p10, p11 = table[part, m + 1, n], table[part, m + 1, n + 1]
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
    _turn(to, p, 2, rr, rt, tr, tt, ry, rz)
    _turn(to, p, 6, r_q / c, -r_p / c, t_q / c, -t_p / c, ry, rz)
    to[p, 0] -= a * (fr * ry - ft * rz)
    to[p, 1] -= a * (fr * rz + ft * ry)


@jit
def _add(to: np.ndarray, p: int, at: int, yy: float, yz: float, zy: float, zz: float) -> None:
    """Add a matrix of y and z."""
    to[p, at] += yy
    to[p, at + 1] += yz
    to[p, at + 2] += zy
    to[p, at + 3] += zz


@jit
def _turn(to: np.ndarray, p: int, at: int, rr: float, rt: float, tr: float, tt: float, c: float, s: float) -> None:
    """Subtract a matrix of outward and along, r = (c, s) and t = (-s, c), as one of y and z."""
    to[p, at] -= rr * c * c - (rt + tr) * c * s + tt * s * s
    to[p, at + 1] -= (rr - tt) * c * s + rt * c * c - tr * s * s
    to[p, at + 2] -= (rr - tt) * c * s + tr * c * c - rt * s * s
    to[p, at + 3] -= rr * s * s + (rt + tr) * c * s + tt * c * c
