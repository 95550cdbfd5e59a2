"""What a law makes of a measured motion, to lay beside what was measured."""

from __future__ import annotations

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike

from ..clearance._pointers import kernel_loop
from ..clearance.contact import ContactModel
from ..clearance.kernel import Clearance, clearance_records, contact_force, contact_step, follow_law, grease_step
from ..clearance.law import ContactLaw, Law
from .forces import RestoringForce

__all__ = ["equivalent_contact", "law_force"]

FINER = 4
"""factor by which motions are interpolated: contact begins and ends between samples"""
PHASES = 2000
"""instants of a cycle"""


def law_force(measured: RestoringForce, law: Law) -> np.ndarray:
    """Force (n_bushings, n_t) of grease and contact, N, that a law gives along the measured motion.

    Positive against positive displacement, as `RestoringForce.force`; the grease is the law's, or else the rig's.
    """
    rig, n, step = measured.rig, measured.time.size, 1 / (measured.fs * FINER)
    points = np.concatenate((measured.displacement[:, None], measured.ends), axis=1)
    x = scipy.signal.resample(points, n * FINER, axis=2)
    v, fine = np.gradient(x, axis=2) * (measured.fs * FINER), np.zeros((len(x), n * FINER))
    _along(x, v, clearance_records(rig, law, step), fine)
    return scipy.signal.resample(fine, n, axis=1)


@kernel_loop()
def _along(x: np.ndarray, v: np.ndarray, clearance: Clearance, out: np.ndarray) -> None:
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


def equivalent_contact(
    law: ContactLaw, gaps: ArrayLike, amplitude: ArrayLike, omega: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """K and c (n, n_bushings) with which a spring and damper beyond the gap come closest to a contact model.

    Least squares over a cycle x = A cos ωt, as `contact.contact_parameters` finds them from records; A (n,) in m, ω
    (n_bushings,) in rad/s; nan where A stays within the gap.
    """
    gaps, amplitude, omega = (np.asarray(v, dtype=float) for v in (gaps, amplitude, omega))
    models = law.contact * (gaps.size if len(law.contact) == 1 else 1)
    k, c = np.full((2, amplitude.size, gaps.size), np.nan)
    for row, column in np.argwhere(amplitude[:, None] > gaps):
        k[row, column], c[row, column] = _equivalent(models[column], gaps[column], amplitude[row], omega[column])
    return k, c


def _equivalent(model: ContactModel, gap: float, amplitude: float, omega: float) -> np.ndarray:
    # Half a cycle, from one reversal to the next, holds one contact from its beginning to its end.
    within = np.arccos(gap / amplitude)
    phase = -within + 2 * within * (np.arange(PHASES) + 0.5) / PHASES
    depth, speed = amplitude * np.cos(phase) - gap, -omega * amplitude * np.sin(phase)
    impact = omega * np.sqrt(amplitude**2 - gap**2)
    force = [model.force(*at, impact) for at in zip(depth, speed)]
    return np.linalg.lstsq(np.column_stack((depth, speed)), np.array(force), rcond=None)[0]
