"""The modes' own step in the compiled loops of the modal engine, several cases side by side, see lanes.py."""

from __future__ import annotations

import numpy as np

from ..clearance.lanes import load, store
from ..core.jit import jit

__all__ = ["move_modes", "read_motion"]


@jit(inline="always")
def move_modes(
    h: float, lanes: tuple[int, ...], inverse_mass: np.ndarray, flow: np.ndarray, coupling: np.ndarray, q: np.ndarray,
    v: np.ndarray, q_before: np.ndarray, total: np.ndarray, middle: np.ndarray, acceleration: np.ndarray,
) -> None:  # fmt: skip
    """Kick modes by their forces ``total``, let them flow freely for a step, and fill in their accelerations.

    ``middle`` is room for velocities in the middle of the kick. All but ``lanes`` are as in `modal_loop.Shaft` and
    `modal_loop.Motion`.
    """
    n, half, per_step2 = q.shape[0], 0.5 * h, 1.0 / (h * h)
    if coupling.size:  # at the velocity in the middle of the kick of all other forces
        for m in range(n):
            kick = half * load(inverse_mass, m, lanes) * load(total, m, lanes)
            store(middle, m, load(v, m, lanes) + kick, lanes)
        for m in range(n):
            damped = load(total, m, lanes)
            for r in range(n):
                damped = damped - load(coupling, m * n + r, lanes) * load(middle, r, lanes)
            store(total, m, damped, lanes)
    for m in range(n):
        place = load(q, m, lanes)
        kicked = load(v, m, lanes) + h * load(inverse_mass, m, lanes) * load(total, m, lanes)
        store(v, m, load(flow, 2 * n + m, lanes) * place + load(flow, 3 * n + m, lanes) * kicked, lanes)
        after = load(flow, m, lanes) * place + load(flow, n + m, lanes) * kicked
        # Force less ω² q would be the same, but a small difference of large numbers for high modes.
        store(acceleration, m, (after - 2.0 * place + load(q_before, m, lanes)) * per_step2, lanes)
        store(q_before, m, place, lanes)
        store(q, m, after, lanes)


@jit(inline="always")
def read_motion(
    h: float, lanes: tuple[int, ...], readings: np.ndarray, q: np.ndarray, q_before: np.ndarray,
    acceleration: np.ndarray, speed: np.ndarray, row: int, out: np.ndarray,
) -> None:  # fmt: skip
    """Add what sensors that are no accelerometers read of modes at the time of the accelerations.

    The velocity is the one that belongs to (q₊ - 2q + q₋)/h²: (q₊ - q₋)/(2h), with q₊ in ``q`` and q in ``q_before``;
    ``speed`` is room for it. ``readings`` are as in `round_scheme.RoundShaft`, ``out`` (columns, n, lanes).
    """
    n, size = q_before.shape[0], out.shape[1]
    for m in range(n):
        moved = load(q, m, lanes) - load(q_before, m, lanes)
        store(speed, m, moved / h - 0.5 * h * load(acceleration, m, lanes), lanes)
    for s in range(readings.shape[0]):
        value, first = load(out, s * size + row, lanes), 2 * s * n
        for m in range(n):
            value += load(readings, first + m, lanes) * load(q_before, m, lanes)
            value += load(readings, first + n + m, lanes) * load(speed, m, lanes)
        store(out, s * size + row, value, lanes)
