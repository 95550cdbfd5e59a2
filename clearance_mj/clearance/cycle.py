"""What laws make of a motion: forces along it, and what contact models are equivalent to in a harmonic cycle."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..core.jit import jit
from .contact import ContactModel
from .follower import contact_force
from .kernel import Clearance, WithBushings, WithTable, clearance_records, contact_step, follow_law, grease_step

__all__ = ["cycle_force", "equivalent_contact", "fill_forces"]

PHASES = 2000  # instants of a cycle
CYCLES = 3  # after which the first one is forgotten


@jit
def fill_forces(x: np.ndarray, v: np.ndarray, clearance: Clearance, out: np.ndarray) -> None:
    """Fill (n_bushings, n_t) forces along the motion x, v (n_bushings, 3, n_t) of the middles and the two ends."""
    bushings, states, numbers = clearance
    for j in range(out.shape[0]):
        bushing, state = bushings[j], states[j]
        for i in range(out.shape[1]):
            elastic, damping = grease_step(bushing, state, numbers, x[j, 0, i])
            follow_law(bushing, state, numbers, x[j, 0, i], i * bushing.step)
            out[j, i] = elastic + damping * v[j, 0, i]
            for end in range(2):
                speed = v[j, end + 1, i]
                g, k, c = contact_step(bushing, state, numbers, end, x[j, end + 1, i], speed, False)
                side = np.sign(g)
                out[j, i] += side * contact_force(k, c, abs(g), side * speed, bushing.adhesion)


def cycle_force(
    rig: WithBushings, law: WithTable, amplitude: np.ndarray, frequency: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement, m, and force, N, (n_bushings, PHASES + 1) of a harmonic cycle, the shaft parallel to itself.

    The amplitude is (n_bushings,) in m, the frequency in Hz; positive forces act against positive displacements.
    """
    phase = 2 * np.pi * np.arange(CYCLES * PHASES + 1) / PHASES
    x = amplitude[:, None] * np.sin(phase)
    v = 2 * np.pi * frequency * amplitude[:, None] * np.cos(phase)
    force, step = np.zeros(x.shape), 1 / (frequency * PHASES)
    fill_forces(*(np.repeat(each[:, None], 3, axis=1) for each in (x, v)), clearance_records(rig, law, step), force)
    return x[:, -PHASES - 1 :], force[:, -PHASES - 1 :]


def equivalent_contact(
    models: Sequence[ContactModel], gaps: ArrayLike, amplitude: ArrayLike, omega: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """K and c (n, n_bushings) with which a spring and damper beyond the gap come closest to a contact model.

    Least squares over a cycle x = A cos ωt, as identification finds them from records; A (n,) in m, ω
    (n_bushings,) in rad/s; nan where A stays within the gap.
    """
    gaps, amplitude, omega = (np.asarray(v, dtype=float) for v in (gaps, amplitude, omega))
    k, c = np.full((2, amplitude.size, gaps.size), np.nan)
    for row, column in np.argwhere(amplitude[:, None] > gaps):
        k[row, column], c[row, column] = _equivalent(models[column], gaps[column], amplitude[row], omega[column])
    return k, c


@functools.lru_cache(maxsize=1000)  # bushings are often alike
def _equivalent(model: ContactModel, gap: float, amplitude: float, omega: float) -> np.ndarray:
    # Half a cycle, from one reversal to the next, holds one contact from its beginning to its end.
    within = np.arccos(gap / amplitude)
    phase = -within + 2 * within * (np.arange(PHASES) + 0.5) / PHASES
    depth, speed = amplitude * np.cos(phase) - gap, -omega * amplitude * np.sin(phase)
    impact = omega * np.sqrt(amplitude**2 - gap**2)
    force = [model.force(*at, impact) for at in zip(depth, speed)]
    return np.linalg.lstsq(np.column_stack((depth, speed)), np.array(force), rcond=None)[0]
