"""Force of a Bouc-Wen element with a gap along a displacement (Eqs 9 and 11), compiled."""

from __future__ import annotations

import numpy as np

from ..clearance.greases.bouc_wen import bouc_wen_step
from ..clearance.walls.slot import gap as penetration
from ..core.jit import jit

__all__: list[str] = []

FINE = 0.05  # largest step of the displacement, as a share of the yield displacement


@jit
def loop_force(
    x: np.ndarray, k: float, ratio: float, z_ult: float, shape: float, exponent: float, d: float, offset: float,
    reopening: bool,
) -> np.ndarray:  # fmt: skip
    """Return the force along a displacement, from rest: Bouc-Wen in units of z_ult, so that β + γ = 1."""
    beta, gamma = 1.0 / (1.0 + shape), shape / (1.0 + shape)
    force = np.empty(x.size)
    y = x[0] - offset
    slack, z = min(max(y, -d), d), 0.0  # position within a re-opening gap; state beyond it
    if reopening:
        z = max(min((y - slack) / z_ult, 0.999), -0.999)
    else:
        y = penetration(y, d)
    last = 0.0 if not reopening else y
    for i in range(x.size):
        u = x[i] - offset
        if reopening:
            dy = u - last
            last = u
            if z * dy < 0.0:  # unload first
                rest, z = _until_zero(z, dy / z_ult, beta, gamma, exponent)
                dy = rest * z_ult
            if z == 0.0 and dy != 0.0:
                beyond = slack + dy
                slack = min(max(beyond, -d), d)
                dy = beyond - slack  # exactly 0 within the gap
            z = _advance(z, dy / z_ult, beta, gamma, exponent)
            y = u
        else:
            y = penetration(u, d)
            z = _advance(z, (y - last) / z_ult, beta, gamma, exponent)
            last = y
        force[i] = ratio * k * y + (1.0 - ratio) * k * z_ult * z
    return force


@jit
def _advance(z: float, travel: float, beta: float, gamma: float, exponent: float) -> float:
    steps = min(int(abs(travel) / FINE) + 1, 1000)
    for _ in range(steps):
        z = bouc_wen_step((z,), (travel / steps,), 1.0, beta, gamma, exponent)[0]
    return z


@jit
def _until_zero(z: float, travel: float, beta: float, gamma: float, exponent: float) -> tuple[float, float]:
    """Advance z towards 0; the travel that is left when it gets there, and z."""
    steps = min(int(abs(travel) / FINE) + 1, 1000)
    part = travel / steps
    for i in range(steps):
        new = bouc_wen_step((z,), (part,), 1.0, beta, gamma, exponent)[0]
        if new * z <= 0.0:
            return part * (steps - i) - part * z / (z - new), 0.0
        z = new
    return 0.0, z
