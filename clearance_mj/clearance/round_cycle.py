"""Forces of laws in a given motion of a round clearance: of filling, contact and friction; compiled."""

from __future__ import annotations

import numpy as np

from ..core.jit import OPTIONS, jit
from .round_kernel import BRISTLES, END_MEMORY, RoundClearance, friction_limit, round_contact, round_filling

__all__ = ["fill_round_forces"]


@jit(**OPTIONS)
def fill_round_forces(
    x: np.ndarray, v: np.ndarray, spin: np.ndarray, lever: float, out_of_round: np.ndarray, clearance: RoundClearance,
    out: np.ndarray,
) -> None:  # fmt: skip
    """Fill forces (n_t, 2) along y and z, N, in the motion x, v (n_t, 3, 2), m and m/s, of the middle and the two ends.

    ``lever``: by which the ends are farther from the middle. ``spin``: (n_t,) rad/s. ``out_of_round``: (2,) m, by which
    the gap in the direction of an angle θ from y is wider per cos 2θ and sin 2θ: the wall's normal is turned by that,
    too. The law's rows over time or amplitude count for nothing.
    """
    bushings, states, numbers = clearance
    bushing, state = bushings[0], states[0]
    wide, across = out_of_round[0], out_of_round[1]
    for i in range(x.shape[0]):
        y, z = x[i, 0, 0], x[i, 0, 1]
        f = round_filling(bushing, state, numbers, y, z, spin[i])
        speed_y, speed_z = v[i, 0, 0], v[i, 0, 1]
        total_y = f[0] + f[2] * speed_y + f[3] * speed_z
        total_z = f[1] + f[4] * speed_y + f[5] * speed_z
        for end in range(2):
            end_y, end_z = y + lever * (x[i, end + 1, 0] - y), z + lever * (x[i, end + 1, 1] - z)
            fast_y = speed_y + lever * (v[i, end + 1, 0] - speed_y)
            fast_z = speed_z + lever * (v[i, end + 1, 1] - speed_z)
            r_y, r_z = end_y + bushing.offset_y, end_z + bushing.offset_z
            square, turned = r_y * r_y + r_z * r_z, 0.0
            if (wide != 0.0 or across != 0.0) and square > 0.0:
                cos, sin = (r_y * r_y - r_z * r_z) / square, 2.0 * r_y * r_z / square
                e = np.sqrt(square)
                farther = (wide * cos + across * sin) / e
                turned = 2.0 * (across * cos - wide * sin) / e
                end_y, end_z = end_y - farther * r_y, end_z - farther * r_z
            depth, n_y, n_z, k, c, bristles = round_contact(
                bushing, state, numbers, end, end_y, end_z, fast_y, fast_z, spin[i]
            )
            if depth > 0.0:
                normal = k * depth + c * (n_y * fast_y + n_z * fast_z)
                if not bushing.adhesion:
                    normal = max(normal, 0.0)
                along = -turned * normal
                if bushing.friction > 0.0:
                    sliding = n_y * fast_z - n_z * fast_y + bushing.radius * spin[i]
                    rubbed = bushing.bristle * bristles + bushing.bristle_damping * sliding
                    limit = friction_limit(bushing, max(normal, 0.0), sliding)
                    most = limit / bushing.bristle
                    numbers[state.ends + END_MEMORY * end + BRISTLES] = min(max(bristles, -most), most)
                    along += min(max(rubbed, -limit), limit)
                total_y += n_y * normal - n_z * along
                total_z += n_z * normal + n_y * along
        out[i, 0], out[i, 1] = total_y, total_z
